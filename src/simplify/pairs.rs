//! Pairs of leaves, one directly behind the other: the pixels that each leaf would uncover if it
//! were pruned.

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
}

/// All pairs that occur, indexed from both sides.
#[derive(Debug)]
pub struct Pairs {
    views: usize,
    places: Vec<Place>,
    /// Pixels by view, `views` numbers per pair.
    counts: Vec<u32>,
    free: Vec<u32>,
    /// For each front leaf, its (second, number) entries.
    of_front: Vec<Vec<(u32, u32)>>,
    /// For each second leaf, its pairs, so that the data that a step reads of most pairs is
    /// contiguous.
    of_second: Vec<Vec<Pair>>,
}

impl Pair {
    /// Views in which the pair occurs.
    pub fn seen_views(&self) -> impl Iterator<Item = usize> + use<> {
        let mut seen = self.seen;
        std::iter::from_fn(move || {
            let view = seen.trailing_zeros();
            seen &= seen.wrapping_sub(1);
            (view < u32::BITS).then_some(view as usize)
        })
    }
}

impl Pairs {
    /// Creates an empty set of pairs for at most 32 views, with fronts below `fronts` and seconds
    /// below `seconds`.
    pub fn new(fronts: usize, seconds: usize, views: usize) -> Self {
        assert!(views <= u32::BITS as usize, "Pair::seen has one bit per view");
        Self {
            views,
            places: Vec::new(),
            counts: Vec::new(),
            free: Vec::new(),
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
        if pair.seen.is_power_of_two() { pair.total } else { self.counts[pair.number as usize * self.views + view] }
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
            self.counts.resize(self.counts.len() + self.views, 0);
            self.places.push(Place::default());
            self.places.len() as u32 - 1
        });
        let (of_front, of_second) = (&mut self.of_front[front as usize], &mut self.of_second[second as usize]);
        self.places[number as usize] =
            Place { front, second, in_front: of_front.len() as u32, in_second: of_second.len() as u32 };
        of_front.push((second, number));
        of_second.push(Pair { front, number, ..Pair::default() });
        number
    }

    /// Adds `delta` to the pair's pixels in view `view`.
    pub fn add(&mut self, number: u32, view: usize, delta: i32) {
        let count = &mut self.counts[number as usize * self.views + view];
        *count = count.wrapping_add_signed(delta);
        let occurs = u32::from(*count > 0);
        let record = self.record(number);
        record.total = record.total.wrapping_add_signed(delta);
        record.seen = record.seen & !(1 << view) | occurs << view;
    }

    /// Removes a pair that no longer occurs.
    pub fn remove(&mut self, number: u32) {
        let Place { front, second, in_front, in_second } = self.places[number as usize];
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
