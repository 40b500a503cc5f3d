//! A budget that all plants of a grove in view share.

use super::budget::{Item, Rule, Spent, Splitter};
use crate::{
    extract::{Far, Sight},
    model::{ErrorCurve, FoliageModel},
};

/// A budget of leaves, for [`Grove::select_within`](super::Grove::select_within).
pub struct SharedBudget {
    /// Number of leaves for all plants in view.
    pub leaves: f64,
    /// When plants are handed over to impostors: those of which no leaf shows take nothing. `None`
    /// if there are no impostors.
    pub far: Option<Far>,
    curves: Vec<ErrorCurve>,
    splitter: Splitter,
    items: Vec<Item>,
    counts: Vec<f32>,
}

impl SharedBudget {
    /// A budget for a grove whose kinds are of these models, in their order. Models without an
    /// error curve are split by their recorded errors.
    pub fn new(models: &[FoliageModel], rule: Rule, leaves: f64) -> Self {
        let curves: Vec<ErrorCurve> = models.iter().map(ErrorCurve::of).collect();
        let splitter = Splitter::new(&curves, rule);
        Self { leaves, far: None, curves, splitter, items: Vec::new(), counts: Vec::new() }
    }

    /// Forgets the last frame, as after a cut.
    pub fn reset(&mut self) {
        self.splitter.reset();
    }

    /// Replaces the plants.
    pub(super) fn fill(&mut self, plants: impl Iterator<Item = (u32, u32, Sight)>) {
        let Self { curves, items, far, .. } = self;
        items.clear();
        let leafless = ErrorCurve::hull(1.0, 2.0, [(0, 0.0)]);
        items.extend(plants.map(|(instance, kind, sight)| {
            let item = Item::seen(kind, curves.get(kind as usize).unwrap_or(&leafless), &sight);
            let is_far = far.is_some_and(|far| far.share(2.0 * sight.radius_px(), instance) >= 1.0);
            if is_far { Item { ceiling: 0.0, ..item } } else { item }
        }));
    }

    /// Splits the budget, after `seconds`, or anew.
    pub(super) fn split(&mut self, seconds: Option<f64>) -> Spent {
        let Self { splitter, items, counts, leaves, .. } = self;
        match seconds {
            Some(seconds) => splitter.follow(items, *leaves, seconds, counts),
            None => splitter.split(items, *leaves, counts),
        }
    }

    /// Counts by what was split last.
    pub(super) fn repeat(&mut self) {
        self.splitter.repeat(&self.items, &mut self.counts);
    }

    /// Counts of the plants; `None` for those that are left to their impostors.
    pub(super) fn counts(&self) -> impl Iterator<Item = Option<f32>> {
        self.items.iter().zip(&self.counts).map(|(item, &count)| (item.ceiling > 0.0).then_some(count))
    }
}
