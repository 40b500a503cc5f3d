//! Species: the parameters that determine how a tree grows.

use serde::Deserialize;

/// Maximum number of leaves of a grown tree.
pub const MAX_GROWN_LEAVES: u32 = 1_000_000;

/// A species: every parameter that the growth of a tree depends on. Lengths are in metres, angles
/// in degrees.
///
/// Ranges are checked on reading and by [`validate`](Self::validate). A field with the suffix `_v`
/// is the maximum random deviation of the field without it, in either direction.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    /// Common name; becomes the name of the plant.
    pub name: String,
    /// Botanical name.
    pub latin: String,
    /// Default number of leaves, 1 to [`MAX_GROWN_LEAVES`].
    pub leaves: u32,
    /// Default seed.
    pub seed: u64,
    /// Size and outline of the crown.
    pub crown: Crown,
    /// Stem levels: trunk, limbs, branches, twigs; 2 to 4 of them.
    pub levels: Vec<Level>,
    /// Leaf cards.
    pub leaf: LeafStyle,
    /// Appearance of the bark.
    pub bark: BarkStyle,
}

/// Size and outline of the whole tree.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crown {
    /// How the length of limbs varies with their height in the crown.
    pub shape: Shape,
    /// Length of the trunk (with its splits, the height of the tree).
    pub height_m: f32,
    /// Deviation of `height_m`.
    pub height_v_m: f32,
    /// Fraction of the trunk, from the ground up, that has no limbs.
    pub base: f32,
    /// Trunk radius over trunk length.
    pub ratio: f32,
    /// Exponent of the radius of a child relative to its parent: radius ~ length^power.
    pub ratio_power: f32,
    /// Widening of the foot of the trunk: 1 about doubles its radius.
    pub flare: f32,
    /// Number of lobes (bulges) around the trunk.
    pub lobes: u32,
    /// Depth of the lobes as a fraction of the radius.
    pub lobe_depth: f32,
    /// Number of trunks from one root.
    pub trunks: u32,
    /// Lean from the vertical, if there are several trunks.
    pub lean: f32,
}

/// Limb length as a function of height in the crown (Weber & Penn, section 4.3 and the table of
/// `ShapeRatio`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Longest at the bottom.
    Conical,
    /// Longest in the middle.
    Spherical,
    /// Longest at the bottom, rounded.
    Hemispherical,
    /// All of the same length.
    Cylindrical,
    /// Longest at the bottom, twice as long as at the top.
    TaperedCylindrical,
    /// Longest at 0.7 of the crown depth from the top.
    Flame,
    /// Longest at the top.
    InverseConical,
    /// Between tapered cylindrical and flame.
    TendFlame,
}

/// One level of stems.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Maximum number of stems of this level on one parent; unused for the trunk.
    #[serde(default)]
    pub branches: u32,
    /// Maximum length, as a fraction of the length of the parent (for the trunk, of `height_m`).
    pub length: f32,
    /// Deviation of `length`.
    pub length_v: f32,
    /// Fraction of the radius lost from foot to tip: 0 is a cylinder, 1 a cone.
    pub taper: f32,
    /// Fraction of each stem, from its foot, without children and leaves; the trunk uses
    /// `crown.base` instead.
    #[serde(default)]
    pub bare: f32,
    /// Number of straight segments of a stem.
    pub segments: u32,
    /// Number of sides of its tube.
    pub sides: u32,
    /// Bend over the whole stem, or over its lower half if `curve_back` is not 0.
    pub curve: f32,
    /// Bend over the upper half.
    pub curve_back: f32,
    /// Random bend, summed over the segments.
    pub curve_v: f32,
    /// Average number of forks per segment.
    pub splits: f32,
    /// Angle between the arms of a fork.
    pub split_angle: f32,
    /// Deviation of `split_angle`.
    pub split_angle_v: f32,
    /// Angle between the stem and its parent.
    pub down_angle: f32,
    /// Deviation of `down_angle`. A negative value is not random: the angle then increases towards
    /// the foot of the parent.
    pub down_angle_v: f32,
    /// Rotation about the parent from one stem to the next.
    pub rotate: f32,
    /// Deviation of `rotate`.
    pub rotate_v: f32,
    /// Turn towards the sky over the whole stem; negative values weep.
    pub lift: f32,
}

/// Leaf cards: quads of two triangles, each a single leaf or a small spray of leaves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafStyle {
    /// Kind of leaf painted on the card.
    pub blade: Blade,
    /// Length of a card from its stalk.
    pub length_m: f32,
    /// Deviation of the card length, as a fraction.
    pub length_v: f32,
    /// Width of the card divided by its length.
    pub aspect: f32,
    /// Number of stem levels that bear leaves, counted from the thinnest.
    pub levels: u32,
    /// Angle between twig and leaf.
    pub down_angle: f32,
    /// Deviation of `down_angle`.
    pub down_angle_v: f32,
    /// Rotation about the twig from one leaf to the next.
    pub rotate: f32,
    /// How strongly leaves gather towards the end of their twig: 0 is even, 1 is strongest.
    pub cluster: f32,
    /// How strongly a leaf faces up and outwards instead of in a random direction: 0 to 1.
    pub light: f32,
    /// How strongly a leaf hangs down: 0 to 1.
    pub droop: f32,
    /// sRGB colour of the upper side.
    pub color: [u8; 3],
    /// sRGB colour of old or shaded leaves; each card has a random colour between the two.
    pub color_dark: [u8; 3],
}

/// Kinds of leaves painted on a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Blade {
    /// A spray of round-lobed leaves (oak).
    Lobed,
    /// Feather-like leaves of many leaflets (pecan).
    Pinnate,
    /// A spray of triangular, toothed, long-pointed leaves (birch).
    Toothed,
    /// Narrow blades from one root (grass).
    Grass,
    /// A pinna: leaflets in two rows along a rib, smaller towards its end (fern).
    Pinna,
}

/// Appearance of the bark.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarkStyle {
    /// Kind of bark.
    pub pattern: BarkPattern,
    /// Side length of one repeat of the square texture on the tree.
    pub size_m: f32,
    /// sRGB colour of the ridges.
    pub color: [u8; 3],
    /// sRGB colour of the furrows.
    pub color_dark: [u8; 3],
    /// sRGB factor applied to thin twigs.
    pub twig_tint: [u8; 3],
    /// Radius below which wood is a twig; from three times this radius it is fully bark.
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
    /// Pale and smooth with dark horizontal marks (birch).
    Papery,
}
