//! Tests of coverage and mean colour far away, on the CPU and on the GPU.

use foliage_lod::{
    Error, FoliageModel, Plant,
    gpu::{GpuDevice, GpuOptions},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    stochastic::shuffled,
};
use foliage_lod_cli::report::far::{FarRow, measure};
use std::path::PathBuf;

/// Largest difference in coverage, relative to the reference.
const COVERAGE: f64 = 0.1;
/// Largest difference of a channel of the mean colour, on the scale of 0 to 255.
const COLOR: f64 = 6.0;

fn check(plant: &Plant, color: f64) {
    let model: FoliageModel = shuffled(plant, 1).unwrap();
    let gpu = match GpuDevice::new(&GpuOptions::from_env()) {
        Ok(gpu) => Some(gpu),
        Err(Error::Gpu { .. }) if std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none() => None,
        Err(error) => panic!("{error}"),
    };
    for FarRow { distance, truth, cpu, gpu } in measure(&model, gpu.as_ref()).unwrap() {
        for (drawer, seen) in
            [Some(cpu), gpu.map(|gpu| gpu[0]), gpu.map(|gpu| gpu[1])].into_iter().flatten().enumerate()
        {
            let (coverage, difference) = (seen.coverage_error(&truth), seen.color_error(&truth));
            println!("{}, {distance} radii, drawer {drawer}: {:+.1} %, {difference:.1}", plant.name, 100.0 * coverage);
            assert!(coverage.abs() < COVERAGE, "{} at {distance} radii, drawer {drawer}: {coverage:.3}", plant.name);
            assert!(difference < color, "{} at {distance} radii, drawer {drawer}: colour {difference:.1}", plant.name);
        }
    }
}

/// The plant in a file of the folder that `variable` names; `None` if it is not set.
fn plant(variable: &str, file: &str) -> Option<Plant> {
    let folder = PathBuf::from(std::env::var_os(variable)?);
    Some(load(&folder.join(file), &ImportOptions::default()).unwrap().plant)
}

#[test]
fn a_grown_birch_covers_as_much_far_away_as_its_full_textures_do() {
    let species = Species::embedded("betula-populifolia").unwrap();
    check(&grow(&species, &GrowOptions { leaves: Some(3000), ..GrowOptions::default() }).unwrap(), COLOR);
}

#[test]
fn sparse_cards_and_a_lone_trunk_cover_as_much_far_away_as_their_full_textures_do() {
    // Seven pixels at 96 radii: the share of trunk in a hundred samples varies.
    plant("FOLIAGE_CASES", "37-sparse-slender-from-afar.glb").inspect(|plant| check(plant, 2.5 * COLOR));
}

#[test]
fn trees_of_few_large_cards_cover_as_much_far_away_as_their_full_textures_do() {
    for file in ["CommonTree_1.glb", "Fern_1.glb"] {
        plant("FOLIAGE_TREES", file).inspect(|plant| check(plant, COLOR));
    }
}
