//! Items with the logarithms of their weights, and their counts at a bound.

use super::{bisect::Bounds, demand::Demand, units::units};

/// An item, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighed {
    /// Index of its demand, which exists.
    pub demand: u32,
    /// Octaves by which its leaves are worth more than those of the demand, less those of their
    /// cost.
    pub gain: f32,
    /// Fewest and most leaves.
    pub bounds: [f32; 2],
    /// Cost of a leaf.
    pub unit_cost: f32,
}

impl Weighed {
    /// Number of leaves at a bound.
    #[inline]
    pub fn count(&self, demands: &[Demand], bound: f64) -> f64 {
        self.count_with(demands, bound, f64::from(self.gain))
    }

    /// As [`count`](Self::count), with another gain.
    #[inline]
    pub fn count_with(&self, demands: &[Demand], bound: f64, gain: f64) -> f64 {
        let [least, most] = self.bounds.map(f64::from);
        demands[self.demand as usize].count(bound - gain).max(least).min(most)
    }

    /// Number of leaves between two bounds.
    #[inline]
    pub fn between(&self, demands: &[Demand], bounds: &Bounds) -> f64 {
        if !demands[self.demand as usize].jumps() {
            return self.count(demands, bounds.middle());
        }
        let within = self.count(demands, bounds.within);
        within + (self.count(demands, bounds.beyond) - within) * bounds.part
    }

    /// Cost of so many leaves, in units.
    #[inline]
    pub fn units(&self, count: f64) -> u64 {
        units(count * f64::from(self.unit_cost))
    }

    /// Worth of its last and of its first leaf, in octaves; `None` if its count is the same at any
    /// bound.
    pub fn range(&self, demands: &[Demand]) -> Option<[f64; 2]> {
        let gain = f64::from(self.gain);
        let [first, last] = demands[self.demand as usize].range().filter(|_| gain.is_finite())?;
        Some([last + gain, first + gain])
    }
}
