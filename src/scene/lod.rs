//! Level-of-detail policy of a scene: its name and parameters.

use super::check::wrong_if;
use crate::{
    Result,
    error::check_range,
    extract::{Blend, CookLambda, LodPolicy, PixelError, Sizes},
    model::FoliageModel,
};
use serde::Deserialize;

/// Names of the level-of-detail policies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// Distance and projected area: [`Blend`].
    #[default]
    Blend,
    /// Lambda of Cook et al.: [`CookLambda`].
    Cook,
    /// Recorded error in pixels: [`PixelError`].
    Pixels,
    /// Fractions measured at several sizes: [`Sizes`].
    Sizes,
    /// Every leaf.
    Full,
}

/// Level-of-detail policy. A missing parameter takes the policy's default; a parameter of another
/// policy is an error.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lod {
    /// The policy.
    pub policy: Policy,
    /// `blend`: distance in radii up to which all leaves are drawn.
    pub near: Option<f32>,
    /// `blend`: distance in radii beyond which nearness is 0.
    pub far: Option<f32>,
    /// `cook`: distance in radii within which all leaves are drawn.
    pub start: Option<f32>,
    /// `cook`: screen area, over that at `start`, at which half of the leaves are drawn.
    pub half_area: Option<f32>,
    /// `pixels`: maximum number of wrong pixels.
    pub bound: Option<f32>,
    /// `sizes`: increasing diameters in pixels, each with the fraction of the leaves that suffices
    /// there.
    pub shares: Vec<[f32; 2]>,
    /// Error in pixels that wood is drawn at (see [`Look::wood_error_px`](crate::Look)).
    pub wood_error: Option<f32>,
    /// Dead band as a fraction of the count: 0 follows the camera immediately.
    pub dead_band: Option<f32>,
}

impl Lod {
    /// The policy for one model.
    pub fn policy(&self, model: &FoliageModel) -> Box<dyn LodPolicy + Send + Sync> {
        match self.policy {
            Policy::Blend => {
                let own = Blend::default();
                let (near, far) = (self.near.unwrap_or(own.near), self.far.unwrap_or(own.far));
                Box::new(Blend { near, far, ..own })
            }
            Policy::Cook => {
                let own = CookLambda::default();
                let half_area = self.half_area.unwrap_or(own.half_area);
                Box::new(CookLambda { start: self.start.unwrap_or(own.start), half_area })
            }
            Policy::Pixels => Box::new(PixelError::new(model, self.bound.unwrap_or(DEFAULT_BOUND_PX))),
            Policy::Sizes => match self.sizes() {
                Some(sizes) => Box::new(sizes),
                None => Box::new(Everything),
            },
            Policy::Full => Box::new(Everything),
        }
    }
}

impl Lod {
    fn sizes(&self) -> Option<Sizes> {
        Sizes::new(&self.shares.iter().map(|&[px, share]| (px, share)).collect::<Vec<_>>())
    }

    pub(super) fn check(&self) -> Result<()> {
        let numbers = [
            ("lod.near", self.near, Policy::Blend, [0.0, 1e9]),
            ("lod.far", self.far, Policy::Blend, [0.0, 1e9]),
            ("lod.start", self.start, Policy::Cook, [1e-3, 1e9]),
            ("lod.half_area", self.half_area, Policy::Cook, [1e-6, 0.999]),
            ("lod.bound", self.bound, Policy::Pixels, [0.0, 1e9]),
        ];
        for (key, number, policy, [least, most]) in numbers {
            let Some(number) = number else { continue };
            let policy_name = format!("{:?}", self.policy).to_lowercase();
            let allowed = format!("left out: the policy {policy_name} does not use it");
            wrong_if(policy != self.policy, key, &number.to_string(), &allowed)?;
            check_range(key, number, least..=most)?;
        }
        let allowed =
            "pairs of an increasing diameter in pixels and a fraction above 0, at most 1, with the policy sizes";
        let fits = if self.policy == Policy::Sizes { self.sizes().is_some() } else { self.shares.is_empty() };
        wrong_if(!fits, "lod.shares", &format!("{:?}", self.shares), allowed)?;
        check_range("lod.wood_error", self.wood_error.unwrap_or(0.0), 0.0..=1e6)?;
        check_range("lod.dead_band", self.dead_band.unwrap_or(0.0), 0.0..=1.0)
    }
}

/// Default bound on wrong pixels.
const DEFAULT_BOUND_PX: f32 = 200.0;

/// Draws every leaf.
struct Everything;

impl LodPolicy for Everything {
    fn lod_outside(&self, _: &crate::extract::Sight) -> f32 {
        1.0
    }
}
