//! Intrinsic cost of leaves (ours): a price on leaves that no view sees.
//!
//! By the image criterion a leaf that no view sees costs nothing, so all hidden leaves go before
//! the first visible one, and the crown is hollow when seen from within. The intrinsic cost of a
//! leaf is
//!
//! ```text
//! c * h(leaf) * covered(leaf) * difference(polygon, background)
//! ```
//!
//! where c is [`SimplifyOptions::intrinsic`](super::SimplifyOptions::intrinsic), h a hash from 0 to
//! 1, and covered the number of pixels over all views that the leaf covers, seen or not. Hidden
//! leaves then go in random order, spread among visible ones of little use. The hash decides which:
//! with the same cost for all of them, small ones would all go first.
//!
//! The weight of a pixel, c * h * difference, is an integer in the unit of the criterion's scores,
//! 1 / [`STEPS`] of a squared step of a channel: c in units of its largest value, rounded to the
//! nearest, times a hash of 32 bits, rounded down. So sums are exact, as all other sums of the
//! criterion are.
//!
//! Limits: only the order changes; growths are judged as without it. What it gains is little: on
//! eight plants with `fast`, a cost of 0.01 changes the RMSE from within by -3 % at half of the
//! leaves (-14 to +9) and by +1 % at 30 % (-9 to +10), and that from outside by +22 % (-2 to +112)
//! and +4 % (-1 to +22) (`tests/inside.rs`). So no preset has one.

use super::{appearance::COVERAGE, price::STEPS};
use crate::random::Random;

/// Largest weight of a pixel, for a cost of 1: the difference between a polygon and the background.
const MOST: i64 = COVERAGE * STEPS;

/// Intrinsic costs of all leaves, in units of 1 / [`STEPS`].
#[derive(Debug)]
pub struct Intrinsic {
    /// Cost of a covered pixel of each leaf.
    weights: Vec<u32>,
    /// Number of pixels over all views that each leaf covers.
    covered: Vec<u32>,
}

impl Intrinsic {
    /// Creates costs for `cost`, from 0 to 1, and leaves that cover so many pixels.
    pub fn new(cost: f32, covered: &[u32]) -> Self {
        let most = (f64::from(cost) * MOST as f64).round() as u64;
        let weight = |leaf: u64| ((most * (Random::new(leaf).bits() >> 32)) >> 32) as u32;
        Self { weights: (0..covered.len() as u64).map(weight).collect(), covered: covered.to_vec() }
    }

    /// Sets the number of pixels that a leaf covers.
    pub fn cover(&mut self, leaf: u32, covered: u32) {
        self.covered[leaf as usize] = covered;
    }

    /// Cost of a leaf.
    pub fn cost(&self, leaf: u32) -> i64 {
        i64::from(self.weights[leaf as usize]) * i64::from(self.covered[leaf as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_grow_with_coverage_and_are_spread_evenly_from_0_to_the_largest() {
        let mut intrinsic = Intrinsic::new(0.25, &vec![3; 10_000]);
        let quarter = 3 * MOST / 4;
        let costs: Vec<i64> = (0..10_000).map(|leaf| intrinsic.cost(leaf)).collect();
        assert!(costs.iter().all(|cost| (0..quarter).contains(cost)));
        let mean = costs.iter().sum::<i64>() as f64 / 10_000.0;
        assert!((mean / quarter as f64 - 0.5).abs() < 0.02, "{mean} of {quarter}");
        intrinsic.cover(7, 30);
        assert_eq!((intrinsic.cost(7), intrinsic.cost(8)), (10 * costs[7], costs[8]));
        let free = Intrinsic::new(0.0, &[9; 100]);
        assert!((0..100).all(|leaf| free.cost(leaf) == 0));
    }
}
