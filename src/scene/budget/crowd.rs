//! All items of a frame, and the bound on the worth of their leaves that spends a budget.

use super::{
    bisect::{Bounds, bisect},
    demand::Demand,
    histogram::Histogram,
    units::sum,
    weighed::Weighed,
};

/// Most items that are counted one by one for each bound that is tried.
const MOST_EXACT: usize = 10_000;

/// Octaves by which the bounds of a histogram are apart from where the budget is spent.
const APART: f64 = 1.0 / 1024.0;
/// Part of the budget beyond the floors that a histogram leaves for its own error.
const SPARE: u64 = 1 << 14;

/// How a budget is spent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found {
    /// Part of the floors that fits.
    Floors(f64),
    /// Bounds on the worth.
    Worth(Bounds),
}

/// See the [module](self). Keeps its memory.
#[derive(Debug, Default)]
pub struct Crowd {
    items: Vec<Weighed>,
    /// Filled if there are many items.
    histogram: Option<Histogram>,
    /// Worth of the last and of the first leaf of any item, in octaves; the first above the second
    /// if there are none.
    range: [f64; 2],
    /// Cost of the floors and of all leaves.
    totals: [u64; 2],
}

impl Crowd {
    /// Prepares for so many items.
    pub fn clear(&mut self, demands: &[Demand], items: usize) {
        self.items.clear();
        self.items.reserve(items);
        match (items > MOST_EXACT, &mut self.histogram) {
            (true, Some(histogram)) => histogram.clear(demands.len()),
            (true, none) => *none = Some(Histogram::new(demands.len())),
            (false, any) => *any = None,
        }
    }

    /// Adds an item.
    #[inline]
    pub fn push(&mut self, demands: &[Demand], item: Weighed) {
        if let Some(histogram) = &mut self.histogram {
            histogram.add(demands, &item, self.items.len() as u32);
        }
        self.items.push(item);
    }

    /// Sums up what does not depend on the budget, once all items are added.
    pub fn sum_up(&mut self, demands: &[Demand]) {
        self.range = [f64::INFINITY, f64::NEG_INFINITY];
        self.totals = [0; 2];
        let Self { items, histogram, range, totals } = self;
        let mut add = |item: &Weighed, count: u64, gains: [f64; 2]| {
            for (total, bound) in totals.iter_mut().zip(item.bounds) {
                *total = total.saturating_add(item.units(f64::from(bound)).saturating_mul(count));
            }
            if let Some([last, first]) =
                (Weighed { gain: 0.0, ..*item }).range(demands).filter(|_| gains[0].is_finite())
            {
                *range = [range[0].min(last + gains[0]), range[1].max(first + gains[1])];
            }
        };
        match histogram {
            Some(histogram) => histogram.for_each_part(items, &mut add),
            None => items.iter().for_each(|item| add(item, 1, [f64::from(item.gain); 2])),
        }
    }

    /// Worth of the last and of the first leaf of any item, in octaves.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Finds how so much is spent on the items: exactly for up to 10,000 of them, else by a
    /// histogram of their weights.
    pub fn solve(&self, demands: &[Demand], budget: u64) -> Found {
        let [floors, all] = self.totals;
        if floors >= budget {
            let part = if floors > 0 { budget as f64 / floors as f64 } else { 1.0 };
            return Found::Floors(part.min(1.0));
        }
        let [low, high] = self.range;
        if all <= budget || low > high || self.tried(demands, low - 1.0) <= budget {
            return Found::Worth(Bounds::at(if low > high { 0.0 } else { low - 1.0 }));
        }
        if self.histogram.is_none() {
            return Found::Worth(bisect(self.range, budget, |bound| self.total(demands, bound)));
        }
        let budget = budget - (budget - floors) / SPARE;
        let found = bisect(self.range, budget, |bound| self.tried(demands, bound));
        // Plants are not quite at the mean of their bin, where their counts may jump.
        let [within, beyond] = [found.within + APART, found.beyond - APART];
        let [least, most] = [within, beyond].map(|bound| self.tried(demands, bound));
        Found::Worth(Bounds::between([within, beyond], [least, most], budget))
    }

    /// Cost at a bound, or nearly so if there are many items.
    fn tried(&self, demands: &[Demand], bound: f64) -> u64 {
        match &self.histogram {
            Some(histogram) => histogram.total(demands, &self.items, bound),
            None => self.total(demands, bound),
        }
    }

    /// Cost at a bound.
    pub fn total(&self, demands: &[Demand], bound: f64) -> u64 {
        sum(self.items.iter().map(|item| item.units(item.count(demands, bound))))
    }

    /// Replaces `counts` with those of the items; returns their cost. If they would cost more than
    /// `most`, all are lowered towards their floors by one factor.
    pub fn count(&self, demands: &[Demand], found: Found, most: u64, counts: &mut Vec<f32>) -> u64 {
        let of = |item: &Weighed| match found {
            Found::Floors(part) => f64::from(item.bounds[0]) * part,
            Found::Worth(bounds) => item.between(demands, &bounds),
        };
        counts.clear();
        let mut total = 0_u64;
        counts.extend(self.items.iter().map(|item| {
            let count = rounded_down(of(item));
            total = total.saturating_add(item.units(f64::from(count)));
            count
        }));
        if total <= most {
            return total;
        }
        let is_squeezed = matches!(found, Found::Floors(_));
        let floors = if is_squeezed { 0 } else { self.totals[0] };
        // What rounding up may add.
        let most = most.saturating_sub(self.items.len() as u64);
        let part = most.saturating_sub(floors) as f64 / total.saturating_sub(floors).max(1) as f64;
        for (count, item) in counts.iter_mut().zip(&self.items) {
            let floor = if is_squeezed { 0.0 } else { f64::from(item.bounds[0]) };
            *count = rounded_down(floor + (f64::from(*count) - floor) * part);
        }
        sum(counts.iter().zip(&self.items).map(|(&count, item)| item.units(f64::from(count))))
    }
}

/// The largest `f32` that is not above a count.
#[inline]
fn rounded_down(count: f64) -> f32 {
    let nearest = count as f32;
    if f64::from(nearest) > count { nearest.next_down() } else { nearest }
}
