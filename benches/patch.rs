//! Placing plants: `cargo bench --bench patch`.
//!
//! A million plants of three spacings on two threads, and the tiles that a walk of 10 m/s needs at
//! 60 frames per second.

mod common;

use criterion::{BatchSize, Criterion};
use foliage_lod::scene::patch::{Patch, PatchEntry, PlantKind, Scratch, TileKey, TileOptions, Tiles};
use glam::DVec3;
use rayon::prelude::*;

/// Metres walked per frame.
const STEP: f64 = 10.0 / 60.0;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let (plants, frames) = if common::as_test() { (10_000, 60) } else { (1_000_000, 6_000) };
    let patch = patch();
    let threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    let mut group = criterion.benchmark_group("patch");
    group.sample_size(10);
    group.bench_function(format!("{plants} plants"), |bencher| {
        bencher.iter(|| threads.install(|| placed(&patch, plants)));
    });
    let mut most = 0;
    group.bench_function(format!("{frames} frames of a walk"), |bencher| {
        let standing = || {
            let mut tiles = Tiles::new(patch.clone(), TileOptions::default());
            tiles.complete(DVec3::ZERO);
            tiles
        };
        let walk = |mut tiles: Tiles| {
            let made = (0..frames).map(|frame| tiles.update(DVec3::new(STEP * f64::from(frame), 1.7, 0.0)).made);
            most = most.max(made.max().unwrap_or(0));
        };
        bencher.iter_batched(standing, walk, BatchSize::PerIteration);
    });
    group.finish();
    println!("walk: at most {most} tiles per frame");
    criterion.final_summary();
}

/// Trees, bushes and grass without end.
fn patch() -> Patch {
    let kinds = [(7.0, 400.0, 2.0), (2.5, 120.0, 0.5), (0.6, 40.0, 0.0)].map(|(spacing, reach, keeps_away)| {
        PlantKind { density: 0.6, reach: Some(reach), keeps_away, ..PlantKind::new("plant", spacing, [1.0, 2.0]) }
    });
    let entry = PatchEntry { cells: 32, ..PatchEntry::new(kinds.to_vec()) };
    entry.patch(vec![None; 3], None).expect("valid kinds")
}

/// Number of plants of the first tiles of the smallest kind that hold at least `plants`.
fn placed(patch: &Patch, plants: usize) -> usize {
    let tiles = (plants as f64 / (0.5 * 32.0 * 32.0)) as i32;
    let side = f64::from(tiles).sqrt().ceil() as i32;
    let tile = |(scratch, plants): &mut (Scratch, Vec<_>), i: i32| {
        patch.tile(TileKey { layer: 2, at: [i % side, i / side] }, scratch, plants);
        plants.len()
    };
    (0..tiles).into_par_iter().map_init(Default::default, tile).sum()
}
