//! Fades: how much of each of the last leaves is there, so that none comes or goes at once.
//!
//! Three published windows about lambda, each falling from 1 to 0 as a leaf's rank passes it, in a straight line or smoothly.
//! What the share fades is the caller's choice: size (area, as the renderers' window does it) or alpha.
//!
//! Limits: only [`Fade::Window`] keeps the total area at lambda exactly, and only while the window fits.

/// Where leaves fade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fade {
    /// Leaves are there or not.
    None,
    /// Cook et al.: within `half_width` of lambda to either side, less near 0 and 1; 0.1 as published.
    Window {
        /// t0, in shares of all leaves.
        half_width: f64,
    },
    /// Gomez: the last 5 % of the leaves that are drawn. Loses 2.5 % of the area.
    Trailing,
    /// Fichtner: a tenth of lambda to either side, at most `most`, and never past the last leaf.
    Relative {
        /// Greatest half width, c, in shares of all leaves.
        most: f64,
    },
}

/// Gomez's share of the drawn leaves that is there whole.
const TRAILING_WHOLE: f64 = 0.95;
/// Fichtner's half width over lambda.
const RELATIVE_HALF_WIDTH: f64 = 0.1;

impl Default for Fade {
    fn default() -> Self {
        Self::Window { half_width: 0.1 }
    }
}

impl Fade {
    /// From which rank to which leaves fade at `lambda`; both at most 1, equal where none does.
    pub fn window(self, lambda: f64) -> [f64; 2] {
        let lambda = if lambda.is_nan() { 1.0 } else { lambda.clamp(0.0, 1.0) };
        let around = |half_width: f64| [lambda - half_width, lambda + half_width];
        match self {
            Self::None => [lambda; 2],
            Self::Window { half_width } => around(half_width.min(lambda).min(1.0 - lambda).max(0.0)),
            Self::Trailing => [TRAILING_WHOLE * lambda, lambda],
            Self::Relative { most } => around((RELATIVE_HALF_WIDTH * lambda).min(most).min(1.0 - lambda).max(0.0)),
        }
    }

    /// How much of the leaf of `rank` (0 to 1) is there at `lambda`: 0 to 1, in a straight line.
    pub fn share(self, rank: f64, lambda: f64) -> f64 {
        let [from, to] = self.window(lambda);
        if rank < from {
            1.0
        } else if rank < to {
            (to - rank) / (to - from)
        } else {
            0.0
        }
    }

    /// As [`share`](Self::share), leaving 1 and reaching 0 without a kink.
    pub fn smooth_share(self, rank: f64, lambda: f64) -> f64 {
        let t = self.share(rank, lambda);
        t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FADES: [Fade; 4] =
        [Fade::None, Fade::Window { half_width: 0.1 }, Fade::Trailing, Fade::Relative { most: 0.1 }];

    /// The window as the paper prints it, t as it stands.
    fn published(rank: f64, lambda: f64, t: f64) -> f64 {
        if rank < lambda - t {
            1.0
        } else if rank < lambda + t {
            (lambda + t - rank) / (2.0 * t)
        } else {
            0.0
        }
    }

    fn total(share: impl Fn(f64) -> f64) -> f64 {
        let steps = 100_000;
        (0..steps).map(|i| share((f64::from(i) + 0.5) / f64::from(steps))).sum::<f64>() / f64::from(steps)
    }

    #[test]
    fn the_window_is_the_papers_where_it_fits_and_keeps_the_area_everywhere() {
        for lambda in [0.1, 0.35, 0.9] {
            for i in 0..=1000 {
                let rank = f64::from(i) / 1000.0;
                let share = Fade::default().share(rank, lambda);
                assert!((share - published(rank, lambda, 0.1)).abs() < 1e-9, "{rank} at {lambda}");
            }
        }
        for lambda in [0.0, 1e-3, 0.01, 0.05, 0.5, 0.97, 1.0] {
            assert!((total(|rank| Fade::default().share(rank, lambda)) - lambda).abs() < 1e-4, "{lambda}");
            assert!((total(|rank| Fade::default().smooth_share(rank, lambda)) - lambda).abs() < 1e-4, "{lambda}");
        }
    }

    #[test]
    fn as_printed_the_window_loses_area_near_one_and_adds_it_near_zero() {
        for (lambda, relative) in [(1.0, 0.975), (0.05, 1.125), (0.01, 3.025)] {
            let area = total(|rank| published(rank, lambda, 0.1)) / lambda;
            assert!((area - relative).abs() < 0.01, "lambda {lambda}: {area}");
        }
        let trailing = total(|rank| Fade::Trailing.share(rank, 0.4)) / 0.4;
        assert!((trailing - 0.975).abs() < 1e-3);
    }

    #[test]
    fn shares_fall_from_one_to_zero_whatever_lambda() {
        for fade in FADES {
            for lambda in [f64::NAN, f64::NEG_INFINITY, 0.0, 1e-6, 0.3, 1.0, f64::INFINITY] {
                let shares: Vec<f64> = (0..=100).map(|i| fade.share(f64::from(i) / 100.0, lambda)).collect();
                assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{fade:?} {lambda}");
                assert!(shares.windows(2).all(|pair| pair[0] >= pair[1]), "{fade:?} {lambda}");
            }
            assert_eq!([fade.share(0.999, 1.0) > 0.0, fade.share(0.0, 0.0) > 0.0], [true, false], "{fade:?}");
        }
        // Every leaf is whole at lambda 1, but for the trailing fade.
        assert_eq!([Fade::default(), Fade::Relative { most: 0.1 }].map(|fade| fade.share(0.999, 1.0)), [1.0; 2]);
    }
}
