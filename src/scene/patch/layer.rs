//! The kinds of one spacing, which share a grid of points.

use super::{
    blue_noise::{self, CELLS, SIDE},
    hash::{Stream, draw, unit},
    kind::{Placing, PlantKind},
};
use std::ops::Range;

/// The whole of all shares.
const WHOLE: u64 = 1 << 32;

/// Kinds of one spacing.
#[derive(Debug, Clone)]
pub(super) struct Layer {
    /// Seed of its random numbers.
    pub(super) seed: u32,
    pub(super) spacing: [f64; 2],
    placing: Placing,
    pub(super) kinds: Vec<Slot>,
    /// Distance beyond which no kind of it is made.
    pub(super) reach: f64,
    /// Greatest radius in which a kind of it keeps smaller ones away.
    pub(super) keeps_away: f64,
    /// Sum of the densities of its kinds, at most 1.
    pub(super) density: f64,
}

/// A kind with its part of the random numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slot {
    /// Index among the patch's kinds.
    pub(super) kind: u16,
    jitter: f64,
    /// Density as a share of [`WHOLE`].
    density: u64,
    /// Sum of the densities before; `None` if the densities sum to more than the whole, so that
    /// the slots lie where the maps say.
    first: Option<u64>,
}

/// What grows on a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) kind: u16,
    /// Place relative to the area's corner.
    pub(super) at: [f64; 2],
    /// Place in the order in which plants of its kind become fewer, as a share of 65536.
    pub(super) rank: u16,
}

impl Layer {
    /// Layers of all kinds, those of large spacing first.
    pub(super) fn all(kinds: &[PlantKind], seed: u32, placing: Placing) -> Vec<Self> {
        let mut spacings: Vec<[f64; 2]> = kinds.iter().map(|kind| kind.spacing.each()).collect();
        spacings.sort_by(|a, b| (b[0] * b[1]).total_cmp(&(a[0] * a[1])).then(b[0].total_cmp(&a[0])));
        spacings.dedup();
        spacings.into_iter().map(|spacing| Self::new(kinds, spacing, seed, placing)).collect()
    }

    fn new(kinds: &[PlantKind], spacing: [f64; 2], seed: u32, placing: Placing) -> Self {
        let own = || kinds.iter().enumerate().filter(move |(_, kind)| kind.spacing.each() == spacing);
        let density = |kind: &PlantKind| (f64::from(kind.density) * WHOLE as f64) as u64;
        let sum: u64 = own().map(|(_, kind)| density(kind)).sum();
        let mut before = 0;
        let slots = own().map(|(index, kind)| {
            let first = (sum <= WHOLE).then_some(before);
            before += density(kind);
            Slot { kind: index as u16, jitter: f64::from(kind.jitter), density: density(kind), first }
        });
        let kinds: Vec<Slot> = slots.collect();
        // Its own spacing makes a layer's numbers independent of which other layers there are.
        let bits = spacing.map(f64::to_bits);
        let of_axis = |seed: u32, bits: u64| draw(seed, [bits as i32, (bits >> 32) as i32], Stream::Layer);
        let seed = of_axis(of_axis(seed, bits[0]), bits[1]);
        let most = |of: fn(&PlantKind) -> f64| own().map(|(_, kind)| of(kind)).fold(0.0, f64::max);
        let (reach, keeps_away) = (most(PlantKind::reach), most(|kind| kind.keeps_away));
        let density = (sum as f64 / WHOLE as f64).min(1.0);
        Self { seed, spacing, placing, kinds, reach, keeps_away, density }
    }

    /// Cells in which plants of a rectangle, relative to the area's corner, may have their points:
    /// first and end along x and z.
    pub(super) fn cells(&self, low: [f64; 2], high: [f64; 2]) -> [Range<i32>; 2] {
        [0, 1].map(|axis| {
            let [low, high] = [low[axis], high[axis]].map(|at| at / self.spacing[axis]);
            low.floor() as i32..(high.floor() as i32).saturating_add(1)
        })
    }

    /// What grows on the point of a cell, where `share(kind, at)` is the share of [`WHOLE`] that a
    /// kind's map has at a place: the first kind in whose slot the cell's random number lies, so
    /// that the shares of all are what densities and maps say.
    pub(super) fn found(&self, cell: [i32; 2], share: impl Fn(u16, [f64; 2]) -> u64) -> Option<Found> {
        let number = self.number(cell);
        let shift = [Stream::Along, Stream::Across].map(|stream| f64::from(unit(self.seed, cell, stream)) * 2.0 - 1.0);
        let mut before = 0;
        let sum = || {
            let of = |slot: &Slot| slot.share(share(slot.kind, self.place(cell, slot.jitter, shift)));
            self.kinds.iter().map(of).sum::<u64>().max(WHOLE)
        };
        // Overlapping maps that sum to more than the whole share it.
        let whole = if self.kinds.first().is_some_and(|slot| slot.first.is_none()) { sum() } else { WHOLE };
        for slot in &self.kinds {
            let at = self.place(cell, slot.jitter, shift);
            let own = slot.share(share(slot.kind, at)) as u128 * WHOLE as u128 / whole as u128;
            let (first, own) = (slot.first.unwrap_or(before), own as u64);
            before = first + own;
            if (first..first + own).contains(&number) {
                let rank = ((number - first) as u128 * (1 << 16) / own as u128) as u16;
                return Some(Found { kind: slot.kind, at, rank });
            }
        }
        None
    }

    /// The random number that decides what grows, below [`WHOLE`].
    fn number(&self, cell: [i32; 2]) -> u64 {
        let random = draw(self.seed, cell, Stream::Kind);
        match self.placing {
            Placing::Jitter => random.into(),
            Placing::BlueNoise => {
                let [x, z] = cell.map(|at| at.rem_euclid(SIDE as i32) as usize);
                let rank = u64::from(blue_noise::ranks()[z * SIDE + x]);
                (rank << 32 | u64::from(random)) / CELLS as u64
            }
        }
    }

    /// Place of the plant of a cell: in its middle, moved by `jitter` of the spacing.
    fn place(&self, cell: [i32; 2], jitter: f64, shift: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (f64::from(cell[axis]) + (0.5 + jitter * shift[axis])) * self.spacing[axis])
    }
}

impl Slot {
    /// Share of the whole on which the kind grows, where its map has a share of it.
    fn share(&self, map: u64) -> u64 {
        ((u128::from(self.density) * u128::from(map)) >> 32) as u64
    }
}
