//! Samples that a plant leaves to its impostor within the band of the hand-over. Twin of
//! `handover.wgsl`.

use super::records::LEAF_BITS;
#[cfg(feature = "software")]
use crate::hash::hash;

/// The largest share of the impostor: all samples.
pub(crate) const WHOLE_SHARE: u32 = 1023;

/// Number of leaves to draw, and the share of the impostor from 0 to 1.
pub(crate) fn packed(drawn: u32, share: f32) -> u32 {
    let share = (share * WHOLE_SHARE as f32).round() as u32;
    drawn.min((1 << LEAF_BITS) - 1) | share.min(WHOLE_SHARE) << LEAF_BITS
}

/// The number of leaves of [`packed`].
pub(crate) fn leaves(packed: u32) -> u32 {
    packed & ((1 << LEAF_BITS) - 1)
}

/// Mask of `coverage * samples` samples, rounded up where the fraction exceeds 1 - `dither`, and
/// rotated by `turn`, from 0 to below 1. Twin of the function in `surface.wgsl`.
#[cfg(feature = "software")]
pub(crate) fn covered_samples(coverage: f32, dither: f32, turn: f32, samples: u32) -> u32 {
    let count = ((coverage * samples as f32 + dither) as u32).min(samples);
    let first = (turn * samples as f32) as u32 % samples;
    let run = (1_u32 << count) - 1;
    (run << first | run >> (samples - first)) & ((1 << samples) - 1)
}

/// Mask of the samples of a pixel that belong to the impostor.
#[cfg(feature = "software")]
pub(crate) fn far_samples(pixel: [i32; 2], share: f32, samples: u32) -> u32 {
    let [dither, turn] = [0, 1].map(|salt| hash([pixel[0], pixel[1], salt]));
    covered_samples(share, dither, turn, samples)
}

#[cfg(all(test, feature = "software"))]
mod tests {
    use super::*;

    #[test]
    fn shares_of_samples_are_right_on_average_and_everything_at_the_ends() {
        for samples in [1, 4, 16] {
            for share in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
                let pixels = (0..128).flat_map(|y| (0..128).map(move |x| [x, y]));
                let sum: u32 = pixels.map(|pixel| far_samples(pixel, share, samples).count_ones()).sum();
                let mean = f64::from(sum) / f64::from(samples * 128 * 128);
                assert!((mean - f64::from(share)).abs() < 0.01, "{share} of {samples}: {mean}");
            }
            assert_eq!(far_samples([5, 7], 0.0, samples), 0);
            assert_eq!(far_samples([5, 7], 1.0, samples), (1 << samples) - 1);
        }
    }

    #[test]
    fn a_packed_count_keeps_both_numbers() {
        assert_eq!(packed(5, 0.0), 5);
        assert_eq!(packed(5, 1.0), 5 | 1023 << 22);
        assert_eq!(packed(u32::MAX, 0.5) >> 22, 512);
    }
}
