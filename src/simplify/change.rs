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
    /// Frontmost polygon at full detail, or the row [`outline::beyond`](super::outline::beyond);
    /// the background if references are not kept.
    pub reference: u32,
    /// Number of pixels.
    pub count: u32,
}

/// Benefit of changing a leaf's footprint, summed over any number of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gain {
    /// Decrease of the difference between the views and their references.
    pub closer: i64,
    /// Increase in the number of covered pixels within the crown's outline.
    pub within: i64,
    /// Increase in the number of covered pixels beyond it.
    pub beyond: i64,
}

impl Gain {
    /// Sum of two gains.
    pub fn plus(self, other: Self) -> Self {
        Self {
            closer: self.closer + other.closer,
            within: self.within + other.within,
            beyond: self.beyond + other.beyond,
        }
    }

    /// Gain of `count` such changes.
    pub fn times(self, count: i64) -> Self {
        Self { closer: self.closer * count, within: self.within * count, beyond: self.beyond * count }
    }
}
