//! Rules by which a budget is split: the least error, and what it is compared with.

use super::{
    demand::{Corners, Demand, Exponent},
    item::{Item, MOST_DIAMETER_PX},
    octaves::Octaves,
    weighed::Weighed,
};
use crate::{
    model::ErrorCurve,
    stochastic::lambda::{SceneReduction, from_area},
};

/// How a budget is split.
///
/// Rules other than the errors say nothing about a budget: they give shares of the leaves, which
/// are all multiplied by the one factor that spends it, but none above 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// The least sum of powers of the errors. With [`Exponent::WORST`] all plants have the same
    /// error, as far as their floors and ceilings let them.
    LeastError(Exponent),
    /// Cook et al.: a power of the area on screen.
    Cook(CookShare),
    /// The scene-wide reduction of Gomez, of Cook's shares.
    Gomez(GomezShare),
    /// The same share of the leaves for all plants.
    Uniform,
}

impl Default for Rule {
    fn default() -> Self {
        Self::LeastError(Exponent::default())
    }
}

/// Parameters of [`Rule::Cook`]: [`from_area`] of the area on screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookShare {
    /// Diameter in pixels from which on the share is 1.
    pub start_px: f32,
    /// Area, over that at `start_px`, at which the share is 1/2: between 0 and 1.
    pub half_area: f32,
}

impl CookShare {
    /// As [`CookLambda`](crate::extract::CookLambda) by default, in pictures of so many rows.
    pub fn of_height(height_px: f32) -> Self {
        // The outline of a sphere at 3 radii, seen with 60 degrees, over half of the height.
        const OUTLINE: f32 = 0.612_372_4;
        Self { start_px: OUTLINE * height_px, half_area: 0.4 }
    }

    fn share(&self, item: &Item) -> f64 {
        let diameter = if item.diameter_px.is_nan() { MOST_DIAMETER_PX } else { item.diameter_px };
        let ratio = f64::from(diameter.max(0.0)) / f64::from(self.start_px);
        from_area(ratio * ratio, f64::from(self.half_area))
    }
}

/// Parameters of [`Rule::Gomez`]; see [`SceneReduction`], whose distances and number of plants are
/// those of the items.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GomezShare {
    /// Shares that are reduced.
    pub cook: CookShare,
    /// Maximum reduction, a, as a share; published as 0.5.
    pub strength: f64,
    /// Distance of the far plane, in the unit of the items' distances.
    pub far: f64,
    /// Number of plants at which the falloff is linear, m; published as 50.
    pub linear_falloff_plants: f64,
}

impl GomezShare {
    /// The published parameters, with Cook's shares in pictures of so many rows.
    pub fn published(height_px: f32, far: f64) -> Self {
        Self { cook: CookShare::of_height(height_px), strength: 0.5, far, linear_falloff_plants: 50.0 }
    }

    fn reduction(&self, items: &[Item]) -> SceneReduction {
        let distances = || items.iter().map(|item| f64::from(item.distance)).filter(|distance| distance.is_finite());
        let range = [distances().fold(f64::INFINITY, f64::min), distances().fold(f64::NEG_INFINITY, f64::max)];
        let &Self { strength, far, linear_falloff_plants, .. } = self;
        SceneReduction { strength, range, far, linear_falloff_plants, plants: items.len() as f64 }
    }
}

impl Rule {
    /// Demand by each of the curves, then that of a plant without leaves.
    pub(super) fn demands(&self, curves: &[ErrorCurve], corners: Corners) -> Vec<Demand> {
        let demand = |curve: &ErrorCurve| match self {
            Self::LeastError(exponent) => Demand::new(curve, *exponent, corners),
            _ => Demand::proportional(curve.leaves()),
        };
        curves.iter().map(demand).chain([Demand::proportional(0)]).collect()
    }

    /// Calls `with` with each of the items, prepared.
    pub(super) fn weigh(&self, items: &[Item], demands: &[Demand], octaves: &Octaves, with: &mut impl FnMut(Weighed)) {
        let last = demands.len() - 1;
        let mut weighed = |item: &Item, gain: &dyn Fn(&Demand) -> f32| {
            let demand = (item.curve as usize).min(last);
            let of = &demands[demand];
            let (bounds, unit_cost) = (item.bounds(of.leaves), item.unit_cost());
            with(Weighed { demand: demand as u32, gain: gain(of), bounds, unit_cost });
        };
        let of_share = |share: f64| octaves.of(share as f32);
        match self {
            Self::LeastError(exponent) => {
                let of_cost = exponent.of_cost() as f32;
                for item in items {
                    weighed(item, &|demand| {
                        let weight = item.weight_octaves(octaves, demand.size, demand.power);
                        match item.unit_cost() {
                            1.0 => weight,
                            _ if weight == f32::NEG_INFINITY => weight,
                            0.0 => f32::INFINITY,
                            cost => weight - of_cost * octaves.of(cost),
                        }
                    });
                }
            }
            Self::Cook(cook) => items.iter().for_each(|item| weighed(item, &|_| of_share(cook.share(item)))),
            Self::Gomez(gomez) => {
                let reduction = gomez.reduction(items);
                for item in items {
                    let share = reduction.reduced(gomez.cook.share(item), f64::from(item.distance));
                    weighed(item, &|_| of_share(share));
                }
            }
            Self::Uniform => items.iter().for_each(|item| weighed(item, &|_| 0.0)),
        }
    }
}
