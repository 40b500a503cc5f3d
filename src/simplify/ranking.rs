//! The remaining leaves ranked by error, where exact errors are expensive: most leaves are ranked
//! by lower bounds, which are made exact only where that can decide who is least.
//!
//! Every leaf has a bound that holds until the epoch ends (see [`drift`](super::drift)) in a
//! tournament. A leaf whose bound is below the least error is *near*: it leaves the tournament for
//! a short list and is ranked by the movement since its error was last exact, which is a much
//! tighter bound, so that few errors have to be computed again in each step.

use super::{
    drift::Drift,
    tournament::{Key, OUT, Tournament},
};

/// Set in a key's tie-break if the error is exact. Of equal values a bound comes first, so that it
/// is made exact.
const EXACT: u64 = 1 << 63;
/// Number of polygons behind all leaves: background and wood.
pub const BOTTOMS: usize = 2;
/// Exact error of a leaf.
#[derive(Debug, Clone, Copy)]
pub struct Exact {
    /// The error.
    pub error: i64,
    /// Decides between equal errors; differs for every leaf and is less than 2^63.
    pub tie_break: u64,
    /// Number of pixels of each bottom that the leaf would uncover, where they affect its error.
    pub uncovered: [u32; BOTTOMS],
}

/// What is known of a leaf.
#[derive(Debug, Clone, Copy)]
struct Standing {
    /// Error when it was last exact, less what it may have moved since because of other leaves.
    error: i64,
    /// Movement of the bottoms at that time.
    since: [f64; BOTTOMS],
    /// Number of pixels of each bottom that it would uncover; 0 if it does not depend on it.
    uncovered: [u32; BOTTOMS],
    is_near: bool,
    is_retired: bool,
}

/// Leaves ranked by error.
pub struct Ranking {
    standings: Vec<Standing>,
    tournament: Tournament,
    near: Vec<u32>,
    bounds: Bounds,
}

/// How far errors may have moved because of the bottoms.
struct Bounds {
    drifts: [Drift; BOTTOMS],
    /// Units of error for each bit of drift.
    scale: f64,
    /// Rounding of the errors that depend on a bottom.
    rounding: i64,
}

impl Bounds {
    /// Lower bound of a leaf's error, where `movement` is that of the errors of leaves that uncover
    /// so many pixels.
    fn lower(&self, standing: &Standing, movement: impl Fn(&Drift, u32) -> f64) -> i64 {
        let Standing { error, since, uncovered, .. } = *standing;
        if uncovered == [0; BOTTOMS] {
            return error;
        }
        let drifts = uncovered.iter().zip(&self.drifts).zip(since).filter(|((uncovered, _), _)| **uncovered > 0);
        let moved: f64 = drifts.map(|((&uncovered, drift), since)| movement(drift, uncovered) - since).sum();
        error.saturating_sub((moved * self.scale) as i64 + 1).saturating_sub(self.rounding)
    }

    fn lower_now(&self, standing: &Standing) -> i64 {
        self.lower(standing, Drift::so_far)
    }

    fn lower_in_this_epoch(&self, standing: &Standing) -> i64 {
        self.lower(standing, Drift::allowed)
    }
}

impl Ranking {
    /// Ranks `leaves` leaves first to last; [`set`](Self::set) must follow for each.
    pub fn new(leaves: usize, scale: f64, rounding: i64) -> Self {
        let standing =
            Standing { error: 0, since: [0.0; BOTTOMS], uncovered: [0; BOTTOMS], is_near: false, is_retired: false };
        Self {
            standings: vec![standing; leaves],
            tournament: Tournament::new(vec![OUT; leaves]),
            near: Vec::new(),
            bounds: Bounds { drifts: [Drift::new(), Drift::new()], scale, rounding },
        }
    }

    /// Whether the leaf takes part.
    pub fn has(&self, leaf: u32) -> bool {
        !self.standings[leaf as usize].is_retired
    }

    /// Excludes a leaf.
    pub fn retire(&mut self, leaf: u32) {
        self.standings[leaf as usize].is_retired = true;
        self.tournament.set(leaf, OUT);
    }

    /// Gives a leaf the error that it has now.
    pub fn set(&mut self, leaf: u32, exact: Exact) {
        self.renew(leaf, exact);
        let standing = &self.standings[leaf as usize];
        if !standing.is_near {
            let key = match standing.uncovered {
                [0, 0] => (exact.error, EXACT | exact.tie_break),
                _ => (self.bounds.lower_in_this_epoch(standing), leaf.into()),
            };
            self.tournament.set(leaf, key);
        }
    }

    fn renew(&mut self, leaf: u32, exact: Exact) {
        let standing = &mut self.standings[leaf as usize];
        (standing.error, standing.uncovered) = (exact.error, exact.uncovered);
        for (bottom, drift) in
            self.bounds.drifts.iter_mut().enumerate().filter(|(bottom, _)| exact.uncovered[*bottom] > 0)
        {
            drift.use_for(exact.uncovered[bottom]);
            standing.since[bottom] = drift.so_far(exact.uncovered[bottom]);
        }
    }

    /// Lowers a leaf's bound because other leaves moved its error by at most `movement`.
    pub fn lower(&mut self, leaf: u32, movement: i64) {
        let standing = &mut self.standings[leaf as usize];
        standing.error = standing.error.saturating_sub(movement);
        if !standing.is_near && !standing.is_retired {
            let key = self.tournament.key(leaf);
            self.tournament.set(leaf, (key.0.saturating_sub(movement), leaf.into()));
        }
    }

    /// Changes what decides between equal errors.
    pub fn break_ties(&mut self, leaf: u32, tie_break: u64) {
        let key = self.tournament.key(leaf);
        if key != OUT && key.1 & EXACT != 0 {
            self.tournament.set(leaf, (key.0, EXACT | tie_break));
        }
    }

    /// Adds a step's movement of a bottom's row. Returns false if the bounds no longer hold, so
    /// that a new epoch must start.
    pub fn advance(&mut self, bottom: usize, old: &[u32], new: &[u32]) -> bool {
        self.bounds.drifts[bottom].advance(old, new)
    }

    /// Starts an epoch: all leaves are ranked by bounds that hold until it ends.
    pub fn start_epoch(&mut self) {
        self.bounds.drifts.iter_mut().for_each(Drift::start_epoch);
        for leaf in self.near.drain(..) {
            self.standings[leaf as usize].is_near = false;
        }
        self.tournament.set_all(|leaf, key| match self.standings.get(leaf as usize) {
            Some(standing) if !standing.is_retired && (key == OUT || key.1 & EXACT == 0) => {
                (self.bounds.lower_in_this_epoch(standing), leaf.into())
            }
            _ => key,
        });
    }

    /// Returns the leaf with the least error, after its key: the error and what breaks ties.
    /// `exact` computes the error of a leaf.
    pub fn least(&mut self, exact: impl Fn(u32) -> Exact) -> Option<(Key, u32)> {
        self.near.retain(|&leaf| !self.standings[leaf as usize].is_retired);
        let mut best = (OUT, u32::MAX);
        let near = std::mem::take(&mut self.near);
        // The least bound first, since it excludes the most others.
        let first = near.iter().copied().min_by_key(|&leaf| self.lower_now(leaf));
        for leaf in first.into_iter().chain(near.iter().copied().filter(|&leaf| Some(leaf) != first)) {
            if self.lower_now(leaf) <= best.0.0 {
                best = best.min(self.made_exact(leaf, &exact));
            }
        }
        self.near = near;
        loop {
            let leaf = self.tournament.winner();
            let key = self.tournament.key(leaf);
            if key == OUT || key.0 > best.0.0 {
                break;
            }
            if key.1 & EXACT != 0 {
                best = best.min((key, leaf));
                break;
            }
            self.tournament.set(leaf, OUT);
            self.standings[leaf as usize].is_near = true;
            self.near.push(leaf);
            if self.lower_now(leaf) <= best.0.0 {
                best = best.min(self.made_exact(leaf, &exact));
            }
        }
        (best.0 != OUT).then_some(best)
    }

    fn lower_now(&self, leaf: u32) -> i64 {
        self.bounds.lower_now(&self.standings[leaf as usize])
    }

    fn made_exact(&mut self, leaf: u32, exact: &impl Fn(u32) -> Exact) -> (Key, u32) {
        let found = exact(leaf);
        self.renew(leaf, found);
        ((found.error, EXACT | found.tie_break), leaf)
    }
}
