//! The share of leaves to keep, lambda: the published laws, including Cook's own, and Gomez's
//! scene-wide reduction.
//!
//! Limits: every law depends on distance or area alone.

/// Minimum lambda: below it a plant would vanish abruptly instead of thinning out (Gomez drops
/// whole models there).
pub const FLOOR: f64 = 0.005;

/// Clamps lambda to the range from [`FLOOR`] to 1. NaN is treated as 1.
pub fn floored(lambda: f64) -> f64 {
    if lambda.is_nan() { 1.0 } else { lambda.clamp(FLOOR, 1.0) }
}

/// Gomez: (d0/d)^(-1/log2 h), from the ratio of *distances*; half of the leaves remain where d0/d
/// is h. Returns 1 for distances up to `start`.
///
/// For h up to 1/2 the number of leaves falls at most as 1/d, while the plant's pixels fall as
/// 1/d^2.
pub fn from_distance(distance: f64, start: f64, half_ratio: f64) -> f64 {
    power_law(start / distance, half_ratio)
}

/// Cook et al., Equation 2: b^(ln(1/2)/ln h), from the ratio of screen *areas*; half of the leaves
/// remain where b is h.
pub fn from_area(area_ratio: f64, half_area: f64) -> f64 {
    power_law(area_ratio, half_area)
}

/// Mack, as published: z^(-log2 h) with z = max(1, distance/start). Only for h near 2 do about half
/// of the leaves remain where z is h.
pub fn as_mack_published(distance: f64, start: f64, half_distance: f64) -> f64 {
    floored((distance / start).max(1.0).powf(-half_distance.log2()))
}

/// Power of `ratio` that is 1/2 at `h`; 1 for ratios of at least 1 and for NaN.
fn power_law(ratio: f64, h: f64) -> f64 {
    if ratio.is_nan() || ratio >= 1.0 {
        return 1.0;
    }
    // The power is infinite at h = 1.
    let h = h.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON);
    floored(ratio.max(0.0).powf(0.5_f64.ln() / h.ln()))
}

/// Scene-wide reduction of lambda (Gomez), which grows with a plant's distance:
/// lambda (1 - a w ((d - d_min) / d_range)^p), where w is d_range over the far plane's distance,
/// clamped to 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneReduction {
    /// Maximum reduction, a, as a share of lambda; published as 0.5.
    pub strength: f64,
    /// Distances of the nearest and farthest plants in view.
    pub range: [f64; 2],
    /// Distance of the far plane. Scenes that do not reach it are reduced less.
    pub far: f64,
    /// Number of plants at which the falloff is linear, m; published as 50.
    pub linear_falloff_plants: f64,
    /// Number of plants in view, n; the exponent p is m/n.
    pub plants: f64,
}

impl SceneReduction {
    /// Reduced lambda of a plant at `distance`, which is clamped to the range. Only clamped to
    /// [`FLOOR`] and 1 if all plants are at the same distance.
    pub fn reduced(&self, lambda: f64, distance: f64) -> f64 {
        let [nearest, farthest] = self.range;
        let range = farthest - nearest;
        if range.is_nan() || range <= 0.0 {
            return floored(lambda);
        }
        let place = ((distance - nearest) / range).clamp(0.0, 1.0);
        let weight = (range / self.far).clamp(0.0, 1.0);
        let exponent = self.linear_falloff_plants / self.plants.max(1.0);
        floored(lambda * (1.0 - self.strength * weight * place.powf(exponent)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REDUCTION: SceneReduction =
        SceneReduction { strength: 0.5, range: [10.0, 90.0], far: 100.0, linear_falloff_plants: 50.0, plants: 50.0 };

    #[test]
    fn half_of_the_leaves_stay_at_h() {
        for h in [1e-6, 0.1, 0.4, 0.5, 0.7, 0.999_999] {
            assert!((from_area(h, h) - 0.5).abs() < 1e-9);
            assert!((from_distance(1.0 / h, 1.0, h) - 0.5).abs() < 1e-9);
        }
        assert_eq!(from_distance(2.0, 1.0, 0.5), 0.5);
        assert_eq!([from_area(0.9, 1.0), from_area(1.0, 1.0)], [FLOOR, 1.0]);
    }

    #[test]
    fn mack_keeps_the_published_shares_at_h() {
        for (h, share) in [(1.5, 0.79), (2.0, 0.5), (3.0, 0.18), (4.0, 0.06)] {
            assert!((as_mack_published(h, 1.0, h) - share).abs() < 0.006, "h {h}");
        }
    }

    #[test]
    fn lambda_stays_within_floor_and_one_whatever_the_numbers() {
        let odd = [f64::NAN, f64::NEG_INFINITY, -1.0, 0.0, 1e-300, 0.5, 1.0, 2.0, 1e300, f64::INFINITY];
        for a in odd {
            for b in odd {
                for c in odd {
                    let laws = [from_distance(a, b, c), from_area(a, b), as_mack_published(a, b, c)];
                    let reduction = SceneReduction { range: [b, c], ..REDUCTION };
                    for lambda in laws.into_iter().chain([reduction.reduced(a, b), REDUCTION.reduced(a, b)]) {
                        assert!((FLOOR..=1.0).contains(&lambda), "{a} {b} {c}: {lambda}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_scene_takes_most_off_the_farthest_plant_and_nothing_off_the_nearest() {
        assert_eq!(REDUCTION.reduced(0.5, 10.0), 0.5);
        assert!((REDUCTION.reduced(0.5, 90.0) - 0.5 * (1.0 - 0.5 * 0.8)).abs() < 1e-12);
        assert!((REDUCTION.reduced(0.5, 50.0) - 0.5 * (1.0 - 0.5 * 0.8 * 0.5)).abs() < 1e-12);
        // With more than m plants the exponent falls below 1, and nearby plants lose more.
        let crowded = SceneReduction { plants: 200.0, ..REDUCTION };
        assert!((crowded.reduced(0.5, 50.0) - 0.5 * (1.0 - 0.5 * 0.8 * 0.5_f64.powf(0.25))).abs() < 1e-12);
        assert_eq!(SceneReduction { range: [30.0, 30.0], ..REDUCTION }.reduced(0.5, 30.0), 0.5);
    }
}
