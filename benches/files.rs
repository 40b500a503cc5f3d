//! Reading and writing the file of a whole oak, packed and exact.
//!
//! `cargo bench --bench files`. The sizes of the files are printed.

mod common;

use criterion::Criterion;
use foliage_lod::FoliageModel;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let exact = common::oak();
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
