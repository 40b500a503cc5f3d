//! Contrast reduction: fewer, larger leaves vary more from pixel to pixel than many small ones, so
//! their colours are moved towards the mean (Cook et al., Equations 22 and 23).
//!
//! Applies to *shaded* colours, that is, after lighting.
//!
//! Limits: one mean for all leaves of a plant.

/// Factor alpha on a colour's distance from the mean: sqrt(lambda) (Equation 22), from 0 to 1.
///
/// `lambda` is clamped to 0 to 1; NaN is treated as 1.
pub fn kept(lambda: f64) -> f64 {
    if lambda.is_nan() { 1.0 } else { lambda.clamp(0.0, 1.0).sqrt() }
}

/// Same as [`kept`] when a pixel averages at most `most_samples` leaves, k_max (Equation 23):
/// sqrt(min(lambda k, k_max) / min(k, k_max)), where k = `samples_at_start` / `area_ratio` is the
/// number of leaves behind a pixel.
///
/// 1 near the camera and very far away, less in between. The published k_max is 121.
pub fn kept_with_samples(lambda: f64, area_ratio: f64, samples_at_start: f64, most_samples: f64) -> f64 {
    let samples = samples_at_start / area_ratio;
    let share = (lambda * samples).min(most_samples) / samples.min(most_samples);
    kept(share)
}

/// Returns mean + kept * (color - mean) for each linear channel.
pub fn toned(color: [f32; 3], mean: [f32; 3], kept: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| mean[i] + kept * (color[i] - mean[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_lambda_n_leaves_becomes_that_of_n() {
        // The mean of n samples has variance sigma^2 / n. With each sample scaled by sqrt(lambda)
        // about the mean, lambda n samples give the same variance.
        for (n, lambda) in [(100.0, 0.25), (1e4, 0.01), (7.0, 1.0)] {
            let variance = kept(lambda).powi(2) / (lambda * n);
            assert!((variance * n - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn with_a_cap_on_samples_near_and_very_far_plants_keep_their_contrast() {
        assert_eq!(kept_with_samples(1.0, 1.0, 1.0, 121.0), 1.0);
        assert!((kept_with_samples(0.25, 0.25, 1.0, 121.0) - 0.5).abs() < 1e-12);
        assert_eq!(kept_with_samples(0.01, 1e-6, 1.0, 121.0), 1.0);
    }

    #[test]
    fn colours_move_to_their_mean() {
        assert_eq!(toned([1.0, 0.0, 0.5], [0.5; 3], 0.5), [0.75, 0.25, 0.5]);
        for lambda in [f64::NAN, -1.0, 0.0, 1e-6, 1.0, 2.0, f64::INFINITY] {
            assert!((0.0..=1.0).contains(&kept(lambda)));
            assert!((0.0..=1.0).contains(&kept_with_samples(lambda, 0.0, 1.0, 121.0)));
        }
    }
}
