//! Live impostors: frames of impostors that are made when plants need them, not in advance.
//!
//! A frame made so is that of [`bake`](super::bake()), byte by byte: the correction is fitted from
//! the same views, of which the frames are the first ones to be made.

use super::{
    bake_options::BakeOptions,
    baker::{Baker, Texels, pages},
    correction::{Correction, compared_frames, fitted},
};
use crate::{
    Result,
    draw::pages::Pages,
    error::check_range,
    model::{FoliageModel, Framing},
};
use rayon::prelude::*;
use std::{collections::BTreeMap, sync::OnceLock};

/// How impostors are made while plants are drawn, for models that have none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveImpostors {
    /// Frames of each impostor.
    pub bake: BakeOptions,
    /// Most frames that a prepared picture adds to those of all models, 1 or more. The GPU renderer
    /// makes them on another thread meanwhile; each costs an upload of its pages, 43 KB if they
    /// have 64 texels a side.
    pub frames_at_once: u32,
    /// Whether the frames around those in use are made too, once no plant waits for one: a plant
    /// that turns needs them next.
    pub ahead: bool,
}

impl Default for LiveImpostors {
    /// 12 x 12 frames of 64 texels over the upper hemisphere, 4 at once, and those around them.
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl LiveImpostors {
    /// The default.
    pub const DEFAULT: Self = Self { bake: BakeOptions::DEFAULT, frames_at_once: 4, ahead: true };

    /// Checks the sizes.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for the first one out of its range.
    pub fn check(&self) -> Result<()> {
        self.bake.check()?;
        check_range("live.frames_at_once", self.frames_at_once, 1..=u32::MAX)
    }
}

/// Makes frames of one model's impostor.
pub(crate) struct FrameMaker<'a> {
    baker: Baker<'a>,
    /// The correction, and the frames that it was fitted from, corrected; set by the first frame.
    first: OnceLock<(Correction, BTreeMap<u32, Texels>)>,
}

impl<'a> FrameMaker<'a> {
    /// Decodes the model's textures.
    ///
    /// # Errors
    /// As [`bake`](super::bake()), except that it is never interrupted.
    pub(crate) fn new(model: &'a FoliageModel, options: &BakeOptions) -> Result<Self> {
        Ok(Self { baker: Baker::new(model, options)?, first: OnceLock::new() })
    }

    pub(crate) fn framing(&self) -> &Framing {
        &self.baker.framing
    }

    /// Makes these frames, in parallel.
    ///
    /// # Errors
    /// As [`Painter::draw`](super::Painter::draw).
    pub(crate) fn make(&self, frames: &[u32]) -> Result<Vec<(u32, Pages)>> {
        let (correction, first) = match self.first.get() {
            Some(first) => first,
            None => {
                let first = self.fitted()?;
                self.first.get_or_init(|| first)
            }
        };
        let frame_px = self.baker.framing.frame_px;
        let made = |&frame: &u32| {
            if let Some(texels) = first.get(&frame) {
                return Ok((frame, pages(frame_px, texels)));
            }
            let mut texels = self.baker.frame(frame)?;
            correction.apply(&mut texels);
            Ok((frame, pages(frame_px, &texels)))
        };
        frames.par_iter().map(made).collect()
    }

    fn fitted(&self) -> Result<(Correction, BTreeMap<u32, Texels>)> {
        let frames: Vec<u32> = compared_frames(&self.baker).into_iter().collect();
        let texels: Vec<Texels> = frames.par_iter().map(|&frame| self.baker.frame(frame)).collect::<Result<_>>()?;
        let correction = fitted(&self.baker, &frames.iter().copied().zip(&texels).collect())?;
        let corrected = frames.into_iter().zip(texels).map(|(frame, mut texels)| {
            correction.apply(&mut texels);
            (frame, texels)
        });
        Ok((correction, corrected.collect()))
    }
}

/// A [`FrameMaker`] with the frames that it has made.
pub(super) struct LiveFrames<'a> {
    maker: FrameMaker<'a>,
    pub(super) frames: Vec<OnceLock<Pages>>,
}

impl<'a> LiveFrames<'a> {
    pub(super) fn new(model: &'a FoliageModel, options: &BakeOptions) -> Result<Self> {
        let maker = FrameMaker::new(model, options)?;
        let frames = (0..maker.framing().lattice.frames()).map(|_| OnceLock::new()).collect();
        Ok(Self { maker, frames })
    }

    pub(super) fn framing(&self) -> &Framing {
        self.maker.framing()
    }

    /// Makes those of these frames that are missing, and returns how many.
    pub(super) fn make(&self, frames: impl Iterator<Item = u32>) -> Result<u32> {
        let mut missing: Vec<u32> = frames.filter(|&frame| self.frames[frame as usize].get().is_none()).collect();
        missing.sort_unstable();
        missing.dedup();
        if missing.is_empty() {
            return Ok(0);
        }
        for (frame, pages) in self.maker.make(&missing)? {
            // Another thread may have made it meanwhile: the same pages.
            let _ = self.frames[frame as usize].set(pages);
        }
        Ok(missing.len() as u32)
    }
}
