//! Number of leaves needed for a target quality.

use super::{metrics::Quality, reference::Reference};
use crate::{
    Error, Plant, Result,
    draw::light::Lighting,
    extract::Sizes,
    model::FoliageModel,
    software::{DrawList, Painter, model_toning},
};
use std::{fmt, str::FromStr};

/// A measure of [`Quality`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Structural similarity; the bound is a minimum.
    Ssim,
    /// Root mean squared error; the bound is a maximum.
    Rmse,
    /// Silhouette difference; the bound is a maximum.
    Xor,
}

/// A bound on a measure at a picture size, written `ssim=0.9@200`: the structural similarity is at
/// least 0.9 in pictures of 200 x 200 pixels that the full plant fills. For `rmse` and `xor` the
/// bound is a maximum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The measure to bound.
    pub measure: Measure,
    /// The bound.
    pub bound: f64,
    /// Side of the pictures in pixels.
    pub pixels: u32,
}

/// The number of leaves that reaches a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Fewest leaves found that meet the bound.
    pub leaves: u32,
    /// Quality with this number of leaves.
    pub quality: Quality,
}

/// Allowed sides of the pictures in pixels.
const SIDES: std::ops::RangeInclusive<u32> = 8..=2048;

impl FromStr for Target {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let refused = || {
            let allowed = "MEASURE=BOUND@PIXELS with ssim, rmse or xor and 8 to 2048 pixels, such as ssim=0.9@200";
            Error::invalid("target", text, allowed)
        };
        let (measure, rest) = text.split_once('=').ok_or_else(refused)?;
        let (bound, pixels) = rest.split_once('@').ok_or_else(refused)?;
        let measure = match measure.trim() {
            "ssim" => Measure::Ssim,
            "rmse" => Measure::Rmse,
            "xor" => Measure::Xor,
            _ => return Err(refused()),
        };
        let bound: f64 = bound.trim().parse().map_err(|_| refused())?;
        let pixels = pixels.trim().trim_end_matches("px").trim().parse().map_err(|_| refused())?;
        let target = Self { measure, bound, pixels };
        if bound.is_finite() && bound >= 0.0 && SIDES.contains(&pixels) { Ok(target) } else { Err(refused()) }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let measure = match self.measure {
            Measure::Ssim => "ssim",
            Measure::Rmse => "rmse",
            Measure::Xor => "xor",
        };
        write!(out, "{measure}={}@{}", self.bound, self.pixels)
    }
}

impl Target {
    /// Whether `quality` meets the bound.
    pub fn holds(&self, quality: &Quality) -> bool {
        match self.measure {
            Measure::Ssim => quality.ssim >= self.bound,
            Measure::Rmse => quality.rmse <= self.bound,
            Measure::Xor => quality.xor <= self.bound,
        }
    }

    /// Applies [`reach`](Self::reach) at several sizes instead of the target's own. The result is a
    /// run-time policy; its sizes are increasing diameters of the plant in pixels.
    ///
    /// # Errors
    /// Same as [`reach`](Self::reach), and [`Error::InvalidOption`] for sizes that do not increase
    /// or are outside 8 to 2048.
    pub fn sizes(&self, plant: &Plant, model: &FoliageModel, diameters_px: &[u32]) -> Result<Sizes> {
        let leaves = model.leaves.len() as f32;
        let refused = || Error::invalid("sizes", format!("{diameters_px:?}"), "increasing, from 8 to 2048 pixels");
        if !diameters_px.iter().all(|pixels| SIDES.contains(pixels)) {
            return Err(refused());
        }
        let share = |&pixels: &u32| {
            let reached = Self { pixels, ..*self }.reach(plant, model)?;
            Ok((pixels as f32, reached.leaves as f32 / leaves))
        };
        Sizes::new(&diameters_px.iter().map(share).collect::<Result<Vec<_>>>()?).ok_or_else(refused)
    }

    /// The fewest leaves of `model`, simplified from `plant`, that meet the bound on average over
    /// the held-out views. Found by bisection, which is exact if quality rises with every leaf. If
    /// no count meets the bound, all leaves are returned.
    ///
    /// # Errors
    /// Same as [`Reference::new`], [`Painter::new`] and [`Painter::draw`].
    pub fn reach(&self, plant: &Plant, model: &FoliageModel) -> Result<Reached> {
        let reference = Reference::new(plant, self.pixels)?;
        let painter = Painter::new(&model.materials, &model.textures)?;
        let tone = model_toning(model, &Lighting::default())?;
        self.fewest(model.leaves.len() as u32, &mut |n| {
            reference.quality(&painter, DrawList::of_model(model, n as usize), tone)
        })
    }

    /// The fewest of `leaves` with which `quality` meets the bound, as of [`reach`](Self::reach).
    ///
    /// # Errors
    /// Those of `quality`.
    pub fn fewest(&self, leaves: u32, quality: &mut dyn FnMut(u32) -> Result<Quality>) -> Result<Reached> {
        let (mut too_few, mut enough) = (0, Reached { leaves, quality: quality(leaves)? });
        while too_few + 1 < enough.leaves {
            let middle = (too_few + enough.leaves) / 2;
            let quality = quality(middle)?;
            if self.holds(&quality) { enough = Reached { leaves: middle, quality } } else { too_few = middle }
        }
        Ok(enough)
    }
}

#[cfg(all(test, feature = "simplify"))]
mod tests {
    use super::*;
    use crate::{
        extract::{LodPolicy, Sight},
        grow::{GrowOptions, Species, grow},
        simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    };

    #[test]
    fn targets_are_read_and_others_refused_in_one_line() {
        let target = Target { measure: Measure::Ssim, bound: 0.9, pixels: 200 };
        assert_eq!("ssim=0.9@200".parse::<Target>().unwrap(), target);
        assert_eq!(target.to_string(), "ssim=0.9@200");
        assert_eq!("xor=0.02@64px".parse::<Target>().unwrap().measure, Measure::Xor);
        for text in ["", "ssim", "ssim=.9", "psnr=3@200", "rmse=NaN@200", "rmse=-1@200", "ssim=.9@4", "ssim=.9@big"] {
            let error = text.parse::<Target>().unwrap_err().to_string();
            assert!(error.contains("such as ssim=0.9@200") && !error.contains('\n'), "{text}: {error}");
        }
    }

    #[test]
    fn the_count_that_is_told_keeps_the_bound_and_one_leaf_fewer_does_not() {
        let species = Species::embedded("betula-populifolia").unwrap();
        let plant = grow(&species, &GrowOptions { leaves: Some(300), ..GrowOptions::default() }).unwrap();
        let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::balanced() };
        let model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        let target: Target = "rmse=12@48".parse().unwrap();
        let reached = target.reach(&plant, &model).unwrap();
        assert!(target.holds(&reached.quality) && (1..300).contains(&reached.leaves), "{reached:?}");
        let reference = Reference::new(&plant, 48).unwrap();
        let painter = Painter::new(&model.materials, &model.textures).unwrap();
        let list = DrawList::of_model(&model, reached.leaves as usize - 1);
        let fewer = reference.quality(&painter, list, None).unwrap();
        assert!(!target.holds(&fewer), "{fewer:?}");

        let sizes = target.sizes(&plant, &model, &[16, 48]).unwrap();
        let share = |diameter_px: f32| {
            // A distant sphere in a picture of 100 rows, with a field of view of one radian.
            let distance = 100.0 / (diameter_px * 0.5_f32.tan());
            sizes.lod_outside(&Sight { distance, radius: 1.0, fov_y: 1.0, height_px: 100.0 })
        };
        let expected = reached.leaves as f32 / 300.0;
        assert!((share(48.0) - expected).abs() < 0.02 && share(1000.0) == expected, "{} {expected}", share(48.0));
        assert!(share(16.0) <= share(30.0) && share(30.0) <= share(48.0) && share(4.0) > 0.0);
        assert!(target.sizes(&plant, &model, &[48, 16]).is_err() && target.sizes(&plant, &model, &[2]).is_err());
    }
}
