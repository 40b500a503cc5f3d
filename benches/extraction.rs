//! CPU cost of a frame: moving a tree to its active count, and selecting among a thousand trees.
//!
//! `cargo bench --bench extraction`. The dolly follows the paper: one oak of 20,146 leaves, with
//! the camera moving back from where the tree fills the picture to where the level of detail ends,
//! and returning, in 2,000 frames. After each case the medians are printed as costs per frame and
//! per changed leaf.

mod common;

use criterion::Criterion;
use foliage_lod::{
    Camera, Depth, FoliageModel, Grove, Swap, Timeline,
    bounds::Sphere,
    extract::{Blend, LodPolicy, REFERENCE_FOV_Y, Sight, leaf_count},
    scene::{Kind, Placement},
};
use glam::{
    DAffine3, DMat4, DVec3,
    dcamera::rh::{proj, view},
};
use std::{
    hint::black_box,
    time::{Duration, Instant},
};

const FRAMES: usize = 2000;
const TREES: usize = 1000;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let model = common::oak();
    let leaves = model.leaves.len();
    dolly(&mut criterion, &model);
    measure(&mut criterion, "0 to N", leaves, "leaf", {
        let mut swap = Swap::new(&model);
        move || {
            swap.set_active(0);
            let started = Instant::now();
            black_box(swap.set_active(leaves as u32));
            started.elapsed()
        }
    });
    lookup(&mut criterion, &model);
    grove(&mut criterion, &model);
    criterion.final_summary();
}

/// Active counts of a dolly from 3 to 60 radii and back.
fn counts(leaves: u32) -> Vec<u32> {
    let policy = Blend::default();
    let distance = |frame: usize| {
        let way = 1.0 - (2.0 * frame as f32 / FRAMES as f32 - 1.0).abs();
        policy.near + (policy.far - policy.near) * way
    };
    let sight = |distance| Sight { distance, radius: 1.0, fov_y: REFERENCE_FOV_Y, height_px: 1080.0 };
    (0..FRAMES).map(|frame| leaf_count(policy.lod(&sight(distance(frame))), leaves, 1)).collect()
}

fn dolly(criterion: &mut Criterion, model: &FoliageModel) {
    let counts = counts(model.leaves.len() as u32);
    let changed: u32 = counts.windows(2).map(|pair| pair[0].abs_diff(pair[1])).sum();
    let mut swap = Swap::new(model);
    let run = move || {
        swap.set_active(counts[0]);
        let started = Instant::now();
        for &n in &counts {
            black_box(swap.set_active(n));
        }
        started.elapsed()
    };
    let seconds = measure(criterion, "dolly", FRAMES, "frame", run);
    if let Some(seconds) = seconds {
        println!("dolly: {:.2} ns per changed leaf, {changed} changes", seconds * 1e9 / f64::from(changed));
    }
}

/// Looks up the same scales without state: every leaf in every tenth frame of the dolly.
fn lookup(criterion: &mut Criterion, model: &FoliageModel) {
    let timeline = Timeline::new(model);
    let counts: Vec<u32> = counts(model.leaves.len() as u32).into_iter().step_by(10).collect();
    let looked_up = counts.iter().sum::<u32>() as usize;
    measure(criterion, "timeline", looked_up, "lookup", move || {
        let started = Instant::now();
        for &n in &counts {
            black_box((0..n).map(|leaf| timeline.scale(leaf, n)).sum::<f32>());
        }
        started.elapsed()
    });
}

/// A thousand oaks on a grid, seen by a camera that circles and turns among them.
fn grove(criterion: &mut Criterion, model: &FoliageModel) {
    let Sphere { radius, .. } = model.sphere();
    let side = (TREES as f64).sqrt().ceil() as usize;
    let place = |i: usize| DVec3::new((i % side) as f64, 0.0, (i / side) as f64) * radius * 2.5;
    let placements: Vec<Placement> =
        (0..TREES).map(|i| Placement { kind: 0, world_from_plant: DAffine3::from_translation(place(i)) }).collect();
    let mut grove = Grove::new(vec![Kind::new(model)], &placements).expect("finite placements");
    let clip = proj::directx::perspective_infinite_reverse(f64::from(REFERENCE_FOV_Y), 16.0 / 9.0, 0.1);
    let middle = place(TREES / 2 + side / 2);
    let cameras: Vec<Camera> = (0..FRAMES)
        .map(|frame| {
            let turn = frame as f64 / FRAMES as f64 * std::f64::consts::TAU;
            let eye = middle + DVec3::new(turn.cos(), 0.05, turn.sin()) * radius * 30.0;
            let forward = DVec3::new((3.0 * turn).sin(), 0.0, (3.0 * turn).cos());
            let clip_from_world: DMat4 = clip * view::look_to_mat4(eye, forward, DVec3::Y);
            Camera { eye, clip_from_world, height_px: 1080, depth: Depth::Reversed }
        })
        .collect();
    let (mut out, mut seen) = (Vec::new(), 0);
    cameras.iter().for_each(|camera| {
        grove.select(camera, &mut out);
        seen += out.len();
    });
    println!("{TREES} trees: {:.0} in view on average", seen as f64 / FRAMES as f64);
    measure(criterion, "1,000 trees", FRAMES, "frame", move || {
        let started = Instant::now();
        for camera in &cameras {
            grove.select(camera, &mut out);
            black_box(&out);
        }
        started.elapsed()
    });
}

/// Benchmarks `run`, which times itself, and prints the median and the median divided by `parts`.
/// Returns the median in seconds, or `None` if it did not run.
fn measure(
    criterion: &mut Criterion,
    name: &str,
    parts: usize,
    part: &str,
    mut run: impl FnMut() -> Duration,
) -> Option<f64> {
    let mut times = Vec::new();
    let mut group = criterion.benchmark_group("extraction");
    group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(2));
    group.bench_function(name, |bencher| {
        bencher.iter_custom(|iterations| {
            let first = times.len();
            times.extend((0..iterations).map(|_| run()));
            times[first..].iter().sum()
        });
    });
    group.finish();
    times.sort_unstable();
    let median = times.get(times.len() / 2)?.as_secs_f64();
    println!("{name}: {:.3} ms, {:.1} ns per {part}", median * 1e3, median * 1e9 / parts as f64);
    Some(median)
}
