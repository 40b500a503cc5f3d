//! Which leaf stands directly behind which: what each leaf would uncover if it were pruned.

/// A leaf and the leaf that stands directly behind it in some pixels.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pair {
    /// The leaf in front.
    pub front: u32,
    /// The leaf directly behind it.
    pub second: u32,
    /// Pixels of all views.
    pub total: u32,
    /// Bit v is set where view v has such pixels.
    pub seen: u32,
    /// Number of the last step that took the pair up; for the owner's use.
    pub stamp: u32,
    place_in_front: u32,
    place_in_second: u32,
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

/// All pairs that occur, found from either side.
#[derive(Debug)]
pub struct Pairs {
    views: usize,
    pairs: Vec<Pair>,
    /// Pixels of each view, `views` numbers a pair.
    counts: Vec<u32>,
    free: Vec<u32>,
    /// For each leaf in front: (second, pair).
    of_front: Vec<Vec<(u32, u32)>>,
    /// For each second leaf: its pairs.
    of_second: Vec<Vec<u32>>,
}

impl Pairs {
    /// No pair yet.
    pub fn new(leaves: usize, views: usize) -> Self {
        assert!(views <= u32::BITS as usize, "Pair::seen has one bit a view");
        Self {
            views,
            pairs: Vec::new(),
            counts: Vec::new(),
            free: Vec::new(),
            of_front: vec![Vec::new(); leaves],
            of_second: vec![Vec::new(); leaves],
        }
    }

    /// The pair's record.
    pub fn get(&self, pair: u32) -> &Pair {
        &self.pairs[pair as usize]
    }

    /// Pixels of each view in which the pair occurs.
    pub fn counts(&self, pair: u32) -> &[u32] {
        &self.counts[pair as usize * self.views..][..self.views]
    }

    /// Pairs whose second leaf is `second`; whoever takes the list out puts it back unchanged.
    pub fn behind_others_mut(&mut self, second: u32) -> &mut Vec<u32> {
        &mut self.of_second[second as usize]
    }

    /// Marks the pair as taken up by step `stamp`; true when it was not yet.
    pub fn stamp(&mut self, pair: u32, stamp: u32) -> bool {
        std::mem::replace(&mut self.pairs[pair as usize].stamp, stamp) != stamp
    }

    /// The pair of two leaves, made where it did not occur yet.
    pub fn find_or_insert(&mut self, front: u32, second: u32) -> u32 {
        if let Some(&(_, pair)) = self.of_front[front as usize].iter().find(|entry| entry.0 == second) {
            return pair;
        }
        let pair = self.free.pop().unwrap_or_else(|| {
            self.counts.resize(self.counts.len() + self.views, 0);
            self.pairs.push(Pair::default());
            self.pairs.len() as u32 - 1
        });
        self.pairs[pair as usize] = Pair {
            front,
            second,
            place_in_front: self.of_front[front as usize].len() as u32,
            place_in_second: self.of_second[second as usize].len() as u32,
            ..Pair::default()
        };
        self.of_front[front as usize].push((second, pair));
        self.of_second[second as usize].push(pair);
        pair
    }

    /// Counts `delta` more pixels of view `view`.
    pub fn add(&mut self, pair: u32, view: usize, delta: i32) {
        let count = &mut self.counts[pair as usize * self.views + view];
        *count = count.wrapping_add_signed(delta);
        let record = &mut self.pairs[pair as usize];
        record.total = record.total.wrapping_add_signed(delta);
        record.seen = record.seen & !(1 << view) | u32::from(*count > 0) << view;
    }

    /// Forgets a pair that no longer occurs.
    pub fn remove(&mut self, pair: u32) {
        let Pair { front, second, total, place_in_front, place_in_second, .. } = self.pairs[pair as usize];
        debug_assert_eq!(total, 0);
        let row = &mut self.of_front[front as usize];
        row.swap_remove(place_in_front as usize);
        if let Some(&(_, moved)) = row.get(place_in_front as usize) {
            self.pairs[moved as usize].place_in_front = place_in_front;
        }
        let row = &mut self.of_second[second as usize];
        row.swap_remove(place_in_second as usize);
        if let Some(&moved) = row.get(place_in_second as usize) {
            self.pairs[moved as usize].place_in_second = place_in_second;
        }
        self.free.push(pair);
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.pairs[..]) + size_of_val(&self.counts[..])
    }
}
