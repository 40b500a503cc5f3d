//! Option values that are chosen by name.

use clap::{
    ValueEnum,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use std::str::FromStr;
use strum::{EnumMessage, ParseError, VariantArray};

/// Parser for an enum of the library. The help lists its variants with their docs.
pub fn variant<T>() -> impl TypedValueParser<Value = T>
where
    T: VariantArray + EnumMessage + FromStr<Err = ParseError> + Copy + Into<&'static str> + Send + Sync,
{
    let value = |&variant: &T| {
        let lines: Vec<&str> = variant.get_documentation().unwrap_or_default().lines().collect();
        PossibleValue::new(variant.into()).help(lines.join(" ").trim_end_matches('.').to_owned())
    };
    PossibleValuesParser::new(T::VARIANTS.iter().map(value)).try_map(|name| name.parse())
}

/// Parses a fraction above 0 and at most 1.
pub fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "write numbers such as 0.5,0.15")?;
    if share > 0.0 && share <= 1.0 {
        Ok(share)
    } else {
        Err("a fraction of the leaves must be above 0 and at most 1".into())
    }
}

/// Presets of the simplification.
#[derive(Clone, Copy, ValueEnum)]
pub enum Preset {
    /// The method as published: criterion vmi, compensate nearest, 256 x 256.
    Paper,
    /// Quick: criterion image, compensate image, 128 x 128, cascade.
    Fast,
    /// Better quality than `paper` for somewhat more time: criterion image, compensate image,
    /// 256 x 256, cascade.
    Balanced,
    /// Highest quality: criterion image, compensate image, 512 x 512.
    Best,
}

/// The processor that captures fragments and draws pictures.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Raster {
    /// The GPU if there is one, else the CPU.
    Auto,
    /// The GPU; an error if there is none.
    Gpu,
    /// The CPU.
    Cpu,
}

/// Whether something is done.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// It is.
    On,
    /// It is not.
    Off,
}

/// How the leaves to draw are chosen.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// The active prefix with its enlarged leaves.
    Vds,
    /// A random subset of the leaves, all enlarged by the same factor (Cook et al.).
    Stochastic,
    /// Every leaf.
    Full,
}

/// The published fades.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FadeRule {
    /// Linear over a tenth of all leaves to either side (Cook et al.).
    Window,
    /// The last 5 % of the drawn leaves (Gomez).
    Trailing,
    /// A tenth of the drawn leaves to either side (Fichtner).
    Relative,
    /// Same as `window`, eased at both ends.
    Smoothstep,
}
