//! Appearance of plants, and the shader variants that it needs.
//!
//! Shaders are assembled from parts. An enabled effect adds its part; a disabled one is replaced by
//! a function that does nothing, so that neither its arithmetic nor its bindings are in the shader.
//! Within a scene each draw uses the [`Variant`] with the features that its plants need in this
//! frame, and no more.

use super::{
    landscape::{Ground, Landscape},
    light::Lighting,
};
use crate::{
    Result,
    effects::{Effects, FadeBy},
    error::check_range,
    extract::Far,
};

/// Appearance of a renderer's plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// How leaves are coloured.
    pub coloring: Coloring,
    /// Effects that are simulated and shaded.
    pub effects: Effects,
    /// Sun and sky.
    pub lighting: Lighting,
    /// Whether enlarged leaves are drawn with the tone of their model (see
    /// [`Growth::tone`](crate::model::Growth::tone)), which then takes the place of the effect
    /// `contrast`.
    pub tone: bool,
    /// The ground under the plants; `None` draws none.
    pub ground: Option<Ground>,
    /// Error in pixels that the wood of a model with an
    /// [order](crate::FoliageModel::wood_order) is drawn at: how far its surface may be from where
    /// it is in full. Of other models, the width below which only some stems are drawn, widened to
    /// cover as much as all of them would; on the GPU alone. 0 draws all wood as it is.
    pub wood_error_px: f32,
    /// Whether plants are drawn in their own [tints](super::Instance::tint); without it, these are
    /// ignored and cost nothing.
    pub tints: bool,
    /// When plants are handed over to the impostors of their models; `None` draws leaves at any
    /// size, as do models without an impostor.
    pub far: Option<Far>,
}

impl Default for Look {
    /// No effects but the model's tone; wood within half a pixel.
    fn default() -> Self {
        Self {
            coloring: Coloring::default(),
            effects: Effects::default(),
            tone: true,
            lighting: Lighting::default(),
            ground: None,
            wood_error_px: 0.5,
            tints: false,
            far: None,
        }
    }
}

impl Look {
    /// Checks `wood_error_px` and the parameters of the hand-over, of the effects and of the
    /// ground.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for the first value out of its range.
    pub fn check(&self) -> Result<()> {
        let haze = self.ground.map_or(1.0, |ground| ground.haze);
        check_range("ground.haze", haze, f64::MIN_POSITIVE..=f64::MAX)?;
        check_range("wood_error_px", self.wood_error_px, 0.0..=1e6)?;
        self.far.map_or(Ok(()), |far| far.check())?;
        self.effects.check()
    }

    /// Checks that ground with heights can be drawn, if it is asked for.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) without a ground.
    #[cfg(feature = "software")]
    pub(crate) fn check_terrain(&self, is_given: bool) -> Result<()> {
        match self.ground {
            None if is_given => {
                Err(crate::Error::invalid("terrain", "given", "left out, or given with a look with a ground"))
            }
            _ => Ok(()),
        }
    }

    /// Whether the mean shaded colour of a model's leaves is needed.
    #[cfg(feature = "software")]
    pub(crate) fn tones(&self, growth: &crate::model::Growth) -> bool {
        self.effects.contrast.is_some() || self.tone && growth.tone > 0.0
    }

    /// Whether plants have tints of their own or stand in the ground's haze.
    pub(crate) fn has_tints(&self) -> bool {
        self.tints || self.ground.is_some()
    }

    /// Whether leaves fade by alpha.
    pub(crate) fn fades_by_alpha(&self) -> bool {
        self.effects.fade.is_some_and(|fade| fade.by == FadeBy::Alpha)
    }

    /// Sun and sky, with the enabled effects applied.
    pub fn lighting(&self) -> Lighting {
        self.lighting.with_effects(&self.effects)
    }

    /// Sky and ground behind the plants; `None` for the plain backdrop.
    pub fn landscape(&self) -> Option<Landscape> {
        let daylight = self.effects.sky.map(|sky| sky.under(self.lighting.towards_sun));
        let lighting = self.lighting();
        (daylight.is_some() || self.ground.is_some()).then_some(Landscape { daylight, ground: self.ground, lighting })
    }
}

/// Colouring of leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coloring {
    /// Their own colours, lit.
    #[default]
    Picture,
    /// A different flat colour for each leaf.
    Flat,
    /// A gradient in pruning order: orange for the leaf that is pruned first, blue for the one that
    /// is kept longest.
    PruneOrder,
    /// By what a plant is drawn with: leaves green, impostors orange.
    Parts,
    /// Wireframe, with a different colour for each leaf. Needs `Features::POLYGON_MODE_LINE`; falls
    /// back to [`Flat`](Self::Flat) without it.
    Wire,
}

impl Coloring {
    /// Number of the colouring in the shaders.
    pub(crate) const fn number(self) -> u32 {
        match self {
            Self::Picture => 0,
            Self::Flat | Self::Wire => 1,
            Self::PruneOrder => 2,
            Self::Parts => 3,
        }
    }
}

/// Shader features that the plants of one draw need in this frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Variant {
    /// The plants move visibly in the wind.
    pub wind: bool,
    /// Shaded colours are pulled towards the mean by the effect `contrast`.
    pub contrast: bool,
    /// Shaded colours of enlarged leaves are pulled towards the mean; excludes `contrast`.
    pub tone: bool,
    /// Enlarged leaves of the model repeat their pictures.
    pub tiles: bool,
    /// Some leaves of the draw are partly present, by alpha.
    pub alpha: bool,
    /// The plants share their samples with their impostors.
    pub handover: bool,
}

impl Variant {
    /// All combinations.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_bits = |bits| {
            let [wind, contrast, tone, tiles, alpha, handover] = [1, 2, 4, 8, 16, 32].map(|bit| bits & bit != 0);
            Self { wind, contrast, tone, tiles, alpha, handover }
        };
        (0..64).map(of_bits).filter(|variant| !(variant.contrast && variant.tone))
    }

    /// Whether its shader reads effect buffers.
    pub fn has_bindings(self) -> bool {
        self.wind || self.contrast
    }
}
