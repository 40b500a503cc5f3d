//! How many leaves a target of quality takes.

use super::{
    method::Method,
    metrics::Quality,
    study::{Study, StudyOptions},
};
use crate::{Error, Plant, Result, extract::lod::Sizes, model::FoliageModel};
use std::str::FromStr;

/// A measure of [`Quality`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// At least.
    Ssim,
    /// At most.
    Rmse,
    /// At most.
    Xor,
}

/// A bound on a measure in pictures of some size, written `ssim=0.9@200`: the structural similarity is at least 0.9 where
/// the full plant fills 200 pixels. `rmse` and `xor` are at most what is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// What is bounded.
    pub measure: Measure,
    /// The bound.
    pub bound: f64,
    /// Side of the pictures.
    pub pixels: u32,
}

/// The number of leaves that reaches a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Fewest leaves found that keep the bound.
    pub leaves: u32,
    /// Quality with that many.
    pub quality: Quality,
}

/// Pictures from 8 to 2048 pixels on a side.
const SIDES: std::ops::RangeInclusive<u32> = 8..=2048;

impl FromStr for Target {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let refused = || {
            let allowed = "ssim, rmse or xor, = and a bound, @ and 8 to 2048 pixels, such as ssim=0.9@200";
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

impl Target {
    /// The quality keeps the bound.
    pub fn holds(&self, quality: &Quality) -> bool {
        match self.measure {
            Measure::Ssim => quality.ssim >= self.bound,
            Measure::Rmse => quality.rmse <= self.bound,
            Measure::Xor => quality.xor <= self.bound,
        }
    }

    /// As [`reach`](Self::reach) at several sizes instead of the target's own: a rule for the run time, whose sizes are
    /// diameters of the plant in pixels, rising.
    ///
    /// # Errors
    /// Those of the drawing, and [`Error::InvalidOption`] for sizes that do not rise or are beyond 8 to 2048.
    pub fn sizes(&self, plant: &Plant, model: &FoliageModel, diameters_px: &[u32]) -> Result<Sizes> {
        let leaves = model.leaves.len() as f32;
        let refused = || Error::invalid("sizes", format!("{diameters_px:?}"), "rising, from 8 to 2048 pixels");
        if !diameters_px.iter().all(|pixels| SIDES.contains(pixels)) {
            return Err(refused());
        }
        let share = |&pixels: &u32| {
            let reached = Self { pixels, ..*self }.reach(plant, model.clone())?;
            Ok((pixels as f32, reached.leaves as f32 / leaves))
        };
        Sizes::new(&diameters_px.iter().map(share).collect::<Result<Vec<_>>>()?).ok_or_else(refused)
    }

    /// The fewest leaves of `model`, made of `plant`, that keep the bound in the mean of the held-out views, by halving:
    /// exact where quality rises with every leaf. All leaves always do.
    ///
    /// # Errors
    /// Those of the drawing.
    pub fn reach(&self, plant: &Plant, model: FoliageModel) -> Result<Reached> {
        let options = StudyOptions { sizes: vec![self.pixels], ..StudyOptions::default() };
        let study = Study::new(plant, &options)?;
        let leaves = model.leaves.len() as u32;
        let method = Method::of_model("target", model);
        let quality = |n: u32| study.quality(&method.at(f64::from(n) / f64::from(leaves)), 0);
        let (mut too_few, mut enough) = (0, Reached { leaves, quality: quality(leaves)? });
        while too_few + 1 < enough.leaves {
            let middle = (too_few + enough.leaves) / 2;
            let quality = quality(middle)?;
            if self.holds(&quality) { enough = Reached { leaves: middle, quality } } else { too_few = middle }
        }
        Ok(enough)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        extract::{LodPolicy, Sight},
        grow::{GrowOptions, Species, grow},
        simplify::{Quiet, SimplifyOptions, raster::CpuFragments, simplify},
    };

    #[test]
    fn targets_are_read_and_others_refused_in_one_line() {
        let target = Target { measure: Measure::Ssim, bound: 0.9, pixels: 200 };
        assert_eq!("ssim=0.9@200".parse::<Target>().unwrap(), target);
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
        let reached = target.reach(&plant, model.clone()).unwrap();
        assert!(target.holds(&reached.quality) && (1..300).contains(&reached.leaves), "{reached:?}");
        let options = StudyOptions { sizes: vec![48], ..StudyOptions::default() };
        let study = Study::new(&plant, &options).unwrap();
        let method = Method::of_model("", model);
        let fewer = study.quality(&method.at(f64::from(reached.leaves - 1) / 300.0), 0).unwrap();
        assert!(!target.holds(&fewer), "{fewer:?}");

        let model = method.model().unwrap();
        let sizes = target.sizes(&plant, model, &[16, 48]).unwrap();
        let share = |diameter_px: f32| {
            // The outline of a sphere far away, in a picture of 100 rows with a field of view of one radian.
            let distance = 100.0 / (diameter_px * 0.5_f32.tan());
            sizes.lod(&Sight { distance, radius: 1.0, fov_y: 1.0, height_px: 100.0 })
        };
        let expected = reached.leaves as f32 / 300.0;
        assert!((share(48.0) - expected).abs() < 0.02 && share(1000.0) == expected, "{} {expected}", share(48.0));
        assert!(share(16.0) <= share(30.0) && share(30.0) <= share(48.0) && share(4.0) > 0.0);
        assert!(target.sizes(&plant, model, &[48, 16]).is_err() && target.sizes(&plant, model, &[2]).is_err());
    }
}
