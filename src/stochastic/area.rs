//! Enlargement of the remaining leaves.
//!
//! Limits: one factor for all leaves, so the holes and clusters of a random order remain.

/// Rule that sets the area of the remaining leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "names",
    derive(strum::Display, strum::EnumMessage, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)
)]
#[cfg_attr(feature = "names", strum(serialize_all = "lowercase"))]
pub enum AreaRule {
    /// Cook et al., Equation 6: preserves the *visible* area, accounting for occlusion between
    /// leaves.
    #[default]
    Visible,
    /// Cook et al., Equation 3: preserves the surface area. Too large where leaves occlude each
    /// other.
    Surface,
    /// Gomez: 1/lambda as a *linear* factor, so the total surface area grows as 1/lambda. Brightens
    /// distant crowns; for comparison.
    Linear,
    /// Leaves keep their size.
    None,
}

impl AreaRule {
    /// Linear scale of every leaf at `lambda`; `visible_share` (r) is one leaf's share of the
    /// plant's visible area.
    ///
    /// Always at least 1, and exactly 1 if `lambda` is NaN or at least 1. A `lambda` below
    /// [`FLOOR`](super::lambda::FLOOR) is raised to it.
    pub fn linear_scale(self, lambda: f64, visible_share: f64) -> f64 {
        let lambda = super::lambda::floored(lambda);
        match self {
            Self::Visible => visible_factor(lambda, visible_share).sqrt(),
            Self::Surface => lambda.recip().sqrt(),
            Self::Linear => lambda.recip(),
            Self::None => 1.0,
        }
    }
}

/// Area factor s = (1 - (1 - r)^(1/lambda)) / r, for lambda in (0, 1].
///
/// `n` leaves of visible share r cover a fraction 1 - (1 - r)^n of the coverable area, so
/// lambda * N leaves of share r * s cover as much as N leaves of share r.
///
/// The factor lies between 1 (for r = 1) and 1/lambda (its limit for r -> 0). `r` is clamped to 0
/// to 1; NaN is treated as 0.
pub fn visible_factor(lambda: f64, visible_share: f64) -> f64 {
    let r = if visible_share.is_nan() { 0.0 } else { visible_share.clamp(0.0, 1.0) };
    // Subnormal numbers have fewer digits, and here the limit is exact to the last bit.
    if r < f64::MIN_POSITIVE {
        return lambda.recip();
    }
    // ln_1p and exp_m1 keep full precision for small r; rounding may still leave the range.
    let factor = -(((-r).ln_1p() / lambda).exp_m1()) / r;
    factor.min(lambda.recip()).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor at lambda = 1/n, with the coverage of n leaves accumulated one leaf at a time.
    fn factor_leaf_by_leaf(n: u32, r: f64) -> f64 {
        let covered = (0..n).fold(0.0, |covered, _| covered + (1.0 - covered) * r);
        covered / r
    }

    #[test]
    fn the_factor_is_what_the_lost_leaves_would_have_covered() {
        for n in [1, 2, 3, 10, 50, 200] {
            for r in [1e-6, 1e-4, 1e-2, 0.1, 0.5, 0.9] {
                let [fast, slow] = [visible_factor(1.0 / f64::from(n), r), factor_leaf_by_leaf(n, r)];
                assert!((fast - slow).abs() < 1e-9 * slow, "n {n}, r {r}: {fast} against {slow}");
            }
        }
    }

    #[test]
    fn published_values_are_met() {
        for (lambda, factor) in [(0.1, 9.56), (0.02, 39.5), (0.01, 63.4)] {
            assert!((visible_factor(lambda, 1e-2) - factor).abs() < 0.05, "lambda {lambda}");
        }
        // For r = 1e-4 the factor is within 1 % of 1/lambda down to lambda = 0.01.
        assert!((0..=99).all(|i| {
            let lambda = 0.01 + 0.01 * f64::from(i);
            visible_factor(lambda, 1e-4) * lambda > 0.99
        }));
    }

    #[test]
    fn limits_are_met_and_nothing_is_infinite() {
        for lambda in [1e-6, 0.005, 0.3, 1.0] {
            assert_eq!(visible_factor(lambda, 0.0), lambda.recip());
            assert!((visible_factor(lambda, 1e-12) * lambda - 1.0).abs() < 1e-5);
            assert_eq!(visible_factor(lambda, 1.0), 1.0);
            assert_eq!(visible_factor(lambda, f64::NAN), lambda.recip());
        }
        for rule in [AreaRule::Visible, AreaRule::Surface, AreaRule::Linear, AreaRule::None] {
            for lambda in [f64::NEG_INFINITY, -1.0, 0.0, 1e-300, 0.5, 1.0, 7.0, f64::INFINITY, f64::NAN] {
                for r in [0.0, 1e-12, 0.01, 1.0] {
                    let scale = rule.linear_scale(lambda, r);
                    assert!((1.0..=200.0).contains(&scale), "{rule:?} {lambda} {r}: {scale}");
                }
            }
            assert_eq!(rule.linear_scale(1.0, 0.01), 1.0);
        }
        assert_eq!(AreaRule::Linear.linear_scale(0.1, 0.0), 10.0);
        assert_eq!(AreaRule::Surface.linear_scale(0.25, 0.0), 2.0);
    }
}
