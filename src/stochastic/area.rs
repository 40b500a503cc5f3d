//! How much larger the leaves that stay are drawn.
//!
//! Limits: one factor for all leaves; holes and clusters of a random order stay what they are.

/// A rule for the area of the leaves that stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AreaRule {
    /// Cook et al., Equation 6: the *visible* area stays what it is, given how much leaves hide each other.
    #[default]
    Visible,
    /// Cook et al., Equation 3: the surface area stays what it is. Too much where leaves hide each other.
    Surface,
    /// Gomez: 1/lambda as a *linear* factor, so that the surface area grows as 1/lambda. Brightens far crowns; for comparison.
    Linear,
    /// No leaf grows.
    None,
}

impl AreaRule {
    /// Linear scale of every leaf at `lambda`, of which `visible_share` (r) is that of one leaf. At least 1; 1 where lambda
    /// is 1 or more, or not a number. Lambda counts as at least [`FLOOR`](super::lambda::FLOOR).
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

/// Area factor s = (1 - (1 - r)^(1/lambda)) / r, for lambda in (0, 1]: `n` leaves of visible share r cover 1 - (1 - r)^n of
/// what can be covered, so lambda * N leaves of share r * s cover as much as N of share r.
///
/// Between 1 and 1/lambda, which is its limit for r -> 0; 1 for r = 1. An `r` outside 0 to 1 counts as the nearer end, and
/// what is not a number as 0.
pub fn visible_factor(lambda: f64, visible_share: f64) -> f64 {
    let r = if visible_share.is_nan() { 0.0 } else { visible_share.clamp(0.0, 1.0) };
    // Below this numbers have fewer digits, and the limit is met to the last one.
    if r < f64::MIN_POSITIVE {
        return lambda.recip();
    }
    // ln(1 - r) and 1 - e^x lose no digits where r is small; the last one may still leave the range.
    let factor = -(((-r).ln_1p() / lambda).exp_m1()) / r;
    factor.min(lambda.recip()).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 - r)^n summed up as what n leaves, one after another, leave uncovered; n a whole number.
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
        // r = 1e-4 stays within 1 % of 1/lambda down to lambda = 0.01.
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
