//! What is known of a species: the numbers of its growth, from an embedded or given `.toml` file.

use super::ranges::check_ranges;
use crate::{Error, Result, file};
use serde::Deserialize;
use std::path::Path;

/// Most leaves that can be grown.
pub const MAX_GROWN_LEAVES: u32 = 1_000_000;

/// Names and sources of the embedded species.
const SOURCES: [(&str, &str); 3] = [
    ("english-oak", include_str!("../../data/species/english-oak.toml")),
    ("carya-illinoinensis", include_str!("../../data/species/carya-illinoinensis.toml")),
    ("betula-populifolia", include_str!("../../data/species/betula-populifolia.toml")),
];

/// A species: every number that its growth depends on. Lengths in metres, angles in degrees.
///
/// Ranges are checked when it is read; a field's `_v` twin is the greatest random deviation from it, either way.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    /// Common name; becomes the plant's name.
    pub name: String,
    /// Botanical name.
    pub latin: String,
    /// Leaf count unless another is asked for, 1 to [`MAX_GROWN_LEAVES`].
    pub leaves: u32,
    /// Seed unless another is asked for.
    pub seed: u64,
    /// Size and outline.
    pub crown: Crown,
    /// Stem levels: trunk, limbs, branches, twigs; 2 to 4 of them.
    pub levels: Vec<Level>,
    /// Leaf cards.
    pub leaf: LeafStyle,
    /// Bark.
    pub bark: BarkStyle,
}

/// Size and outline of the whole tree.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crown {
    /// How long limbs are, by their height in the crown.
    pub shape: Shape,
    /// Length of the trunk (with its splits, the height of the tree).
    pub height_m: f32,
    /// Deviation of `height_m`.
    pub height_v_m: f32,
    /// Lowest fraction of the trunk, without limbs.
    pub base: f32,
    /// Trunk radius over trunk length.
    pub ratio: f32,
    /// How quickly radius falls with length from a stem to its child: radius ~ length^power.
    pub ratio_power: f32,
    /// Widening of the trunk's foot: 1 doubles its radius.
    pub flare: f32,
    /// Bulges around the trunk.
    pub lobes: u32,
    /// Depth of the bulges over the radius.
    pub lobe_depth: f32,
    /// Trunks from one root.
    pub trunks: u32,
    /// Lean of each of several trunks.
    pub lean: f32,
}

/// Limb length over height in the crown (Weber & Penn, section 4.3 and the table of `ShapeRatio`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Longest below.
    Conical,
    /// Longest in the middle.
    Spherical,
    /// Longest below, rounded.
    Hemispherical,
    /// All alike.
    Cylindrical,
    /// A little longer below.
    TaperedCylindrical,
    /// Longest at 0.7 from the top.
    Flame,
    /// Longest above.
    InverseConical,
    /// Between tapered cylindrical and flame.
    TendFlame,
}

/// One level of stems.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Most stems of this level on one parent; unused for the trunk.
    #[serde(default)]
    pub branches: u32,
    /// Greatest length over the parent's (the trunk: over `height_m`).
    pub length: f32,
    /// Deviation of `length`.
    pub length_v: f32,
    /// Lost radius from foot to tip: 0 a cylinder, 1 a cone.
    pub taper: f32,
    /// Lowest fraction of each stem that bears no child and no leaf; the trunk's is `crown.base`.
    #[serde(default)]
    pub bare: f32,
    /// Straight pieces of a stem.
    pub segments: u32,
    /// Sides of its tube.
    pub sides: u32,
    /// Bend over the whole stem, or over its lower half where `curve_back` is not 0.
    pub curve: f32,
    /// Bend over the upper half.
    pub curve_back: f32,
    /// Random bend, summed over the segments.
    pub curve_v: f32,
    /// Forks per segment.
    pub splits: f32,
    /// Angle between a fork's arms.
    pub split_angle: f32,
    /// Deviation of `split_angle`.
    pub split_angle_v: f32,
    /// Angle between parent and stem.
    pub down_angle: f32,
    /// Deviation of `down_angle`; negative: not random, but larger for stems lower on the parent.
    pub down_angle_v: f32,
    /// Turn about the parent from one stem to the next.
    pub rotate: f32,
    /// Deviation of `rotate`.
    pub rotate_v: f32,
    /// Turn towards the sky over the whole stem; negative weeps.
    pub lift: f32,
}

/// Leaf cards: quads of two triangles, each one leaf or a small spray of leaves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafStyle {
    /// What is painted on the card.
    pub blade: Blade,
    /// Length of a card from its stalk.
    pub length_m: f32,
    /// Deviation of the size, as a fraction.
    pub length_v: f32,
    /// Width over length of the card.
    pub aspect: f32,
    /// How many of the thinnest stem levels bear leaves.
    pub levels: u32,
    /// Angle between twig and leaf.
    pub down_angle: f32,
    /// Deviation of `down_angle`.
    pub down_angle_v: f32,
    /// Turn about the twig from one leaf to the next.
    pub rotate: f32,
    /// How far leaves gather towards the end of their twig: 0 even, 1 strongly.
    pub cluster: f32,
    /// How far a leaf faces up and outwards instead of at random: 0 to 1.
    pub light: f32,
    /// How far a leaf hangs: 0 to 1.
    pub droop: f32,
    /// sRGB colour of the upper side.
    pub color: [u8; 3],
    /// sRGB colour of old or shaded leaves; cards lie between both.
    pub color_dark: [u8; 3],
}

/// What is painted on a leaf card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Blade {
    /// A spray of round-lobed leaves (oak).
    Lobed,
    /// Feather-like leaves of many leaflets (pecan).
    Pinnate,
    /// A spray of triangular, toothed, long-pointed leaves (birch).
    Toothed,
}

/// Bark.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarkStyle {
    /// What is painted.
    pub pattern: BarkPattern,
    /// Side of the painted square on the tree.
    pub size_m: f32,
    /// sRGB colour of the ridges.
    pub color: [u8; 3],
    /// sRGB colour of the furrows.
    pub color_dark: [u8; 3],
    /// sRGB factor on thin twigs.
    pub twig_tint: [u8; 3],
    /// Radius below which wood is a twig; at three times as much it is all bark.
    pub twig_radius_m: f32,
}

/// Kinds of bark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BarkPattern {
    /// Deep, upright furrows (oak).
    Furrowed,
    /// Flat, scaly ridges (pecan).
    Scaly,
    /// Pale and smooth with dark level marks (birch).
    Papery,
}

impl Species {
    /// The names that [`Species::embedded`] knows.
    pub const EMBEDDED: [&'static str; 3] = [SOURCES[0].0, SOURCES[1].0, SOURCES[2].0];

    /// One of the species that travel with the crate.
    ///
    /// # Errors
    /// [`InvalidOption`](Error::InvalidOption) for a name that is not in [`Species::EMBEDDED`].
    pub fn embedded(name: &str) -> Result<Self> {
        let source = SOURCES.iter().find(|(known, _)| *known == name);
        let (name, text) = source.ok_or_else(|| {
            let allowed = format!("{}, or a species .toml file", Self::EMBEDDED.join(", "));
            Error::invalid("species", format!("{name:?}"), allowed)
        })?;
        Self::from_toml(text, Path::new(&format!("{name}.toml")))
    }

    /// An embedded species by its name, or one in a `.toml` file.
    ///
    /// # Errors
    /// Those of [`embedded`](Self::embedded) and [`from_toml`](Self::from_toml), and [`Error::Io`].
    pub fn named(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Self::embedded(&path.to_string_lossy());
        }
        let text = std::io::read_to_string(file::open(path)?).map_err(|error| Error::io(path, error))?;
        Self::from_toml(&text, path)
    }

    /// Reads a species; `origin` stands in messages.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable) for text that is not TOML, for missing or unknown keys, and for values out of
    /// range: key, value and allowed range are named.
    pub fn from_toml(text: &str, origin: &Path) -> Result<Self> {
        let species: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let reason = format!("line {line}: {}", error.message().replace(char::is_control, " "));
            Error::unreadable(origin, reason, "see data/species/english-oak.toml for every key")
        })?;
        check_ranges(&species).map_err(|error| broken_by(error, origin))?;
        Ok(species)
    }

    /// Checks the range of every number, for a species that was made or changed by hand.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable), with the species' name as the path, for the first number out of its range.
    pub fn validate(&self) -> Result<()> {
        check_ranges(self).map_err(|error| broken_by(error, Path::new(&self.name)))
    }
}

/// A number out of its range as an error of the species at `origin`.
fn broken_by(error: Error, origin: &Path) -> Error {
    let Error::InvalidOption { field, value, allowed } = error else { return error };
    Error::unreadable(origin, format!("{field} is {value}"), format!("it must be {allowed}"))
}
