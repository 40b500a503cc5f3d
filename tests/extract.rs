//! Tests of changing the active count, against oracles that replay the pruning from scratch.
#![cfg(feature = "simplify")]

use foliage_lod::{
    FoliageModel, Plant, Swap, Timeline,
    extract::BLOCK_LEAVES,
    leaf::Vertex,
    material::Material,
    model::{Prune, Recipe},
};
use proptest::prelude::*;

/// Pseudorandom numbers from a seed (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, end: u32) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) % u64::from(end)) as u32
    }
}

/// A model of single triangles pruned in random order. The target of each is a random remaining
/// leaf, which grows by a random factor or keeps its size. This produces chains, targets of many
/// leaves, and enlarged leaves that are pruned themselves.
fn random_model(leaves: u32, seed: u64) -> FoliageModel {
    let mut random = Random(seed | 1);
    let mut plant = Plant { materials: vec![Material::default()], ..Plant::default() };
    for i in 0..leaves {
        let corner = |x, y| Vertex { position: [x, y, i as f32], normal: [0.0; 3], uv: [0.0; 2], color: [1.0; 4] };
        plant.push_leaf(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)], &[0, 1, 2], [0.0, 0.0, i as f32], 0);
    }
    let mut left: Vec<u32> = (0..leaves).collect();
    let mut scales = vec![1.0_f32; leaves as usize];
    let mut prunes = Vec::new();
    while left.len() > 1 {
        let leaf = left.swap_remove(random.below(left.len() as u32) as usize);
        let target = left[random.below(left.len() as u32) as usize];
        scales[target as usize] *= 1.0 + random.below(3) as f32 * 0.0137;
        prunes.push(Prune { leaf, target, target_scale: scales[target as usize], error: 0.0 });
    }
    FoliageModel::assemble(&plant, &prunes, Recipe::default()).unwrap()
}

/// Drawn scales at active count `n`, replayed from full detail.
fn replayed(model: &FoliageModel, n: u32) -> Vec<f32> {
    let mut drawn = vec![1.0; model.leaves.len()];
    for leaf in model.leaves[n as usize..].iter().rev() {
        if let Some(target) = leaf.target() {
            drawn[target] = leaf.scale;
        }
    }
    drawn
}

fn bits(scales: &[f32]) -> Vec<u32> {
    scales.iter().map(|scale| scale.to_bits()).collect()
}

proptest! {
    #[test]
    fn any_walk_back_to_all_leaves_restores_every_bit(
        leaves in 1_u32..200, seed: u64, walk in prop::collection::vec(0.0..=1.0_f64, 1..40)
    ) {
        let model = random_model(leaves, seed);
        let mut swap = Swap::new(&model);
        let (scales, slots) = (bits(swap.scales()), bits(swap.slots()));
        for step in walk {
            let n = (step * f64::from(leaves)).round() as u32;
            swap.set_active(n);
            prop_assert_eq!(swap.active(), n);
            prop_assert_eq!(bits(swap.scales()), bits(&replayed(&model, n)));
        }
        swap.set_active(leaves);
        prop_assert_eq!(bits(swap.scales()), scales);
        prop_assert_eq!(bits(swap.slots()), slots);
    }

    #[test]
    fn every_changed_scale_lies_in_a_reported_range_and_every_range_holds_a_change(
        leaves in 1_u32..20_000, seed: u64, walk in prop::collection::vec((any::<u32>(), any::<bool>()), 1..10)
    ) {
        let model = random_model(leaves, seed);
        let mut swap = Swap::new(&model);
        for (step, is_small) in walk {
            let before = swap.clone();
            let n = if is_small { swap.active().saturating_sub(step % 3) } else { step % (leaves + 1) };
            let ranges = swap.set_active(n).to_vec();
            prop_assert!(ranges.windows(2).all(|pair| pair[0].end < pair[1].start));
            let is_reported = |leaf: u32| ranges.iter().any(|range| range.contains(&leaf));
            for leaf in 0..leaves {
                let is_same = swap.scales()[leaf as usize].to_bits() == before.scales()[leaf as usize].to_bits();
                prop_assert!(is_same || is_reported(leaf), "leaf {} changed without being reported", leaf);
            }
            let [low, high] = [n.min(before.active()), n.max(before.active())];
            let targets: Vec<u32> = model.leaves[low as usize..high as usize].iter().filter_map(|leaf| leaf.target())
                .map(|target| target as u32 / BLOCK_LEAVES).collect();
            for block in ranges.iter().flat_map(|range| range.start / BLOCK_LEAVES..range.end.div_ceil(BLOCK_LEAVES)) {
                prop_assert!(targets.contains(&block), "block {} reported without a change", block);
            }
        }
    }
}

#[test]
fn split_after_collapse_restores_every_bit_of_scales_and_slots() {
    let model = random_model(300, 5);
    let mut swap = Swap::new(&model);
    for n in (1..=300).rev() {
        swap.set_active(n);
        let before = swap.clone();
        swap.set_active(n - 1);
        swap.set_active(n);
        assert_eq!(bits(swap.scales()), bits(before.scales()));
        assert_eq!(bits(swap.slots()), bits(before.slots()));
    }
}

#[test]
fn timeline_equals_swap_for_every_count_of_2000_leaves() {
    let model = random_model(2000, 7);
    let timeline = Timeline::new(&model);
    let mut swap = Swap::new(&model);
    for n in (0..=2000).rev() {
        swap.set_active(n);
        let looked_up: Vec<f32> = (0..2000).map(|leaf| timeline.scale(leaf, n)).collect();
        assert_eq!(bits(&looked_up), bits(swap.scales()), "at {n}");
    }
}

#[cfg(feature = "simplify")]
#[test]
fn timeline_equals_swap_at_1000_random_counts_of_the_oak() {
    use foliage_lod::{
        grow::{GrowOptions, Species, grow},
        simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    };
    let plant = grow(&Species::embedded("english-oak").unwrap(), &GrowOptions::default()).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    let oak = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    let leaves = oak.leaves.len() as u32;
    assert_eq!(leaves, 20_146);
    let timeline = Timeline::new(&oak);
    let mut swap = Swap::new(&oak);
    let mut random = Random(17);
    for _ in 0..1000 {
        let n = random.below(leaves + 1);
        swap.set_active(n);
        let differs =
            (0..leaves).find(|&leaf| timeline.scale(leaf, n).to_bits() != swap.scales()[leaf as usize].to_bits());
        assert_eq!(differs, None, "at {n}");
    }
    swap.set_active(leaves / 10);
    assert!(swap.scales().iter().any(|&scale| scale > 1.5), "the oak should have enlarged leaves");
}

#[test]
fn a_chain_of_100_000_enlargements_is_walked_and_looked_up_exactly() {
    let leaves = 100_000_u32;
    let mut model = random_model(leaves, 11);
    for (i, leaf) in model.leaves.iter_mut().enumerate().skip(1) {
        (leaf.leaf_to_split, leaf.leaf_to_collapse) = (i as u32 - 1, i as u32 - 1);
        leaf.scale = 1.0 + i as f32 * 1e-5;
    }
    model.max_scale = model.leaves.iter().map(|leaf| leaf.scale).fold(1.0, f32::max);
    model.validate().unwrap();
    let timeline = Timeline::new(&model);
    let mut swap = Swap::new(&model);
    for n in [0, leaves, 1, 50_000, 49_999, leaves - 1, 0, leaves] {
        swap.set_active(n);
        let looked_up: Vec<f32> = (0..leaves).map(|leaf| timeline.scale(leaf, n)).collect();
        assert_eq!(bits(&looked_up), bits(swap.scales()), "at {n}");
    }
}

#[test]
fn asking_for_more_than_all_leaves_gives_all_and_the_same_count_reports_nothing() {
    let mut swap = Swap::new(&random_model(10, 3));
    assert!(swap.set_active(99).is_empty());
    assert_eq!(swap.active(), 10);
    assert_eq!(swap.set_active(9), std::slice::from_ref(&(0..10)));
    assert!(swap.set_active(9).is_empty());
}

#[test]
fn clones_walk_on_their_own() {
    let model = random_model(50, 9);
    let mut first = Swap::new(&model);
    let second = first.clone();
    first.set_active(10);
    assert_eq!(second.active(), 50);
    assert!(second.scales().iter().all(|&scale| scale == 1.0));
}
