//! Pruning criteria: the interface that chooses the next leaf, and two simple implementations.

use super::{
    appearance::{Appearance, COVERAGE},
    areas::Areas,
    change::{Change, Gain},
    layers::Layers,
    price::{Price, Prices, STEPS},
    tournament::{Key, OUT, Tournament},
};
use std::sync::Arc;

/// The next leaf to prune.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// The leaf.
    pub leaf: u32,
    /// Error of pruning the leaf, in the criterion's unit.
    pub error: f64,
}

/// Scores every leaf and keeps the scores up to date.
///
/// The choice must be exact: the leaf with the least error; among equal errors, the leaf that is
/// directly behind the frontmost polygon in the fewest pixels; among these, the leaf with the
/// lowest index.
pub trait Criterion {
    /// Chooses among the remaining leaves. Returns `None` if there are none.
    fn choose(&mut self, areas: &Areas) -> Option<Choice>;

    /// Excludes a leaf that was pruned before the views were captured.
    fn retire(&mut self, leaf: u32);

    /// Excludes leaf `pruned` and applies the step's changes, one slice per view. Commits `areas`.
    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32);
}

/// Tie-break for equal errors: fewest pixels directly behind the frontmost polygon, then lowest
/// index.
pub(super) fn tie_break(areas: &Areas, leaf: u32) -> u64 {
    u64::from(areas.seconds(leaf as usize)) << 32 | u64::from(leaf)
}

/// The simplest criterion: a leaf's error is its visible area in pixels, summed over the views.
pub struct VisibleArea {
    tournament: Tournament,
}

impl VisibleArea {
    /// Scores all leaves.
    pub fn new(areas: &Areas) -> Self {
        Self { tournament: Tournament::new((0..areas.leaves as u32).map(|leaf| area_key(areas, leaf)).collect()) }
    }
}

fn area_key(areas: &Areas, leaf: u32) -> Key {
    (i64::from(areas.total(leaf as usize)), tie_break(areas, leaf))
}

impl Criterion for VisibleArea {
    fn choose(&mut self, _: &Areas) -> Option<Choice> {
        let leaf = self.tournament.winner();
        let key = self.tournament.key(leaf);
        (key != OUT).then_some(Choice { leaf, error: key.0 as f64 })
    }

    fn retire(&mut self, leaf: u32) {
        self.tournament.set(leaf, OUT);
    }

    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32) {
        self.tournament.set(pruned, OUT);
        for (view, changes) in changes.iter().enumerate() {
            changes.iter().for_each(|change| areas.collect(view, change));
        }
        areas.commit();
        for polygon in changes.iter().copied().flatten().flat_map(|change| [change.from, change.to]).flatten() {
            if (polygon as usize) < areas.leaves && polygon != pruned {
                self.tournament.set(polygon, area_key(areas, polygon));
            }
        }
    }
}

/// Image criterion (ours): a leaf's error is how much pruning it increases the difference between
/// the views and the full plant's, plus the price of the pixels that it leaves uncovered.
///
/// Errors are in pixels: 1 is the cost of showing a polygon where the background should be.
/// Negative errors, where the views are better without the leaf, are recorded as 0.
pub struct ImageLoss {
    appearance: Arc<Appearance>,
    price: Price,
    /// Prices used in the tournament's keys, in steps.
    prices: Prices,
    /// Gain of pruning each leaf; usually negative.
    gains: Vec<Gain>,
    tournament: Tournament,
}

impl ImageLoss {
    /// Scores all leaves of freshly captured views, which must keep their references.
    pub fn new(appearance: Arc<Appearance>, price: Price, areas: &Areas, layers: &[Layers]) -> Self {
        let mut gains = vec![Gain::default(); areas.leaves];
        for (view, layers) in layers.iter().enumerate() {
            let look = appearance.view(view);
            for (reference, [front, second]) in layers.references().into_iter().flatten() {
                if let Some(gain) = gains.get_mut(front as usize) {
                    *gain = gain.plus(look.gain(front, second, reference));
                }
            }
        }
        let tournament = Tournament::new(vec![OUT; areas.leaves]);
        let mut criterion = Self { appearance, price, prices: price.steps(areas), gains, tournament };
        (0..areas.leaves as u32).for_each(|leaf| criterion.tournament.set(leaf, criterion.key(areas, leaf)));
        criterion
    }

    fn key(&self, areas: &Areas, leaf: u32) -> Key {
        let score = self.gains[leaf as usize].score(self.prices * self.appearance.coverage());
        (-score, tie_break(areas, leaf))
    }
}

impl Criterion for ImageLoss {
    fn choose(&mut self, _: &Areas) -> Option<Choice> {
        let leaf = self.tournament.winner();
        let key = self.tournament.key(leaf);
        let unit = (COVERAGE * STEPS) as f64;
        (key != OUT).then_some(Choice { leaf, error: key.0.max(0) as f64 / unit })
    }

    fn retire(&mut self, leaf: u32) {
        self.tournament.set(leaf, OUT);
    }

    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32) {
        self.tournament.set(pruned, OUT);
        for (view, changes) in changes.iter().enumerate() {
            let look = self.appearance.view(view);
            for change in *changes {
                areas.collect(view, change);
                for (pair, count) in [(change.from, -i64::from(change.count)), (change.to, change.count.into())] {
                    if let Some(sum) = self.gains.get_mut(pair[0] as usize) {
                        *sum = sum.plus(look.gain(pair[0], pair[1], change.reference).times(count));
                    }
                }
            }
        }
        areas.commit();
        let prices = self.price.steps(areas);
        if self.prices != prices {
            self.prices = prices;
            let live = (0..areas.leaves as u32).filter(|&leaf| self.tournament.key(leaf) != OUT);
            for leaf in live.collect::<Vec<_>>() {
                self.tournament.set(leaf, self.key(areas, leaf));
            }
            return;
        }
        for polygon in changes.iter().copied().flatten().flat_map(|change| [change.from, change.to]).flatten() {
            if (polygon as usize) < areas.leaves && polygon != pruned {
                self.tournament.set(polygon, self.key(areas, polygon));
            }
        }
    }
}
