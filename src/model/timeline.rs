//! Timelines: the drawn scale of any leaf at any active count, looked up without state.
//!
//! When the active count falls to `i`, leaf `i` is removed and its target takes leaf `i`'s scale:
//! an event. Events happen in descending order of `i` and are undone in ascending order, so at
//! active count `n` exactly the events with `i >= n` are in effect, and the latest one to affect
//! leaf `t` has the smallest `i`. Each leaf except leaf 0 has one event, so all lists together are
//! about as long as the model, and a lookup is a binary search in a list that is short on average.
//!
//! The result is bit-identical to reaching the same count by swaps
//! ([`extract::swap`](crate::extract::swap)).

use super::FoliageModel;

/// The events of every leaf, in flat arrays ready for upload.
///
/// Invariants: `starts` has one more entry than there are leaves; leaf `t` owns the events
/// `starts[t]..starts[t + 1]` of `events` and `scales`, where `events` is ascending.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timeline {
    starts: Vec<u32>,
    events: Vec<u32>,
    scales: Vec<f32>,
    has_cards: bool,
}

impl Timeline {
    /// Builds the timelines of all leaves of a valid model. O(leaves).
    pub fn new(model: &FoliageModel) -> Self {
        let count = model.leaves.len();
        let targets = || model.leaves.iter().enumerate().filter_map(|(i, leaf)| Some((i, leaf.target()?, leaf.scale)));
        let mut starts = vec![0_u32; count + 1];
        for (_, target, _) in targets() {
            starts[target + 1] += 1;
        }
        for t in 0..count {
            starts[t + 1] += starts[t];
        }
        let total = starts[count] as usize;
        let (mut events, mut scales, mut next) = (vec![0; total], vec![0.0; total], starts.clone());
        for (i, target, scale) in targets() {
            let at = next[target] as usize;
            (events[at], scales[at]) = (i as u32, scale);
            next[target] += 1;
        }
        Self { starts, events, scales, has_cards: false }
    }

    /// As [`new`](Self::new), but a leaf whose place a [card](super::Clusters) takes has scale 0
    /// there: for drawers that draw the cards too.
    pub fn with_cards(model: &FoliageModel) -> Self {
        let mut timeline = Self::new(model);
        for (number, card) in model.clusters.cards().iter().enumerate() {
            let events = model.clusters.events(number, &timeline);
            debug_assert_eq!(timeline.events[events.end - 1], card.first);
            timeline.scales[events].fill(0.0);
        }
        timeline.has_cards = true;
        timeline
    }

    /// Whether this is a timeline [`with_cards`](Self::with_cards), which are to be drawn.
    pub fn has_cards(&self) -> bool {
        self.has_cards
    }

    /// Number of leaves.
    pub fn leaves(&self) -> u32 {
        self.starts.len().saturating_sub(1) as u32
    }

    /// Position of each leaf's first event, followed by the total number of events.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The leaf removed by each event, ascending among the events of one leaf.
    pub fn events(&self) -> &[u32] {
        &self.events
    }

    /// The drawn scale of each event's owner once the event's leaf has been removed.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Drawn scale of `leaf` at active count `n`, whether or not the leaf is in the prefix: the
    /// scale of its event with the smallest index `>= n`, or 1 if there is none. Returns 1 for a
    /// leaf that does not exist. O(log events of the leaf).
    pub fn scale(&self, leaf: u32, n: u32) -> f32 {
        if leaf >= self.leaves() {
            return 1.0;
        }
        let [start, end] = [self.starts[leaf as usize] as usize, self.starts[leaf as usize + 1] as usize];
        let first = start + self.events[start..end].partition_point(|&event| event < n);
        if first < end { self.scales[first] } else { 1.0 }
    }

    /// Drawn scale of `leaf` while the leaves at the end of the prefix are in transition; 0 for a
    /// leaf that is not drawn yet or does not exist.
    ///
    /// Areas, not scales, change linearly: the leaf's own area with its
    /// [`presence`](Transition::presence), and its target's area from its value without that leaf
    /// to its value with it. At a whole count with a window of 1, a leaf in the prefix has exactly
    /// the bits of [`Timeline::scale`]. O(log events of the leaf + its events within the window).
    pub fn scale_at(&self, leaf: u32, transition: &Transition) -> f32 {
        self.scale_of_share(leaf, transition, transition.presence(leaf))
    }

    /// As [`scale_at`](Self::scale_at), but a leaf in transition has its full size throughout: for
    /// effects that fade it by other means, such as its alpha.
    pub fn full_scale_at(&self, leaf: u32, transition: &Transition) -> f32 {
        self.scale_of_share(leaf, transition, if transition.presence(leaf) > 0.0 { 1.0 } else { 0.0 })
    }

    /// Scale of a leaf with the fraction `share` of its area present.
    fn scale_of_share(&self, leaf: u32, transition: &Transition, share: f32) -> f32 {
        if leaf >= self.leaves() || share == 0.0 {
            return 0.0;
        }
        let [start, end] = [self.starts[leaf as usize] as usize, self.starts[leaf as usize + 1] as usize];
        let scale = |at: usize| if at < end { self.scales[at] } else { 1.0 };
        let first = start + self.events[start..end].partition_point(|&event| event < transition.first_partial());
        let (mut at, mut area) = (first, 0.0);
        while at < end && self.events[at] < transition.drawn() {
            let gone = 1.0 - transition.presence(self.events[at]);
            area += gone * (scale(at) * scale(at) - scale(at + 1) * scale(at + 1));
            at += 1;
        }
        if at == first && share == 1.0 {
            return scale(at);
        }
        ((scale(at) * scale(at) + area).max(0.0) * share).sqrt()
    }
}

/// A fractional active count, and the number of leaves at the end of the prefix that are in
/// transition at once.
///
/// With a window of 1, the last leaf grows from nothing while its target shrinks back, then the
/// next leaf follows. A window of `w` leaves spreads each of these changes over `w` times as many
/// frames, with `w` leaves in transition at any time. A large leaf thus appears more gradually, and
/// the largest change between two frames is smaller. The presences of all leaves add up to the
/// active count (approximately, if the window is not a whole number or the presences are smooth).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    n: u32,
    /// In `0.0..1.0`.
    fraction: f32,
    /// At least 1.
    window: f32,
    is_smooth: bool,
}

impl Transition {
    /// A window that suits plants with thousands of leaves: the largest change between two frames
    /// of a dolly was 0.9 times that with a window of 1 (6,000 leaves at 128 x 128, four samples
    /// per pixel).
    pub const SMOOTH_WINDOW: f32 = 128.0;

    /// Creates a transition at the active count `active` out of `leaves`, clamped to `0..=leaves`
    /// (NaN counts as 0), with `window` leaves in transition: at least 1, and fewer near either
    /// end, where there is no room for more.
    pub fn new(active: f64, window: f32, leaves: u32) -> Self {
        let active = active.max(0.0).min(f64::from(leaves));
        let n = active.floor();
        let room = 2.0 * active.min(f64::from(leaves) - active);
        Self { n: n as u32, fraction: (active - n) as f32, window: window.min(room as f32).max(1.0), is_smooth: false }
            .normal()
    }

    /// Returns the same transition with presences that follow a smoothstep curve, without a kink at
    /// 0 and 1, instead of a straight line.
    pub fn smooth(self) -> Self {
        Self { is_smooth: true, ..self }
    }

    /// Carries into the count a fraction that rounding to `f32` has raised to 1.
    fn normal(self) -> Self {
        if self.fraction < 1.0 { self } else { Self { n: self.n + 1, fraction: 0.0, ..self } }
    }

    /// The whole part of the count, its fraction, and the window.
    pub fn parts(&self) -> (u32, f32, f32) {
        (self.n, self.fraction, self.window)
    }

    /// Fraction of the area of `leaf` that is present: 1 for all leaves before the window, 0 for
    /// all leaves after it.
    pub fn presence(&self, leaf: u32) -> f32 {
        let behind = (i64::from(leaf) - i64::from(self.n)) as f32;
        let t = ((self.fraction - behind - 0.5) / self.window + 0.5).clamp(0.0, 1.0);
        if self.is_smooth { t * t * (3.0 - 2.0 * t) } else { t }
    }

    /// Index of the first leaf that may be only partially present.
    pub fn first_partial(&self) -> u32 {
        let behind = (self.fraction - 0.5 - 0.5 * self.window).floor() as i64 + 1;
        (i64::from(self.n) + behind).max(0) as u32
    }

    /// Number of leaves to draw; all later leaves have presence 0.
    pub fn drawn(&self) -> u32 {
        let behind = (self.fraction - 0.5 + 0.5 * self.window).ceil() as i64;
        (i64::from(self.n) + behind).max(0) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::validate::samples;

    #[test]
    fn scale_equals_the_replay_of_all_events_down_to_n() {
        let model = samples::model(12);
        let timeline = Timeline::new(&model);
        for n in 0..=12_usize {
            let mut drawn = vec![1.0; 12];
            for leaf in model.leaves[n..].iter().rev() {
                if let Some(target) = leaf.target() {
                    drawn[target] = leaf.scale;
                }
            }
            let looked_up: Vec<f32> = (0..12).map(|leaf| timeline.scale(leaf, n as u32)).collect();
            assert_eq!(looked_up, drawn, "at {n}");
        }
    }

    #[test]
    fn there_is_one_event_per_leaf_but_the_first() {
        let timeline = Timeline::new(&samples::model(12));
        assert_eq!((timeline.events().len(), timeline.scales().len(), timeline.starts().len()), (11, 11, 13));
    }

    fn at(active: f64, window: f32) -> Transition {
        Transition::new(active, window, 12)
    }

    #[test]
    fn at_whole_counts_a_transition_has_the_bits_of_the_plain_scale() {
        let timeline = Timeline::new(&samples::model(12));
        for n in 0..=12 {
            let transition = at(f64::from(n), 1.0);
            assert_eq!((transition.first_partial(), transition.drawn()), (n, n));
            for leaf in 0..12 {
                let expected = if leaf < n { timeline.scale(leaf, n) } else { 0.0 };
                assert_eq!(timeline.scale_at(leaf, &transition).to_bits(), expected.to_bits(), "leaf {leaf} at {n}");
            }
        }
    }

    #[test]
    fn between_two_counts_areas_change_evenly() {
        let timeline = Timeline::new(&samples::model(12));
        for n in 0..12 {
            for leaf in 0..=n {
                let start = if leaf == n { 0.0 } else { timeline.scale(leaf, n) };
                let end = timeline.scale(leaf, n + 1);
                let middle = timeline.scale_at(leaf, &at(f64::from(n) + 0.25, 1.0));
                assert!((middle * middle - 0.75 * start * start - 0.25 * end * end).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_window_equals_undoing_each_event_by_its_presence() {
        let model = samples::model(12);
        let timeline = Timeline::new(&model);
        for (active, window) in [(6.3, 4.0), (6.0, 5.5), (1.2, 9.0), (11.6, 9.0), (5.5, 1e9), (7.9, 0.0)] {
            let transition = at(active, window);
            // From the full plant downwards, apply each event to the extent that its leaf is gone.
            let mut areas = [1.0_f32; 12];
            for (i, leaf) in model.leaves.iter().enumerate().rev() {
                if let Some(target) = leaf.target() {
                    let before = timeline.scale(target as u32, i as u32 + 1).powi(2);
                    areas[target] += (1.0 - transition.presence(i as u32)) * (leaf.scale.powi(2) - before);
                }
            }
            let presences: f32 = (0..12).map(|leaf| transition.presence(leaf)).sum();
            assert!((f64::from(presences) - active).abs() < 0.1, "{presences} for {active}");
            for leaf in 0..12 {
                let expected = (areas[leaf as usize] * transition.presence(leaf)).sqrt();
                let scale = timeline.scale_at(leaf, &transition);
                assert!((scale - expected).abs() < 1e-4, "leaf {leaf} at {active}: {scale}, {expected}");
                assert_eq!(scale > 0.0, leaf < transition.drawn());
            }
        }
    }

    #[test]
    fn any_numbers_give_a_count_between_none_and_all() {
        for active in [f64::NAN, -1.0, f64::INFINITY, 1e300, 11.999_999_999] {
            for window in [f32::NAN, -3.0, 0.0, f32::INFINITY] {
                let transition = at(active, window);
                assert!(transition.drawn() <= 12 && transition.first_partial() <= 12, "{transition:?}");
            }
        }
    }

    #[test]
    fn a_leaf_that_does_not_exist_has_scale_1() {
        let timeline = Timeline::new(&samples::model(3));
        assert_eq!(timeline.scale(3, 0), 1.0);
        assert_eq!(timeline.scale_at(3, &Transition::new(3.0, 1.0, 3)), 0.0);
        assert_eq!(Timeline::default().scale(0, 0), 1.0);
    }
}
