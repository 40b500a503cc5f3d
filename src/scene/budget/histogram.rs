//! Histogram of the weights of many items: a bound is tried on its bins instead of on the items.
//!
//! Items of equal demand, floor, ceiling and cost are of one class; each class has 64 bins an
//! octave, each of which knows the number and the mean of the gains in it. Sums are of integers, so
//! that they are the same in any order. Items of rare classes, such as plants with the camera in
//! them, are counted one by one.

use super::{demand::Demand, units::sum, weighed::Weighed};

/// Bins in an octave, and octaves of the gains that have some.
const BINS: i32 = 64;
const OCTAVES: [i32; 2] = [-64, 64];
/// Most classes.
const MOST_CLASSES: usize = 64;
/// Steps of a gain within its bin.
const STEPS: f32 = (1 << 16) as f32;

/// Items whose counts are equal at equal gains.
#[derive(Debug, Clone)]
struct Class {
    /// One of them.
    like: Weighed,
    bins: Vec<Bin>,
    /// First and one-past-last bin in use.
    used: [usize; 2],
}

#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    items: u64,
    /// Sum of the steps from the start of the bin.
    steps: u64,
}

/// See the [module](self). Keeps its memory.
#[derive(Debug, Default)]
pub struct Histogram {
    classes: Vec<Class>,
    /// Classes of frames before, for their memory.
    spare: Vec<Class>,
    /// For each demand, its class that was found last.
    last: Vec<u32>,
    /// Items of no class.
    others: Vec<u32>,
    /// Cost of the items whose counts are the same at any bound.
    constant: u64,
}

/// No class.
const NONE: u32 = u32::MAX;

impl Histogram {
    /// An empty histogram for items of so many demands.
    pub fn new(demands: usize) -> Self {
        let mut new = Self::default();
        new.clear(demands);
        new
    }

    /// Empties it.
    pub fn clear(&mut self, demands: usize) {
        self.spare.append(&mut self.classes);
        self.others.clear();
        self.constant = 0;
        self.last.clear();
        self.last.resize(demands, NONE);
    }

    /// Adds an item, which is that with this number.
    #[inline]
    pub fn add(&mut self, demands: &[Demand], item: &Weighed, number: u32) {
        if !item.gain.is_finite() {
            self.constant = self.constant.saturating_add(item.units(item.count(demands, 0.0)));
            return self.others.push(number);
        }
        let last = self.last[item.demand as usize];
        let class = match self.classes.get(last as usize) {
            Some(class) if class.holds(item) => last,
            _ => self.class_of(item),
        };
        match self.classes.get_mut(class as usize) {
            Some(class) => class.add(item.gain),
            None => self.others.push(number),
        }
    }

    /// The class of an item, which is new if there is room for one.
    #[cold]
    fn class_of(&mut self, item: &Weighed) -> u32 {
        if !is_binned(item.gain) {
            return NONE;
        }
        let known = self.classes.iter().position(|class| class.holds(item));
        let class = match known {
            Some(class) => class,
            None if self.classes.len() < MOST_CLASSES => {
                let class = Class::like(*item, self.spare.pop());
                self.classes.push(class);
                self.classes.len() - 1
            }
            None => return NONE,
        };
        self.last[item.demand as usize] = class as u32;
        class as u32
    }

    /// Calls `with` with items that stand for all: each with how many it stands for, and with the
    /// least and the largest of their gains.
    pub fn for_each_part(&self, items: &[Weighed], with: &mut impl FnMut(&Weighed, u64, [f64; 2])) {
        for class in &self.classes {
            let [from, to] = class.used;
            let count = class.bins[from..to].iter().map(|bin| bin.items).sum();
            with(&class.like, count, [class.gain(from), class.gain(to - 1)]);
        }
        for other in self.others.iter().filter_map(|&other| items.get(other as usize)) {
            with(other, 1, [f64::from(other.gain); 2]);
        }
    }

    /// Cost at a bound. `items` are those that were added.
    pub fn total(&self, demands: &[Demand], items: &[Weighed], bound: f64) -> u64 {
        let others = self.others.iter().map(|&other| &items[other as usize]).filter(|item| item.gain.is_finite());
        let others = sum(others.map(|item| item.units(item.count(demands, bound))));
        let of_class = |class: &Class| {
            let bins = (class.used[0]..class.used[1]).filter(|&bin| class.bins[bin].items > 0);
            sum(bins.map(|bin| {
                let count = class.like.count_with(demands, bound, class.gain(bin));
                class.like.units(count).saturating_mul(class.bins[bin].items)
            }))
        };
        sum([self.constant, others].into_iter().chain(self.classes.iter().map(of_class)))
    }
}

impl Class {
    /// A class without items, in the memory of another.
    fn like(like: Weighed, spare: Option<Self>) -> Self {
        let all = ((OCTAVES[1] - OCTAVES[0]) * BINS) as usize;
        let mut bins = spare.map_or_else(Vec::new, |spare| spare.bins);
        bins.clear();
        bins.resize(all, Bin::default());
        Self { like, bins, used: [all, 0] }
    }

    #[inline]
    fn holds(&self, item: &Weighed) -> bool {
        let Weighed { demand, bounds, unit_cost, gain } = *item;
        (demand, bounds, unit_cost) == (self.like.demand, self.like.bounds, self.like.unit_cost) && is_binned(gain)
    }

    #[inline]
    fn add(&mut self, gain: f32) {
        let place = (gain - OCTAVES[0] as f32) * BINS as f32;
        let number = place as usize;
        let bin = &mut self.bins[number];
        bin.items += 1;
        bin.steps += ((place - number as f32) * STEPS) as u64;
        self.used = [self.used[0].min(number), self.used[1].max(number + 1)];
    }

    /// Mean gain of a bin.
    fn gain(&self, number: usize) -> f64 {
        let Bin { items, steps } = self.bins[number];
        let within = steps as f64 / f64::from(STEPS) / items.max(1) as f64;
        f64::from(OCTAVES[0]) + (number as f64 + within) / f64::from(BINS)
    }
}

/// Whether there is a bin for a gain.
#[inline]
fn is_binned(gain: f32) -> bool {
    gain >= OCTAVES[0] as f32 && gain < OCTAVES[1] as f32
}
