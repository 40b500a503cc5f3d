//! Sizes of an impostor.

use crate::{
    Error, Result,
    error::check_range,
    model::{FRAME_SIDES, FRAMES_ACROSS, Lattice},
};

/// How an impostor is baked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BakeOptions {
    /// Frames along each side of the lattice: 2 to 16, at least 3 for the whole sphere.
    pub across: u32,
    /// Side of a frame in texels: a multiple of 4 from 8 to 256.
    pub frame_px: u32,
    /// Whether the plant is seen from below too.
    pub is_whole_sphere: bool,
}

impl Default for BakeOptions {
    /// 12 x 12 frames of 64 texels over the upper hemisphere.
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl BakeOptions {
    /// The default.
    pub const DEFAULT: Self = Self { across: 12, frame_px: 64, is_whole_sphere: false };

    /// Checks the sizes.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first one out of its range.
    pub fn check(&self) -> Result<()> {
        let lattice = Lattice { across: self.across, is_whole_sphere: self.is_whole_sphere };
        check_range("bake.across", self.across, lattice.least()..=FRAMES_ACROSS[1])?;
        check_range("bake.frame_px", self.frame_px, FRAME_SIDES[0]..=FRAME_SIDES[1])?;
        if self.frame_px.is_multiple_of(4) {
            return Ok(());
        }
        Err(Error::invalid("bake.frame_px", self.frame_px, "a multiple of 4"))
    }
}
