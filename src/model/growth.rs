//! How leaves are drawn that stand for others.

use serde::{Deserialize, Serialize};

/// How enlarged leaves are drawn. The default is plain scaling.
///
/// Tone applies the contrast reduction of Cook et al. (see
/// [`stochastic::contrast`](crate::stochastic::contrast)) to each leaf by its own scale.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Growth {
    /// Tone: a leaf of linear scale s > 1 keeps s^(-2 tone) of its shaded colour's distance from
    /// the plant's mean. From 0, all of it, to [`MAX_TONE`](Self::MAX_TONE).
    pub tone: f32,
    /// Whether enlarged cut-out leaves that fill a rectangle of their texture repeat it, so that
    /// what they show keeps its size.
    pub tiles: bool,
}

impl Growth {
    /// Largest exponent of tone: colours keep the share of their distance from the mean that an
    /// unscaled leaf's area is of the enlarged one's.
    pub const MAX_TONE: f32 = 1.0;
}
