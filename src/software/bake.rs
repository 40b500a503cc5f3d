//! Bakes a model's impostor: draws all of its leaves and wood from every direction of a lattice.
//!
//! Each frame is orthographic and has the bounding sphere of the plant in its middle. The same
//! model gives the same bytes on any number of threads.

use super::{
    bake_options::BakeOptions,
    baker::{Baker, Texels},
    correction::{compared_frames, fitted},
};
use crate::{
    Error, Result,
    model::{FoliageModel, Framing, Impostor},
};
use rayon::prelude::*;

/// Frames that are drawn before progress is told: one may take 30 MB.
const BATCH: u32 = 8;

/// Bakes the impostor of a model. `advance` is told the number of frames drawn, of
/// `options.across` squared; baking stops if it returns false.
///
/// Coverage is corrected by one exponent, and colour by one factor, so that sprites cover as much
/// as the plant does and are as bright, on average over views between the frames.
///
/// # Errors
/// [`Error::InvalidOption`] for options out of range or a plant without extent,
/// [`Error::Unreadable`] for a damaged texture, [`Error::Interrupted`] if `advance` returns false.
pub fn bake(model: &FoliageModel, options: &BakeOptions, advance: &mut dyn FnMut(u64) -> bool) -> Result<Impostor> {
    let baker = Baker::new(model, options)?;
    let Framing { lattice, frame_px, center, half_side } = baker.framing;
    let mut frames: Vec<Texels> = Vec::with_capacity(lattice.frames() as usize);
    for first in (0..lattice.frames()).step_by(BATCH as usize) {
        if !advance(u64::from(first)) {
            return Err(Error::Interrupted);
        }
        let batch = first..(first + BATCH).min(lattice.frames());
        frames.extend(batch.into_par_iter().map(|frame| baker.frame(frame)).collect::<Result<Vec<_>>>()?);
    }
    let correction =
        fitted(&baker, &compared_frames(&baker).into_iter().map(|at| (at, &frames[at as usize])).collect())?;
    frames.par_iter_mut().for_each(|texels| correction.apply(texels));
    let (color, surface): (Vec<[u8; 4]>, Vec<[u8; 4]>) = frames.into_iter().flatten().unzip();
    let (color, surface) = (color.into_flattened(), surface.into_flattened());
    Ok(Impostor { lattice, frame_px, center, half_side, color, surface })
}
