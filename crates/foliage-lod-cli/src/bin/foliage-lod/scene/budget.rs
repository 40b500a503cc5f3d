//! Budgets of scenes.

use super::Opened;
use foliage_lod::scene::{Amount, BudgetEntry, SharedBudget, budget::Spent};

/// Leaves that a budget of milliseconds begins with.
pub const FIRST_LEAVES: f64 = 1e5;

/// A budget that a scene can be given, with what it keeps from picture to picture.
pub struct Budgeting {
    entry: Option<BudgetEntry>,
    state: Option<(SharedBudget, Option<Spent>)>,
}

impl Budgeting {
    /// A budget without a picture before.
    pub fn of(entry: Option<BudgetEntry>) -> Self {
        Self { entry, state: None }
    }
}

impl Opened {
    /// The budget that the scene asks for, in pictures of so many rows.
    pub(super) fn shared_budget(&self, entry: &BudgetEntry, height_px: u32) -> SharedBudget {
        let far = self.look().ground.map_or(f64::from(f32::MAX), |ground| ground.haze);
        let (rule, look) = (entry.rule(height_px as f32, far), self.look());
        let shared = match entry.amount {
            Amount::Leaves(leaves) => SharedBudget::new(&self.models, rule, leaves),
            Amount::Triangles(triangles) => {
                let shared = SharedBudget::new(&self.models, rule, triangles);
                shared.with_triangles(&self.models, look.wood_error_px)
            }
            // What is found for the time is set frame by frame.
            Amount::Ms(_) => SharedBudget::new(&self.models, rule, FIRST_LEAVES),
        };
        let mut shared = if entry.visibility { shared.with_visibility(&self.models) } else { shared };
        shared.far = self.file.far;
        if let (Some(visibility), Some(terrain)) = (shared.visibility_mut(), &self.terrain) {
            visibility.set_ground(Some(terrain.heights()));
        }
        shared
    }

    /// Gives the scene another budget, or none.
    pub fn set_budget(&mut self, entry: Option<BudgetEntry>) {
        self.exchange(&mut Budgeting::of(entry));
    }

    /// Exchanges the scene's budget for another one, which goes on from where it was.
    pub fn exchange(&mut self, other: &mut Budgeting) {
        std::mem::swap(&mut self.file.budget, &mut other.entry);
        std::mem::swap(&mut self.budget, &mut other.state);
    }

    /// What is left of the budget changes from frame to frame.
    pub fn shared(&mut self) -> Option<&mut SharedBudget> {
        self.budget.as_mut().map(|(shared, _)| shared)
    }

    /// What was spent of the budget, if there is one.
    pub fn spent(&self) -> Option<Spent> {
        self.budget.as_ref().and_then(|(_, spent)| *spent)
    }
}
