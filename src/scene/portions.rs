//! The budget of a scene: its amount and its rule.

use super::{
    budget::{CookShare, Exponent, GomezShare, Rule},
    check::wrong_if,
};
use crate::{Result, error::check_range};
use serde::Deserialize;

/// Names of the rules by which a budget is split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Portions {
    /// The least sum of powers of the errors.
    #[default]
    Error,
    /// The same error for all plants.
    Equal,
    /// Cook et al.: a power of the area on screen.
    Cook,
    /// The scene-wide reduction of Gomez.
    Gomez,
    /// The same share of the leaves for all plants.
    Uniform,
}

/// Budget of a scene, split among the plants in view; it takes the place of the policy of the level
/// of detail.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BudgetEntry {
    /// Number of leaves: 0 to 1e12.
    pub leaves: f64,
    /// How they are split.
    #[serde(default)]
    pub rule: Portions,
    /// `error` and `equal`: whether errors count by what shows of each plant behind others; by
    /// default they do not.
    #[serde(default)]
    pub visibility: bool,
    /// `error`: exponent of the errors, from 1, their sum, to 64; by default 2.
    pub exponent: Option<f32>,
}

impl BudgetEntry {
    /// So many leaves, split by the errors.
    pub fn of_leaves(leaves: f64) -> Self {
        Self { leaves, rule: Portions::Error, visibility: false, exponent: None }
    }

    /// The rule for pictures of so many rows and a far plane at a distance.
    pub fn rule(&self, height_px: f32, far: f64) -> Rule {
        match self.rule {
            Portions::Error => Rule::LeastError(self.exponent.map_or_else(Exponent::default, Exponent::new)),
            Portions::Equal => Rule::LeastError(Exponent::WORST),
            Portions::Cook => Rule::Cook(CookShare::of_height(height_px)),
            Portions::Gomez => Rule::Gomez(GomezShare::published(height_px, far)),
            Portions::Uniform => Rule::Uniform,
        }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for the first out of its range.
    pub fn check(&self) -> Result<()> {
        check_range("budget.leaves", self.leaves, 0.0..=1e12)?;
        let allowed = "left out: only the rules error and equal use it";
        let ignores = !matches!(self.rule, Portions::Error | Portions::Equal);
        wrong_if(self.visibility && ignores, "budget.visibility", "true", allowed)?;
        let Some(exponent) = self.exponent else { return Ok(()) };
        let allowed = "left out: only the rule error uses it";
        wrong_if(self.rule != Portions::Error, "budget.exponent", &exponent.to_string(), allowed)?;
        check_range("budget.exponent", exponent, 1.0..=64.0)
    }
}
