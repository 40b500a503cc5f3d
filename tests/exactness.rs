//! The pruning order equals that of the naive method, which redraws and recounts everything for
//! every candidate at every step.
#![cfg(feature = "simplify")]

mod common;

use common::{
    naive::{Comparison, Naive},
    plants,
};
use foliage_lod::{
    Plant,
    internals::appearance::Appearance,
    simplify::{Compensate, CpuFragments, Criterion, GrowBy, Quiet, SimplifyOptions, ViewSet, order},
};
use glam::DVec3;

fn assert_equals_naive(plant: &Plant, resolution: u32, background: bool, max_scale: f32) {
    let options = SimplifyOptions { resolution, background, max_scale, ..SimplifyOptions::paper() };
    assert_equals_naive_with(plant, &options);
}

/// Compares the two methods with views of 32 x 32 pixels.
fn assert_judged_as_naive(plant: &Plant, criterion: Criterion, compensate: Compensate) {
    let options = SimplifyOptions { resolution: 32, criterion, compensate, ..SimplifyOptions::paper() };
    assert_equals_naive_with(plant, &options);
}

fn assert_equals_naive_with(plant: &Plant, options: &SimplifyOptions) {
    // The depths of a leaf that is not quite flat depend on which of its triangles comes first.
    let mut plant = plant.clone();
    plant.canonicalize();
    let plant = &plant;
    let &SimplifyOptions { resolution, background, max_scale, .. } = options;
    let (prunes, ..) = order(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap();
    let views = ViewSet::new(plant.sphere(), resolution, 20).unwrap();
    let image = Appearance::image(plant, &views).unwrap();
    let silhouette = Appearance::silhouette(plant.leaves.len(), 20);
    let mut naive = Naive::new(plant, resolution, background, max_scale);
    let same_views: Vec<usize> = naive.cameras.iter().map(|[.., toward]| same_view(&views, *toward)).collect();
    let comparison = |appearance| comparison(appearance, same_views.clone());
    naive.pivot_uv = (options.grow_by == GrowBy::Tile).then_some([0.5, 0.0]);
    naive.criterion = options.criterion;
    naive.compensate = options.compensate;
    naive.intrinsic = options.intrinsic.into();
    let judging = if options.compensate == Compensate::Silhouette { &silhouette } else { &image };
    naive.comparisons = [Some(comparison(&image)), Some(comparison(judging))];
    let expected = naive.run();
    assert_eq!(prunes.len(), plant.leaves.len() - 1);
    for (step, (prune, expected)) in prunes.iter().zip(&expected).enumerate() {
        assert_eq!(prune, expected, "step {step} of {} at {resolution} px", plant.name);
    }
    let grown = prunes.iter().filter(|prune| prune.target_scale > 1.0).count();
    assert!(grown > plant.leaves.len() / 4, "{}: only {grown} prunings enlarged a leaf", plant.name);
}

fn same_view(views: &ViewSet, toward: DVec3) -> usize {
    views.views.iter().position(|view| view.toward.dot(toward) > 0.999).unwrap()
}

fn comparison(appearance: &Appearance, same_views: Vec<usize>) -> Comparison<'_> {
    let difference =
        move |view: usize, a: usize, b: usize| appearance.view(same_views[view]).difference(a as u32, b as u32);
    Comparison { difference: Box::new(difference), coverage: appearance.coverage() }
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

#[test]
fn quads_grow_for_their_silhouettes_as_by_the_naive_method() {
    assert_judged_as_naive(&plants::quads(200, 3.0, 9), Criterion::Vmi, Compensate::Silhouette);
}

#[test]
fn leaves_about_wood_grow_for_pictures_as_by_the_naive_method() {
    assert_judged_as_naive(&plants::with_wood(200, 10), Criterion::Vmi, Compensate::Image);
}

#[test]
fn masked_leaves_are_pruned_and_grow_for_pictures_as_by_the_naive_method() {
    assert_judged_as_naive(&plants::masked(200, 11), Criterion::Image, Compensate::Image);
}

#[test]
fn masked_leaves_grow_by_tiling_as_by_the_naive_method() {
    let options = SimplifyOptions { resolution: 32, grow_by: GrowBy::Tile, ..SimplifyOptions::paper() };
    assert_equals_naive_with(&plants::masked(200, 6), &options);
    let judged = SimplifyOptions { criterion: Criterion::Image, compensate: Compensate::Image, ..options };
    assert_equals_naive_with(&plants::masked(200, 11), &judged);
}

#[test]
fn bent_cards_are_pruned_and_grow_for_pictures_as_by_the_naive_method() {
    assert_judged_as_naive(&plants::bent(200, 12), Criterion::Image, Compensate::Image);
}

#[test]
fn leaves_with_an_intrinsic_cost_are_pruned_as_by_the_naive_method() {
    let options = SimplifyOptions { resolution: 32, intrinsic: 0.03, cascade: false, ..SimplifyOptions::fast() };
    let plant = plants::with_wood(200, 14);
    assert_equals_naive_with(&plant, &options);
    let order = |options: &SimplifyOptions| order(&plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap().0;
    let free = order(&SimplifyOptions { intrinsic: 0.0, ..options.clone() });
    let moved = order(&options).iter().zip(&free).filter(|(a, b)| a.leaf != b.leaf).count();
    assert!(moved > 100, "the cost changes {moved} of 199 steps");
}

#[test]
fn coincident_twins_pruned_for_pictures_grow_for_silhouettes_as_by_the_naive_method() {
    assert_judged_as_naive(&plants::twins(200, 13), Criterion::Image, Compensate::Silhouette);
}
