//! The range of a texture's alpha, kept because it decides cutoffs long after decoding.

use crate::material::Pixels;

/// The least and the largest alpha of a texture's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AlphaRange {
    pub(super) least: u8,
    pub(super) most: u8,
}

impl AlphaRange {
    /// The range over all texels.
    pub(super) fn of(pixels: &Pixels) -> Self {
        let alphas = pixels.rgba.iter().skip(3).step_by(4);
        alphas.fold(Self { least: 255, most: 0 }, |range, &alpha| Self {
            least: range.least.min(alpha),
            most: range.most.max(alpha),
        })
    }

    /// Whether some texel is rather transparent than opaque.
    pub(super) fn has_holes(self) -> bool {
        self.least < 128
    }
}
