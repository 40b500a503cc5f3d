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
const COLOR: f64 = 4.0;

/// Distance, drawer (the CPU, the GPU with one sample and with four), and the errors of coverage
/// and colour.
type Errors = (f64, usize, f64, f64);

fn errors(plant: &Plant) -> Vec<Errors> {
    let model: FoliageModel = shuffled(plant, 1).unwrap();
    let gpu = match GpuDevice::new(&GpuOptions::from_env()) {
        Ok(gpu) => Some(gpu),
        Err(Error::Gpu { .. }) if std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none() => None,
        Err(error) => panic!("{error}"),
    };
    let rows = measure(&model, gpu.as_ref()).unwrap().into_iter();
    rows.flat_map(|FarRow { distance, truth, cpu, gpu }| {
        let seen = std::iter::once(cpu).chain(gpu.into_iter().flatten()).enumerate();
        seen.map(move |(drawer, seen)| (distance, drawer, seen.coverage_error(&truth), seen.color_error(&truth)))
    })
    .inspect(|(distance, drawer, coverage, color)| {
        println!("{}, {distance} radii, drawer {drawer}: {:+.1} %, {color:.1}", plant.name, 100.0 * coverage);
    })
    .collect()
}

fn check(plant: &Plant) {
    for (distance, drawer, coverage, difference) in errors(plant) {
        assert!(coverage.abs() < COVERAGE, "{} at {distance} radii, drawer {drawer}: {coverage:.3}", plant.name);
        assert!(difference < COLOR, "{} at {distance} radii, drawer {drawer}: colour {difference:.1}", plant.name);
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
    check(&grow(&species, &GrowOptions { leaves: Some(3000), ..GrowOptions::default() }).unwrap());
}

#[test]
fn sparse_cards_and_a_lone_trunk_cover_as_much_far_away_as_their_full_textures_do() {
    plant("FOLIAGE_CASES", "37-sparse-slender-from-afar.glb").inspect(check);
}

#[test]
fn trees_of_few_large_cards_cover_as_much_far_away_as_their_full_textures_do() {
    for file in ["CommonTree_1.glb", "Fern_1.glb"] {
        plant("FOLIAGE_TREES", file).inspect(check);
    }
}

#[test]
#[ignore = "takes two minutes: the table of the README"]
fn nine_plants_cover_as_much_far_away_as_their_full_textures_do() {
    let grown = Species::EMBEDDED.map(|name| grow(&Species::embedded(name).unwrap(), &GrowOptions::default()).unwrap());
    let files = ["eztree_oak_medium", "sapling_birch_8k_rect", "CommonTree_1", "Fern_1", "ftlab_keyaki"];
    let read = files.iter().filter_map(|file| plant("FOLIAGE_TREES", &format!("{file}.glb")));
    let sparse = plant("FOLIAGE_CASES", "37-sparse-slender-from-afar.glb");
    let all: Vec<Errors> = grown.into_iter().chain(read).chain(sparse).flat_map(|plant| errors(&plant)).collect();
    for drawer in 0..3 {
        let of_drawer = || all.iter().filter(|row| row.1 == drawer);
        let mean = |error: fn(&Errors) -> f64| of_drawer().map(error).sum::<f64>() / of_drawer().count() as f64;
        let most = |error: fn(&Errors) -> f64| of_drawer().map(error).fold(0.0, f64::max);
        let coverage = |row: &Errors| 100.0 * row.2.abs();
        let color = |row: &Errors| row.3;
        println!(
            "drawer {drawer}: coverage {:.1} %, at most {:.1} %; colour {:.1}, at most {:.1}",
            mean(coverage),
            most(coverage),
            mean(color),
            most(color)
        );
        assert!(mean(coverage) < 5.0 && most(coverage) < 10.0);
    }
}
