//! Which leaf stands directly behind which: what each leaf would uncover if it were pruned.

/// A leaf and the leaf that stands directly behind it in some pixels, as listed with the latter.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pair {
    /// The leaf in front.
    pub front: u32,
    /// Pixels of all views.
    pub total: u32,
    /// Bit v is set where view v has such pixels.
    pub seen: u32,
    /// Number of the last step that changed the counts; for the owner's use.
    pub stamp: u32,
    /// Number of the pair.
    pub number: u32,
}

/// Where a pair is listed.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    front: u32,
    second: u32,
    in_front: u32,
    in_second: u32,
}

/// All pairs that occur, found from either side.
#[derive(Debug)]
pub struct Pairs {
    views: usize,
    places: Vec<Place>,
    /// Pixels of each view, `views` numbers a pair.
    counts: Vec<u32>,
    free: Vec<u32>,
    /// For each leaf in front: (second, number).
    of_front: Vec<Vec<(u32, u32)>>,
    /// For each second leaf its pairs, all that a step reads of most of them side by side.
    of_second: Vec<Vec<Pair>>,
}

impl Pair {
    /// The views in which the pair occurs.
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
    /// No pair yet.
    pub fn new(leaves: usize, views: usize) -> Self {
        assert!(views <= u32::BITS as usize, "Pair::seen has one bit a view");
        Self {
            views,
            places: Vec::new(),
            counts: Vec::new(),
            free: Vec::new(),
            of_front: vec![Vec::new(); leaves],
            of_second: vec![Vec::new(); leaves],
        }
    }

    /// The pair's record and its second leaf.
    pub fn get(&self, number: u32) -> (&Pair, u32) {
        let Place { second, in_second, .. } = self.places[number as usize];
        (&self.of_second[second as usize][in_second as usize], second)
    }

    /// Pixels of view `view` in which `pair` occurs.
    pub fn count(&self, pair: &Pair, view: usize) -> u32 {
        if pair.seen.is_power_of_two() { pair.total } else { self.counts[pair.number as usize * self.views + view] }
    }

    /// Pairs whose second leaf is `second`.
    pub fn behind_others(&self, second: u32) -> &[Pair] {
        &self.of_second[second as usize]
    }

    /// Marks the pair as changed by step `stamp`; true when it was not yet.
    pub fn stamp(&mut self, number: u32, stamp: u32) -> bool {
        std::mem::replace(&mut self.record(number).stamp, stamp) != stamp
    }

    fn record(&mut self, number: u32) -> &mut Pair {
        let Place { second, in_second, .. } = self.places[number as usize];
        &mut self.of_second[second as usize][in_second as usize]
    }

    /// The pair of two leaves, made where it did not occur yet.
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

    /// Counts `delta` more pixels of view `view`.
    pub fn add(&mut self, number: u32, view: usize, delta: i32) {
        let count = &mut self.counts[number as usize * self.views + view];
        *count = count.wrapping_add_signed(delta);
        let occurs = u32::from(*count > 0);
        let record = self.record(number);
        record.total = record.total.wrapping_add_signed(delta);
        record.seen = record.seen & !(1 << view) | occurs << view;
    }

    /// Forgets a pair that no longer occurs.
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
