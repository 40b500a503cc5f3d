//! Pairs of leaves, one directly behind the other: the pixels that each leaf would uncover if it
//! were pruned.

use super::{
    areas::{Row, set_bits},
    views::MAX_VIEWS,
};

/// A leaf and the leaf directly behind it in some pixels. Stored in the list of the leaf behind,
/// the second one, so that the data that a step reads of most pairs is contiguous.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Leaf in front.
    pub front: u32,
    /// Number of pixels over all views.
    pub total: u32,
    /// Bit v is set if view v has such pixels.
    pub seen: u32,
    /// Last step that changed the counts; for the owner's use.
    pub stamp: u32,
    /// Index of the pair in the list of the leaf in front.
    in_front: u32,
    /// Index of the pair's block of counts, or [`NO_COUNTS`].
    counts: u32,
}

/// Where a pair is stored. Valid until a pair is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Place {
    /// Leaf behind.
    pub second: u32,
    /// Index in its list.
    index: u32,
}

/// A pair that occurs in a single view has no counts, since its total says it all.
const NO_COUNTS: u32 = u32::MAX;

/// All pairs that occur, indexed from both sides.
#[derive(Debug)]
pub struct Pairs {
    /// Pixels by view of pairs that occur in several views.
    counts: Vec<Row>,
    free_counts: Vec<u32>,
    of_front: Vec<Vec<Place>>,
    of_second: Vec<Vec<Pair>>,
}

impl Pair {
    /// Views in which the pair occurs.
    pub fn seen_views(&self) -> impl Iterator<Item = usize> + use<> {
        set_bits(self.seen)
    }
}

impl Pairs {
    /// Creates an empty set of pairs with fronts below `fronts` and seconds below `seconds`.
    pub fn new(fronts: usize, seconds: usize) -> Self {
        Self {
            counts: Vec::new(),
            free_counts: Vec::new(),
            of_front: vec![Vec::new(); fronts],
            of_second: vec![Vec::new(); seconds],
        }
    }

    /// Returns a pair.
    pub fn get(&self, at: Place) -> &Pair {
        &self.of_second[at.second as usize][at.index as usize]
    }

    fn get_mut(&mut self, at: Place) -> &mut Pair {
        &mut self.of_second[at.second as usize][at.index as usize]
    }

    /// Number of pixels of view `view`, one of [`Pair::seen_views`], in which `pair` occurs.
    pub fn count(&self, pair: &Pair, view: usize) -> u32 {
        match pair.counts {
            NO_COUNTS => pair.total,
            block => self.counts[block as usize][view],
        }
    }

    /// Pairs whose second leaf is `second`.
    pub fn behind_others(&self, second: u32) -> &[Pair] {
        &self.of_second[second as usize]
    }

    /// Marks a pair as changed by step `stamp`. Returns true if it was not marked yet.
    pub fn stamp(&mut self, at: Place, stamp: u32) -> bool {
        std::mem::replace(&mut self.get_mut(at).stamp, stamp) != stamp
    }

    /// Returns the place of the pair of two leaves, creating it if it does not exist.
    pub fn find_or_insert(&mut self, front: u32, second: u32) -> Place {
        let of_front = &mut self.of_front[front as usize];
        if let Some(&place) = of_front.iter().find(|place| place.second == second) {
            return place;
        }
        let of_second = &mut self.of_second[second as usize];
        let place = Place { second, index: of_second.len() as u32 };
        let in_front = of_front.len() as u32;
        of_front.push(place);
        of_second.push(Pair { front, total: 0, seen: 0, stamp: 0, in_front, counts: NO_COUNTS });
        place
    }

    /// Adds `delta` to the pair's pixels in view `view`.
    pub fn add(&mut self, at: Place, view: usize, delta: i32) {
        let pair = &mut self.of_second[at.second as usize][at.index as usize];
        let before = (pair.seen, pair.total);
        pair.total = pair.total.wrapping_add_signed(delta);
        let bit = 1 << view;
        if pair.counts == NO_COUNTS {
            if pair.seen & !bit == 0 {
                pair.seen = if pair.total > 0 { bit } else { 0 };
                return;
            }
            pair.counts = new_counts(&mut self.counts, &mut self.free_counts, before);
        }
        let count = &mut self.counts[pair.counts as usize][view];
        *count = count.wrapping_add_signed(delta);
        pair.seen = if *count > 0 { pair.seen | bit } else { pair.seen & !bit };
        if pair.seen & pair.seen.wrapping_sub(1) == 0 {
            self.free_counts.push(std::mem::replace(&mut pair.counts, NO_COUNTS));
        }
    }

    /// Removes pairs that no longer occur, each named once.
    pub fn remove(&mut self, gone: &mut Vec<Place>) {
        // The last one of a list first, so that the others stay where they are.
        gone.sort_unstable_by(|a, b| b.cmp(a));
        for at in gone.drain(..) {
            let Pair { front, in_front, .. } = self.remove_of_second(at);
            let of_front = &mut self.of_front[front as usize];
            of_front.swap_remove(in_front as usize);
            if let Some(&moved) = of_front.get(in_front as usize) {
                self.get_mut(moved).in_front = in_front;
            }
        }
    }

    /// Removes all pairs whose leaf in front is `front`.
    pub fn remove_of_front(&mut self, front: u32) {
        for at in std::mem::take(&mut self.of_front[front as usize]) {
            let pair = self.remove_of_second(at);
            if pair.counts != NO_COUNTS {
                self.free_counts.push(pair.counts);
            }
        }
    }

    /// Removes a pair from the list of the leaf behind.
    fn remove_of_second(&mut self, at: Place) -> Pair {
        let of_second = &mut self.of_second[at.second as usize];
        let removed = of_second.swap_remove(at.index as usize);
        if let Some(moved) = of_second.get(at.index as usize) {
            self.of_front[moved.front as usize][moved.in_front as usize].index = at.index;
        }
        removed
    }
}

/// Returns the index of a block of counts that holds what a pair had in its single view.
fn new_counts(counts: &mut Vec<Row>, free: &mut Vec<u32>, (seen, total): (u32, u32)) -> u32 {
    let block = free.pop().unwrap_or_else(|| {
        counts.push([0; MAX_VIEWS]);
        counts.len() as u32 - 1
    });
    counts[block as usize] = [0; MAX_VIEWS];
    counts[block as usize][seen.trailing_zeros() as usize] = total;
    block
}
