//! Kinds of plants of a patch, as scene files give them.

use crate::{Result, error::check_range};
use serde::Deserialize;
use std::path::PathBuf;

/// Where the points lie on which plants may grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placing {
    /// One in each cell, moved at random by at most `jitter`; which of them carry a plant is
    /// random.
    #[default]
    Jitter,
    /// One in each cell as well, but the cells are ranked by a blue-noise pattern: at any density
    /// the plants are spread evenly, without clumps and gaps.
    BlueNoise,
}

/// A kind of plant of a patch. Lengths are in the scene's units.
///
/// Kinds of the same `spacing` share a grid of points: one random number decides for each point
/// which of them grows there, if any.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantKind {
    /// Name of its model.
    pub model: String,
    /// Distance of the points on which it may grow, along x and z: above 0.
    pub spacing: Spacing,
    /// Greatest shift of a plant from its point, over the spacing: 0 to 0.5, at which it may lie
    /// anywhere in its cell. Two plants are at least `(1 - 2 jitter) spacing` apart.
    #[serde(default = "half")]
    pub jitter: f32,
    /// Share of the points on which it grows: 0 to 1.
    #[serde(default = "one")]
    pub density: f32,
    /// Picture that `density` is multiplied with, black for 0: over the patch's whole area, its
    /// first row at the least z. Relative to the scene file.
    pub map: Option<PathBuf>,
    /// Least and greatest height.
    pub height: [f32; 2],
    /// Least and greatest width, over the width that the model has at its height.
    #[serde(default = "ones")]
    pub ratio: [f32; 2],
    /// Least and greatest rotation about the vertical, in degrees.
    #[serde(default = "full_turn")]
    pub turn: [f32; 2],
    /// Colour factors (linear) between which each plant takes one: 0 to 16.
    #[serde(default = "no_tint")]
    pub tint: [[f32; 3]; 2],
    /// Least and greatest slope of the ground, in degrees.
    #[serde(default = "any_slope")]
    pub slope: [f32; 2],
    /// Least and greatest height of the ground.
    #[serde(default = "any_altitude")]
    pub altitude: [f64; 2],
    /// Radius around its foot in which no plant of this patch with smaller spacing grows: at most
    /// 4 times its own spacing, since each tile looks for larger plants that far.
    #[serde(default)]
    pub keeps_away: f64,
    /// Distance beyond which it is not made; by default [`REACH`] times its spacing.
    pub reach: Option<f64>,
    /// Last part of the reach over which its plants become fewer and larger, and sink into the
    /// ground before they go: 0, at which all vanish at once, to 1.
    #[serde(default = "thins_over")]
    pub thins_over: f32,
    /// Whether they take the ground's colour meanwhile, as grass does well whose ground has about
    /// its colour.
    #[serde(default)]
    pub blends: bool,
}

/// Default of [`PlantKind::reach`], over the spacing.
pub const REACH: f64 = 200.0;

/// Greatest [`PlantKind::keeps_away`] over the spacing.
const MOST_KEPT_AWAY: f64 = 4.0;

/// Distance of points along x and z: one number or two.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Spacing {
    /// The same along both axes.
    Same(f64),
    /// Along x, and along z.
    Each([f64; 2]),
}

impl Spacing {
    /// Distance along x, and along z.
    pub fn each(self) -> [f64; 2] {
        match self {
            Self::Same(spacing) => [spacing; 2],
            Self::Each(spacing) => spacing,
        }
    }
}

fn half() -> f32 {
    0.5
}

fn one() -> f32 {
    1.0
}

fn thins_over() -> f32 {
    0.4
}

fn ones() -> [f32; 2] {
    [1.0; 2]
}

fn full_turn() -> [f32; 2] {
    [0.0, 360.0]
}

fn no_tint() -> [[f32; 3]; 2] {
    [[1.0; 3]; 2]
}

fn any_slope() -> [f32; 2] {
    [0.0, 90.0]
}

fn any_altitude() -> [f64; 2] {
    [-1e9, 1e9]
}

impl PlantKind {
    /// A kind with every other parameter at its default.
    pub fn new(model: impl Into<String>, spacing: f64, height: [f32; 2]) -> Self {
        Self {
            model: model.into(),
            spacing: Spacing::Same(spacing),
            jitter: half(),
            density: one(),
            map: None,
            height,
            ratio: ones(),
            turn: full_turn(),
            tint: no_tint(),
            slope: any_slope(),
            altitude: any_altitude(),
            keeps_away: 0.0,
            reach: None,
            thins_over: thins_over(),
            blends: false,
        }
    }

    /// Distance beyond which it is not made.
    pub fn reach(&self) -> f64 {
        let [x, z] = self.spacing.each();
        self.reach.unwrap_or(REACH * x.max(z))
    }

    /// Checks every parameter; `key(name)` is a parameter's dotted key.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for the first out of its range.
    pub(super) fn check(&self, key: impl Fn(&str) -> String) -> Result<()> {
        let rising = |name: &str, [low, high]: [f64; 2], range: [f64; 2]| {
            check_range(key(name), low, range[0]..=range[1])?;
            check_range(key(name), high, low..=range[1])
        };
        self.spacing.each().iter().try_for_each(|&spacing| check_range(key("spacing"), spacing, 1e-3..=1e6))?;
        check_range(key("jitter"), self.jitter, 0.0..=0.5)?;
        check_range(key("thins_over"), self.thins_over, 0.0..=1.0)?;
        check_range(key("density"), self.density, 0.0..=1.0)?;
        rising("height", self.height.map(f64::from), [1e-6, 1e6])?;
        rising("ratio", self.ratio.map(f64::from), [1e-3, 1e3])?;
        rising("turn", self.turn.map(f64::from), [-3600.0, 3600.0])?;
        self.tint.as_flattened().iter().try_for_each(|&factor| check_range(key("tint"), factor, 0.0..=16.0))?;
        rising("slope", self.slope.map(f64::from), [0.0, 90.0])?;
        rising("altitude", self.altitude, [-1e9, 1e9])?;
        let [x, z] = self.spacing.each();
        check_range(key("keeps_away"), self.keeps_away, 0.0..=MOST_KEPT_AWAY * x.min(z))?;
        check_range(key("reach"), self.reach(), 0.0..=1e9)
    }
}
