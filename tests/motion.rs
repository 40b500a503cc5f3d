//! Motion vectors lead back to the place where the previous frame showed the same point.
//!
//! Without an adapter the tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    Error, FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt,
    draw::{Coloring, Ground, ModelId, records::InstanceRecord},
    effects::{Effects, Wind},
    gpu::{GpuDevice, MOTION, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::Image,
};
use glam::{DAffine3, DVec2, DVec3};

const SIZE: [u32; 2] = [480, 400];
const ACTIVE: f32 = 150.0;

struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    model: ModelId,
    camera: LookAt,
}

impl Stage {
    /// With flat colouring only the leaves are drawn, each in its own colour; otherwise the plant.
    fn new(look: Look) -> Option<Self> {
        let gpu = gpu()?;
        let mut model = birch();
        if look.coloring == Coloring::Flat {
            (model.wood, model.wood_order) = (Default::default(), None);
        }
        let target = Offscreen::new(&gpu, SIZE).unwrap();
        let foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        let mut foliage = foliage.with_motion(gpu.device(), MOTION);
        let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
        let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
        let camera = LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 0.7).with_aspect(aspect);
        Some(Self { gpu, target, foliage, model: id, camera })
    }

    fn plant(&self) -> Instance {
        Instance::new(self.model, DAffine3::IDENTITY, ACTIVE)
    }

    fn draw(&mut self, frame: Frame, plant: Instance) -> (Image, Vec<[f32; 2]>) {
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), frame, &[plant]).unwrap();
        (self.target.picture(&self.foliage).unwrap(), self.target.motion(&self.foliage).unwrap())
    }
}

fn birch() -> FoliageModel {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(400), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::balanced() };
    let mut model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.order_wood();
    model
}

fn windy() -> Look {
    let effects = Effects { wind: Some(Wind { strength: 0.08, ..Wind::default() }), ..Effects::default() };
    Look { effects, ..Look::default() }
}

fn frame(camera: &LookAt) -> Frame {
    camera.camera(SIZE[1]).into()
}

fn pixels() -> impl Iterator<Item = (usize, DVec2)> {
    let [width, height] = SIZE.map(|side| side as usize);
    (0..width * height).map(move |at| (at, DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5)))
}

fn size() -> DVec2 {
    DVec2::new(SIZE[0].into(), SIZE[1].into())
}

/// The leaf at each pixel, identified by its colour; `None` at the border of the picture and where
/// a neighbour has another colour.
fn leaves(picture: &Image) -> Vec<Option<[u8; 3]>> {
    let [width, height] = SIZE.map(|side| side as usize);
    let color = |at: usize| <[u8; 3]>::try_from(&picture.rgba[4 * at..4 * at + 3]).unwrap();
    let inside = |at: usize| (1..width - 1).contains(&(at % width)) && (1..height - 1).contains(&(at / width));
    let alike = |at: usize| [at - 1, at + 1, at - width, at + width].iter().all(|next| color(*next) == color(at));
    (0..width * height).map(|at| (inside(at) && alike(at)).then(|| color(at))).collect()
}

/// Follows `share` of the motion vector back from each moving pixel inside a leaf, and returns the
/// fraction of these pixels for which `before` shows the same leaf there.
fn found(before: &Image, now: &Image, vectors: &[[f32; 2]], share: f64) -> f64 {
    let leaves = leaves(now);
    let (mut same, mut all) = (0, 0);
    for (at, pixel) in pixels().filter(|(at, _)| vectors[*at] != [0.0; 2]) {
        let [x, y] = vectors[at].map(f64::from);
        let from = (pixel - DVec2::new(x, y) * share * size()).floor();
        if let Some(leaf) = leaves[at].filter(|_| from.cmpge(DVec2::ZERO).all() && from.cmplt(size()).all()) {
            let source = 4 * (from.y as usize * SIZE[0] as usize + from.x as usize);
            all += 1;
            same += usize::from(before.rgba[source..source + 3] == leaf);
        }
    }
    assert!(all > SIZE[0] as usize * SIZE[1] as usize / 20, "{all} pixels move");
    f64::from(same as u32) / f64::from(all as u32)
}

#[test]
fn motion_leads_back_to_what_the_frame_before_showed() {
    let Some(mut stage) = Stage::new(Look { coloring: Coloring::Flat, ..windy() }) else { return };
    let first = frame(&stage.camera).at(12.5);
    let eye = stage.camera.eye + DVec3::new(0.15, 0.05, -0.1) * stage.camera.eye.distance(stage.camera.target) * 0.25;
    let second = frame(&LookAt { eye, ..stage.camera }).at(13.0).after(&first);
    let turned = DAffine3::from_rotation_y(0.04) * DAffine3::from_translation(DVec3::new(0.05, 0.02, 0.0));
    let plant = stage.plant();
    let moved = Instance { world_from_plant: turned, before: Some(plant.world_from_plant), ..plant };
    let (before, _) = stage.draw(first, plant);
    let (now, vectors) = stage.draw(second, moved);
    let [with, half, without] = [1.0, 0.5, 0.0].map(|share| found(&before, &now, &vectors, share));
    println!("found again: {with:.3}, halfway {half:.3}, in the same place {without:.3}");
    // Points that were hidden in the previous frame cannot be found.
    assert!(with > 0.84 && half < with - 0.05 && without < with - 0.15, "{with} {half} {without}");
    // Each cause contributes to the vectors.
    let (_, no_wind) = stage.draw(Frame { before: Some((stage.camera.camera(SIZE[1]), 13.0)), ..second }, moved);
    let (_, no_step) = stage.draw(second, Instance { before: None, ..moved });
    let (_, no_camera) = stage.draw(Frame { before: Some((second.camera, 12.5)), ..second }, moved);
    for (cause, vectors) in [("wind", no_wind), ("plant", no_step), ("camera", no_camera)] {
        let found = found(&before, &now, &vectors, 1.0);
        println!("without {cause}: {found:.3}");
        assert!(found < with - 0.1, "without {cause}: {found} of {with}");
    }
}

#[test]
fn a_turning_camera_moves_every_pixel_as_its_ray_turns_shifted_or_not() {
    let Some(mut stage) = Stage::new(Look::default()) else { return };
    let camera = stage.camera;
    let target = camera.target + DVec3::new(0.1, 0.06, 0.0) * camera.eye.distance(camera.target);
    let first = frame(&LookAt { target, ..camera });
    let still = frame(&camera).after(&first);
    let plant = stage.plant();
    for jitter_px in [[0.0, 0.0], [0.3, -0.45]] {
        let (_, vectors) = stage.draw(Frame { jitter_px, ..still }, plant);
        let mut seen = 0;
        for (at, pixel) in pixels().filter(|(at, _)| vectors[*at] != [0.0; 2]) {
            let place = (pixel - DVec2::from(jitter_px)) / size();
            let ndc = (place * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
            let world = camera.clip_from_world().inverse().project_point3(ndc.extend(0.5));
            let before = first.camera.clip_from_world * (world - camera.eye).extend(0.0)
                + first.camera.clip_from_world * camera.eye.extend(1.0);
            let expected = place - (DVec2::new(before.x, -before.y) / before.w * 0.5 + 0.5);
            let found = DVec2::new(vectors[at][0].into(), vectors[at][1].into());
            assert!((found - expected).length() < 1e-4, "{pixel}: {found} instead of {expected}");
            seen += 1;
        }
        assert!(seen > 10_000, "{seen} pixels");
    }
    let [plain, shifted] = [[0.0; 2], [0.3, -0.45]].map(|jitter_px| stage.draw(Frame { jitter_px, ..still }, plant).0);
    assert_ne!(plain.rgba, shifted.rgba, "the picture itself is shifted");
}

#[test]
fn sky_and_ground_move_as_the_camera_does() {
    let ground = Ground { color: [0.2, 0.3, 0.1], height: -1.0, haze: 300.0 };
    let Some(mut stage) = Stage::new(Look { ground: Some(ground), ..Look::default() }) else { return };
    let eye = DVec3::new(1e5, 2.0, -3e4);
    let camera = LookAt { eye, target: eye + DVec3::new(0.2, -0.3, -1.0), ..stage.camera };
    let before = LookAt { eye: eye + DVec3::new(0.3, 0.1, 0.2), target: eye + DVec3::new(0.6, -0.2, -1.0), ..camera };
    let frame = frame(&camera).after(&frame(&before));
    stage.foliage.prepare(stage.gpu.device(), stage.gpu.queue(), frame, &[]).unwrap();
    let vectors = stage.target.motion(&stage.foliage).unwrap();
    let mut seen = [0, 0];
    for (at, pixel) in pixels() {
        let place = pixel / size();
        let ndc = (place * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
        let near = LookAt { eye: DVec3::ZERO, target: camera.target - eye, ..camera };
        let ray = near.clip_from_world().inverse().project_point3(ndc.extend(0.5));
        let is_ground = ray.y < 0.0;
        let met = ray * ((eye.y - ground.height) / -ray.y);
        let point = if is_ground { (met + eye).extend(1.0) } else { ray.extend(0.0) };
        let then = before.clip_from_world() * point;
        let expected = place - (DVec2::new(then.x, -then.y) / then.w * 0.5 + 0.5);
        let found = DVec2::new(vectors[at][0].into(), vectors[at][1].into());
        assert!((found - expected).length() < 1e-4, "{pixel}: {found} instead of {expected}");
        seen[usize::from(is_ground)] += 1;
    }
    assert!(seen.iter().all(|pixels| *pixels > 10_000), "{seen:?}");
}

#[test]
fn more_plants_than_fit_are_an_error_and_nothing_of_an_earlier_frame_is_drawn() {
    let Some(mut stage) = Stage::new(Look::default()) else { return };
    let (frame, plant) = (frame(&stage.camera), stage.plant());
    let (seen, _) = stage.draw(frame, plant);
    let limits = stage.gpu.device().limits();
    let room = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / size_of::<InstanceRecord>() as u64;
    // With motion vectors each plant is listed twice, so these plants would only fit without them.
    let hidden = Instance { active: 0.0, ..plant };
    let many = vec![hidden; usize::try_from(room / 2 + 1).unwrap()];
    let error = stage.foliage.prepare(stage.gpu.device(), stage.gpu.queue(), frame, &many).unwrap_err();
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    let none = stage.target.picture(&stage.foliage).unwrap();
    assert!(none.rgba != seen.rgba && stage.target.motion(&stage.foliage).unwrap().iter().all(|v| *v == [0.0; 2]));
    stage.foliage.prepare(stage.gpu.device(), stage.gpu.queue(), frame, &[]).unwrap();
    assert_eq!(none.rgba, stage.target.picture(&stage.foliage).unwrap().rgba);
}

#[test]
fn still_plants_have_no_motion_and_without_motion_vectors_there_is_no_pass() {
    let Some(mut stage) = Stage::new(windy()) else { return };
    let frame = frame(&stage.camera).at(12.5);
    let plant = stage.plant();
    for frame in [frame, frame.after(&frame)] {
        let (_, vectors) = stage.draw(frame, plant);
        let most = vectors.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
        assert!(most < 1e-6, "{most}");
    }
    assert_eq!(stage.foliage.diagnostics().passes, ["motion vectors"]);
    let (with, _) = stage.draw(frame, plant);
    let look = *stage.foliage.look();
    stage.foliage = FoliageRenderer::new(stage.gpu.device(), TARGET, look).unwrap();
    assert!(stage.foliage.diagnostics().passes.is_empty());
    stage.model = stage.foliage.add_model(stage.gpu.device(), stage.gpu.queue(), &birch()).unwrap();
    let plant = stage.plant();
    let (without, vectors) = stage.draw(frame.after(&Frame { seconds: 3.0, ..frame }), plant);
    assert_eq!(with.rgba, without.rgba, "motion vectors must not change the picture");
    assert!(vectors.iter().all(|vector| *vector == [0.0; 2]));
}
