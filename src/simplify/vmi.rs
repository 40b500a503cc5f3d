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
    criterion::{Choice, Criterion, tie_break},
    ranking::{BOTTOMS, Exact, Ranking},
    terms::Terms,
};

/// The VMI criterion.
pub struct Vmi {
    background: bool,
    terms: Terms,
    ranking: Ranking,
}

impl Vmi {
    /// Scores all leaves of freshly counted `areas`. `pixels` is the number of pixels of all views;
    /// `fronts` yields the view and the (front, second) pair of each pixel.
    pub fn new(areas: &Areas, pixels: u64, background: bool, fronts: impl Iterator<Item = (usize, [u32; 2])>) -> Self {
        let mut terms = Terms::new(areas, pixels, background, fronts);
        // Each term has four products a L(A), each off by at most half a step times its area,
        // before and after.
        let rounding = 4 * pixels as i64 * BOTTOMS as i64;
        let mut ranking = Ranking::new(areas.leaves, terms.unit(), rounding);
        terms.moves.marked.clear();
        for leaf in 0..areas.leaves as u32 {
            ranking.set(leaf, exact(&terms, areas, leaf));
        }
        Self { background, terms, ranking }
    }

    fn advance_drifts(&mut self, areas: &Areas) -> bool {
        let mut holds = true;
        for i in 0..areas.pending() {
            let row = areas.pending_row(i);
            if row >= areas.leaves && (row == areas.wood() || self.background) {
                holds &= self.ranking.advance(row - areas.leaves, areas.row(row), &areas.pending_areas(i).0);
            }
        }
        holds
    }

    /// Ranks the leaves again whose errors a step moved.
    fn rank(&mut self, areas: &Areas) {
        let Self { terms, ranking, .. } = self;
        for leaf in std::mem::take(&mut terms.moves.moved) {
            let movement = terms.moves.take_movement(leaf);
            if ranking.has(leaf) && !terms.moves.has_marked(leaf) {
                ranking.lower(leaf, movement);
            }
        }
        for leaf in std::mem::take(&mut terms.moves.marked) {
            if ranking.has(leaf) {
                ranking.set(leaf, exact(terms, areas, leaf));
            }
        }
    }

    /// Exact error of pruning `leaf`, in fixed point.
    #[cfg(test)]
    pub fn error(&self, areas: &Areas, leaf: u32) -> i64 {
        self.terms.error(areas, leaf)
    }

    /// F(v) of every view, without the background's row.
    #[cfg(test)]
    pub fn f(&self) -> &[i64] {
        self.terms.f()
    }
}

fn exact(terms: &Terms, areas: &Areas, leaf: u32) -> Exact {
    Exact { error: terms.error(areas, leaf), tie_break: tie_break(areas, leaf), uncovered: terms.uncovered(leaf) }
}

impl Criterion for Vmi {
    fn choose(&mut self, areas: &Areas) -> Option<Choice> {
        let (leaf, error) = self.ranking.least(|leaf| exact(&self.terms, areas, leaf))?;
        Some(Choice { leaf, error: self.terms.error_bits(areas, error) })
    }

    fn retire(&mut self, leaf: u32) {
        self.ranking.retire(leaf);
    }

    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32) {
        self.ranking.retire(pruned);
        self.terms.begin_step();
        for (view, changes) in changes.iter().enumerate() {
            for change in *changes {
                areas.collect(view, change);
                self.terms.count_pair(areas, view, change.from, -(change.count as i32));
                self.terms.count_pair(areas, view, change.to, change.count as i32);
            }
        }
        let epoch_holds = self.advance_drifts(areas);
        if !self.background && areas.pending() > 0 {
            // All errors depend on the background's areas.
            let remaining = (0..areas.leaves as u32).filter(|&leaf| self.ranking.has(leaf));
            remaining.for_each(|leaf| self.terms.moves.mark(leaf));
        }
        self.terms.move_rows(areas);
        areas.commit();
        self.terms.end_step(areas);
        self.rank(areas);
        if !epoch_holds {
            self.ranking.start_epoch();
        }
        // The leaves behind the changed pixels are second in more or fewer pixels than before.
        for leaf in changes.iter().copied().flatten().flat_map(|change| [change.from[1], change.to[1]]) {
            if (leaf as usize) < areas.leaves {
                self.ranking.break_ties(leaf, tie_break(areas, leaf));
            }
        }
    }
}
