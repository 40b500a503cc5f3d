//! Arbitrary sequences of active counts: the drawn scales follow from the pruning order alone,
//! whatever was requested before.
//!
//! `FOLIAGE_FUZZ_CASES` is the number of sequences.
#![cfg(feature = "simplify")]

mod common;
#[allow(dead_code, reason = "this test damages no files")]
#[path = "common/mutate.rs"]
mod mutate;

use common::plants;
use foliage_lod::{
    FoliageModel, Swap, Timeline,
    extract::{Blend, CookLambda, Hysteresis, LodPolicy, Sight, leaf_count},
    model::Transition,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use mutate::{Random, survive};

const STEPS: usize = 24;
const HOSTILE: [f64; 12] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-300, 0.5, 1e9, 4_294_967_295.0, 1e40, 1e300];

fn models() -> Vec<FoliageModel> {
    let options = SimplifyOptions { resolution: 16, threads: 1, ..SimplifyOptions::paper() };
    let plants = [plants::quads(37, 2.0, 5), plants::with_wood(9, 2), plants::quads(1, 1.0, 3)];
    plants.iter().map(|plant| simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model).collect()
}

/// Sets targets and scales that no simplification would choose.
fn regrow(model: &mut FoliageModel, random: &mut Random) {
    for leaf in 1..model.leaves.len() {
        if random.below(3) == 0 {
            model.leaves[leaf].leaf_to_collapse = random.below(leaf) as u32;
            model.leaves[leaf].scale = [1.0, 1.5, 1e-3, 1e6, 3e38, -1.0, f32::NAN][random.below(7)];
        }
    }
}

fn any_number(random: &mut Random, leaves: u32) -> f64 {
    match random.below(3) {
        0 => HOSTILE[random.below(HOSTILE.len())],
        _ => random.below(64 * leaves as usize + 1) as f64 / 64.0,
    }
}

/// Collapses the whole model to `n` leaves, one at a time; returns the bits of their scales.
fn scales_from_whole(model: &FoliageModel, n: usize) -> Vec<u32> {
    let mut drawn = vec![1.0_f32; model.leaves.len()];
    for pruned in model.leaves[n..].iter().rev() {
        if let Some(target) = pruned.target() {
            drawn[target] = pruned.scale;
        }
    }
    drawn[..n].iter().map(|scale| scale.to_bits()).collect()
}

fn check_count(model: &FoliageModel, swap: &mut Swap, timeline: &Timeline, n: u32) {
    let before: Vec<u32> = swap.scales().iter().map(|scale| scale.to_bits()).collect();
    let changed = swap.set_active(n).to_vec();
    let n = n.min(timeline.leaves());
    assert_eq!(swap.active(), n);
    let after: Vec<u32> = swap.scales().iter().map(|scale| scale.to_bits()).collect();
    assert_eq!(after[..n as usize], scales_from_whole(model, n as usize), "at {n}");
    let looked_up: Vec<u32> = (0..n).map(|leaf| timeline.scale(leaf, n).to_bits()).collect();
    assert_eq!(after[..n as usize], looked_up, "at {n}");
    let is_reported = |leaf: usize| changed.iter().any(|range| range.contains(&(leaf as u32)));
    assert!((0..after.len()).all(|leaf| before[leaf] == after[leaf] || is_reported(leaf)), "unreported change at {n}");
}

fn check_between(timeline: &Timeline, active: f64, window: f32, is_smooth: bool) {
    let leaves = timeline.leaves();
    let transition = Transition::new(active, window, leaves);
    let transition = if is_smooth { transition.smooth() } else { transition };
    let (first, drawn) = (transition.first_partial(), transition.drawn());
    assert!(drawn <= leaves && first <= leaves, "{active} in {window}: {first} {drawn} of {leaves}");
    let mut last = 1.0;
    for leaf in 0..leaves {
        let presence = transition.presence(leaf);
        assert!((0.0..=last).contains(&presence), "leaf {leaf} at {active} in {window}: {presence} after {last}");
        assert!(leaf >= first || presence == 1.0, "leaf {leaf} is before {first}");
        assert!(leaf < drawn || presence == 0.0, "leaf {leaf} is after {drawn}");
        last = presence;
    }
    for leaf in 0..drawn {
        let scales = [timeline.scale_at(leaf, &transition), timeline.full_scale_at(leaf, &transition)];
        assert!(scales.iter().all(|scale| *scale >= 0.0), "leaf {leaf} at {active} in {window}: {scales:?}");
    }
}

fn check_levels(random: &mut Random, hysteresis: &mut Hysteresis, leaves: u32) {
    let mut any = || any_number(random, leaves) as f32;
    let sight = Sight { distance: any(), radius: any(), fov_y: any(), height_px: any() };
    let policies: [&dyn LodPolicy; 2] = [&Blend::default(), &CookLambda::default()];
    let least = leaves.min(3);
    for lod in policies.map(|policy| policy.lod(&sight)).into_iter().chain([any()]) {
        let count = leaf_count(lod, leaves, least);
        assert!((least..=leaves).contains(&count), "{lod} yields {count} of {leaves}");
    }
    for policy in policies {
        let lod = policy.lod(&sight);
        assert!((0.0..=1.0).contains(&lod), "{lod} for {sight:?}");
    }
    let settled = hysteresis.follow(any_number(random, leaves), leaves, least);
    assert!((f64::from(least)..=f64::from(leaves)).contains(&settled), "{settled} of {leaves}");
}

#[test]
fn any_walk_draws_what_the_order_says() {
    let models = models();
    survive("walks", &["walked", "unsound"], move |random| {
        let mut model = models[random.below(models.len())].clone();
        regrow(&mut model, random);
        if model.validate().is_err() {
            return "unsound";
        }
        let (timeline, mut swap) = (Timeline::new(&model), Swap::new(&model));
        let leaves = timeline.leaves();
        let mut hysteresis = Hysteresis::new(any_number(random, leaves) as f32);
        for _ in 0..STEPS {
            let n = if random.below(8) == 0 { u32::MAX } else { random.below(leaves as usize + 2) as u32 };
            check_count(&model, &mut swap, &timeline, n);
            let (active, window) = (any_number(random, leaves), any_number(random, leaves) as f32);
            check_between(&timeline, active, window, random.below(2) == 0);
            check_levels(random, &mut hysteresis, leaves);
        }
        "walked"
    });
}
