//! Pruning criteria: the interface that chooses the next leaf, and two simple implementations.

use super::{
    appearance::{Appearance, COVERAGE},
    areas::Areas,
    change::{Change, Gain},
    crew::locked,
    intrinsic::Intrinsic,
    layers::Layers,
    price::{Price, Prices, STEPS},
    tournament::{Key, OUT, Tournament},
};
use std::sync::{Arc, Mutex};

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
pub trait Criterion: Send + Sync {
    /// Number of parts that may [absorb](Self::absorb) a step at the same time.
    fn parts(&self) -> usize {
        1
    }

    /// Chooses among the remaining leaves. Returns `None` if there are none.
    fn choose(&self, areas: &Areas) -> Option<Choice>;

    /// Excludes a leaf that was pruned before the views were captured.
    fn retire(&self, leaf: u32);

    /// Takes note that a leaf covers so many pixels over all views, visible or not, once it has
    /// grown. The step is absorbed afterwards.
    fn cover(&self, _leaf: u32, _covered: u32) {}

    /// Excludes leaf `pruned` and applies the step's changes, one slice per view, to one of the
    /// parts. `areas` have changed already.
    fn absorb(&self, part: usize, areas: &Areas, changes: &[&[Change]], pruned: u32);
}

/// Tie-break for equal errors: fewest pixels directly behind the frontmost polygon, then lowest
/// index.
pub(super) fn tie_break(areas: &Areas, leaf: u32) -> u64 {
    u64::from(areas.seconds(leaf as usize)) << 32 | u64::from(leaf)
}

/// The simplest criterion: a leaf's error is its visible area in pixels, summed over the views.
pub struct VisibleArea {
    tournament: Mutex<Tournament>,
}

impl VisibleArea {
    /// Scores all leaves.
    pub fn new(areas: &Areas) -> Self {
        let keys = (0..areas.leaves as u32).map(|leaf| area_key(areas, leaf)).collect();
        Self { tournament: Mutex::new(Tournament::new(keys)) }
    }
}

fn area_key(areas: &Areas, leaf: u32) -> Key {
    (i64::from(areas.total(leaf as usize)), tie_break(areas, leaf))
}

impl Criterion for VisibleArea {
    fn choose(&self, _: &Areas) -> Option<Choice> {
        let tournament = locked(&self.tournament);
        let leaf = tournament.winner();
        let key = tournament.key(leaf);
        (key != OUT).then_some(Choice { leaf, error: key.0 as f64 })
    }

    fn retire(&self, leaf: u32) {
        locked(&self.tournament).set(leaf, OUT);
    }

    fn absorb(&self, _: usize, areas: &Areas, changes: &[&[Change]], pruned: u32) {
        let mut tournament = locked(&self.tournament);
        tournament.set(pruned, OUT);
        for leaf in changed_leaves(areas, changes).filter(|&leaf| leaf != pruned) {
            tournament.set(leaf, area_key(areas, leaf));
        }
    }
}

/// Leaves that are, or were, frontmost or second where something changed; some more than once.
fn changed_leaves(areas: &Areas, changes: &[&[Change]]) -> impl Iterator<Item = u32> {
    let polygons = changes.iter().copied().flatten().flat_map(|change| [change.from, change.to]).flatten();
    polygons.filter(|&polygon| (polygon as usize) < areas.leaves)
}

/// Image criterion (ours): a leaf's error is how much pruning it increases the difference between
/// the views and the full plant's, plus the price of the pixels that it leaves uncovered. The
/// leaf with the least sum of that error and its [intrinsic cost](super::intrinsic) goes first.
///
/// Errors are in pixels: 1 is the cost of showing a polygon where the background should be.
/// Negative errors, where the views are better without the leaf, are recorded as 0.
pub struct ImageLoss {
    appearance: Arc<Appearance>,
    price: Price,
    scores: Mutex<Scores>,
}

/// Scores of all leaves.
struct Scores {
    /// Prices used in the tournament's keys.
    prices: Prices,
    /// Gain of pruning each leaf; usually negative.
    gains: Vec<Gain>,
    /// `None` if leaves have no intrinsic cost.
    intrinsic: Option<Intrinsic>,
    /// Leaf that has grown since the last step was absorbed.
    grown: Option<u32>,
    tournament: Tournament,
}

impl ImageLoss {
    /// Scores all leaves of freshly captured views, which must keep their references.
    pub fn new(
        appearance: Arc<Appearance>,
        price: Price,
        intrinsic: Option<Intrinsic>,
        areas: &Areas,
        layers: &[Layers],
    ) -> Self {
        let mut gains = vec![Gain::default(); areas.leaves];
        for (view, layers) in layers.iter().enumerate() {
            let look = appearance.view(view);
            for (reference, [front, second]) in layers.references().into_iter().flatten() {
                if let Some(gain) = gains.get_mut(front as usize) {
                    *gain = gain.plus(look.gain(front, second, reference));
                }
            }
        }
        let mut scores = Scores {
            prices: price.steps(areas) * appearance.coverage(),
            gains,
            intrinsic,
            grown: None,
            tournament: Tournament::new(vec![OUT; areas.leaves]),
        };
        (0..areas.leaves as u32).for_each(|leaf| scores.update(areas, leaf));
        Self { appearance, price, scores: Mutex::new(scores) }
    }
}

impl Scores {
    fn update(&mut self, areas: &Areas, leaf: u32) {
        let score = self.gains[leaf as usize].score(self.prices);
        self.tournament.set(leaf, (self.intrinsic_cost(leaf) - score, tie_break(areas, leaf)));
    }

    fn intrinsic_cost(&self, leaf: u32) -> i64 {
        self.intrinsic.as_ref().map_or(0, |intrinsic| intrinsic.cost(leaf))
    }
}

impl Criterion for ImageLoss {
    fn choose(&self, _: &Areas) -> Option<Choice> {
        let scores = locked(&self.scores);
        let leaf = scores.tournament.winner();
        let key = scores.tournament.key(leaf);
        let unit = (COVERAGE * STEPS) as f64;
        let error = || (key.0 - scores.intrinsic_cost(leaf)).max(0) as f64 / unit;
        (key != OUT).then(|| Choice { leaf, error: error() })
    }

    fn cover(&self, leaf: u32, covered: u32) {
        let scores = &mut *locked(&self.scores);
        if let Some(intrinsic) = &mut scores.intrinsic {
            intrinsic.cover(leaf, covered);
            scores.grown = Some(leaf);
        }
    }

    fn retire(&self, leaf: u32) {
        locked(&self.scores).tournament.set(leaf, OUT);
    }

    fn absorb(&self, _: usize, areas: &Areas, changes: &[&[Change]], pruned: u32) {
        let scores = &mut *locked(&self.scores);
        scores.tournament.set(pruned, OUT);
        for (view, changes) in changes.iter().enumerate() {
            let look = self.appearance.view(view);
            for change in *changes {
                for (pair, count) in [(change.from, -i64::from(change.count)), (change.to, change.count.into())] {
                    if let Some(sum) = scores.gains.get_mut(pair[0] as usize) {
                        *sum = sum.plus(look.gain(pair[0], pair[1], change.reference).times(count));
                    }
                }
            }
        }
        let grown = scores.grown.take();
        let prices = self.price.steps(areas) * self.appearance.coverage();
        if scores.prices != prices {
            scores.prices = prices;
            let live = (0..areas.leaves as u32).filter(|&leaf| scores.tournament.key(leaf) != OUT);
            live.collect::<Vec<_>>().into_iter().for_each(|leaf| scores.update(areas, leaf));
            return;
        }
        for leaf in changed_leaves(areas, changes).chain(grown).filter(|&leaf| leaf != pruned) {
            scores.update(areas, leaf);
        }
    }
}
