//! Names that options of the command line take, and what they stand for in the library.

use clap::ValueEnum;
use foliage_lod::{
    effects::{FadeBy, fade::Rule},
    stochastic::AreaRule,
};

/// Names of presets.
#[derive(Clone, Copy, ValueEnum)]
pub enum Preset {
    /// The method as published: vmi, nearest, 256 x 256.
    Paper,
    /// Quick: image, image, 128 x 128, cascade.
    Fast,
    /// Better than the paper at little more time: image, image, 256 x 256, cascade.
    Balanced,
    /// As good as it gets: image, image, 512 x 512.
    Best,
}

/// Names of criteria.
#[derive(Clone, Copy, ValueEnum)]
pub enum CriterionName {
    /// Least change of the viewpoint mutual information.
    Vmi,
    /// Least visible area.
    Area,
    /// Least change of colour and coverage, compared with the full plant.
    Image,
}

/// Names of the rules that enlarge.
#[derive(Clone, Copy, ValueEnum)]
pub enum CompensateName {
    /// The nearest remaining leaf takes the share of it that was seen.
    Nearest,
    /// Of the nearest ones that which wins back most of the silhouettes.
    Silhouette,
    /// Of the nearest ones that which brings the views closest to the full plant's.
    Image,
    /// It is lost.
    None,
}

/// What is one leaf.
#[derive(Clone, Copy, ValueEnum)]
pub enum GroupName {
    /// Cards that cross at one centre.
    Crossed,
    /// Every connected piece.
    Piece,
}

/// Where fragments are captured and pictures are drawn.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Raster {
    /// On a GPU where an adapter answers, else on the CPU.
    Auto,
    /// On a GPU or not at all.
    Gpu,
    /// On the CPU.
    Cpu,
}

/// What is drawn.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// The active prefix with its enlarged leaves.
    Vds,
    /// A random part of the leaves, all enlarged alike (Cook et al.).
    Stochastic,
    /// Every leaf.
    Full,
}

/// Names of the rules for the leaves of stochastic pictures.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum AreaName {
    /// The visible area stays what it is (Cook et al., Equation 6).
    Visible,
    /// The surface area stays what it is (Cook et al., Equation 3).
    Surface,
    /// 1/lambda as a linear factor (Gomez).
    Linear,
    /// No leaf grows.
    None,
}

/// Names of the published fades.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FadeRule {
    /// A tenth of the leaves to either side, in a straight line (Cook et al.).
    Window,
    /// The last 5 % of those drawn (Gomez).
    Trailing,
    /// A tenth of those drawn to either side (Fichtner).
    Relative,
    /// As window, without a kink.
    Smoothstep,
}

/// What of a fading leaf changes.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FadeByName {
    /// Its size.
    Size,
    /// The share of each pixel that it covers.
    Alpha,
}

impl AreaName {
    /// As the library takes it.
    pub fn rule(self) -> AreaRule {
        match self {
            Self::Visible => AreaRule::Visible,
            Self::Surface => AreaRule::Surface,
            Self::Linear => AreaRule::Linear,
            Self::None => AreaRule::None,
        }
    }
}

impl From<FadeRule> for Rule {
    fn from(rule: FadeRule) -> Self {
        match rule {
            FadeRule::Window | FadeRule::Smoothstep => Self::Window,
            FadeRule::Trailing => Self::Trailing,
            FadeRule::Relative => Self::Relative,
        }
    }
}

impl From<FadeByName> for FadeBy {
    fn from(by: FadeByName) -> Self {
        match by {
            FadeByName::Size => Self::Size,
            FadeByName::Alpha => Self::Alpha,
        }
    }
}
