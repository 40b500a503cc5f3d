//! Pictures of a model at an active count.

use foliage_lod::{
    FoliageModel, LookAt, Result,
    bounds::Sphere,
    extract::{Blend, LodPolicy, REFERENCE_FOV_Y, Sight, fewest_leaves, leaf_count},
    model::scaled,
    software::{DrawList, DrawOptions, Image, draw_model},
};
use glam::{DVec3, Vec3};

/// Direction from the plant to the camera: in front, a little to the right and above.
pub const DIRECTION: DVec3 = DVec3::new(0.45, 0.25, 1.0);
/// Distance in radii at which the plant fills the picture: the default for the level of detail.
pub const FILLING_RADII: f32 = 2.0;
/// Height in pixels of the screen that the inset is a part of.
const SCREEN_HEIGHT_PX: u32 = 1080;
/// Half the inset's side, in radii of the plant on the screen: leaves some sky around the plant.
const INSET_RADII: f32 = 1.2;

/// Renders the first `n` leaves from `distance` radii; by default the plant fills the picture.
pub fn draw(model: &FoliageModel, n: u32, distance: Option<f32>, size: [u32; 2]) -> Result<Image> {
    let sphere = if distance.is_some() { model.sphere() } else { drawn_sphere(model, n) };
    let camera = camera(&sphere, distance).with_aspect(f64::from(size[0]) / f64::from(size[1]));
    draw_model(model, n as usize, &camera.camera(size[1]), size, &DrawOptions::default())
}

/// The plant's bounding sphere, enlarged about its centre to hold the first `n` leaves as drawn.
pub fn drawn_sphere(model: &FoliageModel, n: u32) -> Sphere {
    let sphere = model.sphere();
    let parts = DrawList::of_model(model, n as usize).parts;
    let corners = parts.iter().flat_map(|part| {
        let vertices = part.indices.iter().map(|&index| part.vertices[index as usize].position);
        vertices.map(|position| scaled(position, part.pivot, part.scale))
    });
    let distances = corners.map(|corner| Vec3::from(corner).as_dvec3().distance(sphere.center()));
    Sphere { radius: distances.fold(sphere.radius, f64::max), ..sphere }
}

/// Camera with a square picture, `distance` radii from a plant; by default the plant fills the
/// picture.
pub fn camera(sphere: &Sphere, distance: Option<f32>) -> LookAt {
    let fov_y = f64::from(REFERENCE_FOV_Y);
    let radii_that_fit = 1.0 / (0.5 * fov_y).sin();
    let factor = distance.map_or(1.0, |radii| f64::from(radii) / radii_that_fit);
    LookAt::framing(sphere, DIRECTION, fov_y, factor)
}

/// Renders the plant filling the picture, with an inset in the lower left corner: the same leaves
/// from `distance` radii, as large as on a screen of 1080 rows. The inset is left out if it would
/// take up a quarter of the side or more.
pub fn draw_with_inset(model: &FoliageModel, n: u32, distance: f32, side: u32) -> Result<Image> {
    let mut picture = draw(model, n, None, [side; 2])?;
    let inset = (2.0 * INSET_RADII * sight(model, distance).radius_px()).ceil() as u32;
    if inset < side / 4 {
        picture.paste(&draw_as_seen(model, n, distance, inset)?, 0, side - inset);
    }
    Ok(picture)
}

/// Renders the middle `side` x `side` pixels of a screen of 1080 rows, with the plant `distance`
/// radii away.
fn draw_as_seen(model: &FoliageModel, n: u32, distance: f32, side: u32) -> Result<Image> {
    let share_of_screen = f64::from(side) / f64::from(SCREEN_HEIGHT_PX);
    let fov_y = 2.0 * ((0.5 * f64::from(REFERENCE_FOV_Y)).tan() * share_of_screen).atan();
    let factor = f64::from(distance) * (0.5 * fov_y).sin();
    let camera = LookAt::framing(&model.sphere(), DIRECTION, fov_y, factor);
    draw_model(model, n as usize, &camera.camera(side), [side; 2], &DrawOptions::default())
}

/// Active count of the default policy at `distance` radii.
pub fn count_at(model: &FoliageModel, distance: f32) -> u32 {
    let leaves = model.leaves.len() as u32;
    leaf_count(Blend::default().lod(&sight(model, distance)), leaves, fewest_leaves(leaves))
}

/// View of a plant `distance` radii away, on a screen of 1080 rows.
pub fn sight(model: &FoliageModel, distance: f32) -> Sight {
    let radius = model.sphere().radius as f32;
    Sight { distance: distance * radius, radius, fov_y: REFERENCE_FOV_Y, height_px: SCREEN_HEIGHT_PX as f32 }
}
