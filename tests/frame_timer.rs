//! Times of frames on the GPU, and a budget of milliseconds that goes by them.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Grove, Instance, Look, LookAt,
    draw::ModelId,
    gpu::{FrameTimer, GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    scene::{
        Active, Kind, Placement, SharedBudget,
        budget::{Pace, Rule, Times},
    },
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use glam::{DAffine3, DVec3};
use std::time::Instant;

fn model(leaves: u32) -> FoliageModel {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let mut model = simplify(&plant, &SimplifyOptions::fast(), &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.order_wood();
    model
}

struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    id: ModelId,
}

impl Stage {
    fn new(model: &FoliageModel, size: [u32; 2]) -> Option<Self> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, size).unwrap();
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        Some(Self { gpu, target, foliage, id })
    }

    /// A small birch, ready to be drawn.
    fn of_a_birch() -> Option<Self> {
        let model = model(300);
        let mut stage = Self::new(&model, [64; 2])?;
        let camera = LookAt::framing(&model.sphere(), DVec3::Z, 1.0, 1.0);
        stage.prepare(&camera, &[(DAffine3::IDENTITY, 300.0)]);
        Some(stage)
    }

    fn prepare(&mut self, camera: &LookAt, plants: &[(DAffine3, f32)]) -> u64 {
        let plants: Vec<Instance> =
            plants.iter().map(|&(world_from_plant, active)| Instance::new(self.id, world_from_plant, active)).collect();
        let frame = Frame::new(&camera.camera(self.target.size()[1]));
        let prepared = self.foliage.prepare(self.gpu.device(), self.gpu.queue(), frame, &plants).unwrap();
        prepared.wood_triangles
    }

    fn timer(&self) -> FrameTimer {
        FrameTimer::new(self.gpu.device(), self.gpu.queue()).expect("the adapter has timestamps")
    }
}

#[test]
fn frames_are_timed_in_order_and_no_longer_than_they_took() {
    let Some(stage) = Stage::of_a_birch() else { return };
    let mut timer = stage.timer();
    let started = Instant::now();
    let mut times = Vec::new();
    for frame in 0..6 {
        stage.target.draw_timed(&stage.foliage, &mut timer, 10 * frame).unwrap();
        times.extend(timer.read());
    }
    let took_ms = 1e3 * started.elapsed().as_secs_f64();
    assert_eq!(times.iter().map(|time| time.0).collect::<Vec<_>>(), [0, 10, 20, 30, 40, 50]);
    assert!(times.iter().all(|time| time.1 > 0.0), "{times:?}");
    assert!(times.iter().map(|time| time.1).sum::<f64>() <= took_ms, "{times:?} in {took_ms}");
    assert_eq!(timer.read(), [], "each time is read once");
}

#[test]
fn frames_that_nobody_reads_are_not_timed_and_later_ones_are() {
    let Some(stage) = Stage::of_a_birch() else { return };
    let mut timer = stage.timer();
    for frame in 0..20 {
        stage.target.draw_timed(&stage.foliage, &mut timer, frame).unwrap();
    }
    let times = timer.read();
    assert_eq!(times.iter().map(|time| time.0).collect::<Vec<_>>(), (0..8).collect::<Vec<_>>());
    // Commands that are never submitted cost no slot.
    for _ in 0..20 {
        let mut encoder = stage.gpu.device().create_command_encoder(&Default::default());
        timer.begin(99, &mut encoder);
        timer.end(&mut encoder);
    }
    stage.target.draw_timed(&stage.foliage, &mut timer, 20).unwrap();
    assert_eq!(timer.read().iter().map(|time| time.0).collect::<Vec<_>>(), [20]);
    stage.gpu.check().unwrap();
}

#[test]
fn devices_without_timestamps_have_no_timer() {
    let Some(_) = gpu() else { return };
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
    assert!(FrameTimer::new(&device, &queue).is_none());
}

/// A walk through a grove of 96 birches for 2,000 frames, which looks back halfway; prints how the
/// times keep to a target.
#[test]
#[ignore = "a measurement"]
fn a_walk_keeps_to_its_time() {
    let model = model(2000);
    let Some(mut stage) = Stage::new(&model, [96, 54]) else { return };
    let radius = model.sphere().radius;
    let at = |i: i32, j: i32| DVec3::new(f64::from(i), 0.0, f64::from(j)) * 2.2 * radius;
    let places: Vec<DAffine3> = (0..96).map(|i| DAffine3::from_translation(at(i % 8 - 4, -(i / 8)))).collect();
    let placements: Vec<Placement> =
        places.iter().map(|&world_from_plant| Placement { kind: 0, world_from_plant }).collect();
    let mut grove = Grove::new(vec![Kind::new(&model)], &placements).unwrap();
    let camera = |frame: u64| {
        let eye = DVec3::new(0.5 * radius, 0.5 * radius, (10.0 - 30.0 * frame as f64 / 2000.0) * radius);
        let angle = std::f64::consts::PI * ((frame as f64 - 1000.0) / 150.0).clamp(0.0, 1.0);
        let target = eye + DVec3::new(angle.sin(), 0.05, -angle.cos());
        let near = 0.02 * radius;
        LookAt {
            eye,
            target,
            near,
            fov_y_radians: 1.0,
            aspect: 96.0 / 54.0,
            ..LookAt::framing(&model.sphere(), DVec3::Z, 1.0, 1.0)
        }
    };
    for factor in [1.3, 2.0] {
        let mut budget = SharedBudget::new(std::slice::from_ref(&model), Rule::default(), 1.0);
        let mut timer = stage.timer();
        let mut seen: Vec<Active> = Vec::new();
        let mut frame = |number: u64, leaves: f64, timer: &mut FrameTimer, stage: &mut Stage| {
            let camera = camera(number);
            budget.amount = leaves;
            grove.select_within(&camera.camera(54), &mut budget, Some(1.0 / 60.0), &mut seen);
            let plants: Vec<_> = seen.iter().map(|active| (places[active.instance as usize], active.count)).collect();
            let wood = stage.prepare(&camera, &plants);
            stage.target.draw_timed(&stage.foliage, timer, number).unwrap();
            budget.load(wood)
        };
        // What the wood and an empty picture take at most; the first frames warm up.
        let mut bare: f64 = 0.0;
        for number in 0..40 {
            frame(50 * number, 1.0, &mut timer, &mut stage);
            let ms = timer.read().last().map_or(0.0, |time| time.1);
            bare = if number < 3 { 0.0 } else { bare.max(ms) };
        }
        let target_ms = factor * bare;
        let mut pace = Pace::new(target_ms, 10_000.0);
        let (mut times, mut leaves, mut mean) = (Vec::new(), Vec::new(), None);
        let (mut near, mut near_mean) = (0, 0);
        for number in 0..2000 {
            leaves.push(pace.leaves());
            let load = frame(number, pace.leaves(), &mut timer, &mut stage);
            pace.drew(number, load);
            for (frame, ms) in timer.read() {
                pace.took(frame, Times { gpu_ms: Some(ms), ..Times::default() });
                times.push(ms);
                let smooth = mean.map_or(ms, |mean: f64| mean + 0.1 * (ms - mean));
                mean = Some(smooth);
                near += u32::from((ms / target_ms - 1.0).abs() <= 0.1);
                near_mean += u32::from((smooth / target_ms - 1.0).abs() <= 0.1);
            }
        }
        let count = times.len() as f64;
        let over = times.iter().filter(|&&ms| ms > 1.25 * target_ms).count();
        let [least, most] = [f64::min, f64::max].map(|of| leaves[100..].iter().copied().reduce(of).unwrap());
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[(share * (count - 1.0)) as usize];
        println!(
            "target {target_ms:.1} ms: {count} frames, within 10 % {:.1} %, their mean of ten {:.1} %, a quarter over \
             {:.1} %; p50 {:.1} p95 {:.1} p99 {:.1}; {least:.0} to {most:.0} leaves",
            100.0 * f64::from(near) / count,
            100.0 * f64::from(near_mean) / count,
            100.0 * over as f64 / count,
            at(0.5),
            at(0.95),
            at(0.99),
        );
        assert!(count >= 1990.0 && f64::from(near_mean) / count > 0.5, "{near_mean} of {count}");
    }
}
