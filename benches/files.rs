//! Reading and writing the file of a whole oak, packed and exact.
//!
//! `cargo bench --bench files`. The sizes of the files are printed.

use criterion::Criterion;
use foliage_lod::{
    FoliageModel,
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    // Same rule as criterion: `cargo bench` passes `--bench`, `cargo test --benches` does not.
    let has = |wanted: &str| std::env::args().any(|argument| argument == wanted);
    let leaves = (has("--test") || !has("--bench")).then_some(300);
    let exact = oak(leaves);
    let mut packed = exact.clone();
    packed.quantize();
    let mut group = criterion.benchmark_group("files");
    group.sample_size(20);
    for (name, model) in [("packed", packed), ("exact", exact)] {
        let bytes = model.to_bytes().expect("the model is sound");
        println!("{name}: {} bytes, {:.1} per leaf", bytes.len(), bytes.len() as f64 / model.leaves.len() as f64);
        group.bench_function(format!("read {name}"), |bencher| bencher.iter(|| FoliageModel::from_bytes(&bytes)));
        group.bench_function(format!("write {name}"), |bencher| bencher.iter(|| model.to_bytes()));
    }
    group.finish();
    criterion.final_summary();
}

/// The embedded oak, simplified with low-resolution views.
fn oak(leaves: Option<u32>) -> FoliageModel {
    let species = Species::embedded("english-oak").expect("an embedded species");
    let plant = grow(&species, &GrowOptions { leaves, ..GrowOptions::default() }).expect("embedded species grow");
    let options = SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).expect("the plant is sound").model
}
