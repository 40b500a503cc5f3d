//! The limbs of a model as a texture, which vertices read in the wind; `wind.wgsl` reads it.
//!
//! A texture takes none of the eight storage buffers that a vertex may read. Its texels are
//! numbered row by row: a header with the numbers of the first texels of stems and of leaves, two
//! texels for each limb, eight stems and four leaves a texel.

use super::shaders::LIMB_COLUMNS;
use crate::{
    effects::limbs::{Limb, Limbs, Ride},
    model::octahedral,
};

/// Bits of the texels, four to a texel, in whole rows, and the number of columns and rows; a single
/// texel without limbs. Upload them as `Rgba32Uint` for `wind.wgsl`.
pub fn limb_texels(limbs: Option<&Limbs>) -> (Vec<[u32; 4]>, [u32; 2]) {
    let Some(limbs) = limbs else { return (vec![[0; 4]], [1; 2]) };
    let first_stem = 2 * limbs.limbs.len();
    let first_leaf = first_stem + limbs.of_stem.len().div_ceil(8);
    let mut texels = vec![[first_stem as u32, first_leaf as u32, 0, 0], [0; 4]];
    texels.extend(limbs.limbs.iter().skip(1).flat_map(of_limb));
    let of_stems =
        limbs.of_stem.chunks(8).map(|stems| words(stems.chunks(2).map(|pair| [pair[0], *pair.last().unwrap_or(&0)])));
    texels.extend(of_stems);
    let of_leaves =
        limbs.of_leaf.chunks(4).map(|leaves| words(leaves.iter().map(|&Ride { limb, height }| [limb, height])));
    texels.extend(of_leaves);
    let rows = texels.len().div_ceil(LIMB_COLUMNS as usize);
    texels.resize(rows * LIMB_COLUMNS as usize, [0; 4]);
    (texels, [LIMB_COLUMNS, rows as u32])
}

fn of_limb(limb: &Limb) -> [[u32; 4]; 2] {
    let [x, y, z] = limb.foot.to_array().map(f32::to_bits);
    let axis = octahedral::encode(limb.axis.to_array(), 16).map(|steps| steps as i16 as u16);
    [[x, y, z, pair(axis)], [limb.turn.to_bits(), pair(limb.cycles), pair(limb.phases), limb.below.into()]]
}

fn pair([low, high]: [u16; 2]) -> u32 {
    u32::from(low) | u32::from(high) << 16
}

fn words(pairs: impl Iterator<Item = [u16; 2]>) -> [u32; 4] {
    let mut words = [0; 4];
    words.iter_mut().zip(pairs).for_each(|(word, of)| *word = pair(of));
    words
}
