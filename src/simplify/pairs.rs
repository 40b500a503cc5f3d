//! Pairs of leaves, one directly behind the other: the pixels that each leaf would uncover if it
//! were pruned.

use super::{
    areas::{Row, views_of},
    views::MAX_VIEWS,
};

/// A leaf and the leaf directly behind it in some pixels. Stored in the list of the leaf behind,
/// the second one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pair {
    /// Leaf in front.
    pub front: u32,
    /// Number of pixels over all views.
    pub total: u32,
    /// Bit v is set if view v has such pixels.
    pub seen: u32,
    /// Last step that changed the counts; for the owner's use.
    pub stamp: u32,
    /// Index of the pair.
    pub number: u32,
}

/// Position of a pair in the lists of both leaves.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    front: u32,
    second: u32,
    in_front: u32,
    in_second: u32,
    /// Index of the pair's block of counts, or [`NO_COUNTS`].
    counts: u32,
}

/// A pair that occurs in a single view has no counts, since its total says it all.
const NO_COUNTS: u32 = u32::MAX;

/// All pairs that occur, indexed from both sides.
#[derive(Debug)]
pub struct Pairs {
    places: Vec<Place>,
    free: Vec<u32>,
    /// Pixels by view of pairs that occur in several views.
    counts: Vec<Row>,
    free_counts: Vec<u32>,
    /// For each front leaf, its (second, number) entries.
    of_front: Vec<Vec<(u32, u32)>>,
    /// For each second leaf, its pairs, so that the data that a step reads of most pairs is
    /// contiguous.
    of_second: Vec<Vec<Pair>>,
}

impl Pair {
    /// Views in which the pair occurs.
    pub fn seen_views(&self) -> impl Iterator<Item = usize> + use<> {
        views_of(self.seen)
    }
}

impl Pairs {
    /// Creates an empty set of pairs with fronts below `fronts` and seconds below `seconds`.
    pub fn new(fronts: usize, seconds: usize) -> Self {
        Self {
            places: Vec::new(),
            free: Vec::new(),
            counts: Vec::new(),
            free_counts: Vec::new(),
            of_front: vec![Vec::new(); fronts],
            of_second: vec![Vec::new(); seconds],
        }
    }

    /// Returns a pair and its second leaf.
    pub fn get(&self, number: u32) -> (&Pair, u32) {
        let Place { second, in_second, .. } = self.places[number as usize];
        (&self.of_second[second as usize][in_second as usize], second)
    }

    /// Number of pixels of view `view`, one of [`Pair::seen_views`], in which `pair` occurs.
    pub fn count(&self, pair: &Pair, view: usize) -> u32 {
        match self.places[pair.number as usize].counts {
            NO_COUNTS => pair.total,
            block => self.counts[block as usize][view],
        }
    }

    /// Pairs whose second leaf is `second`.
    pub fn behind_others(&self, second: u32) -> &[Pair] {
        &self.of_second[second as usize]
    }

    /// Marks a pair as changed by step `stamp`. Returns true if it was not marked yet.
    pub fn stamp(&mut self, number: u32, stamp: u32) -> bool {
        std::mem::replace(&mut self.record(number).stamp, stamp) != stamp
    }

    fn record(&mut self, number: u32) -> &mut Pair {
        let Place { second, in_second, .. } = self.places[number as usize];
        &mut self.of_second[second as usize][in_second as usize]
    }

    /// Returns the pair of two leaves, creating it if it does not exist.
    pub fn find_or_insert(&mut self, front: u32, second: u32) -> u32 {
        if let Some(&(_, number)) = self.of_front[front as usize].iter().find(|entry| entry.0 == second) {
            return number;
        }
        let number = self.free.pop().unwrap_or_else(|| {
            self.places.push(Place::default());
            self.places.len() as u32 - 1
        });
        let (of_front, of_second) = (&mut self.of_front[front as usize], &mut self.of_second[second as usize]);
        self.places[number as usize] = Place {
            front,
            second,
            in_front: of_front.len() as u32,
            in_second: of_second.len() as u32,
            counts: NO_COUNTS,
        };
        of_front.push((second, number));
        of_second.push(Pair { front, number, ..Pair::default() });
        number
    }

    /// Adds `delta` to the pair's pixels in view `view`.
    pub fn add(&mut self, number: u32, view: usize, delta: i32) {
        let Place { second, in_second, counts, .. } = self.places[number as usize];
        let record = &mut self.of_second[second as usize][in_second as usize];
        let before = (record.seen, record.total);
        record.total = record.total.wrapping_add_signed(delta);
        let bit = 1 << view;
        if counts == NO_COUNTS && record.seen & !bit == 0 {
            record.seen = if record.total > 0 { bit } else { 0 };
            return;
        }
        let block = if counts == NO_COUNTS { self.new_counts(number, before) } else { counts };
        let count = &mut self.counts[block as usize][view];
        *count = count.wrapping_add_signed(delta);
        let occurs = *count > 0;
        let record = self.record(number);
        record.seen = if occurs { record.seen | bit } else { record.seen & !bit };
        if record.seen & record.seen.wrapping_sub(1) == 0 {
            self.free_counts.push(block);
            self.places[number as usize].counts = NO_COUNTS;
        }
    }

    /// Gives a pair a block of counts, with what it had in its single view.
    fn new_counts(&mut self, number: u32, (seen, total): (u32, u32)) -> u32 {
        let block = self.free_counts.pop().unwrap_or_else(|| {
            self.counts.push([0; MAX_VIEWS]);
            self.counts.len() as u32 - 1
        });
        self.counts[block as usize] = [0; MAX_VIEWS];
        self.counts[block as usize][seen.trailing_zeros() as usize] = total;
        self.places[number as usize].counts = block;
        block
    }

    /// Removes a pair that no longer occurs.
    pub fn remove(&mut self, number: u32) {
        let Place { front, second, in_front, in_second, .. } = self.places[number as usize];
        let row = &mut self.of_front[front as usize];
        row.swap_remove(in_front as usize);
        if let Some(&(_, moved)) = row.get(in_front as usize) {
            self.places[moved as usize].in_front = in_front;
        }
        let row = &mut self.of_second[second as usize];
        row.swap_remove(in_second as usize);
        if let Some(moved) = row.get(in_second as usize) {
            self.places[moved.number as usize].in_second = in_second;
        }
        self.free.push(number);
    }
}
