//! Time to find the pruning order, compared with the time to rasterise all fragments once, the
//! lower bound for any method that visits every fragment.
//!
//! `cargo bench --bench simplify` measures all cases, `cargo bench --bench simplify -- oak/256` one
//! of them. After each case the ratio of the medians and the peak memory (Linux) are printed.

mod common;

use criterion::{Criterion, SamplingMode};
use foliage_lod::{
    Plant,
    simplify::{CpuFragments, Quiet, SimplifyOptions, order, rasterise_all},
};
use std::time::{Duration, Instant};

/// Species, number of leaves (`None`: the species' default) and resolution.
const CASES: [(&str, Option<u32>, u32); 6] = [
    ("english-oak", None, 256),
    ("english-oak", None, 512),
    ("carya-illinoinensis", None, 256),
    ("betula-populifolia", None, 256),
    ("english-oak", Some(100_000), 256),
    ("english-oak", Some(100_000), 512),
];

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    for (species, leaves, resolution) in CASES {
        // As a test, every case runs once on a small input.
        let (leaves, resolution) = if common::as_test() { (Some(300), 64) } else { (leaves, resolution) };
        let name = format!("simplify/{species}{}/{resolution}", leaves.map_or(String::new(), |n| format!("-{n}")));
        bench(&mut criterion, &name, species, leaves, resolution);
    }
    criterion.final_summary();
}

fn bench(criterion: &mut Criterion, name: &str, species: &str, leaves: Option<u32>, resolution: u32) {
    let options = SimplifyOptions { resolution, ..SimplifyOptions::paper() };
    let mut plant: Option<Plant> = None;
    let (mut once, mut whole) = (Vec::new(), Vec::new());
    let mut group = criterion.benchmark_group("paper");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(1));
    group.bench_function(name, |bencher| {
        let plant = plant.get_or_insert_with(|| common::plant(species, leaves));
        bencher.iter_custom(|iterations| {
            let started = Instant::now();
            for _ in 0..iterations {
                let begun = Instant::now();
                rasterise_all(plant, &options, &mut CpuFragments::new()).expect("the views fit");
                once.push(begun.elapsed());
                let begun = Instant::now();
                order(plant, &options, &mut CpuFragments::new(), &mut Quiet).expect("the plant is sound");
                whole.push(begun.elapsed());
            }
            started.elapsed() - once[once.len() - iterations as usize..].iter().sum()
        });
    });
    group.finish();
    if let (Some(once), Some(whole), Some(plant)) = (common::median_ms(once), common::median_ms(whole), plant) {
        let (leaves, once, whole) = (plant.leaves.len(), 1e-3 * once, 1e-3 * whole);
        println!(
            "{name}: {leaves} leaves, {whole:.2} s in total, {once:.3} s to rasterise once, ratio {:.1}, {:.0} us per leaf, peak {} MiB",
            whole / once,
            whole * 1e6 / leaves as f64,
            peak_megabytes().map_or("?".into(), |peak| peak.to_string()),
        );
    }
}

/// Peak memory of the process so far, in MiB; `None` on systems other than Linux.
fn peak_megabytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kilobytes| kilobytes / 1024)
}
