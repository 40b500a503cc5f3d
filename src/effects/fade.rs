//! Fade at the end of the prefix: which leaves are in transition, and whether their size or alpha
//! changes.

use crate::{Result, error::check_range, model::Transition, stochastic};
use serde::Deserialize;

/// Property of a fading leaf that changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(
    feature = "names",
    derive(strum::Display, strum::EnumMessage, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)
)]
#[cfg_attr(feature = "names", strum(serialize_all = "lowercase"))]
pub enum FadeBy {
    /// Size: the leaf grows from its pivot.
    #[default]
    Size,
    /// Alpha: the share of a pixel's samples that the leaf may cover.
    Alpha,
}

/// Window in which leaves fade; the published rules of [`stochastic::FadeWindow`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// `half_width` on either side of the active share.
    #[default]
    Window,
    /// The last 5 % of the prefix.
    Trailing,
    /// A tenth of the active share on either side, at most `half_width`.
    Relative,
}

/// Default half width: 1 % of the leaves are in transition at once. For 10,000 leaves that is close
/// to [`Transition::SMOOTH_WINDOW`], which suits plants of thousands of leaves.
const DEFAULT_HALF_WIDTH: f32 = 0.005;
/// Largest half width: the window then spans all leaves.
const MAX_HALF_WIDTH: f32 = 0.5;

/// Gradual transition of the last leaves of a prefix.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fade {
    /// Whether leaves fade by size or by alpha.
    pub by: FadeBy,
    /// Rule that selects the fading leaves.
    pub rule: Rule,
    /// Half width of the window as a share of all leaves: 0 to 0.5.
    pub half_width: f32,
    /// Whether leaves fade with a smoothstep instead of linearly.
    pub smooth: bool,
}

impl Default for Fade {
    /// Fades by size, over half a percent of the leaves on either side.
    fn default() -> Self {
        Self { by: FadeBy::Size, rule: Rule::Window, half_width: DEFAULT_HALF_WIDTH, smooth: false }
    }
}

impl Fade {
    /// Transition of a plant of `leaves` leaves at the active count `active`.
    pub fn transition(&self, active: f64, leaves: u32) -> Transition {
        let all = f64::from(leaves);
        let half_width = f64::from(self.half_width);
        let rule = match self.rule {
            Rule::Window => stochastic::FadeWindow::Window { half_width },
            Rule::Trailing => stochastic::FadeWindow::Trailing,
            Rule::Relative => stochastic::FadeWindow::Relative { most: half_width },
        };
        let [from, to] = rule.window(active / all.max(1.0)).map(|rank| rank * all);
        let middle = (from + to) * 0.5;
        let transition = Transition::new(middle, (to - from) as f32, leaves);
        if self.smooth { transition.smooth() } else { transition }
    }

    pub(super) fn check(&self) -> Result<()> {
        check_range("effects.fade.half_width", self.half_width, 0.0..=MAX_HALF_WIDTH)
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
                    Rule::Window => stochastic::FadeWindow::Window { half_width: 0.1 },
                    Rule::Trailing => stochastic::FadeWindow::Trailing,
                    Rule::Relative => stochastic::FadeWindow::Relative { most: 0.1 },
                };
                for lambda in [0.2, 0.5, 0.85] {
                    let transition = fade.transition(lambda * 10_000.0, 10_000);
                    for leaf in (0..10_000).step_by(7) {
                        // The rank of a leaf is measured at its middle.
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
