//! Splits budgets among plants, frame by frame.

use super::{
    bisect::Bounds,
    crowd::{Crowd, Found},
    demand::{Corners, Demand},
    item::Item,
    octaves::Octaves,
    rule::Rule,
    steady::Steady,
    units::{budget_units, cost, sum, units},
};
use crate::model::ErrorCurve;

/// What was spent of a budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spent {
    /// The budget.
    pub asked: f64,
    /// Sum of all costs. At most the budget, unless fixed costs alone exceed it, or smoothing does.
    pub used: f64,
    /// Fixed costs among them.
    pub fixed: f64,
    /// What the next leaf of any plant would take off the error for each unit of its cost (for an
    /// exponent q, of the q-th root of the sum of powers): mu^(1/q), in pixels. 0 if the budget is
    /// enough for all leaves.
    pub mu: f64,
    /// Part of the floors that fits in the budget: 1 if it is enough for all of them.
    pub floors: f64,
}

/// Splits budgets by one rule among plants of given error curves. Keeps its memory.
pub struct Splitter {
    rule: Rule,
    demands: Vec<Demand>,
    octaves: Octaves,
    crowd: Crowd,
    steady: Steady,
    last: Found,
}

impl Splitter {
    /// A splitter among plants of these curves, whose counts follow the budget without jumps.
    /// O(corners).
    pub fn new(curves: &[ErrorCurve], rule: Rule) -> Self {
        Self::with_corners(curves, rule, Corners::Round)
    }

    /// A splitter whose error is exactly the least on the curves, but whose counts jump from corner
    /// to corner of a curve: for comparisons.
    pub fn sharp(curves: &[ErrorCurve], rule: Rule) -> Self {
        Self::with_corners(curves, rule, Corners::Sharp)
    }

    fn with_corners(curves: &[ErrorCurve], rule: Rule, corners: Corners) -> Self {
        let demands = rule.demands(curves, corners);
        Self {
            rule,
            demands,
            octaves: Octaves::new(),
            crowd: Crowd::default(),
            steady: Steady::default(),
            last: Found::Floors(0.0),
        }
    }

    /// The rule.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// Replaces `counts` with the number of leaves of each of `items`, fractional, that spends
    /// `budget`. Independent of frames before, and of the order of the items.
    ///
    /// Exact for up to 10,000 items. Above, the bound on the worth of leaves is found by a
    /// histogram of weights, and counts above the budget are lowered by one factor. NaN and
    /// negative budgets count as 0. O(items), without allocation once all memory is there.
    pub fn split(&mut self, items: &[Item], budget: f64, counts: &mut Vec<f32>) -> Spent {
        let (fixed, left) = self.prepare(items, budget);
        let found = self.crowd.solve(&self.demands, left);
        let used = self.crowd.count(&self.demands, found, left, counts);
        self.spent(found, budget, [fixed, used])
    }

    /// As [`split`](Self::split) for the next frame, `seconds` after the last one, with the bound
    /// on the worth of leaves smoothed over a quarter of a second: what is spent follows, and may
    /// exceed the budget by a twentieth, for half a second. The first frame, and the one after
    /// [`reset`](Self::reset), is not smoothed.
    ///
    /// No plant is smoothed by itself: its count depends on how it is seen, and on the one bound.
    pub fn follow(&mut self, items: &[Item], budget: f64, seconds: f64, counts: &mut Vec<f32>) -> Spent {
        let (fixed, left) = self.prepare(items, budget);
        let found = self.crowd.solve(&self.demands, left);
        let Found::Worth(right) = found else {
            self.steady.keep(self.crowd.range()[1], false, seconds);
            let used = self.crowd.count(&self.demands, found, left, counts);
            return self.spent(found, budget, [fixed, used]);
        };
        let most = units(self.steady.most(cost(left), seconds)).max(left);
        let (found, used) = match self.steady.followed(right.middle(), seconds) {
            Some(octaves) if self.crowd.total(&self.demands, octaves) <= most => {
                let found = Found::Worth(Bounds::at(octaves));
                (found, self.crowd.count(&self.demands, found, most, counts))
            }
            Some(_) => {
                let found = self.crowd.solve(&self.demands, most);
                (found, self.crowd.count(&self.demands, found, most, counts))
            }
            None => (found, self.crowd.count(&self.demands, found, left, counts)),
        };
        let octaves = if let Found::Worth(bounds) = found { bounds.middle() } else { right.middle() };
        self.steady.keep(octaves, used > left, seconds);
        self.spent(found, budget, [fixed, used])
    }

    /// Replaces `counts` with those of other items by what the last budget was split by, whatever
    /// they cost: of plants that are not seen themselves, but cast shadows. Plants that took part
    /// in the split have the same counts, but for rounding. Without a split before, none has a
    /// leaf.
    pub fn repeat(&mut self, items: &[Item], counts: &mut Vec<f32>) {
        self.prepare(items, 0.0);
        self.crowd.count(&self.demands, self.last, u64::MAX, counts);
    }

    /// Forgets the last frame, as after a cut.
    pub fn reset(&mut self) {
        self.steady = Steady::default();
    }

    /// Weighs the items; returns the sum of fixed costs, and what is left of the budget.
    fn prepare(&mut self, items: &[Item], budget: f64) -> (u64, u64) {
        let Self { rule, demands, octaves, crowd, .. } = self;
        crowd.clear(demands, items.len());
        rule.weigh(items, demands, octaves, &mut |item| crowd.push(demands, item));
        crowd.sum_up(demands);
        let fixed = sum(items.iter().map(|item| units(f64::from(item.fixed_cost()))));
        (fixed, budget_units(budget).saturating_sub(fixed))
    }

    fn spent(&mut self, found: Found, asked: f64, [fixed, used]: [u64; 2]) -> Spent {
        self.last = found;
        let (mu, floors) = match found {
            Found::Floors(part) => (libm::exp2(self.crowd.range()[1]), part),
            Found::Worth(bounds) if bounds.within < self.crowd.range()[0] => (0.0, 1.0),
            Found::Worth(bounds) => (libm::exp2(bounds.middle()), 1.0),
        };
        Spent { asked, used: cost(fixed.saturating_add(used)), fixed: cost(fixed), mu, floors }
    }
}
