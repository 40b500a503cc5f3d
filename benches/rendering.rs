//! Frames drawn with scales from the timeline, compared with frames drawn with plain scales that
//! are stored per plant.
//!
//! `cargo bench --bench rendering`: one oak of 20,146 leaves at several active counts, on the
//! adapter that `GpuOptions::from_env` selects. Both kinds of frame alternate within each sample,
//! so that the printed ratio compares like with like.

mod common;

use criterion::{Criterion, SamplingMode};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Swap,
    gpu::{GpuDevice, Offscreen, TARGET},
    simplify::SimplifyOptions,
};
use glam::{DAffine3, DVec3};
use std::time::{Duration, Instant};

const SIZE: [u32; 2] = [640, 360];
const SHARES: [f32; 3] = [1.0, 0.5, 0.15];

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let Some(gpu) = common::gpu() else { return };
    let model = oak();
    for share in SHARES {
        bench(&mut criterion, &gpu, &model, share);
    }
    criterion.final_summary();
}

fn camera(model: &FoliageModel) -> LookAt {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    LookAt::framing(&model.sphere(), DVec3::new(0.4, 0.2, 1.0), 0.8, 1.0).with_aspect(aspect)
}

fn oak() -> FoliageModel {
    let mut plant = common::plant("english-oak", common::as_test().then_some(300));
    // Leaves only: the wood costs the same either way.
    plant.wood = Default::default();
    common::simplified(&plant, &SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() })
}

fn bench(criterion: &mut Criterion, gpu: &GpuDevice, model: &FoliageModel, share: f32) {
    let target = Offscreen::new(gpu, SIZE).expect("a small target");
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), model).expect("the model fits");
    let mut swap = Swap::new(model);
    let active = (share * model.leaves.len() as f32).round();
    swap.set_active(active as u32);
    let scales = foliage.add_scales(gpu.device(), gpu.queue(), &swap).expect("the scales fit");
    let camera = camera(model).camera(SIZE[1]);
    let mut frame = |scales| {
        let instance = Instance { scales, ..Instance::new(id, DAffine3::IDENTITY, active) };
        let started = Instant::now();
        foliage.prepare(gpu.device(), gpu.queue(), camera, &[instance]).expect("one plant fits");
        target.draw(&foliage).expect("the device answers");
        started.elapsed()
    };
    let (mut timeline, mut plain) = (Vec::new(), Vec::new());
    let mut group = criterion.benchmark_group("rendering");
    group.sample_size(20).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(500));
    group.bench_function(format!("timeline/{active}"), |bencher| {
        bencher.iter_custom(|iterations| {
            let first = timeline.len();
            for _ in 0..iterations {
                plain.push(frame(Some(scales)));
                timeline.push(frame(None));
            }
            timeline[first..].iter().sum()
        });
    });
    group.finish();
    if let (Some(timeline), Some(plain)) = (common::median_ms(timeline), common::median_ms(plain)) {
        let ratio = timeline / plain;
        println!(
            "{active} leaves: {timeline:.2} ms from the timeline, {plain:.2} ms from plain scales, ratio {ratio:.3}"
        );
    }
}
