//! Effects: what is simulated or shaded beyond the plain prefix, each a switch with its parameters.
//!
//! An effect that is off costs nothing: renderers build neither pipeline nor buffer nor pass for it. One that is on is
//! simulated only where it shows; [`Count`] tells how often that was.

pub mod fade;
pub mod sky;
mod switch;
pub mod wind;

pub use fade::{Fade, FadeBy};
pub use sky::Sky;
pub use wind::Wind;

use crate::{
    Result,
    error::check_range,
    model::Transition,
    stochastic::{contrast, lambda},
};
use serde::Deserialize;

/// Which effects a scene calls for. All are off by default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// The last leaves of a prefix come and go gradually.
    #[serde(deserialize_with = "switch::deserialize")]
    pub fade: Option<Fade>,
    /// Reduced plants keep the contrast of full ones.
    #[serde(deserialize_with = "switch::deserialize")]
    pub contrast: Option<Contrast>,
    /// Leaves are lit as parts of a round crown.
    #[serde(deserialize_with = "switch::deserialize")]
    pub crown_normals: Option<CrownNormals>,
    /// Trunk, branches and leaves move.
    #[serde(deserialize_with = "switch::deserialize")]
    pub wind: Option<Wind>,
    /// Light shines through leaves towards who looks at the sun.
    #[serde(deserialize_with = "switch::deserialize")]
    pub translucency: Option<Translucency>,
    /// Plants cast shadows on each other and on the ground.
    #[serde(deserialize_with = "switch::deserialize")]
    pub shadow: Option<Shadow>,
    /// The sky and its light follow the sun.
    #[serde(deserialize_with = "switch::deserialize")]
    pub sky: Option<Sky>,
}

/// Shaded colours of reduced plants are drawn to their mean (see [`stochastic::contrast`](crate::stochastic::contrast)).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Contrast {
    /// How much of the published reduction is taken: 0 (none) to 1.
    pub strength: f32,
}

/// Normals of leaves are blended with the direction outwards from the crown.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CrownNormals {
    /// Share of the crown's direction: 0 (the leaf's own normal) to 1 (a smooth ellipsoid).
    pub blend: f32,
}

/// Light through leaves, brightest against the sun.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Translucency {
    /// Share of the sun's light that passes a leaf: 0 to 1.
    pub strength: f32,
    /// How many times as much reaches an eye that looks straight at the sun: 0 to 16 more.
    pub glow: f32,
    /// How closely around the sun: the exponent of the cosine, 1 to 64.
    pub sharpness: f32,
}

/// Shadows of the sun, from plants drawn a second time at a lower level of detail.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shadow {
    /// Pixels on a side of the shadow map: 64 to 8192.
    pub resolution: u32,
    /// How far from the camera shadows fall, in world units, above 0.
    pub distance: f32,
    /// Leaves that cast shadows, over those that the plant is drawn with: 0 to 1.
    pub lod: f32,
    /// Half width of a shadow's edge in pixels of the map: 0 to 4.
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
    /// Share of a colour's distance from the mean that stays with `active` of `leaves`.
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

/// How often an effect was simulated and how often it could be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// Leaves (fade) or plants (all others) it was simulated for.
    pub simulated: u64,
    /// Those it would not have changed visibly.
    pub skipped: u64,
}

impl Count {
    /// Counts one plant.
    pub fn add(&mut self, is_simulated: bool) {
        self.simulated += u64::from(is_simulated);
        self.skipped += u64::from(!is_simulated);
    }
}

/// One [`Count`] for each effect that is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Leaves in the window, and those before it.
    pub fade: Option<Count>,
    /// Plants below full detail, and those at it.
    pub contrast: Option<Count>,
    /// All plants.
    pub crown_normals: Option<Count>,
    /// Plants that move by more than half a pixel, and the others.
    pub wind: Option<Count>,
    /// All plants.
    pub translucency: Option<Count>,
    /// Plants whose shadow reaches the view, and the others.
    pub shadow: Option<Count>,
    /// One for each picture.
    pub sky: Option<Count>,
}

impl Counts {
    /// Zero for each effect that is on.
    pub fn of(effects: &Effects) -> Self {
        let zero = |is_on: bool| is_on.then(Count::default);
        Self {
            fade: zero(effects.fade.is_some()),
            contrast: zero(effects.contrast.is_some()),
            crown_normals: zero(effects.crown_normals.is_some()),
            wind: zero(effects.wind.is_some()),
            translucency: zero(effects.translucency.is_some()),
            shadow: zero(effects.shadow.is_some()),
            sky: effects.sky.map(|_| Count { simulated: 1, skipped: 0 }),
        }
    }

    /// Counts one plant for which every effect on how it is lit and where it is was simulated.
    pub fn add_plant(&mut self) {
        let counts = [&mut self.contrast, &mut self.crown_normals, &mut self.wind, &mut self.translucency];
        counts.into_iter().flatten().for_each(|count| count.add(true));
    }

    /// Counts the leaves of one plant for `fade`.
    pub fn add_leaves(&mut self, transition: &Transition) {
        self.add_drawn(transition.first_partial(), transition.drawn());
    }

    /// As [`add_leaves`](Self::add_leaves), for a plant of `drawn` leaves whose first one on its way is `first_partial`.
    pub(crate) fn add_drawn(&mut self, first_partial: u32, drawn: u32) {
        if let Some(fade) = &mut self.fade {
            let whole = first_partial.min(drawn);
            fade.simulated += u64::from(drawn - whole);
            fade.skipped += u64::from(whole);
        }
    }

    /// Names and counts of the effects that are on.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, Count)> {
        [
            ("fade", self.fade),
            ("contrast", self.contrast),
            ("crown_normals", self.crown_normals),
            ("wind", self.wind),
            ("translucency", self.translucency),
            ("shadow", self.shadow),
            ("sky", self.sky),
        ]
        .into_iter()
        .filter_map(|(name, count)| Some((name, count?)))
    }
}

impl Effects {
    /// Each effect that is on, alone, by its name.
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

    /// Checks every parameter.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] that names the first one out of its range.
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
