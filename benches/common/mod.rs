//! What benchmarks have in common: the embedded oak, and how they are run.

#![allow(dead_code)] // Each benchmark uses only some of it.

use foliage_lod::{
    FoliageModel, Plant,
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use std::time::Duration;

/// Whether the benchmark is only run as a test, on small plants.
pub fn as_test() -> bool {
    // Same rule as criterion: `cargo bench` passes `--bench`, `cargo test --benches` does not.
    let has = |wanted: &str| std::env::args().any(|argument| argument == wanted);
    has("--test") || !has("--bench")
}

/// The device that the environment selects; `None`, with a note, without an adapter.
#[cfg(feature = "render")]
pub fn gpu() -> Option<foliage_lod::gpu::GpuDevice> {
    use foliage_lod::gpu::{GpuDevice, GpuOptions};
    let gpu = GpuDevice::new(&GpuOptions::from_env());
    gpu.as_ref().map_or_else(|error| println!("skipped: {error}"), |gpu| println!("on {}", gpu.adapter_name()));
    gpu.ok()
}

/// An embedded species, with all its leaves or with so many.
pub fn plant(species: &str, leaves: Option<u32>) -> Plant {
    let species = Species::embedded(species).expect("an embedded species");
    grow(&species, &GrowOptions { leaves, ..GrowOptions::default() }).expect("embedded species grow")
}

/// The oak, simplified with low-resolution views: benchmarks depend on the chains and targets of
/// leaves, hardly on the exact pruning order.
pub fn oak() -> FoliageModel {
    let options = SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() };
    simplified(&plant("english-oak", as_test().then_some(300)), &options)
}

pub fn simplified(plant: &Plant, options: &SimplifyOptions) -> FoliageModel {
    simplify(plant, options, &mut CpuFragments::new(), &mut Quiet).expect("the plant is sound").model
}

/// Median in milliseconds; `None` if nothing was measured.
pub fn median_ms(mut times: Vec<Duration>) -> Option<f64> {
    times.sort_unstable();
    times.get(times.len() / 2).map(|time| time.as_secs_f64() * 1e3)
}
