//! Fragment capture: the GPU pass compared with the CPU rasteriser, on the same cloud of leaves
//! seen from 20 directions.
//!
//! Prints the number of fragments and the ratio of the two times before criterion's own figures.
//! Without an adapter only the CPU runs.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use foliage_lod::{
    gpu::{GpuDevice, GpuFragments, GpuOptions},
    simplify::{AlphaTest, Coverage, CpuFragments, FragmentSource, VIEW_COUNTS, ViewTriangles},
};
use glam::{Quat, Vec3};
use std::time::{Duration, Instant};

/// Number of leaves in the cloud, about as many as the embedded oak has.
const LEAVES: u32 = 20_000;
/// Half the side of a leaf, relative to the cloud's radius. Yields about 5 million fragments in 20
/// views at 256 x 256.
const HALF_SIDE: f32 = 0.021;
/// Number of runs; the ratio uses the fastest.
const RUNS: usize = 5;

/// Hash of (leaf, purpose) in -1..1, the same on every machine.
fn hashed(leaf: u32, purpose: u32) -> f32 {
    let mut bits = (leaf ^ purpose.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
    (bits ^ (bits >> 16)) as f32 / u32::MAX as f32 * 2.0 - 1.0
}

fn leaf_corners(leaf: u32) -> [Vec3; 4] {
    let at = |purpose| Vec3::new(hashed(leaf, purpose), hashed(leaf, purpose + 1), hashed(leaf, purpose + 2));
    let center = at(0).normalize_or_zero() * (0.9 - 0.4 * hashed(leaf, 9).abs());
    let turn = Quat::from_rotation_arc(Vec3::Z, at(3).normalize_or(Vec3::X));
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| center + turn * Vec3::new(x, y, 0.0) * HALF_SIDE)
}

/// The cloud seen orthographically along one of 20 directions, snapped to 1/256 pixel.
fn view(direction: u32, resolution: u32) -> Vec<[[i32; 2]; 3]> {
    let turn = Quat::from_rotation_y(direction as f32 * 0.7) * Quat::from_rotation_x(direction as f32 * 1.3);
    let half = resolution as f32 / 2.0;
    let step = |unit: f32| ((unit * half + half - 0.5) * 256.0).round_ties_even() as i32;
    let mut triangles = Vec::new();
    for leaf in 0..LEAVES {
        let [a, b, c, d] =
            leaf_corners(leaf).map(|corner| turn * corner).map(|corner| [step(corner.x), step(corner.y)]);
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    triangles
}

fn capture(source: &mut dyn FragmentSource, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> usize {
    out.iter_mut().for_each(Vec::clear);
    source.capture_batch(views, out).expect("capturing works");
    out.iter().map(Vec::len).sum()
}

fn fastest(source: &mut dyn FragmentSource, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Duration {
    let run = |_| {
        let start = Instant::now();
        capture(source, views, out);
        start.elapsed()
    };
    (0..RUNS).map(run).min().unwrap_or_default()
}

fn fragments(criterion: &mut Criterion) {
    let gpu = GpuDevice::new(&GpuOptions::from_env()).and_then(|gpu| GpuFragments::new(&gpu));
    let mut gpu = gpu.inspect_err(|error| println!("CPU only: {error}")).ok();
    let mut cpu = CpuFragments::new();
    let mut group = criterion.benchmark_group("fragments");
    group.sample_size(10);
    for resolution in [256, 512] {
        let screens: Vec<_> = (0..VIEW_COUNTS[4]).map(|direction| view(direction, resolution)).collect();
        let alpha = vec![AlphaTest::NONE; 2 * LEAVES as usize];
        let views: Vec<_> =
            screens.iter().map(|screen| ViewTriangles { resolution, screen, alpha: &alpha, tiling: &[] }).collect();
        let mut out = vec![Vec::new(); views.len()];
        let count = capture(&mut cpu, &views, &mut out);
        group.throughput(Throughput::Elements(count as u64));
        let on_cpu = fastest(&mut cpu, &views, &mut out);
        println!("{resolution}: {count} fragments, CPU {on_cpu:.1?}");
        group.bench_function(BenchmarkId::new("cpu", resolution), |b| b.iter(|| capture(&mut cpu, &views, &mut out)));
        if let Some(gpu) = &mut gpu {
            let on_gpu = fastest(gpu, &views, &mut out);
            let ratio = on_gpu.as_secs_f64() / on_cpu.as_secs_f64();
            println!(
                "{resolution}: GPU {on_gpu:.1?}, {ratio:.2} times the CPU time ({})",
                gpu.adapter().unwrap_or_default()
            );
            group.bench_function(BenchmarkId::new("gpu", resolution), |b| b.iter(|| capture(gpu, &views, &mut out)));
        }
    }
    group.finish();
}

criterion_group!(benches, fragments);
criterion_main!(benches);
