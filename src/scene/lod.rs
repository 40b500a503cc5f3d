//! How many leaves a scene's plants are drawn with: a policy by its name, with its numbers.

use super::check::wrong_if;
use crate::{
    Result,
    error::check_range,
    extract::{
        LodPolicy,
        lod::{Blend, CookLambda, PixelError, Sizes},
    },
    model::FoliageModel,
};
use serde::Deserialize;

/// Names of the rules for the level of detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// By distance and projected area.
    #[default]
    Blend,
    /// Cook's lambda.
    Cook,
    /// By recorded error in pixels.
    Pixels,
    /// By shares measured at some sizes.
    Sizes,
    /// Every leaf.
    Full,
}

/// How many leaves are drawn. A number that is missing has the rule's own default; one that another rule takes is an error.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lod {
    /// The rule.
    pub policy: Policy,
    /// `blend`: distance in radii up to which everything is drawn.
    pub near: Option<f32>,
    /// `blend`: distance in radii from which distance takes off no more.
    pub far: Option<f32>,
    /// `cook`: distance in radii within which everything is drawn.
    pub start: Option<f32>,
    /// `cook`: screen area, over that at `start`, at which half of the leaves stay.
    pub half_area: Option<f32>,
    /// `pixels`: most pixels that may be wrong.
    pub bound: Option<f32>,
    /// `sizes`: diameters in pixels, rising, each with the share of the leaves that is enough there.
    pub shares: Vec<[f32; 2]>,
    /// Dead band over the count: 0 follows the camera at once.
    pub dead_band: Option<f32>,
}

impl Lod {
    /// The rule for one model.
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
            let allowed = format!("left out: the policy {policy_name} does not take it");
            wrong_if(policy != self.policy, key, &number.to_string(), &allowed)?;
            check_range(key, number, least..=most)?;
        }
        let allowed = "pairs of a rising diameter in pixels and a share above 0, at most 1, with the policy sizes";
        let fits = if self.policy == Policy::Sizes { self.sizes().is_some() } else { self.shares.is_empty() };
        wrong_if(!fits, "lod.shares", &format!("{:?}", self.shares), allowed)?;
        check_range("lod.dead_band", self.dead_band.unwrap_or(0.0), 0.0..=1.0)
    }
}

/// Pixels that may be wrong unless a scene says otherwise.
const DEFAULT_BOUND_PX: f32 = 200.0;

/// Draws every leaf.
struct Everything;

impl LodPolicy for Everything {
    fn lod(&self, _: &crate::extract::Sight) -> f32 {
        1.0
    }
}
