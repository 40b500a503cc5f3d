//! Effects of a step on the views: changed pixels ([`Change`]) and how much closer the views come
//! to their references ([`Gain`]).

/// `count` pixels whose frontmost and second polygons changed in the same way. Polygons are
/// numbered: leaves from 0, then the background, then the wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// (front, second) before the change.
    pub from: [u32; 2],
    /// (front, second) after the change.
    pub to: [u32; 2],
    /// Frontmost polygon at full detail; the background if references are not kept.
    pub reference: u32,
    /// Number of pixels.
    pub count: u32,
}

/// Benefit of changing a leaf's footprint, summed over any number of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gain {
    /// Decrease of the difference between the views and their references.
    pub closer: i64,
    /// Increase in the number of covered pixels.
    pub covered: i64,
}

impl Gain {
    /// Sum of two gains.
    pub fn plus(self, other: Self) -> Self {
        Self { closer: self.closer + other.closer, covered: self.covered + other.covered }
    }

    /// Gain of `count` such changes.
    pub fn times(self, count: i64) -> Self {
        Self { closer: self.closer * count, covered: self.covered * count }
    }
}
