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
    /// For each row, bit v is set if the row is visible in view v.
    seen: Vec<u32>,
    /// For each row, the number of pixels over all views in which it is directly behind the
    /// frontmost polygon.
    seconds: Vec<u32>,
    /// Number of covered pixels over all views beyond the crown's outline.
    beyond: i64,
    before: Before,
}

/// Areas of one row, one per view, in pixels. Entries beyond the last view are 0.
pub type Row = [u32; MAX_VIEWS];

/// One row at one time.
#[derive(Debug, Clone, Copy)]
pub struct Sums {
    /// Areas.
    pub row: Row,
    /// Their sum.
    pub total: u32,
    /// Bit v is set if the area in view v is not 0.
    pub seen: u32,
}

/// Rows as they were before a step.
#[derive(Debug, Clone)]
struct Before {
    /// Rows whose areas the step changed, each once.
    rows: Vec<u32>,
    /// For each row, its index in `rows` plus one, or 0 if it is not there.
    places: Vec<u32>,
    /// What each entry of `rows` was.
    areas: Vec<Sums>,
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
            seen: vec![0; rows],
            seconds: vec![0; rows],
            beyond: 0,
            before: Before { rows: Vec::new(), places: vec![0; rows], areas: Vec::new() },
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
        self.seen[front as usize] |= 1 << view;
        self.seconds[second as usize] += 1;
    }

    /// Begins a step: what the areas are now is what they were [before](Self::before).
    pub fn begin_step(&mut self) {
        self.before.rows.drain(..).for_each(|row| self.before.places[row as usize] = 0);
        self.before.areas.clear();
    }

    /// Applies a change in view `view`.
    pub fn apply(&mut self, view: usize, change: &Change) {
        self.seconds[change.from[1] as usize] -= change.count;
        self.seconds[change.to[1] as usize] += change.count;
        if change.from[0] != change.to[0] {
            self.add(change.from[0], view, -(change.count as i32));
            self.add(change.to[0], view, change.count as i32);
            self.count_beyond(change.reference, change.from[0], -i64::from(change.count));
            self.count_beyond(change.reference, change.to[0], change.count.into());
        }
    }

    fn add(&mut self, row: u32, view: usize, delta: i32) {
        let at = row as usize;
        let place = &mut self.before.places[at];
        if *place == 0 {
            self.before.rows.push(row);
            self.before.areas.push(Sums { row: self.areas[at], total: self.totals[at], seen: self.seen[at] });
            *place = self.before.rows.len() as u32;
        }
        self.areas[at][view] = self.areas[at][view].wrapping_add_signed(delta);
        self.totals[at] = self.totals[at].wrapping_add_signed(delta);
        let is_seen = u32::from(self.areas[at][view] > 0);
        self.seen[at] = self.seen[at] & !(1 << view) | is_seen << view;
    }

    /// Rows whose areas the step changed.
    pub fn changed(&self) -> impl Iterator<Item = usize> {
        self.before.rows.iter().map(|&row| row as usize)
    }

    /// A row before the step.
    pub fn before(&self, row: usize) -> Sums {
        match self.before.places[row] {
            0 => self.now(row),
            place => self.before.areas[place as usize - 1],
        }
    }

    /// A row as it is now.
    pub fn now(&self, row: usize) -> Sums {
        Sums { row: self.areas[row], total: self.totals[row], seen: self.seen[row] }
    }
}

/// Indices of the bits that are set, such as views.
pub fn set_bits(bits: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut bits = bits.into();
    std::iter::from_fn(move || {
        let index = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (index < u64::BITS).then_some(index as usize)
    })
}
