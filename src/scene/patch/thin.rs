//! How plants of a patch become fewer with distance, and are gone at the end of their reach.
//!
//! Over the last part of the reach those of high ranks go first; those that stay grow, so that
//! together they cover as much from any side and may take the ground's colour, and each sinks into
//! the ground just before it goes: nothing vanishes at once.

use super::kind::PlantKind;

/// Greatest growth of plants that thin out, with which a fourth of the plants cover what all did.
pub const MOST_GROWTH: f64 = 2.0;
/// Part of the plants that are gone when the others have the ground's colour.
const FADES_OVER: f64 = 0.75;
/// Part of the distance over which plants become fewer over which one of them sinks.
const SINKS_OVER: f64 = 0.12;

/// How a plant of a patch is drawn at a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Factor of its width: 1 to 2.
    pub width: f64,
    /// Factor of its height: 0 to 2.
    pub height: f64,
    /// Share of its colour that is the ground's: 0 to 1.
    pub fade: f64,
}

impl PlantKind {
    /// How a plant of `rank` (see [`PatchPlant`](super::PatchPlant)) is drawn at a distance; `None`
    /// if it is left out.
    pub fn seen(&self, rank: u16, distance: f64) -> Option<Seen> {
        let reach = self.reach();
        // Where plants begin to become fewer, and how far that goes.
        let over = reach * f64::from(self.thins_over);
        let own = reach - over * f64::from(rank) / 65_536.0;
        let is_seen = distance < own;
        let share = if over > 0.0 { ((reach - distance) / over).clamp(0.0, 1.0) } else { 1.0 };
        let height = if over > 0.0 { ((own - distance) / (SINKS_OVER * over)).min(1.0) } else { 1.0 };
        let growth = (1.0 / share.sqrt()).min(MOST_GROWTH);
        let fade = if self.blends { ((1.0 - share) / FADES_OVER).min(1.0) } else { 0.0 };
        is_seen.then_some(Seen { width: growth, height: growth * height, fade })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plants_become_fewer_and_larger_and_none_vanishes_at_once() {
        let kind = PlantKind { reach: Some(100.0), thins_over: 0.4, ..PlantKind::new("grass", 1.0, [1.0, 2.0]) };
        let ranks = || (0..4096_u32).map(|i| (16 * i) as u16);
        for (distance, share) in [(0.0, 1.0), (59.9, 1.0), (80.0, 0.5), (90.0, 0.25), (100.0, 0.0)] {
            let seen: Vec<_> = ranks().filter_map(|rank| kind.seen(rank, distance)).collect();
            assert!((seen.len() as f64 / 4096.0 - share).abs() < 0.01, "{} at {distance}", seen.len());
            assert!(
                seen.iter()
                    .all(|seen| (seen.width * seen.width * share - 1.0).abs() < 0.01 && seen.height <= seen.width)
            );
        }
        for rank in [0, 30_000, 65_535] {
            let heights: Vec<f64> =
                (0..10_000).map(|i| kind.seen(rank, f64::from(i) * 0.01).map_or(0.0, |seen| seen.height)).collect();
            let blending = PlantKind { blends: true, ..kind.clone() };
            let fades = [50.0, 75.0, 99.0].map(|at| blending.seen(0, at).map_or(-1.0, |seen| seen.fade));
            assert!((fades[1] - 0.5).abs() < 1e-6 && [fades[0], fades[2]] == [0.0, 1.0], "{fades:?}");
            assert!(heights.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.005), "{rank}");
        }
        let abrupt = PlantKind { thins_over: 0.0, ..kind };
        assert_eq!(
            [99.9, 100.0].map(|at| abrupt.seen(9, at)),
            [Some(Seen { width: 1.0, height: 1.0, fade: 0.0 }), None]
        );
    }
}
