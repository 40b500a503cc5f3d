//! Fades: partial presence of the last leaves, so that none appears or disappears abruptly.
//!
//! Three published windows around lambda. Within each, a leaf's share falls from 1 to 0 with its
//! rank, linearly or smoothly. The caller applies the share to size (to area, as the renderers'
//! window does) or to alpha.
//!
//! Limits: only [`FadeWindow::Window`] keeps the total area exactly at lambda, by narrowing near 0
//! and 1.

/// Window of ranks in which leaves fade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FadeWindow {
    /// No fade: a leaf is either drawn or not.
    None,
    /// Cook et al.: `half_width` on either side of lambda, narrower near 0 and 1; published as 0.1.
    Window {
        /// t0, as a share of all leaves.
        half_width: f64,
    },
    /// Gomez: the last 5 % of the drawn leaves. Loses 2.5 % of the area.
    Trailing,
    /// Fichtner: a tenth of lambda on either side, at most `most`, and never past the last leaf.
    Relative {
        /// Maximum half width, c, as a share of all leaves.
        most: f64,
    },
}

/// Gomez's share of the drawn leaves that are fully present.
const TRAILING_WHOLE: f64 = 0.95;
/// Fichtner's half width as a fraction of lambda.
const RELATIVE_HALF_WIDTH: f64 = 0.1;

impl Default for FadeWindow {
    fn default() -> Self {
        Self::Window { half_width: 0.1 }
    }
}

impl FadeWindow {
    /// First and last rank of the fade at `lambda`; both at most 1, and equal if no leaf fades.
    ///
    /// `lambda` is clamped to 0 to 1; NaN is treated as 1.
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

    /// Share of the leaf at `rank` (0 to 1) that is present at `lambda`: 0 to 1, linear in rank.
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

    /// Same as [`share`](Self::share), eased with a smoothstep at both ends.
    pub fn smooth_share(self, rank: f64, lambda: f64) -> f64 {
        let t = self.share(rank, lambda);
        t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FADES: [FadeWindow; 4] = [
        FadeWindow::None,
        FadeWindow::Window { half_width: 0.1 },
        FadeWindow::Trailing,
        FadeWindow::Relative { most: 0.1 },
    ];

    /// The window as printed in the paper, without narrowing t near 0 and 1.
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
                let share = FadeWindow::default().share(rank, lambda);
                assert!((share - published(rank, lambda, 0.1)).abs() < 1e-9, "{rank} at {lambda}");
            }
        }
        for lambda in [0.0, 1e-3, 0.01, 0.05, 0.5, 0.97, 1.0] {
            assert!((total(|rank| FadeWindow::default().share(rank, lambda)) - lambda).abs() < 1e-4, "{lambda}");
            assert!((total(|rank| FadeWindow::default().smooth_share(rank, lambda)) - lambda).abs() < 1e-4, "{lambda}");
        }
    }

    #[test]
    fn as_printed_the_window_loses_area_near_one_and_adds_it_near_zero() {
        for (lambda, relative) in [(1.0, 0.975), (0.05, 1.125), (0.01, 3.025)] {
            let area = total(|rank| published(rank, lambda, 0.1)) / lambda;
            assert!((area - relative).abs() < 0.01, "lambda {lambda}: {area}");
        }
        let trailing = total(|rank| FadeWindow::Trailing.share(rank, 0.4)) / 0.4;
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
        // At lambda 1 every leaf is fully present, except with the trailing fade.
        assert_eq!(
            [FadeWindow::default(), FadeWindow::Relative { most: 0.1 }].map(|fade| fade.share(0.999, 1.0)),
            [1.0; 2]
        );
    }
}
