//! The end of the prefix: how many leaves are on their way at once, and what of them changes.

use crate::{Result, error::check_range, model::Transition, stochastic};
use serde::Deserialize;

/// What of a fading leaf changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FadeBy {
    /// Its size: it grows from its pivot.
    #[default]
    Size,
    /// Its alpha: the share of a pixel's samples that it may cover.
    Alpha,
}

/// Where leaves fade; the published rules of [`stochastic::Fade`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// `half_width` to either side of the active share.
    #[default]
    Window,
    /// The last 5 % of the prefix.
    Trailing,
    /// A tenth of the active share to either side, at most `half_width`.
    Relative,
}

/// How the last leaves of a prefix come and go.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fade {
    /// By size or by alpha.
    pub by: FadeBy,
    /// Which leaves.
    pub rule: Rule,
    /// Half the window in shares of all leaves: 0 to 0.5.
    pub half_width: f32,
    /// Leaves leave and arrive without a kink (smoothstep) instead of in a straight line.
    pub smooth: bool,
}

impl Default for Fade {
    /// By size, within half a percent of the leaves to either side.
    fn default() -> Self {
        Self { by: FadeBy::Size, rule: Rule::Window, half_width: 0.005, smooth: false }
    }
}

impl Fade {
    /// What leaves `0..active` of `leaves` become when the end fades.
    pub fn transition(&self, active: f64, leaves: u32) -> Transition {
        let all = f64::from(leaves);
        let half_width = f64::from(self.half_width);
        let rule = match self.rule {
            Rule::Window => stochastic::Fade::Window { half_width },
            Rule::Trailing => stochastic::Fade::Trailing,
            Rule::Relative => stochastic::Fade::Relative { most: half_width },
        };
        let [from, to] = rule.window(active / all.max(1.0)).map(|rank| rank * all);
        let transition = Transition::new((from + to) * 0.5, (to - from) as f32, leaves);
        if self.smooth { transition.smooth() } else { transition }
    }

    pub(super) fn check(&self) -> Result<()> {
        check_range("effects.fade.half_width", self.half_width, 0.0..=0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presences_follow_the_published_shares() {
        for rule in [Rule::Window, Rule::Trailing, Rule::Relative] {
            for smooth in [false, true] {
                let fade = Fade { rule, half_width: 0.1, smooth, ..Fade::default() };
                let published = match rule {
                    Rule::Window => stochastic::Fade::Window { half_width: 0.1 },
                    Rule::Trailing => stochastic::Fade::Trailing,
                    Rule::Relative => stochastic::Fade::Relative { most: 0.1 },
                };
                for lambda in [0.2, 0.5, 0.85] {
                    let transition = fade.transition(lambda * 10_000.0, 10_000);
                    for leaf in (0..10_000).step_by(7) {
                        // A leaf's rank is that of its middle.
                        let rank = (f64::from(leaf) + 0.5) / 10_000.0;
                        let share =
                            if smooth { published.smooth_share(rank, lambda) } else { published.share(rank, lambda) };
                        let presence = f64::from(transition.presence(leaf));
                        assert!(
                            (presence - share).abs() < 2e-3,
                            "{rule:?} at {lambda}, leaf {leaf}: {presence}, {share}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn ends_and_odd_numbers_leave_nothing_half_there() {
        for leaves in [0, 1, 2, 1000] {
            for active in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
                let transition = Fade::default().transition(active, leaves);
                let is_whole = (0..leaves).all(|leaf| [0.0, 1.0].contains(&transition.presence(leaf)));
                assert!(is_whole && transition.drawn() <= leaves, "{active} of {leaves}");
            }
        }
    }
}
