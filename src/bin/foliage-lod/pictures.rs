//! Pictures of a model at some active count.

use foliage_lod::{
    Result,
    bounds::Sphere,
    extract::{
        LodPolicy, Sight, leaf_count,
        lod::{Blend, REFERENCE_FOV_Y, fewest_leaves},
    },
    model::FoliageModel,
    render::{
        camera::Camera,
        image::Image,
        software::{DrawOptions, draw_model},
    },
};
use glam::DVec3;

/// Where the camera stands, seen from the plant: in front, a little to the right and above.
pub const DIRECTION: DVec3 = DVec3::new(0.45, 0.25, 1.0);
/// Distance in radii from which a picture without a distance takes its level of detail: where the plant fills it.
pub const FILLING_RADII: f32 = 2.0;
/// Height of the screen on which the inset shows the plant at its true size.
const SCREEN_HEIGHT_PX: u32 = 1080;
/// Half the inset's side in radii of the plant on screen: some sky remains around it.
const INSET_RADII: f32 = 1.2;

/// Draws the first `n` leaves from `distance` radii; by default from where the plant fills the picture.
pub fn draw(model: &FoliageModel, n: u32, distance: Option<f32>, size: [u32; 2]) -> Result<Image> {
    let camera = camera(&model.sphere(), distance).with_aspect(f64::from(size[0]) / f64::from(size[1]));
    draw_model(model, n as usize, &camera, size, &DrawOptions::default())
}

/// The camera `distance` radii from a plant; by default where the plant fills the picture. Square.
pub fn camera(sphere: &Sphere, distance: Option<f32>) -> Camera {
    let fov_y = f64::from(REFERENCE_FOV_Y);
    let radii_that_fit = 1.0 / (0.5 * fov_y).sin();
    let factor = distance.map_or(1.0, |radii| f64::from(radii) / radii_that_fit);
    Camera::framing(sphere, DIRECTION, fov_y, factor)
}

/// As [`draw`], filling the picture; and where it takes less than a quarter of the side, in the lower left corner the same
/// leaves from `distance` radii as large as they are on a screen of 1080 rows.
pub fn draw_with_inset(model: &FoliageModel, n: u32, distance: f32, side: u32) -> Result<Image> {
    let mut picture = draw(model, n, None, [side; 2])?;
    let inset = (2.0 * INSET_RADII * sight(model, distance).radius_px()).ceil() as u32;
    if inset < side / 4 {
        picture.paste(&draw_as_seen(model, n, distance, inset)?, 0, side - inset);
    }
    Ok(picture)
}

/// The middle `side` pixels of what a screen of 1080 rows shows of the plant from `distance` radii.
fn draw_as_seen(model: &FoliageModel, n: u32, distance: f32, side: u32) -> Result<Image> {
    let share_of_screen = f64::from(side) / f64::from(SCREEN_HEIGHT_PX);
    let fov_y = 2.0 * ((0.5 * f64::from(REFERENCE_FOV_Y)).tan() * share_of_screen).atan();
    let factor = f64::from(distance) * (0.5 * fov_y).sin();
    let camera = Camera::framing(&model.sphere(), DIRECTION, fov_y, factor);
    draw_model(model, n as usize, &camera, [side; 2], &DrawOptions::default())
}

/// The active count that the default policy gives from `distance` radii.
pub fn count_at(model: &FoliageModel, distance: f32) -> u32 {
    let leaves = model.leaves.len() as u32;
    leaf_count(Blend::default().lod(&sight(model, distance)), leaves, fewest_leaves(leaves))
}

/// How a plant `distance` radii away is seen on that screen.
pub fn sight(model: &FoliageModel, distance: f32) -> Sight {
    let radius = model.sphere().radius as f32;
    Sight { distance: distance * radius, radius, fov_y: REFERENCE_FOV_Y, height_px: SCREEN_HEIGHT_PX as f32 }
}
