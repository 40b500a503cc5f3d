//! Sample positions in a pixel.

use crate::edge::SUBPIXEL;

/// Number of samples per pixel.
pub(super) const SAMPLES: usize = 16;
/// Sample `s` lies in column `s` and row `SAMPLE_ROWS[s]` of a 16 x 16 grid: each column and each
/// row holds one sample, so that nearly vertical and nearly horizontal edges get sixteen steps too
/// (bit reversal, as in Hammersley's point set).
const SAMPLE_ROWS: [i64; SAMPLES] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];

/// Position of a sample in its pixel, in steps.
pub(super) fn sample_steps(sample: usize) -> [i64; 2] {
    let cell = SUBPIXEL / SAMPLES as i64;
    [sample as i64 * cell + cell / 2, SAMPLE_ROWS[sample] * cell + cell / 2]
}

/// Place of a sample of a pixel, in pixels.
pub(super) fn sample_px(at: [i64; 2], sample: usize) -> [f64; 2] {
    let steps = sample_steps(sample);
    [0, 1].map(|axis| at[axis] as f64 + steps[axis] as f64 / SUBPIXEL as f64)
}

/// Indices of the set bits of `mask`.
pub(super) fn indices(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let sample = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        sample
    })
}
