//! What decides which leaf goes next: the seam that every criterion stands behind.

use super::{
    areas::Areas,
    layers::Change,
    tournament::{Key, OUT, Tournament},
};

/// The next leaf to prune.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// The leaf.
    pub leaf: u32,
    /// Its error, in the criterion's unit.
    pub error: f64,
}

/// Scores every leaf and keeps the scores up to date.
///
/// The choice must be exact: the leaf of least error, of those the one that stands directly behind the frontmost in the
/// fewest pixels, of those the one of least index.
pub trait Criterion {
    /// Chooses among the remaining leaves; `None` when none remains.
    fn choose(&mut self, areas: &Areas) -> Option<Choice>;

    /// Takes leaf `pruned` out and takes in what the step changed in each view. Commits `areas`.
    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32);
}

/// Ties of equal error: fewest pixels directly behind the frontmost, then least index.
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
