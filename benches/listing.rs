//! CPU cost of a frame with 100,000 plants in view: selecting them with their levels of detail, and
//! listing and uploading what is drawn.
//!
//! `cargo bench --bench listing`, on the adapter that `GpuOptions::from_env` selects. The forest
//! mixes three species, as in a wood; the camera moves forward between two frames. After the
//! benchmark the medians of all parts are printed.

mod common;

use criterion::{Criterion, SamplingMode};
use foliage_lod::{
    Camera, FoliageModel, FoliageRenderer, Grove, Instance, Look, LookAt,
    extract::CookLambda,
    gpu::{GpuDevice, TARGET},
    scene::{Kind, Placement},
    simplify::SimplifyOptions,
};
use glam::{DAffine3, DQuat, DVec3};
use std::time::{Duration, Instant};

const PLANTS: usize = 100_000;
const LEAVES: u32 = 3000;
const SPECIES: [&str; 3] = ["english-oak", "betula-populifolia", "carya-illinoinensis"];
/// Metres between neighbouring plants.
const SPACING: f64 = 6.6;
/// Steps of the camera before it starts again.
const FRAMES: usize = 100;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let Some(gpu) = common::gpu() else { return };
    let (plants, leaves) = if common::as_test() { (1000, 30) } else { (PLANTS, LEAVES) };
    let mut forest = Forest::new(&gpu, &SPECIES.map(|species| model(species, leaves)), plants);
    let mut parts = [const { Vec::new() }; 3];
    let mut group = criterion.benchmark_group("listing");
    group.sample_size(20).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(500));
    group.bench_function(format!("{plants} plants"), |bencher| {
        bencher.iter_custom(|iterations| {
            let frame = |_| {
                let times = forest.frame(&gpu);
                parts.iter_mut().zip(times).for_each(|(part, time)| part.push(time));
                times[0] + times[2]
            };
            (0..iterations).map(frame).sum()
        });
    });
    group.finish();
    let [select, copy, prepare] = parts.map(|times| common::median_ms(times).unwrap_or(f64::NAN));
    println!("{plants} plants: {select:.2} ms to select, {copy:.2} ms to copy, {prepare:.2} ms to prepare");
    criterion.final_summary();
}

fn model(species: &str, leaves: u32) -> FoliageModel {
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() };
    common::simplified(&common::plant(species, Some(leaves)), &options)
}

/// A forest on a jittered grid, all of it in view.
struct Forest {
    grove: Grove,
    foliage: FoliageRenderer,
    /// Every plant with all its leaves.
    whole: Vec<Instance>,
    selected: Vec<foliage_lod::scene::Active>,
    instances: Vec<Instance>,
    frames: usize,
    side: f64,
}

impl Forest {
    fn new(gpu: &GpuDevice, models: &[FoliageModel], plants: usize) -> Self {
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).expect("a usable device");
        let add = |model| foliage.add_model(gpu.device(), gpu.queue(), model).expect("the model fits");
        let ids: Vec<_> = models.iter().map(add).collect();
        let side = (plants as f64).sqrt().ceil() as usize;
        // A fixed sequence that looks random: multiples of the golden ratio.
        let random = |i: usize, step: f64| (i as f64 * step).fract();
        let placements: Vec<Placement> = (0..plants)
            .map(|i| {
                let place = DVec3::new((i % side) as f64, 0.0, (i / side) as f64) * SPACING;
                let jitter = DVec3::new(random(i, 0.618_034), 0.0, random(i, 0.754_878)) * 0.5 * SPACING;
                let turn = DQuat::from_rotation_y(random(i, 0.569_84) * std::f64::consts::TAU);
                let scale = DVec3::splat(0.8 + 0.4 * random(i, 0.819_173));
                let world_from_plant = DAffine3::from_scale_rotation_translation(scale, turn, place + jitter);
                Placement { kind: (random(i, 0.671_044) * ids.len() as f64) as u32, world_from_plant }
            })
            .collect();
        let policy = CookLambda { start: 2.0, half_area: 0.4 };
        let kinds = models.iter().map(|model| Kind { policy: Box::new(policy), ..Kind::new(model) }).collect();
        let whole = placements.iter().map(|&Placement { kind, world_from_plant }| {
            Instance::new(ids[kind as usize], world_from_plant, LEAVES as f32)
        });
        Self {
            whole: whole.collect(),
            grove: Grove::new(kinds, &placements).expect("finite placements"),
            foliage,
            selected: Vec::new(),
            instances: Vec::new(),
            frames: 0,
            side: side as f64 * SPACING,
        }
    }

    fn camera(&self) -> Camera {
        let step = (self.frames % FRAMES) as f64 / FRAMES as f64;
        let eye = DVec3::new(0.5 * self.side, 0.3 * self.side, (2.0 - 0.2 * step) * self.side);
        let target = DVec3::new(0.5 * self.side, 0.0, 0.5 * self.side);
        let camera = LookAt { eye, target, up: DVec3::Y, fov_y_radians: 1.2, aspect: 16.0 / 9.0, near: 0.1 };
        camera.camera(1080)
    }

    /// Durations of selecting, of copying the selected plants' instances, and of preparing.
    fn frame(&mut self, gpu: &GpuDevice) -> [Duration; 3] {
        let camera = self.camera();
        self.frames += 1;
        let started = Instant::now();
        self.grove.select(&camera, &mut self.selected);
        let selected = started.elapsed();
        assert_eq!(self.selected.len(), self.whole.len(), "all plants are in view");
        self.instances.clear();
        let of = |active: &foliage_lod::scene::Active| Instance {
            active: active.count,
            ..self.whole[active.instance as usize]
        };
        self.instances.extend(self.selected.iter().map(of));
        let copied = started.elapsed();
        let prepared =
            self.foliage.prepare(gpu.device(), gpu.queue(), camera, &self.instances).expect("the plants fit");
        let whole = started.elapsed();
        assert_eq!(prepared.skipped, 0);
        // Uploads wait for a submission.
        let submission = gpu.submit([]).expect("the device answers");
        gpu.wait(submission, Duration::from_secs(60)).expect("the device answers");
        [selected, copied - selected, whole - copied]
    }
}
