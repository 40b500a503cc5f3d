//! The order equals that of the naive method, which draws and counts everything again for every candidate of every step.

mod common;

use common::{naive::Naive, plants};
use foliage_lod::{
    Plant,
    simplify::{Quiet, SimplifyOptions, order, raster::CpuFragments},
};

fn assert_equals_naive(plant: &Plant, resolution: u32, background: bool, max_scale: f32) {
    // Depths of a leaf that is not quite flat depend on which of its triangles comes first.
    let mut plant = plant.clone();
    plant.canonicalize();
    let plant = &plant;
    let options = SimplifyOptions { resolution, background, max_scale, ..SimplifyOptions::paper() };
    let (prunes, ..) = order(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap();
    let expected = Naive::new(plant, resolution, background, max_scale).run();
    assert_eq!(prunes.len(), plant.leaves.len() - 1);
    for (step, (prune, expected)) in prunes.iter().zip(&expected).enumerate() {
        assert_eq!(prune, expected, "step {step} of {} at {resolution} px", plant.name);
    }
    let grown = prunes.iter().filter(|prune| prune.target_scale > 1.0).count();
    assert!(grown > plant.leaves.len() / 4, "{}: only {grown} prunings enlarged a leaf", plant.name);
}

#[test]
fn quads_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::quads(200, 3.0, 1), 32, true, 8.0);
}

#[test]
fn bent_cards_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::bent(200, 2), 32, true, 8.0);
}

#[test]
fn crossed_cards_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::crossed(200, 3), 32, true, 3.0);
}

#[test]
fn coincident_twins_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::twins(200, 4), 32, true, 8.0);
}

#[test]
fn leaves_about_wood_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::with_wood(200, 5), 32, true, 8.0);
}

#[test]
fn masked_leaves_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::masked(200, 6), 32, true, 8.0);
}

#[test]
fn without_the_background_leaves_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::with_wood(120, 7), 32, false, 8.0);
}

#[test]
fn leaves_of_less_than_a_pixel_are_pruned_as_by_the_naive_method() {
    assert_equals_naive(&plants::quads(200, 0.5, 8), 16, true, 8.0);
}
