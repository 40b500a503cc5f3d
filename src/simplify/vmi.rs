//! Change in viewpoint mutual information from pruning a leaf, kept up to date for all leaves.
//!
//! After C. Gasch, M. Chover, I. Remolar, C. Rebollo, "Multiresolution Foliage Rendering", section
//! 4.1 (the leaf with the least change is pruned next), with the measure of Castelló et al. (see
//! [`information`](super::information)). Where the paper is silent or wrong: the error is the sum
//! over the views of |I(v) - I_without(v)|, so that views cannot cancel out; the background is one
//! more polygon by default, so that a hole against the sky counts; ties are broken as [`Criterion`]
//! specifies.
//!
//! Limits: without the background, a_t and A change at every step, and every error with them, so
//! each step recomputes the errors of all leaves.

use super::{
    areas::Areas,
    change::Change,
    crew::locked,
    criterion::{Choice, Criterion, tie_break},
    information::FixedLog,
    ranking::{BOTTOMS, Exact, Ranking},
    terms::{Share, Terms},
    tournament::Key,
};
use rayon::prelude::*;
use std::sync::{Arc, Mutex};

/// Largest number of parts, as a power of two. What every part does for itself makes more of them
/// slower.
const MAX_BITS: u32 = 3;

/// The VMI criterion. Each part looks after a share of the leaves and shares nothing with others.
pub struct Vmi {
    parts: Vec<Mutex<Part>>,
}

/// A share of the leaves.
struct Part {
    share: Share,
    background: bool,
    terms: Terms,
    ranking: Ranking,
    /// Least key and its leaf, if nothing changed since it was found.
    least: Option<(Key, u32)>,
}

impl Vmi {
    /// Scores all leaves of freshly counted `areas`, with as many parts as there are threads.
    /// `pixels` is the number of pixels of all views; `fronts` yields the view and the (front,
    /// second) pair of each pixel.
    pub fn new<F>(areas: &Areas, pixels: u64, background: bool, fronts: impl Fn() -> F + Sync) -> Self
    where
        F: Iterator<Item = (usize, [u32; 2])>,
    {
        let bits = rayon::current_num_threads().next_power_of_two().ilog2().min(MAX_BITS);
        let log = Arc::new(FixedLog::new(pixels));
        let parts = Share::all(bits).collect::<Vec<_>>().into_par_iter().map(|share| {
            let terms = Terms::new(share, areas, pixels, background, fronts(), log.clone());
            // Each term has four products a L(A), each off by at most half a step times its area,
            // before and after.
            let rounding = 4 * pixels as i64 * BOTTOMS as i64;
            let mut ranking = Ranking::new(share.count(areas.leaves), terms.unit(), rounding);
            for place in 0..share.count(areas.leaves) as u32 {
                ranking.set(place, exact(share, &terms, areas, place));
            }
            Mutex::new(Part { share, background, terms, ranking, least: None })
        });
        Self { parts: parts.collect() }
    }

    /// Exact error of pruning `leaf`, in fixed point.
    #[cfg(test)]
    pub fn error(&self, areas: &Areas, leaf: u32) -> i64 {
        let parts = self.parts.iter().map(locked).filter(|part| part.share.has(leaf));
        parts.map(|part| part.terms.error(areas, part.share.place(leaf))).sum()
    }
}

fn exact(share: Share, terms: &Terms, areas: &Areas, place: u32) -> Exact {
    Exact {
        error: terms.error(areas, place),
        tie_break: tie_break(areas, share.leaf(place)),
        uncovered: terms.uncovered(place),
    }
}

impl Part {
    fn retire(&mut self, leaf: u32) {
        self.least = None;
        if self.share.has(leaf) {
            self.ranking.retire(self.share.place(leaf));
        }
    }

    /// Least key and its leaf.
    fn least(&mut self, areas: &Areas) -> Option<(Key, u32)> {
        if self.least.is_none() {
            let (share, terms) = (self.share, &self.terms);
            let least = self.ranking.least(|place| exact(share, terms, areas, place));
            self.least = least.map(|(key, place)| (key, share.leaf(place)));
        }
        self.least
    }

    fn absorb(&mut self, areas: &Areas, changes: &[&[Change]], pruned: u32) {
        self.retire(pruned);
        self.terms.absorb(areas, changes, pruned);
        let mut epoch_holds = true;
        for bottom in areas.changed().filter_map(|row| row.checked_sub(areas.leaves)) {
            if self.background {
                let row = areas.leaves + bottom;
                epoch_holds &= self.ranking.advance(bottom, &areas.before(row).row, areas.row(row));
            }
        }
        if !self.background && areas.changed().next().is_some() {
            // All errors depend on the background's areas.
            let places = 0..self.share.count(areas.leaves) as u32;
            places.for_each(|place| self.terms.moves.mark(place));
        }
        self.rank(areas);
        if !epoch_holds {
            self.ranking.start_epoch();
        }
        // The leaves behind the changed pixels are second in more or fewer pixels than before.
        for leaf in changes.iter().copied().flatten().flat_map(|change| [change.from[1], change.to[1]]) {
            if (leaf as usize) < areas.leaves && self.share.has(leaf) {
                self.ranking.break_ties(self.share.place(leaf), tie_break(areas, leaf));
            }
        }
        self.least(areas);
    }

    /// Ranks the leaves again whose errors a step moved.
    fn rank(&mut self, areas: &Areas) {
        let Self { share, terms, ranking, .. } = self;
        for place in std::mem::take(&mut terms.moves.moved) {
            let movement = terms.moves.take_movement(place);
            if ranking.has(place) && !terms.moves.has_marked(place) {
                ranking.lower(place, movement);
            }
        }
        for place in std::mem::take(&mut terms.moves.marked) {
            if ranking.has(place) {
                ranking.set(place, exact(*share, terms, areas, place));
            }
        }
    }
}

impl Criterion for Vmi {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn choose(&self, areas: &Areas) -> Option<Choice> {
        let least = self.parts.iter().filter_map(|part| locked(part).least(areas)).min()?;
        let ((error, _), leaf) = least;
        Some(Choice { leaf, error: locked(&self.parts[0]).terms.error_bits(areas, error) })
    }

    fn retire(&self, leaf: u32) {
        self.parts.iter().for_each(|part| locked(part).retire(leaf));
    }

    fn absorb(&self, part: usize, areas: &Areas, changes: &[&[Change]], pruned: u32) {
        locked(&self.parts[part]).absorb(areas, changes, pruned);
    }
}
