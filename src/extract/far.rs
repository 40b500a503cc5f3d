//! Hand-over from leaves to the impostor of a plant that is small on screen.

use super::sight::unit;
use crate::{Result, error::check_range, hash::HASH_MULTIPLIER};
use serde::Deserialize;

/// Greatest part by which a plant's own diameter of hand-over differs from the others': without it
/// all plants at one distance would change at once, in a ring around the camera.
const SPREAD: f32 = 0.15;

/// Sizes on screen at which plants are handed over to their impostors.
///
/// Within the band both are drawn, each in its own share of the samples of every pixel, so that
/// their coverage adds up to that of one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Far {
    /// Diameter of the plant's bounding sphere in pixels at which it is handed over: 0 to 1024.
    pub at_px: f32,
    /// Parts of `at_px` at which the leaves are gone and at which the impostor appears: 0.1 to 1,
    /// and 1 to 10.
    pub band: [f32; 2],
}

impl Default for Far {
    /// 64 pixels, from 0.8 to 1.25 of them.
    fn default() -> Self {
        Self { at_px: 64.0, band: [0.8, 1.25] }
    }
}

impl Far {
    /// Share of a plant's samples that its impostor takes, from 0 to 1, at a diameter in pixels.
    /// `seed` tells plants apart. NaN counts as near.
    pub fn share(&self, diameter_px: f32, seed: u32) -> f32 {
        let own = (seed.wrapping_mul(HASH_MULTIPLIER) >> 8) as f32 / (1 << 24) as f32;
        let at = self.at_px * (1.0 + SPREAD * (2.0 * own - 1.0));
        let [low, high] = self.band;
        if diameter_px.is_nan() {
            return 0.0;
        }
        unit((high * at / diameter_px.max(0.0)).ln() / (high / low).ln())
    }

    /// The same for a plant whose impostor takes at least a share, or no share at all. An infinite
    /// diameter is that of a plant without an impostor, or one too near for it.
    pub(crate) fn share_of(&self, diameter_px: f32, seed: u32, least: Option<f32>) -> f32 {
        let least = least.filter(|_| diameter_px < f32::INFINITY);
        least.map_or(0.0, |least| self.share(diameter_px, seed).max(unit(least)))
    }

    /// Checks both parameters.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for the first out of its range.
    pub fn check(&self) -> Result<()> {
        check_range("far.at_px", self.at_px, 0.0..=1024.0)?;
        check_range("far.band", self.band[0], 0.1..=1.0)?;
        check_range("far.band", self.band[1], 1.0..=10.0)?;
        // A band without width would be a switch.
        check_range("far.band", self.band[1] / self.band[0], 1.01..=100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_rise_from_none_to_all_within_the_band_of_every_plant() {
        let far = Far::default();
        for seed in 0..1000 {
            let shares: Vec<f32> = (1..=1000).rev().map(|px| far.share(px as f32 * 0.2, seed)).collect();
            assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]));
            assert!(far.share(64.0 * 1.25 * 1.16, seed) == 0.0 && far.share(64.0 * 0.8 * 0.84, seed) == 1.0);
        }
        let middle: Vec<f32> = (0..1000).map(|seed| far.share(64.0, seed)).collect();
        let spread = middle.iter().copied().fold(0.0, f32::max) - middle.iter().copied().fold(1.0, f32::min);
        assert!((0.5..0.8).contains(&spread), "{spread}");
    }

    #[test]
    fn plants_that_switch_between_two_eyes_a_metre_apart_form_no_ring() {
        // Trees of 8 m across, at 1080 lines and 50 degrees, are 64 pixels large at 145 m.
        let px_at = |away: f32| 8.0 * 1158.0 / away;
        let switched = |seed: fn(u32) -> u32| -> f32 {
            let is_far = |away: f32, i: u32| Far::default().share(px_at(away), seed(i)) >= 0.5;
            let plants = (0..20_000).map(|i| (i, 100.0 + 0.005 * i as f32));
            let at: Vec<f32> =
                plants.filter(|&(i, at)| is_far(at, i) != is_far(at + 1.0, i)).map(|(_, at)| at).collect();
            at[at.len() - 1] - at[0]
        };
        let [spread, ring] = [switched(|i| i), switched(|_| 1)];
        assert!(spread >= 5.0 && ring < 1.01, "spread over {spread} m, {ring} m without seeds");
    }

    #[test]
    fn odd_sizes_are_near_or_far_and_never_nothing() {
        let far = Far::default();
        assert_eq!([f32::NAN, f32::INFINITY, 1e9].map(|px| far.share(px, 3)), [0.0; 3]);
        assert_eq!([0.0, -5.0, 1e-9].map(|px| far.share(px, 3)), [1.0; 3]);
        assert_eq!(Far { at_px: 0.0, ..far }.share(0.5, 1), 0.0);
        for band in [[1.0, 1.0], [0.05, 1.2], [0.8, 11.0], [f32::NAN, 1.25]] {
            assert!(Far { band, ..far }.check().is_err(), "{band:?}");
        }
        assert_eq!(far.share_of(f32::INFINITY, 1, Some(1.0)), 0.0);
        assert!(far.check().is_ok() && Far { at_px: f32::NAN, ..far }.check().is_err());
    }
}
