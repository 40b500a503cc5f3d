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

/// Amount of a budget, and what it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// Number of leaves: 0 to 1e12.
    Leaves(f64),
    /// Number of triangles, of leaves, wood and impostors: 0 to 1e12.
    Triangles(f64),
    /// Time of a frame in milliseconds: 0.001 to 1e5. Leaves are found for it by a
    /// [`Pace`](super::budget::Pace).
    Ms(f64),
}

impl Amount {
    /// What it counts, as in a scene file.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Leaves(_) => "leaves",
            Self::Triangles(_) => "triangles",
            Self::Ms(_) => "ms",
        }
    }

    /// The number.
    pub fn number(&self) -> f64 {
        let (Self::Leaves(number) | Self::Triangles(number) | Self::Ms(number)) = *self;
        number
    }
}

/// Budget of a scene, split among the plants in view; it takes the place of the policy of the level
/// of detail.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Entry")]
pub struct BudgetEntry {
    /// One of the keys `leaves`, `triangles` and `ms`.
    pub amount: Amount,
    /// How it is split.
    pub rule: Portions,
    /// `error` and `equal`: whether errors count by what shows of each plant behind others; by
    /// default they do not.
    pub visibility: bool,
    /// `error`: exponent of the errors, from 1, their sum, to 64; by default 2.
    pub exponent: Option<f32>,
}

/// Budget as a scene file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    leaves: Option<f64>,
    triangles: Option<f64>,
    ms: Option<f64>,
    #[serde(default)]
    rule: Portions,
    #[serde(default)]
    visibility: bool,
    exponent: Option<f32>,
}

impl TryFrom<Entry> for BudgetEntry {
    type Error = &'static str;

    fn try_from(entry: Entry) -> std::result::Result<Self, Self::Error> {
        let Entry { leaves, triangles, ms, rule, visibility, exponent } = entry;
        let amounts = [leaves.map(Amount::Leaves), triangles.map(Amount::Triangles), ms.map(Amount::Ms)];
        let mut given = amounts.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(amount), None) => Ok(Self { amount, rule, visibility, exponent }),
            _ => Err("a budget has one of the keys `leaves`, `triangles` and `ms`"),
        }
    }
}

impl BudgetEntry {
    /// So much, split by the errors.
    pub fn of(amount: Amount) -> Self {
        Self { amount, rule: Portions::Error, visibility: false, exponent: None }
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
        match self.amount {
            Amount::Leaves(leaves) => check_range("budget.leaves", leaves, 0.0..=1e12)?,
            Amount::Triangles(triangles) => check_range("budget.triangles", triangles, 0.0..=1e12)?,
            Amount::Ms(ms) => check_range("budget.ms", ms, 1e-3..=1e5)?,
        }
        let allowed = "left out: only the rules error and equal use it";
        let ignores = !matches!(self.rule, Portions::Error | Portions::Equal);
        wrong_if(self.visibility && ignores, "budget.visibility", "true", allowed)?;
        let Some(exponent) = self.exponent else { return Ok(()) };
        let allowed = "left out: only the rule error uses it";
        wrong_if(self.rule != Portions::Error, "budget.exponent", &exponent.to_string(), allowed)?;
        check_range("budget.exponent", exponent, 1.0..=64.0)
    }
}
