//! The CPU renderer, compared with pixel counts and pictures that are known in advance.
#![cfg(any(feature = "simplify", feature = "render"))]

use foliage_lod::{
    FoliageModel, LookAt, Plant,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat},
    model::{Leaf, NO_LEAF},
    plant::PlantOf,
    software::{Background, DrawList, DrawOptions, Image, Painter, Placed, draw_model, draw_plant},
};
use glam::{DAffine3, DVec3, Quat, Vec3};

const SIZE: [u32; 2] = [96, 96];
fn bare() -> DrawOptions {
    DrawOptions { background: Background::Transparent, ..DrawOptions::default() }
}

/// A camera at (0, 0, 10), for which one unit at the origin is 24 pixels.
fn camera() -> LookAt {
    LookAt {
        eye: DVec3::Z * 10.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y_radians: 2.0 * 0.2_f64.atan(),
        aspect: 1.0,
        near: 0.01,
    }
}

fn material(color: [f32; 3]) -> Material {
    let [r, g, b] = color;
    Material { base_color: [r, g, b, 1.0], double_sided: true, ..Default::default() }
}

/// Adds a square of side `2 * half` about `center`, rotated by `turn`, as a leaf of two triangles.
fn push_square(plant: &mut Plant, center: Vec3, half: f32, turn: Quat, material: u32) {
    let corner = |x: f32, y: f32| Vertex {
        position: (center + turn * Vec3::new(x * half, y * half, 0.0)).to_array(),
        normal: (turn * Vec3::Z).to_array(),
        uv: [(x + 1.0) / 2.0, (1.0 - y) / 2.0],
        color: [1.0; 4],
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], center.to_array(), material);
}

fn squares(places: &[(Vec3, f32, u32)], materials: &[Material]) -> Plant {
    let mut plant = Plant { materials: materials.to_vec(), ..Default::default() };
    for &(center, half, material) in places {
        push_square(&mut plant, center, half, Quat::IDENTITY, material);
    }
    plant
}

fn draw(plant: &Plant) -> Image {
    draw_plant(plant, &camera().camera(SIZE[1]), SIZE, &bare()).unwrap()
}

/// Number of covered pixels; partly covered pixels count as fractions.
fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| alpha as f64 / 255.0).sum()
}

fn model_of(plant: &Plant, records: &[(u32, f32)]) -> FoliageModel {
    let leaves = plant.leaves.iter().zip(records).map(|(leaf, &(target, scale))| Leaf {
        vertices: leaf.vertices,
        indices: leaf.indices,
        pivot: leaf.pivot,
        material: leaf.material,
        leaf_to_split: target,
        leaf_to_collapse: target,
        scale,
        error: 0.0,
    });
    let plant = PlantOf {
        vertices: plant.vertices.clone(),
        indices: plant.indices.clone(),
        leaves: leaves.collect(),
        materials: plant.materials.clone(),
        ..Default::default()
    };
    FoliageModel { plant, max_scale: 4.0, ..Default::default() }
}

#[test]
fn a_square_covers_its_area_and_has_no_seam_along_its_diagonal() {
    let image = draw(&squares(&[(Vec3::ZERO, 1.0, 0)], &[material([1.0; 3])]));
    assert_eq!(covered_px(&image), 48.0 * 48.0);
    assert!((24..72).all(|i| image.pixel(i, i).unwrap()[3] == 255 && image.pixel(i, 95 - i).unwrap()[3] == 255));
}

#[test]
fn a_turned_square_covers_its_area_to_a_thousandth() {
    let mut plant = squares(&[], &[material([1.0; 3])]);
    push_square(&mut plant, Vec3::ZERO, 1.0, Quat::from_rotation_z(0.3), 0);
    let area = covered_px(&draw(&plant)) / (48.0 * 48.0);
    assert!((area - 1.0).abs() < 1e-3, "{area}");
}

#[test]
fn the_nearer_leaf_hides_the_farther_one_in_either_order() {
    let materials = [material([1.0, 0.0, 0.0]), material([0.0, 0.0, 1.0])];
    let near_red = (Vec3::Z, 1.0, 0);
    let far_blue = (Vec3::NEG_Z, 1.0, 1);
    for places in [[near_red, far_blue], [far_blue, near_red]] {
        let [red, _, blue, alpha] = draw(&squares(&places, &materials)).pixel(48, 48).unwrap();
        assert!(red > 60 && blue == 0 && alpha == 255, "{red} {blue} {alpha}");
    }
}

#[test]
fn leaves_behind_the_eye_vanish_and_one_across_the_near_plane_is_cut() {
    let mut plant = squares(&[(Vec3::Z * 20.0, 1.0, 0)], &[material([1.0; 3])]);
    assert_eq!(covered_px(&draw(&plant)), 0.0);
    push_square(&mut plant, Vec3::new(0.0, -0.05, 10.0), 5.0, Quat::from_rotation_x(std::f32::consts::FRAC_PI_2), 0);
    let covered = covered_px(&draw(&plant));
    assert!(covered > 0.2 * 96.0 * 96.0 && covered < 0.6 * 96.0 * 96.0, "{covered}");
}

#[test]
fn a_model_drawn_whole_is_the_plant_and_fewer_leaves_are_drawn_at_their_swapped_scale() {
    let plant = squares(&[(Vec3::ZERO, 0.5, 0), (Vec3::X, 0.5, 0), (Vec3::NEG_X, 0.5, 0)], &[material([1.0; 3])]);
    let model = model_of(&plant, &[(NO_LEAF, 1.0), (0, 3.0), (0, 1.5)]);
    let drawn = |n| draw_model(&model, n, &camera().camera(SIZE[1]), SIZE, &bare()).unwrap();
    assert_eq!(drawn(3), draw(&plant));
    assert_eq!(drawn(usize::MAX), draw(&plant));
    assert_eq!(covered_px(&drawn(1)), (3.0 * 24.0_f64).powi(2));
    let overlap = 6.0 * 24.0;
    assert_eq!(covered_px(&drawn(2)), 36.0 * 36.0 + 24.0 * 24.0 - overlap);
    assert_eq!(covered_px(&drawn(0)), 0.0);
}

fn draw_at(plant: &Plant, transforms: &[DAffine3], camera: &LookAt) -> Image {
    let list = DrawList::of_plant(plant);
    let placed: Vec<_> = transforms.iter().map(|&world_from_plant| Placed::new(&list, world_from_plant)).collect();
    Painter::new(&plant.materials, &plant.textures)
        .unwrap()
        .draw_placed(&placed, &camera.camera(SIZE[1]), SIZE, &bare())
        .unwrap()
}

#[test]
fn placed_plants_are_drawn_where_they_stand_and_one_that_stands_nowhere_is_left_out() {
    let plant = squares(&[(Vec3::ZERO, 0.25, 0)], &[material([1.0; 3])]);
    let nowhere = [DAffine3::from_scale(DVec3::ZERO), DAffine3::from_translation(DVec3::splat(f64::NAN))];
    let places = [-1.0, 0.0, 1.0].map(|x| DAffine3::from_translation(DVec3::X * x));
    let image = draw_at(&plant, &[&places[..], &nowhere].concat(), &camera());
    assert_eq!(covered_px(&image), 3.0 * 12.0 * 12.0);
    assert!([24, 48, 72].iter().all(|&x| image.pixel(x, 48).unwrap()[3] == 255));
    assert_eq!(covered_px(&draw_at(&plant, &[], &camera())), 0.0);
}

#[test]
fn plants_far_from_the_origin_are_drawn_as_at_the_origin() {
    let plant = squares(&[(Vec3::ZERO, 0.3, 0)], &[material([0.3, 0.6, 0.2])]);
    let at = |offset: DVec3| {
        let places = [DVec3::new(-0.7, 0.1, 0.0), DVec3::new(0.6, -0.2, 1.0)];
        let camera = LookAt { eye: camera().eye + offset, target: camera().target + offset, ..camera() };
        draw_at(&plant, &places.map(|place| DAffine3::from_translation(place + offset)), &camera)
    };
    assert!(at(DVec3::ZERO) == at(DVec3::new(1e6, -2e6, 1e6)));
}

#[test]
fn a_turned_plant_looks_like_one_whose_vertices_are_turned() {
    let turn = Quat::from_euler(glam::EulerRot::YXZ, 0.8, -0.3, 0.4);
    let materials = [material([0.3, 0.6, 0.2])];
    let turned_at_once =
        draw_at(&squares(&[(Vec3::ZERO, 1.0, 0)], &materials), &[DAffine3::from_quat(turn.as_dquat())], &camera());
    let mut plant = squares(&[], &materials);
    push_square(&mut plant, Vec3::ZERO, 1.0, turn, 0);
    let (a, b) = (turned_at_once.pixel(48, 48).unwrap(), draw(&plant).pixel(48, 48).unwrap());
    assert!((covered_px(&turned_at_once) - covered_px(&draw(&plant))).abs() < 1.0);
    assert!(a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 4) && a[1] > 60, "{a:?} {b:?}");
}

#[test]
fn the_same_bytes_come_out_on_any_number_of_threads() {
    let mut plant = squares(&[], &[material([0.2, 0.7, 0.2])]);
    for i in 0..400_u32 {
        let [a, b, c] = [7.0, 11.0, 13.0].map(|step| (i as f32 * step).sin());
        push_square(
            &mut plant,
            Vec3::new(a, b, c) * 1.5,
            0.2,
            Quat::from_rotation_arc(Vec3::Z, Vec3::new(b, c, a).normalize()),
            0,
        );
    }
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| draw(&plant));
    assert_eq!(on(1), on(5));
}

/// A texture with an opaque white disc, whose radius is 0.3 of the texture's side.
fn disc_texture() -> Texture {
    let mut pixels = image::RgbaImage::new(128, 128);
    for (x, y, pixel) in pixels.enumerate_pixels_mut() {
        let inside = (x as f32 - 63.5).hypot(y as f32 - 63.5) < 0.3 * 128.0;
        *pixel = image::Rgba(if inside { [255; 4] } else { [255, 0, 0, 0] });
    }
    let mut bytes = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    Texture { name: "disc".into(), format: TextureFormat::Png, bytes: bytes.into_inner() }
}

#[test]
fn a_masked_leaf_keeps_its_coverage_with_distance() {
    let masked = Material { texture: Some(0), alpha_mode: AlphaMode::Mask, ..material([1.0; 3]) };
    let mut plant = squares(&[(Vec3::ZERO, 1.5, 0)], &[masked]);
    plant.textures.push(disc_texture());
    for distance in [10.0, 20.0, 40.0, 80.0] {
        let camera = LookAt { eye: DVec3::Z * distance, ..camera() };
        let covered = covered_px(&draw_plant(&plant, &camera.camera(SIZE[1]), SIZE, &bare()).unwrap());
        let disc = std::f64::consts::PI * (0.3 * 3.0 * 24.0 * 10.0 / distance).powi(2);
        assert!((covered / disc - 1.0).abs() < 0.2, "{distance}: {covered} {disc}");
    }
}

#[test]
fn hostile_cameras_numbers_and_sizes_never_panic() {
    let mut plant = squares(&[(Vec3::ZERO, 1.0, 0), (Vec3::splat(1e30), 1e30, 0)], &[material([1.0; 3])]);
    plant.vertices[0].position = [f32::NAN; 3];
    plant.vertices[1].uv = [f32::INFINITY; 2];
    for eye in [DVec3::ZERO, DVec3::splat(f64::NAN), DVec3::splat(1e300)] {
        for near in [0.0, f64::NAN, 1e-300] {
            draw_plant(&plant, &LookAt { eye, near, ..camera() }.camera(SIZE[1]), SIZE, &bare()).unwrap();
        }
    }
    for size in [[0, 9], [9, 0], [u32::MAX, 9]] {
        assert!(draw_plant(&plant, &camera().camera(9), size, &bare()).is_err());
    }
}
