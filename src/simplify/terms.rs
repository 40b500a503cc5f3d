//! Terms of the viewpoint mutual information, kept up to date for all leaves.
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
//! leaf's exact error is needed; [`ranking`](super::ranking) decides when it is. All errors are
//! integers, equal to a computation from scratch bit for bit.

use super::{
    areas::{Areas, Row, Sums, set_bits},
    change::Change,
    information::FixedLog,
    pairs::{Pairs, Place},
    ranking::BOTTOMS,
    views::MAX_VIEWS,
};
use std::{hint::black_box, sync::Arc};

/// One of several equal shares of the leaves.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    number: u32,
    /// There are two to this power.
    bits: u32,
}

impl Share {
    /// Divides the leaves into two to the power of `bits` shares.
    pub fn all(bits: u32) -> impl Iterator<Item = Self> {
        (0..1 << bits).map(move |number| Self { number, bits })
    }

    /// Whether a leaf belongs to the share.
    pub fn has(self, leaf: u32) -> bool {
        leaf & ((1 << self.bits) - 1) == self.number
    }

    /// Place of one of its leaves within the share.
    pub fn place(self, leaf: u32) -> u32 {
        leaf >> self.bits
    }

    /// Leaf at a place within the share.
    pub fn leaf(self, place: u32) -> u32 {
        place << self.bits | self.number
    }

    /// Number of its leaves if there are `leaves` in all.
    pub fn count(self, leaves: usize) -> usize {
        (leaves + (1 << self.bits) - 1 - self.number as usize) >> self.bits
    }
}

/// What a step did to the errors of a share's leaves, which are named by their places in it.
#[derive(Default)]
pub struct Moves {
    /// Leaves whose errors must be computed again, each once.
    pub marked: Vec<u32>,
    /// For each leaf, the step that last marked it.
    stamps: Vec<u32>,
    step: u32,
    /// Leaves whose errors moved by at most `movement`; a leaf may be marked as well.
    pub moved: Vec<u32>,
    movement: Vec<i64>,
}

impl Moves {
    /// Marks a leaf.
    pub fn mark(&mut self, leaf: u32) {
        if std::mem::replace(&mut self.stamps[leaf as usize], self.step) != self.step {
            self.marked.push(leaf);
        }
    }

    /// Whether a leaf is marked.
    pub fn has_marked(&self, leaf: u32) -> bool {
        self.stamps[leaf as usize] == self.step
    }

    /// Returns how far a leaf's error moved at most, and sets it to 0.
    pub fn take_movement(&mut self, leaf: u32) -> i64 {
        std::mem::take(&mut self.movement[leaf as usize])
    }

    fn add_movement(&mut self, leaf: u32, movement: i64) {
        let sum = &mut self.movement[leaf as usize];
        if *sum == 0 && movement > 0 {
            self.moved.push(leaf);
        }
        *sum += movement;
    }
}

/// Number of pairs that are found again without a search.
const RECENT: usize = 256;

/// A pair whose counts a step changed.
#[derive(Debug, Clone, Copy, Default)]
struct Recent {
    pair: [u32; 2],
    /// The step; none is 0.
    step: u32,
    at: Place,
}

impl Recent {
    fn index([front, second]: [u32; 2]) -> usize {
        (front ^ second.wrapping_mul(31)) as usize % RECENT
    }
}

/// F of every view, and how pruning each leaf of a share would change it.
pub struct Terms {
    share: Share,
    log: Arc<FixedLog>,
    background: bool,
    /// Number of pixels of all views.
    pixels: u64,
    pairs: Pairs,
    /// Change of F(v) when leaf x is pruned, without the terms of background and wood.
    local: Vec<[i64; MAX_VIEWS]>,
    /// F(v) of the current state, without the background's row; only if the background does not
    /// count.
    f: [i64; MAX_VIEWS],
    /// Pixels of background and wood that leaf x would uncover in each view.
    uncovered: [Vec<Row>; BOTTOMS],
    uncovered_totals: [Vec<u32>; BOTTOMS],
    /// Pairs whose counts changed in this step; their terms are left out until it ends.
    touched_pairs: Vec<Place>,
    /// Some of these, each at the index that its leaves give.
    recent: Vec<Recent>,
    /// What this step did so far.
    pub moves: Moves,
}

impl Terms {
    /// Creates the terms of a share of the leaves in freshly counted `areas`. `pixels` is the
    /// number of pixels of all views; `fronts` yields the view and the (front, second) pair of each
    /// pixel.
    pub fn new(
        share: Share,
        areas: &Areas,
        pixels: u64,
        background: bool,
        fronts: impl Iterator<Item = (usize, [u32; 2])>,
        log: Arc<FixedLog>,
    ) -> Self {
        let leaves = share.count(areas.leaves);
        let mut terms = Self {
            share,
            log,
            background,
            pixels,
            pairs: Pairs::new(leaves, areas.leaves),
            local: vec![[0; MAX_VIEWS]; leaves],
            f: [0; MAX_VIEWS],
            uncovered: [vec![[0; MAX_VIEWS]; leaves], vec![[0; MAX_VIEWS]; leaves]],
            uncovered_totals: [vec![0; leaves], vec![0; leaves]],
            touched_pairs: Vec::new(),
            recent: vec![Recent::default(); RECENT],
            moves: Moves { stamps: vec![0; leaves], movement: vec![0; leaves], step: 1, ..Moves::default() },
        };
        for (view, pair) in fronts {
            terms.count_pair(areas, view, pair, 1);
        }
        for row in (0..areas.leaves).chain([areas.wood()]) {
            terms.add_own(areas.leaves, row, &areas.now(row), 1);
        }
        terms.add_touched_pairs(areas);
        terms.moves.marked.clear();
        terms
    }

    /// Adds `sign` times a row's own term to F, and subtracts it from the change that pruning the
    /// row's leaf causes.
    fn add_own(&mut self, leaves: usize, row: usize, Sums { row: row_areas, total, seen }: &Sums, sign: i64) {
        let is_own = row < leaves && self.share.has(row as u32);
        if self.background && !is_own {
            return;
        }
        let log_total = self.log.log2(*total);
        for view in set_bits(*seen) {
            let term = sign * i64::from(row_areas[view]) * (self.log.log2(row_areas[view]) - log_total);
            self.f[view] += term;
            if is_own {
                self.local[self.share.place(row as u32) as usize][view] -= term;
            }
        }
    }

    /// Adds `sign` times the pair's contribution to the change of its front leaf.
    fn add_pair(&mut self, at: Place, Sums { row, total, seen }: &Sums, sign: i64) {
        let pair = self.pairs.get(at);
        let local = &mut self.local[pair.front as usize];
        let log_after = self.log.log2(total + pair.total);
        let log_change = sign * (self.log.log2(*total) - log_after);
        for view in set_bits(*seen) {
            local[view] += i64::from(row[view]) * log_change;
        }
        for view in pair.seen_views() {
            local[view] += sign * self.log.handed_over(row[view], self.pairs.count(pair, view), log_after);
        }
    }

    /// Adds the terms of the touched pairs, or removes the pairs that no longer occur.
    fn add_touched_pairs(&mut self, areas: &Areas) {
        let mut gone = std::mem::take(&mut self.touched_pairs);
        gone.retain(|&at| {
            let occurs = self.pairs.get(at).total > 0;
            if occurs {
                self.add_pair(at, &areas.now(at.second as usize), 1);
            }
            !occurs
        });
        self.pairs.remove(&mut gone);
        self.touched_pairs = gone;
    }

    /// Applies a step that changed `areas` and pruned a leaf, whose own pairs no longer matter.
    pub fn absorb(&mut self, areas: &Areas, changes: &[&[Change]], pruned: u32) {
        self.moves.step += 1;
        if self.share.has(pruned) {
            self.pairs.remove_of_front(self.share.place(pruned));
        }
        for (view, changes) in changes.iter().enumerate() {
            for change in *changes {
                if change.from[0] != pruned {
                    self.count_pair(areas, view, change.from, -(change.count as i32));
                }
                self.count_pair(areas, view, change.to, change.count as i32);
            }
        }
        for row in areas.changed().filter(|&row| row != areas.background()) {
            let (before, after) = (areas.before(row), areas.now(row));
            self.add_own(areas.leaves, row, &before, -1);
            self.add_own(areas.leaves, row, &after, 1);
            if row < areas.leaves {
                if self.share.has(row as u32) {
                    self.moves.mark(self.share.place(row as u32));
                }
                self.move_row(row as u32, &before, &after);
            }
        }
        self.add_touched_pairs(areas);
    }

    /// Adds `delta` to the pixels of one view in which `second` is directly behind `front`.
    fn count_pair(&mut self, areas: &Areas, view: usize, [front, second]: [u32; 2], delta: i32) {
        if front as usize >= areas.leaves || !self.share.has(front) {
            return;
        }
        let front = self.share.place(front);
        let recent = self.recent[Recent::index([front, second])];
        if recent.pair == [front, second] && recent.step == self.moves.step {
            return self.pairs.add(recent.at, view, delta);
        }
        self.moves.mark(front);
        match (second as usize).checked_sub(areas.leaves) {
            Some(bottom) => {
                let count = &mut self.uncovered[bottom][front as usize][view];
                *count = count.wrapping_add_signed(delta);
                let total = &mut self.uncovered_totals[bottom][front as usize];
                *total = total.wrapping_add_signed(delta);
            }
            None => {
                let (pair, step) = ([front, second], self.moves.step);
                let at = self.pairs.find_or_insert(front, second);
                if self.pairs.stamp(at, step) {
                    self.add_pair(at, &areas.before(second as usize), -1);
                    self.touched_pairs.push(at);
                }
                self.pairs.add(at, view, delta);
                self.recent[Recent::index(pair)] = Recent { pair, step, at };
            }
        }
    }

    /// Corrects every pair whose second leaf is the one whose row changes, unless the pair's own
    /// counts change too. Records an upper bound on how far that moves the errors of the
    /// front leaves.
    fn move_row(&mut self, second: u32, old: &Sums, new: &Sums) {
        let log_before = [old.total, new.total].map(|total| self.log.log2(total));
        let pairs = self.pairs.behind_others(second);
        // Rows come into the cache side by side instead of one after another.
        let parts = pairs.iter().map(|pair| &self.local[pair.front as usize]).map(|row| row[0] ^ row[8] ^ row[16]);
        black_box(parts.fold(0, |all, part| all ^ part));
        for pair in pairs {
            if pair.stamp == self.moves.step {
                continue;
            }
            let local = &mut self.local[pair.front as usize];
            let log_after = [old.total, new.total].map(|total| self.log.log2(total + pair.total));
            let log_change = [log_before[0] - log_after[0], log_before[1] - log_after[1]];
            let mut movement = 0;
            for view in set_bits(old.seen | new.seen) {
                let change = i64::from(new.row[view]) * log_change[1] - i64::from(old.row[view]) * log_change[0];
                local[view] += change;
                movement += change.abs();
            }
            for view in pair.seen_views() {
                let handed = self.pairs.count(pair, view);
                let change = self.log.handed_over(new.row[view], handed, log_after[1])
                    - self.log.handed_over(old.row[view], handed, log_after[0]);
                local[view] += change;
                movement += change.abs();
            }
            self.moves.add_movement(pair.front, movement);
        }
    }

    /// Number of pixels of each bottom that pruning a leaf would uncover, where they count.
    pub fn uncovered(&self, place: u32) -> [u32; BOTTOMS] {
        let [background, wood] = [0, 1].map(|bottom| self.uncovered_totals[bottom][place as usize]);
        if self.background { [background, wood] } else { [0; BOTTOMS] }
    }

    /// Change of F(v) in every view when a leaf is pruned, without the background's term if the
    /// background does not count.
    fn f_changes(&self, areas: &Areas, place: u32) -> [i64; MAX_VIEWS] {
        let mut changes = self.local[place as usize];
        for bottom in 0..BOTTOMS {
            let uncovered_total = self.uncovered_totals[bottom][place as usize];
            if uncovered_total == 0 || (bottom == 0 && !self.background) {
                continue;
            }
            let row = areas.row(areas.leaves + bottom);
            let total = areas.total(areas.leaves + bottom);
            let log_after = self.log.log2(total + uncovered_total);
            let log_change = self.log.log2(total) - log_after;
            for ((change, &area), &uncovered) in
                changes.iter_mut().zip(row).zip(&self.uncovered[bottom][place as usize])
            {
                *change += i64::from(area) * log_change;
                if uncovered > 0 {
                    *change += self.log.handed_over(area, uncovered, log_after);
                }
            }
        }
        changes
    }

    /// Exact error of pruning a leaf, in fixed point. With the background, it is multiplied by the
    /// number of pixels of a view.
    pub fn error(&self, areas: &Areas, place: u32) -> i64 {
        let changes = self.f_changes(areas, place);
        if self.background {
            return changes.iter().map(|change| change.abs()).sum();
        }
        let pixels_per_view = (self.pixels / areas.views as u64) as u32;
        let background = areas.background();
        let total = self.pixels as u32 - areas.total(background);
        let uncovered_total = self.uncovered_totals[0][place as usize];
        let log_total = [total, total - uncovered_total].map(|total| self.log.log2(total));
        let information = |f: i64, covered: u32, log_total: i64| match covered {
            0 => 0,
            _ => f.div_euclid(i64::from(covered)) + log_total - self.log.log2(covered),
        };
        (0..areas.views)
            .map(|view| {
                let covered = pixels_per_view - areas.row(background)[view];
                let uncovered = self.uncovered[0][place as usize][view];
                let before = information(self.f[view], covered, log_total[0]);
                let after = information(self.f[view] + changes[view], covered - uncovered, log_total[1]);
                (after - before).abs()
            })
            .sum()
    }

    /// Converts an [`error`](Self::error) to bits of information.
    pub fn error_bits(&self, areas: &Areas, error: i64) -> f64 {
        let scale = if self.background { self.pixels as f64 / areas.views as f64 } else { 1.0 };
        self.log.to_bits(error) / scale
    }

    /// Units of an [`error`](Self::error) that are one bit times one pixel.
    pub fn unit(&self) -> f64 {
        (1_u64 << self.log.fraction_bits()) as f64
    }
}
