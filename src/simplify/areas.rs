//! Visible areas: the number of pixels of each view in which each polygon is frontmost.

use super::{change::Change, outline::beyond};

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
    /// a_z(v) at index `z * views + v`, in pixels.
    areas: Vec<u32>,
    /// A_z, the sum of row z.
    totals: Vec<u32>,
    /// For each row, the number of pixels over all views in which it is directly behind the
    /// frontmost polygon.
    seconds: Vec<u32>,
    /// Number of covered pixels over all views beyond the crown's outline.
    beyond: i64,
    pending: Pending,
}

/// Changes that are collected but not committed yet.
#[derive(Debug, Clone)]
struct Pending {
    /// Rows whose areas change, each once.
    rows: Vec<u32>,
    /// For each row, its index in `rows` plus one, or 0 if it is not there.
    places: Vec<u32>,
    /// Area changes by view, `views` numbers for each entry of `rows`.
    deltas: Vec<i32>,
}

impl Areas {
    /// Creates areas with no pixel counted yet.
    pub fn new(leaves: usize, views: usize) -> Self {
        let rows = leaves + 2;
        Self {
            leaves,
            views,
            areas: vec![0; rows * views],
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

    /// Areas of one row, one per view, in pixels.
    pub fn row(&self, row: usize) -> &[u32] {
        &self.areas[row * self.views..][..self.views]
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
        self.areas[front as usize * self.views + view] += 1;
        self.totals[front as usize] += 1;
        self.seconds[second as usize] += 1;
    }

    /// Collects a change in view `view`. Areas stay the same until [`commit`](Self::commit); the
    /// counts of [`seconds`](Self::seconds) and [`beyond`](Self::beyond) change at once.
    pub fn collect(&mut self, view: usize, change: &Change) {
        self.seconds[change.from[1] as usize] -= change.count;
        self.seconds[change.to[1] as usize] += change.count;
        if change.from[0] != change.to[0] {
            self.pending.add(change.from[0], view, self.views, -(change.count as i32));
            self.pending.add(change.to[0], view, self.views, change.count as i32);
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

    /// Writes the areas that the `i`-th waiting row will have to `new` and returns their sum.
    pub fn pending_areas(&self, i: usize, new: &mut [u32]) -> u32 {
        let deltas = &self.pending.deltas[i * self.views..][..self.views];
        let old = self.row(self.pending_row(i));
        new.iter_mut()
            .zip(old)
            .zip(deltas)
            .map(|((new, old), delta)| {
                *new = old.wrapping_add_signed(*delta);
                *new
            })
            .sum()
    }

    /// Applies the collected changes.
    pub fn commit(&mut self) {
        for (i, &row) in self.pending.rows.iter().enumerate() {
            let row = row as usize;
            let deltas = &self.pending.deltas[i * self.views..][..self.views];
            for (area, &delta) in self.areas[row * self.views..].iter_mut().zip(deltas) {
                *area = area.wrapping_add_signed(delta);
            }
            self.totals[row] = self.totals[row].wrapping_add_signed(deltas.iter().sum());
            self.pending.places[row] = 0;
        }
        self.pending.rows.clear();
        self.pending.deltas.clear();
    }
}

impl Pending {
    fn add(&mut self, row: u32, view: usize, views: usize, delta: i32) {
        let place = &mut self.places[row as usize];
        if *place == 0 {
            self.rows.push(row);
            self.deltas.resize(self.rows.len() * views, 0);
            *place = self.rows.len() as u32;
        }
        self.deltas[(*place as usize - 1) * views + view] += delta;
    }
}
