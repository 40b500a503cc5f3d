//! Timelines: the drawn scale of any leaf at any active count, looked up without state.
//!
//! When the active count falls to `i`, leaf `i` goes and its target gets leaf `i`'s scale. Events happen in the order of
//! `i` and are undone in the opposite order, so at active count `n` exactly the events with `i >= n` hold, and of those
//! that touch leaf `t` the last one to happen has the smallest `i`. There is one event a leaf, so all lists together are as
//! long as the model, and a lookup is a binary search in a list that is short on average.
//!
//! Equal to walking there by swaps ([`extract::swap`](crate::extract::swap)), to the bit.

use super::FoliageModel;

/// The events of every leaf, in flat arrays ready to be uploaded.
///
/// Invariants: `starts` has one entry a leaf and one more; leaf `t` owns the events `starts[t]..starts[t + 1]` of `events`
/// and `scales`; within them `events` rises.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timeline {
    starts: Vec<u32>,
    events: Vec<u32>,
    scales: Vec<f32>,
}

impl Timeline {
    /// The timelines of all leaves of a sound model. O(leaves).
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
        Self { starts, events, scales }
    }

    /// Number of leaves.
    pub fn leaves(&self) -> u32 {
        self.starts.len().saturating_sub(1) as u32
    }

    /// First event of each leaf, and at the end the number of events.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Per event, the leaf that goes: rising within each leaf's events.
    pub fn events(&self) -> &[u32] {
        &self.events
    }

    /// Per event, the drawn scale of the event's owner once that leaf is gone.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Drawn scale of `leaf` at active count `n`, whether or not the leaf is in the prefix: the scale of its event with the
    /// smallest index `>= n`, or 1. 1 for a leaf that does not exist. O(log events of the leaf).
    pub fn scale(&self, leaf: u32, n: u32) -> f32 {
        if leaf >= self.leaves() {
            return 1.0;
        }
        let [start, end] = [self.starts[leaf as usize] as usize, self.starts[leaf as usize + 1] as usize];
        let first = start + self.events[start..end].partition_point(|&event| event < n);
        if first < end { self.scales[first] } else { 1.0 }
    }

    /// Drawn scale of `leaf` at the active count `n + fraction`, which draws the leaves `0..=n` when `fraction` is above 0:
    /// leaf `n` grows from nothing while its target shrinks back, so nothing pops.
    ///
    /// Areas change evenly with `fraction`, scales with their square roots. `fraction` is clamped to 0..=1 (NaN is 0) and
    /// at both ends the result has the bits of [`Timeline::scale`] at `n` and `n + 1`.
    pub fn scale_between(&self, leaf: u32, n: u32, fraction: f32) -> f32 {
        let without = if leaf == n { 0.0 } else { self.scale(leaf, n) };
        let with = self.scale(leaf, n.saturating_add(1));
        if fraction >= 1.0 || without == with {
            with
        } else if fraction > 0.0 {
            (without * without + (with * with - without * without) * fraction).sqrt()
        } else {
            without
        }
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

    #[test]
    fn between_two_counts_areas_change_evenly_and_the_ends_are_exact() {
        let timeline = Timeline::new(&samples::model(12));
        for n in 0..12 {
            for leaf in 0..=n {
                let start = if leaf == n { 0.0 } else { timeline.scale(leaf, n) };
                let end = timeline.scale(leaf, n + 1);
                assert_eq!(timeline.scale_between(leaf, n, 0.0).to_bits(), start.to_bits());
                assert_eq!(timeline.scale_between(leaf, n, f32::NAN).to_bits(), start.to_bits());
                assert_eq!(timeline.scale_between(leaf, n, 1.0).to_bits(), end.to_bits());
                let middle = timeline.scale_between(leaf, n, 0.5);
                assert!((middle * middle - 0.5 * (start * start + end * end)).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_leaf_that_does_not_exist_has_scale_1() {
        let timeline = Timeline::new(&samples::model(3));
        assert_eq!(timeline.scale(3, 0), 1.0);
        assert_eq!(Timeline::default().scale(0, 0), 1.0);
    }
}
