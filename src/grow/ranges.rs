//! Allowed ranges of the parameters of a species.

use super::species::{BarkStyle, Crown, LeafStyle, Level, MAX_GROWN_LEAVES, Species};
use crate::{Error, Result, error::check_range};
use std::path::Path;

/// Key, value, minimum and maximum.
type Ranged = (&'static str, f32, f32, f32);

impl Species {
    /// Checks every number against its range, for a species created or changed in code.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable), with the name of the species as the path, for the first
    /// number out of range.
    pub fn validate(&self) -> Result<()> {
        self.check(Path::new(&self.name))
    }

    /// As [`validate`](Self::validate), with `origin` as the path in the error.
    pub(super) fn check(&self, origin: &Path) -> Result<()> {
        check_ranges(self).map_err(|error| {
            let Error::InvalidOption { field, value, allowed } = error else { return error };
            Error::unreadable(origin, format!("{field} is {value}"), format!("it must be {allowed}"))
        })
    }
}

/// Checks every number of a species.
///
/// # Errors
/// [`InvalidOption`](Error::InvalidOption) for the first number out of range.
fn check_ranges(species: &Species) -> Result<()> {
    check_range("leaves", species.leaves, 1..=MAX_GROWN_LEAVES)?;
    check_range("levels", species.levels.len(), 2..=4)?;
    check_range("leaf.levels", species.leaf.levels as usize, 1..=species.levels.len())?;
    check_table("crown.", &crown(&species.crown))?;
    for (i, fields) in species.levels.iter().map(level).enumerate() {
        check_table(&format!("levels[{i}]."), &fields)?;
    }
    check_table("leaf.", &leaf(&species.leaf))?;
    check_table("bark.", &bark(&species.bark))
}

fn check_table(prefix: &str, fields: &[Ranged]) -> Result<()> {
    fields.iter().try_for_each(|&(key, value, least, most)| check_range(format!("{prefix}{key}"), value, least..=most))
}

fn crown(crown: &Crown) -> [Ranged; 10] {
    [
        ("height_m", crown.height_m, 0.01, 200.0),
        ("height_v_m", crown.height_v_m, 0.0, 0.5 * crown.height_m),
        ("base", crown.base, 0.0, 0.95),
        ("ratio", crown.ratio, 0.001, 0.2),
        ("ratio_power", crown.ratio_power, 0.5, 3.0),
        ("flare", crown.flare, 0.0, 5.0),
        ("lobes", crown.lobes as f32, 0.0, 12.0),
        ("lobe_depth", crown.lobe_depth, 0.0, 0.5),
        ("trunks", crown.trunks as f32, 1.0, 12.0),
        ("lean", crown.lean, 0.0, 60.0),
    ]
}

fn level(level: &Level) -> [Ranged; 18] {
    [
        ("branches", level.branches as f32, 0.0, 500.0),
        ("length", level.length, 0.001, 2.0),
        ("length_v", level.length_v, 0.0, 0.9 * level.length),
        ("taper", level.taper, 0.0, 1.0),
        ("bare", level.bare, 0.0, 0.95),
        ("segments", level.segments as f32, 1.0, 40.0),
        ("sides", level.sides as f32, 3.0, 32.0),
        ("curve", level.curve, -360.0, 360.0),
        ("curve_back", level.curve_back, -360.0, 360.0),
        ("curve_v", level.curve_v, 0.0, 720.0),
        ("splits", level.splits, 0.0, 2.0),
        ("split_angle", level.split_angle, 0.0, 180.0),
        ("split_angle_v", level.split_angle_v, 0.0, 180.0),
        ("down_angle", level.down_angle, 0.0, 180.0),
        ("down_angle_v", level.down_angle_v, -180.0, 180.0),
        ("rotate", level.rotate, -360.0, 360.0),
        ("rotate_v", level.rotate_v, 0.0, 360.0),
        ("lift", level.lift, -360.0, 360.0),
    ]
}

fn leaf(leaf: &LeafStyle) -> [Ranged; 9] {
    [
        ("length_m", leaf.length_m, 0.001, 10.0),
        ("length_v", leaf.length_v, 0.0, 0.9),
        ("aspect", leaf.aspect, 0.05, 4.0),
        ("down_angle", leaf.down_angle, 0.0, 180.0),
        ("down_angle_v", leaf.down_angle_v, 0.0, 180.0),
        ("rotate", leaf.rotate, -360.0, 360.0),
        ("cluster", leaf.cluster, 0.0, 1.0),
        ("light", leaf.light, 0.0, 1.0),
        ("droop", leaf.droop, 0.0, 1.0),
    ]
}

fn bark(bark: &BarkStyle) -> [Ranged; 2] {
    [("size_m", bark.size_m, 0.01, 10.0), ("twig_radius_m", bark.twig_radius_m, 0.0001, 1.0)]
}
