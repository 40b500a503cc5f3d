//! Change in viewpoint mutual information from pruning a leaf, kept up to date for all leaves.
//!
//! After C. Gasch, M. Chover, I. Remolar, C. Rebollo, "Multiresolution Foliage Rendering", section
//! 4.1 (the leaf with the least change is pruned next), with the measure of Castelló et al. (see
//! [`information`](super::information)). Where the paper is silent or wrong: the error is the sum
//! over the views of |I(v) - I_without(v)|, so that views cannot cancel out; the background is one
//! more polygon by default, so that a hole against the sky counts; ties are broken as [`Criterion`]
//! specifies.
//!
//! Pruning x hands its pixels to the polygons directly behind it. If polygon y receives d(v)
//! pixels, D in total, F changes in each view by
//!
//! ```text
//! sum over y of  (a_y + d)(L(a_y + d) - L(A_y + D)) - a_y (L(a_y) - L(A_y))
//! minus          a_x (L(a_x) - L(A_x))
//! ```
//!
//! Each leaf's sum over leaves y is kept per view and corrected when a row or a pair changes. The
//! terms of background and wood, which affect thousands of leaves at every step, are added when a
//! leaf's exact error is needed; a lower bound (in `drift`) decides when it is. All errors are
//! integers, equal to a computation from scratch bit for bit.
//!
//! Limits: without the background, a_t and A change at every step, and every error with them, so
//! each step recomputes the errors of all leaves.

use super::{
    areas::Areas,
    change::Change,
    criterion::{Choice, Criterion, tie_break},
    drift::Drift,
    information::FixedLog,
    pairs::Pairs,
    tournament::{Key, OUT, Tournament},
    views::VIEW_COUNTS,
};

/// Set in a key's tie-break if the error is exact. Of equal values a bound comes first, so that it
/// is made exact.
const EXACT: u64 = 1 << 63;
/// Largest number of views.
const MAX_VIEWS: usize = VIEW_COUNTS[VIEW_COUNTS.len() - 1] as usize;
/// Number of polygons behind all leaves: background and wood.
const BOTTOMS: usize = 2;

/// The VMI criterion.
pub struct Vmi {
    log: FixedLog,
    background: bool,
    /// Number of pixels of all views.
    pixels: u64,
    pairs: Pairs,
    /// Change of F(v) when leaf x is pruned, without the terms of background and wood; `views`
    /// numbers per leaf.
    local: Vec<i64>,
    /// F(v) of the current state, without the background's row.
    f: Vec<i64>,
    /// Pixels of background and wood that leaf x would uncover in each view.
    uncovered: [Vec<u32>; BOTTOMS],
    uncovered_totals: [Vec<u32>; BOTTOMS],
    drifts: [Drift; BOTTOMS],
    tournament: Tournament,
    step: u32,
    work: Work,
}

/// Memory kept between steps.
#[derive(Default)]
struct Work {
    /// Leaves whose errors must be recomputed.
    dirty: Vec<u32>,
    dirty_stamps: Vec<u32>,
    /// Leaves whose errors moved by at most `movement`; their bounds are lowered by that amount.
    moved: Vec<u32>,
    movement: Vec<i64>,
    touched_pairs: Vec<u32>,
    /// Leaves whose errors the last choice made exact although they depend on background or wood.
    exact: Vec<u32>,
    new_row: Vec<u32>,
}

impl Work {
    fn mark(&mut self, leaf: u32, step: u32) {
        if std::mem::replace(&mut self.dirty_stamps[leaf as usize], step) != step {
            self.dirty.push(leaf);
        }
    }

    fn add_movement(&mut self, leaf: u32, movement: i64) {
        let sum = &mut self.movement[leaf as usize];
        if *sum == 0 && movement > 0 {
            self.moved.push(leaf);
        }
        *sum += movement;
    }
}

impl Vmi {
    /// Scores all leaves of freshly counted `areas`. `pixels` is the number of pixels of all views;
    /// `fronts` yields the view and the (front, second) pair of each pixel.
    pub fn new(areas: &Areas, pixels: u64, background: bool, fronts: impl Iterator<Item = (usize, [u32; 2])>) -> Self {
        let (leaves, views) = (areas.leaves, areas.views);
        let mut vmi = Self {
            log: FixedLog::new(pixels),
            background,
            pixels,
            pairs: Pairs::new(leaves, views),
            local: vec![0; leaves * views],
            f: vec![0; views],
            uncovered: [vec![0; leaves * views], vec![0; leaves * views]],
            uncovered_totals: [vec![0; leaves], vec![0; leaves]],
            drifts: [Drift::new(), Drift::new()],
            tournament: Tournament::new(Vec::new()),
            step: 0,
            work: Work {
                dirty_stamps: vec![0; leaves],
                movement: vec![0; leaves],
                new_row: vec![0; views],
                ..Work::default()
            },
        };
        for (view, [front, second]) in fronts {
            vmi.count_pair(areas, view, [front, second], 1);
        }
        for row in (0..leaves).chain([areas.wood()]) {
            vmi.add_own(row, areas.row(row), areas.total(row), 1);
        }
        for pair in std::mem::take(&mut vmi.work.touched_pairs) {
            vmi.add_pair(areas, pair, 1);
        }
        vmi.tournament = Tournament::new((0..leaves as u32).map(|leaf| vmi.key(areas, leaf)).collect());
        vmi
    }

    /// Adds `sign` times a row's own term to F, and subtracts it from the change that pruning the
    /// row's leaf causes.
    fn add_own(&mut self, row: usize, areas: &[u32], total: u32, sign: i64) {
        let log_total = self.log.log2(total);
        for (view, &area) in areas.iter().enumerate().filter(|(_, area)| **area > 0) {
            let term = sign * i64::from(area) * (self.log.log2(area) - log_total);
            self.f[view] += term;
            if let Some(local) = self.local.get_mut(row * areas.len() + view) {
                *local -= term;
            }
        }
    }

    /// Adds `sign` times the pair's contribution to the change of its front leaf.
    fn add_pair(&mut self, areas: &Areas, number: u32, sign: i64) {
        let (pair, second) = self.pairs.get(number);
        let (row, total) = (areas.row(second as usize), areas.total(second as usize));
        let local = &mut self.local[pair.front as usize * row.len()..][..row.len()];
        let log_after = self.log.log2(total + pair.total);
        let log_change = sign * (self.log.log2(total) - log_after);
        for (local, &area) in local.iter_mut().zip(row) {
            *local += i64::from(area) * log_change;
        }
        for view in pair.seen_views() {
            local[view] += sign * self.log.handed_over(row[view], self.pairs.count(pair, view), log_after);
        }
    }

    /// Corrects every pair whose second leaf is the one whose row is about to change, unless the
    /// pair's own counts change too. Records an upper bound on how far that moves the errors of the
    /// front leaves.
    fn move_row(&mut self, areas: &Areas, second: usize, new_row: &[u32], new_total: u32) {
        let (old_row, old_total) = (areas.row(second), areas.total(second));
        let log_before = [old_total, new_total].map(|total| self.log.log2(total));
        for pair in self.pairs.behind_others(second as u32) {
            if pair.stamp == self.step + 1 {
                continue;
            }
            let local = &mut self.local[pair.front as usize * old_row.len()..][..old_row.len()];
            let log_after = [old_total, new_total].map(|total| self.log.log2(total + pair.total));
            let log_change = [log_before[0] - log_after[0], log_before[1] - log_after[1]];
            let mut movement = 0;
            for ((local, &old), &new) in local.iter_mut().zip(old_row).zip(new_row) {
                let change = i64::from(new) * log_change[1] - i64::from(old) * log_change[0];
                *local += change;
                movement += change.abs();
            }
            for view in pair.seen_views() {
                let handed = self.pairs.count(pair, view);
                let change = self.log.handed_over(new_row[view], handed, log_after[1])
                    - self.log.handed_over(old_row[view], handed, log_after[0]);
                local[view] += change;
                movement += change.abs();
            }
            self.work.add_movement(pair.front, movement);
        }
    }

    /// Adds `delta` to the pixels of one view in which `second` is directly behind `front`.
    fn count_pair(&mut self, areas: &Areas, view: usize, [front, second]: [u32; 2], delta: i32) {
        if front as usize >= areas.leaves {
            return;
        }
        self.work.mark(front, self.step);
        match (second as usize).checked_sub(areas.leaves) {
            Some(bottom) => {
                let count = &mut self.uncovered[bottom][front as usize * areas.views + view];
                *count = count.wrapping_add_signed(delta);
                let total = &mut self.uncovered_totals[bottom][front as usize];
                *total = total.wrapping_add_signed(delta);
            }
            None => {
                let pair = self.pairs.find_or_insert(front, second);
                if self.pairs.stamp(pair, self.step + 1) {
                    self.add_pair(areas, pair, -1);
                    self.work.touched_pairs.push(pair);
                }
                self.pairs.add(pair, view, delta);
            }
        }
    }

    /// Change of F(v) in every view when `leaf` is pruned, without the background's term if the
    /// background does not count.
    fn f_changes(&self, areas: &Areas, leaf: u32) -> [i64; MAX_VIEWS] {
        let first = leaf as usize * areas.views;
        let mut changes = [0; MAX_VIEWS];
        changes[..areas.views].copy_from_slice(&self.local[first..][..areas.views]);
        for bottom in 0..BOTTOMS {
            let uncovered_total = self.uncovered_totals[bottom][leaf as usize];
            if uncovered_total == 0 || (bottom == 0 && !self.background) {
                continue;
            }
            let total = areas.total(areas.leaves + bottom);
            let log_after = self.log.log2(total + uncovered_total);
            let log_change = self.log.log2(total) - log_after;
            let uncovered = &self.uncovered[bottom][first..][..areas.views];
            for ((change, &area), &uncovered) in changes.iter_mut().zip(areas.row(areas.leaves + bottom)).zip(uncovered)
            {
                *change += i64::from(area) * log_change;
                if uncovered > 0 {
                    *change += self.log.handed_over(area, uncovered, log_after);
                }
            }
        }
        changes
    }

    /// Exact error of pruning `leaf`, in fixed point. With the background, it is multiplied by the
    /// number of pixels of a view.
    pub fn error(&self, areas: &Areas, leaf: u32) -> i64 {
        if self.background {
            return self.f_changes(areas, leaf).iter().map(|change| change.abs()).sum();
        }
        let pixels_per_view = (self.pixels / areas.views as u64) as u32;
        let background = areas.background();
        let total = self.pixels as u32 - areas.total(background);
        let uncovered_total = self.uncovered_totals[0][leaf as usize];
        let log_total = [total, total - uncovered_total].map(|total| self.log.log2(total));
        let information = |f: i64, covered: u32, log_total: i64| match covered {
            0 => 0,
            _ => f.div_euclid(i64::from(covered)) + log_total - self.log.log2(covered),
        };
        let changes = self.f_changes(areas, leaf);
        (0..areas.views)
            .map(|view| {
                let covered = pixels_per_view - areas.row(background)[view];
                let uncovered = self.uncovered[0][leaf as usize * areas.views + view];
                let before = information(self.f[view], covered, log_total[0]);
                let after = information(self.f[view] + changes[view], covered - uncovered, log_total[1]);
                (after - before).abs()
            })
            .sum()
    }

    fn exact_key(&self, areas: &Areas, leaf: u32) -> Key {
        (self.error(areas, leaf), EXACT | tie_break(areas, leaf))
    }

    /// Returns an exact key or, if background or wood can change the error, a lower bound that
    /// holds until the epoch ends.
    fn key(&self, areas: &Areas, leaf: u32) -> Key {
        let exact = self.exact_key(areas, leaf);
        if self.background && self.depends_on_bottoms(leaf) { self.bound(exact.0, leaf) } else { exact }
    }

    /// Lower bound of an error that is exact now.
    fn bound(&self, error: i64, leaf: u32) -> Key {
        let allowance: f64 = (0..BOTTOMS)
            .map(|bottom| (self.uncovered_totals[bottom][leaf as usize], &self.drifts[bottom]))
            .map(|(uncovered, drift)| if uncovered > 0 { drift.allowance(uncovered) } else { 0.0 })
            .sum();
        // Each term has four products a L(A), each off by at most half a step times its area,
        // before and after.
        let rounding = 4 * self.pixels as i64 * BOTTOMS as i64;
        let allowance = (allowance * (1_u64 << self.log.fraction_bits()) as f64).ceil() as i64;
        (error.saturating_sub(allowance).saturating_sub(rounding), u64::from(leaf))
    }

    fn depends_on_bottoms(&self, leaf: u32) -> bool {
        self.uncovered_totals.iter().any(|totals| totals[leaf as usize] > 0)
    }

    /// Returns the leaf with the least error, replacing bounds with exact errors while a bound is
    /// the least key.
    fn least(&mut self, areas: &Areas) -> Option<u32> {
        loop {
            let leaf = self.tournament.winner();
            let key = self.tournament.key(leaf);
            if key == OUT {
                return None;
            }
            if key.1 & EXACT != 0 {
                return Some(leaf);
            }
            self.tournament.set(leaf, self.exact_key(areas, leaf));
            self.work.exact.push(leaf);
        }
    }

    /// Converts an [`error`](Self::error) to bits of information.
    pub fn error_bits(&self, areas: &Areas, error: i64) -> f64 {
        let scale = if self.background { self.pixels as f64 / areas.views as f64 } else { 1.0 };
        self.log.to_bits(error) / scale
    }

    /// F(v) of every view, without the background's row.
    #[cfg(test)]
    pub fn f(&self) -> &[i64] {
        &self.f
    }

    fn advance_drifts(&mut self, areas: &Areas, new_row: &mut [u32]) -> bool {
        let mut holds = true;
        for i in 0..areas.pending() {
            let row = areas.pending_row(i);
            if row >= areas.leaves && (row == areas.wood() || self.background) {
                areas.pending_areas(i, new_row);
                holds &= self.drifts[row - areas.leaves].advance(areas.row(row), new_row);
            }
        }
        holds && (self.background || areas.pending() == 0)
    }

    /// Replaces the errors that were made exact for a choice with bounds again, before anything
    /// moves.
    fn retire_exact(&mut self) {
        for leaf in std::mem::take(&mut self.work.exact) {
            let key = self.tournament.key(leaf);
            if key != OUT && key.1 & EXACT != 0 && self.depends_on_bottoms(leaf) {
                self.tournament.set(leaf, self.bound(key.0, leaf));
            }
        }
    }

    fn refresh_keys(&mut self, areas: &Areas, epoch_holds: bool) {
        if !epoch_holds {
            self.drifts.iter_mut().for_each(Drift::start_epoch);
            for leaf in 0..areas.leaves as u32 {
                if self.tournament.key(leaf) != OUT && (!self.background || self.depends_on_bottoms(leaf)) {
                    self.work.mark(leaf, self.step);
                }
            }
        }
        let mut moved = std::mem::take(&mut self.work.moved);
        for leaf in moved.drain(..) {
            let movement = std::mem::take(&mut self.work.movement[leaf as usize]);
            let key = self.tournament.key(leaf);
            if key != OUT && self.work.dirty_stamps[leaf as usize] != self.step {
                self.tournament.set(leaf, (key.0.saturating_sub(movement), u64::from(leaf)));
            }
        }
        self.work.moved = moved;
        let mut dirty = std::mem::take(&mut self.work.dirty);
        for leaf in dirty.drain(..) {
            if self.tournament.key(leaf) != OUT {
                self.tournament.set(leaf, self.key(areas, leaf));
            }
        }
        self.work.dirty = dirty;
    }

    /// Updates the tie-breaks of leaves with exact errors that are now second in more or fewer
    /// pixels.
    fn refresh_tie_breaks(&mut self, areas: &Areas, changes: &[&[Change]]) {
        for leaf in changes.iter().copied().flatten().flat_map(|change| [change.from[1], change.to[1]]) {
            if (leaf as usize) < areas.leaves {
                let key = self.tournament.key(leaf);
                if key != OUT && key.1 & EXACT != 0 {
                    self.tournament.set(leaf, (key.0, EXACT | tie_break(areas, leaf)));
                }
            }
        }
    }
}

impl Criterion for Vmi {
    fn choose(&mut self, areas: &Areas) -> Option<Choice> {
        let leaf = self.least(areas)?;
        let error = self.error_bits(areas, self.tournament.key(leaf).0);
        Some(Choice { leaf, error })
    }

    fn retire(&mut self, leaf: u32) {
        self.tournament.set(leaf, OUT);
    }

    fn absorb(&mut self, areas: &mut Areas, changes: &[&[Change]], pruned: u32) {
        self.step += 1;
        self.tournament.set(pruned, OUT);
        self.retire_exact();
        for (view, changes) in changes.iter().enumerate() {
            for change in *changes {
                areas.collect(view, change);
                self.count_pair(areas, view, change.from, -(change.count as i32));
                self.count_pair(areas, view, change.to, change.count as i32);
            }
        }
        let mut new_row = std::mem::take(&mut self.work.new_row);
        let epoch_holds = self.advance_drifts(areas, &mut new_row);
        for i in 0..areas.pending() {
            let row = areas.pending_row(i);
            if row == areas.background() {
                continue;
            }
            let new_total = areas.pending_areas(i, &mut new_row);
            self.add_own(row, areas.row(row), areas.total(row), -1);
            self.add_own(row, &new_row, new_total, 1);
            if row < areas.leaves {
                self.work.mark(row as u32, self.step);
                self.move_row(areas, row, &new_row, new_total);
            }
        }
        self.work.new_row = new_row;
        areas.commit();
        let mut touched_pairs = std::mem::take(&mut self.work.touched_pairs);
        for pair in touched_pairs.drain(..) {
            if self.pairs.get(pair).0.total == 0 {
                self.pairs.remove(pair);
            } else {
                self.add_pair(areas, pair, 1);
            }
        }
        self.work.touched_pairs = touched_pairs;
        self.refresh_keys(areas, epoch_holds);
        self.refresh_tie_breaks(areas, changes);
    }
}
