//! Effects: optional simulation and shading on top of the drawn prefix. Each is a switch with
//! parameters of its own.
//!
//! A disabled effect costs nothing: renderers build no pipeline, buffer or pass for it. An enabled
//! effect is simulated only where it is visible; [`Count`] records how often.

mod fade;
pub(crate) mod limbs;
pub(crate) mod sky;
mod switch;
pub(crate) mod wind;

pub use fade::{Fade, FadeBy, Rule as FadeRule};
pub use limbs::{Carry, Limbs};
pub use sky::{Daylight, Dome, Sky};
pub use wind::{LimbReach, Moment, Shape as WindShape, Sway, Wind};

use crate::{
    Result,
    error::check_range,
    model::Transition,
    stochastic::{contrast, lambda},
};
use serde::Deserialize;

/// Effects enabled in a scene. All are disabled by default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// Fades the last leaves of a prefix in and out gradually.
    #[serde(deserialize_with = "switch::deserialize")]
    pub fade: Option<Fade>,
    /// Gives reduced plants the contrast of full ones.
    #[serde(deserialize_with = "switch::deserialize")]
    pub contrast: Option<Contrast>,
    /// Lights leaves as parts of a round crown.
    #[serde(deserialize_with = "switch::deserialize")]
    pub crown_normals: Option<CrownNormals>,
    /// Moves the trunk, branches and leaves.
    #[serde(deserialize_with = "switch::deserialize")]
    pub wind: Option<Wind>,
    /// Lets light through leaves, towards a viewer facing the sun.
    #[serde(deserialize_with = "switch::deserialize")]
    pub translucency: Option<Translucency>,
    /// Casts shadows of plants on each other and on the ground.
    #[serde(deserialize_with = "switch::deserialize")]
    pub shadow: Option<Shadow>,
    /// Derives the sky and its light from the position of the sun.
    #[serde(deserialize_with = "switch::deserialize")]
    pub sky: Option<Sky>,
}

/// Moves the shaded colours of reduced plants towards their mean (see
/// [`stochastic::contrast`](crate::stochastic::contrast)).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Contrast {
    /// Share of the published contrast reduction to apply: 0 (none) to 1 (all).
    pub strength: f32,
}

/// Blends the normals of leaves with the outward direction of the crown.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CrownNormals {
    /// Weight of the crown's direction: 0 (the leaf's own normal) to 1 (a smooth ellipsoid).
    pub blend: f32,
}

/// Light transmitted through leaves, brightest when facing the sun.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Translucency {
    /// Share of the sun's light that passes through a leaf: 0 to 1.
    pub strength: f32,
    /// Extra transmitted light when looking straight at the sun, as a multiple of `strength`: 0 to
    /// 16.
    pub glow: f32,
    /// Concentration of the glow around the sun: the exponent of the cosine, 1 to 64.
    pub sharpness: f32,
}

/// Shadows from the sun: plants are drawn into a shadow map at a lower level of detail.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shadow {
    /// Side of the shadow map in texels: 64 to 8192.
    pub resolution: u32,
    /// Maximum distance of shadows from the camera, in world units: above 0.
    pub distance: f32,
    /// Leaves that cast shadows, as a share of the plant's drawn leaves: 0 to 1.
    pub lod: f32,
    /// Half width of the shadow edge in texels of the map: 0 to 4.
    pub softness: f32,
}

impl Default for Shadow {
    fn default() -> Self {
        Self { resolution: 2048, distance: 80.0, lod: 0.4, softness: 1.0 }
    }
}

impl Default for Contrast {
    fn default() -> Self {
        Self { strength: 1.0 }
    }
}

impl Contrast {
    /// Factor applied to a colour's distance from the mean with `active` of `leaves` leaves drawn.
    pub fn kept(&self, active: f32, leaves: usize) -> f32 {
        let lambda = lambda::floored(f64::from(active) / leaves.max(1) as f64);
        1.0 + self.strength * (contrast::kept(lambda) as f32 - 1.0)
    }
}

impl Default for CrownNormals {
    fn default() -> Self {
        Self { blend: 0.7 }
    }
}

impl Default for Translucency {
    fn default() -> Self {
        Self { strength: 0.45, glow: 3.0, sharpness: 4.0 }
    }
}

/// How often an effect was simulated and how often it was skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// Number of leaves (fade), pictures (sky) or plants (all others) the effect was simulated for.
    pub simulated: u64,
    /// Number that were skipped because the effect would not have changed them visibly.
    pub skipped: u64,
}

impl Count {
    /// Counts one plant.
    pub fn add(&mut self, is_simulated: bool) {
        self.simulated += u64::from(is_simulated);
        self.skipped += u64::from(!is_simulated);
    }
}

/// One [`Count`] for each enabled effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Leaves inside the window; skips the leaves before it.
    pub fade: Option<Count>,
    /// Plants below full detail; skips plants at full detail.
    pub contrast: Option<Count>,
    /// All plants.
    pub crown_normals: Option<Count>,
    /// Plants that move by more than half a pixel; skips the others.
    pub wind: Option<Count>,
    /// Plants with limbs on which a level of them moves by more than half a pixel, for levels 1 and
    /// 2; skips the other plants with limbs. `None` without any.
    pub wind_limbs: Option<[Count; 2]>,
    /// All plants.
    pub translucency: Option<Count>,
    /// Plants whose shadow can reach the view; skips the others.
    pub shadow: Option<Count>,
    /// One per picture.
    pub sky: Option<Count>,
}

impl Counts {
    /// Initial counts for `effects`: zero for each enabled effect, except one picture for the sky.
    pub fn of(effects: &Effects) -> Self {
        let zero = |is_on: bool| is_on.then(Count::default);
        Self {
            fade: zero(effects.fade.is_some()),
            contrast: zero(effects.contrast.is_some()),
            crown_normals: zero(effects.crown_normals.is_some()),
            wind: zero(effects.wind.is_some()),
            wind_limbs: None,
            translucency: zero(effects.translucency.is_some()),
            shadow: zero(effects.shadow.is_some()),
            sky: effects.sky.map(|_| Count { simulated: 1, skipped: 0 }),
        }
    }

    /// Counts one plant whose lighting and motion effects were all simulated.
    pub fn add_plant(&mut self) {
        let counts = [&mut self.contrast, &mut self.crown_normals, &mut self.wind, &mut self.translucency];
        counts.into_iter().flatten().for_each(|count| count.add(true));
    }

    /// Counts one plant of a model with limbs, of which each level moves with a share of its
    /// motion.
    pub fn add_limbs(&mut self, shares: [f32; 2]) {
        let counts = self.wind_limbs.get_or_insert_default();
        counts.iter_mut().zip(shares).for_each(|(count, share)| count.add(share > 0.0));
    }

    /// Adds the leaves of one plant to the fade count.
    pub fn add_leaves(&mut self, transition: &Transition) {
        self.add_drawn(transition.first_partial(), transition.drawn());
    }

    /// Same as [`add_leaves`](Self::add_leaves), for a plant with `drawn` leaves, the first one in
    /// transition being `first_partial`.
    pub(crate) fn add_drawn(&mut self, first_partial: u32, drawn: u32) {
        if let Some(fade) = &mut self.fade {
            let whole = first_partial.min(drawn);
            fade.simulated += u64::from(drawn - whole);
            fade.skipped += u64::from(whole);
        }
    }

    /// Names and counts of the enabled effects.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, Count)> {
        let limbs = |level: usize| self.wind_limbs.map(|counts| counts[level]);
        [
            ("fade", self.fade),
            ("contrast", self.contrast),
            ("crown_normals", self.crown_normals),
            ("wind", self.wind),
            ("wind_limbs_1", limbs(0)),
            ("wind_limbs_2", limbs(1)),
            ("translucency", self.translucency),
            ("shadow", self.shadow),
            ("sky", self.sky),
        ]
        .into_iter()
        .filter_map(|(name, count)| Some((name, count?)))
    }
}

impl Effects {
    /// Iterates over the enabled effects, each by name and with all others disabled.
    pub fn each(&self) -> impl Iterator<Item = (&'static str, Self)> + use<> {
        let (on, none) = (*self, Self::default());
        [
            ("fade", Self { fade: on.fade, ..none }),
            ("contrast", Self { contrast: on.contrast, ..none }),
            ("crown_normals", Self { crown_normals: on.crown_normals, ..none }),
            ("wind", Self { wind: on.wind, ..none }),
            ("translucency", Self { translucency: on.translucency, ..none }),
            ("shadow", Self { shadow: on.shadow, ..none }),
            ("sky", Self { sky: on.sky, ..none }),
        ]
        .into_iter()
        .filter(move |(_, alone)| *alone != none)
    }

    /// Checks that every parameter is within its range.
    ///
    /// # Errors
    /// [`InvalidOption`](crate::Error::InvalidOption) for the first parameter out of range.
    pub fn check(&self) -> Result<()> {
        if let Some(fade) = &self.fade {
            fade.check()?;
        }
        if let Some(contrast) = &self.contrast {
            check_range("effects.contrast.strength", contrast.strength, 0.0..=1.0)?;
        }
        if let Some(normals) = &self.crown_normals {
            check_range("effects.crown_normals.blend", normals.blend, 0.0..=1.0)?;
        }
        if let Some(through) = &self.translucency {
            check_range("effects.translucency.strength", through.strength, 0.0..=1.0)?;
            check_range("effects.translucency.glow", through.glow, 0.0..=16.0)?;
            check_range("effects.translucency.sharpness", through.sharpness, 1.0..=64.0)?;
        }
        if let Some(shadow) = &self.shadow {
            check_range("effects.shadow.resolution", shadow.resolution as f32, 64.0..=8192.0)?;
            check_range("effects.shadow.distance", shadow.distance, 1e-6..=1e9)?;
            check_range("effects.shadow.lod", shadow.lod, 0.0..=1.0)?;
            check_range("effects.shadow.softness", shadow.softness, 0.0..=4.0)?;
        }
        self.sky.as_ref().map_or(Ok(()), Sky::check)?;
        self.wind.as_ref().map_or(Ok(()), Wind::check)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_within_their_ranges_and_each_number_beyond_is_named() {
        let all = Effects {
            fade: Some(Fade::default()),
            contrast: Some(Contrast::default()),
            crown_normals: Some(CrownNormals::default()),
            wind: Some(Wind::default()),
            translucency: Some(Translucency::default()),
            shadow: Some(Shadow::default()),
            sky: Some(Sky::default()),
        };
        all.check().unwrap();
        assert_eq!(Counts::of(&all).named().count(), 7);
        assert_eq!(Counts::of(&Effects::default()).named().count(), 0);
        let odd = Effects { contrast: Some(Contrast { strength: f32::NAN }), ..all };
        assert!(odd.check().unwrap_err().to_string().contains("effects.contrast.strength is NaN"));
        let odd = Effects { wind: Some(Wind { strength: 7.0, ..Wind::default() }), ..all };
        assert!(odd.check().unwrap_err().to_string().contains("effects.wind.strength is 7"));
    }
}
