//! Contrast: fewer, larger leaves vary more from pixel to pixel than many small ones, so their colours are drawn towards
//! their mean (Cook et al., Equations 22 and 23).
//!
//! It acts on *shaded* colours: those that light has reached.
//!
//! Limits: one mean for all leaves of a plant.

/// Share alpha of a colour's distance from the mean that stays: sqrt(lambda) (Equation 22). Within 0 and 1.
pub fn kept(lambda: f64) -> f64 {
    if lambda.is_nan() { 1.0 } else { lambda.clamp(0.0, 1.0).sqrt() }
}

/// As [`kept`] where a pixel averages at most `most_samples` leaves (Equation 23): sqrt(min(lambda k, k_max) / min(k, k_max))
/// with k = `samples_at_start` / `area_ratio` the leaves behind a pixel. 1 near and very far, less between; k_max is 121 as
/// published.
pub fn kept_with_samples(lambda: f64, area_ratio: f64, samples_at_start: f64, most_samples: f64) -> f64 {
    let samples = samples_at_start / area_ratio;
    let share = (lambda * samples).min(most_samples) / samples.min(most_samples);
    kept(share)
}

/// mean + kept (color - mean), each channel linear.
pub fn toned(color: [f32; 3], mean: [f32; 3], kept: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| mean[i] + kept * (color[i] - mean[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_lambda_n_leaves_becomes_that_of_n() {
        // Means of n draws vary by sigma^2 / n: lambda n of them, each drawn to the mean by sqrt(lambda), as n do.
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
