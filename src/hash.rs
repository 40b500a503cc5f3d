//! The multiplicative hash that spreads numbers of plants, leaves and cells; the shaders have the
//! same one.

/// Multiplier of Knuth's multiplicative hash: a prime near 2^32 over the golden ratio.
pub(crate) const HASH_MULTIPLIER: u32 = 2_654_435_761;

/// Hash of a cell, from 0 to below 1; the function of the same name in `surface.wgsl`.
pub(crate) fn hash(cell: [i32; 3]) -> f32 {
    let mixed =
        cell.into_iter().fold(0_u32, |mixed, at| (mixed ^ mixed >> 15 ^ at as u32).wrapping_mul(HASH_MULTIPLIER));
    ((mixed ^ mixed >> 15) >> 8) as f32 / 16_777_216.0
}
