//! Cameras from the caller's own matrix: every projection that an engine may use, on the GPU and on
//! the CPU. Also removed models, reused scale ranges and upload records.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    Camera, Depth, Error, FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt, Swap,
    draw::{Ground, Upload},
    extract::{LodPolicy, Sight},
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::SoftwareRenderer,
};
use glam::{DAffine3, DMat4, DVec3, DVec4, dcamera::rh::proj::directx, dcamera::rh::view};

const SIZE: [u32; 2] = [200, 160];

fn birch() -> FoliageModel {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(500), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::balanced() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

/// Turns standard depth into reversed depth, and back.
fn flipped(matrix: DMat4) -> DMat4 {
    DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::NEG_Z, DVec4::new(0.0, 0.0, 1.0, 1.0)) * matrix
}

/// Cameras at the same place: perspective and orthographic, standard and reversed depth, centred
/// and off-centre.
fn cameras(model: &FoliageModel) -> Vec<(&'static str, Camera)> {
    let (center, radius) = (model.sphere().center(), model.sphere().radius);
    let eye = center + DVec3::new(0.4, 0.3, 1.0).normalize() * 3.0 * radius;
    let camera_from_world = view::look_at_mat4(eye, center, DVec3::Y);
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let finite = directx::perspective(0.8, aspect, 0.5 * radius, 9.0 * radius);
    let off_centre = DMat4::from_translation(DVec3::new(0.2, -0.1, 0.0)) * finite;
    let half = 1.2 * radius;
    let parallel = directx::orthographic(-half * aspect, half * aspect, -half, half, 0.5 * radius, 9.0 * radius);
    let camera = |projection: DMat4, depth| {
        let clip_from_world = projection * camera_from_world;
        Camera { clip_from_world, eye, height_px: SIZE[1], depth }
    };
    let mut cameras = Vec::new();
    for (name, standard) in [("perspective", finite), ("off-centre", off_centre), ("orthographic", parallel)] {
        cameras.push((name, camera(standard, Depth::Standard)));
        cameras.push((name, camera(flipped(standard), Depth::Reversed)));
    }
    cameras.push(("infinite", camera(directx::perspective_infinite_reverse(0.8, aspect, 0.1), Depth::Reversed)));
    cameras
}

struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
}

impl Stage {
    fn new() -> Option<Self> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, SIZE).unwrap();
        let look = Look { wood_error_px: 0.0, ..Look::default() };
        let foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        Some(Self { gpu, target, foliage })
    }
}

#[test]
fn every_projection_draws_the_same_on_gpu_and_cpu_and_by_either_depth() {
    let model = birch();
    let mut painter = SoftwareRenderer::new(Look::default()).unwrap();
    let on_cpu = painter.add_model(&model).unwrap();
    let mut pictures = Vec::new();
    for (name, camera) in cameras(&model) {
        let plant = Instance::new(on_cpu, DAffine3::IDENTITY, 250.0);
        let painted = painter.draw(camera, &[plant], SIZE).unwrap().image;
        let greens = painted.rgba.chunks_exact(4).filter(|p| p[1] > p[2].saturating_add(20)).count();
        assert!(greens > 2000, "{name}: {greens} green pixels");
        if let Some(mut stage) = Stage::new() {
            let id = stage.foliage.add_model(stage.gpu.device(), stage.gpu.queue(), &model).unwrap();
            let plant = Instance { model: id, ..plant };
            stage.foliage.prepare(stage.gpu.device(), stage.gpu.queue(), camera, &[plant]).unwrap();
            assert_eq!(stage.foliage.depth_clear_value(), camera.depth.clear_value());
            let drawn = stage.target.picture(&stage.foliage).unwrap();
            let (mean, percentile) = difference(&drawn, &painted);
            println!("{name} {:?}: mean {mean:.2}, 95th percentile {percentile}", camera.depth);
            assert!(mean < 3.0 && percentile < 40, "{name}: {mean} {percentile}");
        }
        pictures.push((name, painted));
    }
    for pair in pictures[..6].chunks_exact(2) {
        let (mean, _) = difference(&pair[0].1, &pair[1].1);
        assert!(mean < 0.01, "{}: standard and reversed depth differ by {mean}", pair[0].0);
    }
    let (infinite, finite) = (&pictures[6].1, &pictures[0].1);
    assert!(difference(infinite, finite).0 < 0.01, "a near or far plane cuts the plant");
}

#[test]
fn near_and_far_planes_cut_alike_on_gpu_and_cpu() {
    let model = birch();
    let (center, radius) = (model.sphere().center(), model.sphere().radius);
    let eye = center + DVec3::Z * 3.0 * radius;
    // A thin slice around the centre of the crown.
    let projection = directx::perspective(0.8, 1.25, 2.95 * radius, 3.05 * radius);
    let clip_from_world = projection * view::look_at_mat4(eye, center, DVec3::Y);
    let camera = Camera { clip_from_world, eye, height_px: SIZE[1], depth: Depth::Standard };
    let mut painter = SoftwareRenderer::new(Look::default()).unwrap();
    let plant = Instance::new(painter.add_model(&model).unwrap(), DAffine3::IDENTITY, 500.0);
    let cut = painter.draw(camera, &[plant], SIZE).unwrap().image;
    let whole = LookAt { eye, target: center, up: DVec3::Y, fov_y_radians: 0.8, aspect: 1.25, near: 0.1 };
    let whole = painter.draw(whole.camera(SIZE[1]), &[plant], SIZE).unwrap().image;
    assert!(difference(&cut, &whole).0 > 0.5, "the planes cut {}", difference(&cut, &whole).0);
    let Some(mut stage) = Stage::new() else { return };
    let id = stage.foliage.add_model(stage.gpu.device(), stage.gpu.queue(), &model).unwrap();
    let plant = Instance { model: id, ..plant };
    stage.foliage.prepare(stage.gpu.device(), stage.gpu.queue(), camera, &[plant]).unwrap();
    let (mean, percentile) = difference(&stage.target.picture(&stage.foliage).unwrap(), &cut);
    assert!(mean < 3.0 && percentile < 40, "{mean} {percentile}");
}

#[test]
fn a_camera_tells_its_angles_and_a_wrong_depth_convention_is_refused() {
    let model = birch();
    for (name, camera) in cameras(&model) {
        camera.check().unwrap();
        let other = if camera.depth == Depth::Standard { Depth::Reversed } else { Depth::Standard };
        let wrong = Camera { depth: other, ..camera }.check();
        assert_eq!(wrong.is_err(), name != "orthographic", "{name}: {wrong:?}");
        if name == "orthographic" {
            assert!(camera.is_orthographic());
        } else {
            assert!((camera.fov_y() - 0.8).abs() < 1e-9, "{name}: {}", camera.fov_y());
        }
        assert!((camera.aspect() - 1.25).abs() < 1e-9, "{name}: {}", camera.aspect());
    }
    // Under an orthographic projection, the radius in pixels is the sphere's radius on the screen.
    let (_, parallel) = cameras(&model).swap_remove(4);
    let sight = Sight::new(&parallel, model.sphere().center(), model.sphere().radius);
    let expected = 0.5 * f64::from(SIZE[1]) / 1.2;
    assert!((f64::from(sight.radius_px()) - expected).abs() < 1e-3 * expected, "{} {expected}", sight.radius_px());
    let lod = foliage_lod::Blend::default().lod(&sight);
    assert!((0.1..=1.0).contains(&lod), "{lod}");

    let ground = Some(Ground { color: [0.2; 3], height: 0.0, haze: 100.0 });
    let painter = SoftwareRenderer::new(Look { ground, ..Look::default() }).unwrap();
    let refused = painter.draw(parallel, &[], SIZE).unwrap_err().to_string();
    assert!(refused.starts_with("camera is orthographic; it must be a perspective"), "{refused}");
    let Some(stage) = Stage::new() else { return };
    let mut foliage = FoliageRenderer::new(stage.gpu.device(), TARGET, Look { ground, ..Look::default() }).unwrap();
    let refused = foliage.prepare(stage.gpu.device(), stage.gpu.queue(), parallel, &[]).unwrap_err();
    assert!(matches!(refused, Error::InvalidOption { .. }), "{refused}");
}

#[test]
fn removed_models_are_skipped_and_their_numbers_are_not_used_again() {
    let Some(mut stage) = Stage::new() else { return };
    let model = birch();
    let (device, queue) = (stage.gpu.device().clone(), stage.gpu.queue().clone());
    let frame: Frame = cameras(&model)[0].1.into();
    let first = stage.foliage.add_model(&device, &queue, &model).unwrap();
    let plant = Instance::new(first, DAffine3::IDENTITY, 500.0);
    let drawn = stage.foliage.prepare(&device, &queue, frame, &[plant]).unwrap();
    assert_eq!((drawn.instances, drawn.skipped, stage.foliage.diagnostics().models), (1, 0, 1));
    let picture = stage.target.picture(&stage.foliage).unwrap();
    assert!(stage.foliage.remove_model(first) && !stage.foliage.remove_model(first));
    // The frame prepared before the removal no longer draws the model, and does not crash.
    let empty = stage.target.picture(&stage.foliage).unwrap();
    assert!(empty.rgba != picture.rgba);
    let drawn = stage.foliage.prepare(&device, &queue, frame, &[plant]).unwrap();
    assert_eq!((drawn.instances, drawn.skipped, drawn.leaves, stage.foliage.diagnostics().models), (0, 1, 0, 0));
    let second = stage.foliage.add_model(&device, &queue, &model).unwrap();
    assert_ne!(first, second);
    let drawn = stage.foliage.prepare(&device, &queue, frame, &[plant, Instance { model: second, ..plant }]).unwrap();
    assert_eq!((drawn.instances, drawn.skipped), (1, 1));
    assert_eq!(stage.target.picture(&stage.foliage).unwrap().rgba, picture.rgba);
}

#[test]
fn scales_that_are_given_back_make_room_for_others() {
    let Some(mut stage) = Stage::new() else { return };
    let model = birch();
    let (device, queue) = (stage.gpu.device().clone(), stage.gpu.queue().clone());
    let swap = Swap::new(&model);
    let ids: Vec<_> = (0..10).map(|_| stage.foliage.add_scales(&device, &queue, &swap).unwrap()).collect();
    let [used, room] = stage.foliage.diagnostics().scales;
    assert!(used == 5000 && room >= 5000, "{used} {room}");
    for id in &ids[2..8] {
        stage.foliage.remove_scales(*id);
    }
    assert_eq!(stage.foliage.diagnostics().scales, [2000, room]);
    for _ in 0..6 {
        stage.foliage.add_scales(&device, &queue, &swap).unwrap();
    }
    assert_eq!(stage.foliage.diagnostics().scales, [5000, room], "the buffer has not grown");
}

#[test]
fn upload_records_give_each_material_its_own_prefix() {
    let model = birch();
    let upload = Upload::new(&model);
    assert_eq!(upload.leaf_vertices.len(), model.vertices.len());
    assert_eq!([upload.index_end(0), upload.index_end(9999)], [0, model.indices.len() as u32]);
    let groups = upload.by_material();
    for n in [0, 1, 250, 500, 600] {
        let drawn: u32 = groups.iter().map(|group| group.index_end(n)).sum();
        assert_eq!(drawn, upload.index_end(n), "{n} leaves");
    }
    for (group, index) in groups.iter().flat_map(|group| group.indices.iter().map(move |&index| (group, index))) {
        let leaf = upload.leaf_vertices[index as usize].leaf;
        assert_eq!(upload.leaves[leaf as usize].material, group.material);
    }
    assert_eq!(upload.drawn_wood(0.0).corners.len(), upload.wood_indices.len());
}
