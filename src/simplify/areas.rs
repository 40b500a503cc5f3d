//! Visible areas: the number of pixels of each view in which each polygon is frontmost.

use super::{change::Change, outline::beyond, views::MAX_VIEWS};

/// Areas a_z(v) of the leaves, the background and the wood, and the number of pixels in which each
/// is directly behind the frontmost polygon.
///
/// Row z is leaf z for z below [`leaves`](Self::leaves), followed by the background and the wood.
#[derive(Debug, Clone)]
pub struct Areas {
    /// Number of leaves.
    pub leaves: usize,
    /// Number of views.
    pub views: usize,
    /// a_z(v), in pixels.
    areas: Vec<Row>,
    /// A_z, the sum of row z.
    totals: Vec<u32>,
    /// For each row, the number of pixels over all views in which it is directly behind the
    /// frontmost polygon.
    seconds: Vec<u32>,
    /// Number of covered pixels over all views beyond the crown's outline.
    beyond: i64,
    pending: Pending,
}

/// Areas of one row, one per view, in pixels. Entries beyond the last view are 0.
pub type Row = [u32; MAX_VIEWS];

/// Changes that are collected but not committed yet.
#[derive(Debug, Clone)]
struct Pending {
    /// Rows whose areas change, each once.
    rows: Vec<u32>,
    /// For each row, its index in `rows` plus one, or 0 if it is not there.
    places: Vec<u32>,
    /// Area changes by view, for each entry of `rows`.
    deltas: Vec<[i32; MAX_VIEWS]>,
}

impl Areas {
    /// Creates areas with no pixel counted yet.
    pub fn new(leaves: usize, views: usize) -> Self {
        let rows = leaves + 2;
        Self {
            leaves,
            views,
            areas: vec![[0; MAX_VIEWS]; rows],
            totals: vec![0; rows],
            seconds: vec![0; rows],
            beyond: 0,
            pending: Pending { rows: Vec::new(), places: vec![0; rows], deltas: Vec::new() },
        }
    }

    /// Row of the background.
    pub fn background(&self) -> usize {
        self.leaves
    }

    /// Row of the wood.
    pub fn wood(&self) -> usize {
        self.leaves + 1
    }

    /// Areas of one row.
    pub fn row(&self, row: usize) -> &Row {
        &self.areas[row]
    }

    /// Sum of one row over all views, in pixels.
    pub fn total(&self, row: usize) -> u32 {
        self.totals[row]
    }

    /// Number of pixels, over all views, in which a leaf is directly behind the frontmost polygon.
    pub fn seconds(&self, leaf: usize) -> u32 {
        self.seconds[leaf]
    }

    /// Number of covered pixels, over all views, beyond the crown's [outline](super::outline); 0 if
    /// the views keep no references.
    pub fn beyond(&self) -> i64 {
        self.beyond
    }

    /// Counts `count` pixels that are covered by `front`, or uncovered if negative.
    pub fn count_beyond(&mut self, reference: u32, front: u32, count: i64) {
        let background = self.background() as u32;
        if reference == beyond(background) && front != background {
            self.beyond += count;
        }
    }

    /// Counts a pixel of view `view`, to build the initial areas.
    pub fn count(&mut self, view: usize, [front, second]: [u32; 2]) {
        self.areas[front as usize][view] += 1;
        self.totals[front as usize] += 1;
        self.seconds[second as usize] += 1;
    }

    /// Collects a change in view `view`. Areas stay the same until [`commit`](Self::commit); the
    /// counts of [`seconds`](Self::seconds) and [`beyond`](Self::beyond) change at once.
    pub fn collect(&mut self, view: usize, change: &Change) {
        self.seconds[change.from[1] as usize] -= change.count;
        self.seconds[change.to[1] as usize] += change.count;
        if change.from[0] != change.to[0] {
            self.pending.add(change.from[0], view, -(change.count as i32));
            self.pending.add(change.to[0], view, change.count as i32);
            self.count_beyond(change.reference, change.from[0], -i64::from(change.count));
            self.count_beyond(change.reference, change.to[0], change.count.into());
        }
    }

    /// Number of rows that wait for [`commit`](Self::commit).
    pub fn pending(&self) -> usize {
        self.pending.rows.len()
    }

    /// Index of the `i`-th waiting row.
    pub fn pending_row(&self, i: usize) -> usize {
        self.pending.rows[i] as usize
    }

    /// Returns the areas that the `i`-th waiting row will have, and their sum.
    pub fn pending_areas(&self, i: usize) -> (Row, u32) {
        let (old, deltas) = (self.row(self.pending_row(i)), &self.pending.deltas[i]);
        let new = std::array::from_fn(|view| old[view].wrapping_add_signed(deltas[view]));
        (new, new.iter().sum())
    }

    /// Applies the collected changes.
    pub fn commit(&mut self) {
        for i in 0..self.pending() {
            let row = self.pending_row(i);
            let (new, total) = self.pending_areas(i);
            (self.areas[row], self.totals[row]) = (new, total);
            self.pending.places[row] = 0;
        }
        self.pending.rows.clear();
        self.pending.deltas.clear();
    }
}

impl Pending {
    fn add(&mut self, row: u32, view: usize, delta: i32) {
        let place = &mut self.places[row as usize];
        if *place == 0 {
            self.rows.push(row);
            self.deltas.push([0; MAX_VIEWS]);
            *place = self.rows.len() as u32;
        }
        self.deltas[*place as usize - 1][view] += delta;
    }
}
