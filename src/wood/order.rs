//! The order in which the wood of a plant loses detail, as a model stores it.

use crate::{
    Error, Result,
    plant::{Broken, Checked, Wood, check},
};
use serde::{Deserialize, Serialize};

/// Most vertices that a vertex slides to one after another.
pub const MAX_SLIDES: u32 = 64;

/// Number of ratios of the error to a stem's width that its swell is given for: two for each
/// octave, 1 and 1.5 times a power of two.
pub const SWELLS: usize = 16;
/// The least of these ratios.
pub const LEAST_SWELL: f32 = 1.0 / 16.0;
/// Steps of a swell in one error, and the step that stands for none.
pub const SWELL_STEPS: f32 = 64.0;
/// See [`SWELL_STEPS`].
pub const NO_SWELL: u8 = 32;

/// How far a stem is widened on all sides, over the error, at each of [`SWELLS`] ratios of the
/// error to its width: in [`SWELL_STEPS`], [`NO_SWELL`] being 0.
pub type Swell = [u8; SWELLS];

/// Place of a stem among the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StemLink {
    /// The stem that it grows on, which has a lower number; `None` for a trunk.
    pub parent: Option<u32>,
    /// Number of stems below it, at most 255; 0 for a trunk.
    pub level: u8,
}

/// The order in which the wood of a plant loses detail. See [`wood`](crate::wood).
///
/// Invariants, checked by [`validate`](Self::validate):
/// - `triangle_stems` has an element for each triangle of the wood, and `parents` and `thresholds`
///   for each vertex, `swells` for each stem; all numbers are in range.
/// - A stem's parent has a lower number, and the level below or, from 255 on, the same.
/// - Thresholds are above 0, never fall from a vertex to its parent, and have the precision of
///   [`bf16`](https://en.wikipedia.org/wiki/Bfloat16_floating-point_format): their lower 16 bits
///   are 0.
/// - A vertex is its own parent if and only if its threshold is infinite. At most [`MAX_SLIDES`]
///   parents follow each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WoodOrder {
    /// The stems, each after its parent.
    pub stems: Vec<StemLink>,
    /// Of each triangle of the wood, in the order of its indices: its stem.
    pub triangle_stems: Vec<u32>,
    /// Of each vertex of the wood: the vertex that it slides to.
    pub parents: Vec<u32>,
    /// Of each vertex of the wood: the error, in the plant's units, from which on it is drawn where
    /// its parent is.
    pub thresholds: Vec<f32>,
    /// Of each stem: how far it is widened, so that what is left covers as much as all of it would.
    pub swells: Vec<Swell>,
    /// Of ribbons: how much wider those are drawn that are thinner than the error, so that all wood
    /// covers as much as in full; `None` if no stem is drawn as a ribbon.
    pub boosts: Option<Boosts>,
}

/// Number of errors that boosts are given for: in half octaves from half a pixel of wood of 2048
/// pixels, down to 23.
pub const BOOSTS: usize = 14;

/// By how much factors exceed 1 at each of [`BOOSTS`] errors: in [`SWELL_STEPS`], [`NO_SWELL`]
/// being 0.
pub type Boosts = [u8; BOOSTS];

/// How far a vertex of a stem of this width is drawn outside the surface, along its normal.
pub(crate) fn widened(swell: &Swell, width: f32, error: f32) -> f32 {
    error * swell_at(swell, error / width)
}

/// The swell at a ratio of the error to the width.
pub(super) fn swell_at(swell: &Swell, ratio: f32) -> f32 {
    // The bits of a number rise with its logarithm, linear between powers of two.
    let above = ratio.max(LEAST_SWELL).to_bits().saturating_sub(LEAST_SWELL.to_bits());
    let at = (above as f32 / (1 << 22) as f32).min((SWELLS - 1) as f32);
    let step = (at as usize).min(SWELLS - 2);
    let [low, high] =
        [swell[step], swell[step + 1]].map(|steps| (f32::from(steps) - f32::from(NO_SWELL)) / SWELL_STEPS);
    low + (high - low) * (at - step as f32)
}

/// Number of stems of each level, from the trunks up.
pub fn levels(stems: &[StemLink]) -> Vec<u32> {
    let mut levels = vec![0; stems.iter().map(|stem| usize::from(stem.level) + 1).max().unwrap_or_default()];
    stems.iter().for_each(|stem| levels[usize::from(stem.level)] += 1);
    levels
}

impl WoodOrder {
    /// Checks the invariants for `wood`. O(wood).
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the first one that is broken.
    pub fn validate(&self, wood: &Wood) -> Result<()> {
        let told = |broken: Broken| Error::invalid("wood order", broken.what, "one that was found for this wood");
        self.check(wood).map_err(told)
    }

    pub(crate) fn check(&self, wood: &Wood) -> Checked {
        let counts = [self.triangle_stems.len(), self.parents.len(), self.thresholds.len(), self.swells.len()];
        let expected = [wood.triangles(), wood.vertices.len(), wood.vertices.len(), self.stems.len()];
        let what = || format!("an order of {counts:?} triangles, vertices and swells, not {expected:?}");
        check(16, counts == expected, what)?;
        self.check_stems()?;
        let unknown = self.triangle_stems.iter().find(|&&stem| stem as usize >= self.stems.len());
        check(16, unknown.is_none(), || format!("stem {unknown:?} of {}", self.stems.len()))?;
        (0..self.parents.len()).try_for_each(|vertex| self.check_vertex(vertex))
    }

    fn check_stems(&self) -> Checked {
        for (i, stem) in self.stems.iter().enumerate() {
            let level = stem.parent.map(|parent| self.stems[..i].get(parent as usize).map(|below| below.level));
            let is_sound = match level {
                None => stem.level == 0,
                Some(below) => below.is_some_and(|below| below.saturating_add(1) == stem.level),
            };
            check(16, is_sound, || format!("stem {i} is {stem:?}"))?;
        }
        Ok(())
    }

    fn check_vertex(&self, vertex: usize) -> Checked {
        let broken = |what: &str| Broken { invariant: 16, what: format!("wood vertex {vertex} {what}") };
        let (parent, threshold) = (self.parents[vertex] as usize, self.thresholds[vertex]);
        if !(threshold > 0.0 && is_short(threshold)) {
            return Err(broken(&format!("has threshold {threshold}")));
        }
        let Some(&next) = self.thresholds.get(parent) else { return Err(broken(&format!("slides to {parent}"))) };
        if (parent == vertex) != (threshold == f32::INFINITY) || next < threshold {
            return Err(broken(&format!("slides to {parent} at {threshold}, that one at {next}")));
        }
        let mut at = parent;
        for _ in 0..MAX_SLIDES {
            match self.parents.get(at).map(|&next| next as usize) {
                Some(next) if next == at => return Ok(()),
                Some(next) => at = next,
                // The vertex that lies outside is reported when its own turn comes.
                None => return Ok(()),
            }
        }
        Err(broken(&format!("slides more than {MAX_SLIDES} times")))
    }
}

/// The number rounded up to one whose lower 16 bits are 0; it must be above 0.
#[cfg(feature = "simplify")]
pub(super) fn shortened(number: f32) -> f32 {
    f32::from_bits(number.to_bits().saturating_add(0xffff).min(f32::INFINITY.to_bits()) & 0xffff_0000)
}

/// Whether the number's lower 16 bits are 0.
fn is_short(number: f32) -> bool {
    number.to_bits() & 0xffff == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Vertex;

    fn wood() -> Wood {
        Wood { vertices: vec![bytemuck::Zeroable::zeroed(); 4], indices: vec![0, 1, 2, 1, 2, 3], parts: Vec::new() }
    }

    fn order() -> WoodOrder {
        let link = |parent, level| StemLink { parent, level };
        WoodOrder {
            stems: vec![link(None, 0), link(Some(0), 1)],
            triangle_stems: vec![0, 1],
            parents: vec![0, 0, 1, 1],
            thresholds: vec![f32::INFINITY, 2.0, 1.0, 2.0],
            swells: vec![[NO_SWELL; SWELLS]; 2],
            boosts: None,
        }
    }

    #[test]
    fn every_broken_invariant_is_found() {
        let _: Vertex = wood().vertices[0];
        assert!(order().check(&wood()).is_ok());
        let broken: [fn(&mut WoodOrder); 12] = [
            |order| order.triangle_stems.truncate(1),
            |order| order.parents.push(0),
            |order| order.triangle_stems[0] = 2,
            |order| order.stems[1].parent = Some(1),
            |order| order.stems[1].level = 2,
            |order| order.thresholds[2] = 0.0,
            |order| order.thresholds[2] = 3.0,
            |order| order.thresholds[1] = 2.000_001,
            |order| order.thresholds[1] = f32::INFINITY,
            |order| order.parents[0] = 1,
            |order| order.parents[3] = 4,
            |order| order.swells.truncate(1),
        ];
        for (i, damage) in broken.iter().enumerate() {
            let mut order = order();
            damage(&mut order);
            assert!(order.check(&wood()).is_err(), "{i}");
        }
    }

    #[test]
    fn circles_and_long_ways_are_found() {
        let wood = |vertices| Wood { vertices: vec![bytemuck::Zeroable::zeroed(); vertices], ..Wood::default() };
        let circle = WoodOrder { parents: vec![1, 0], thresholds: vec![1.0; 2], ..WoodOrder::default() };
        assert!(circle.check(&wood(2)).is_err());
        for (length, is_sound) in [(65, true), (66, false)] {
            let mut thresholds = vec![1.0; length];
            thresholds[0] = f32::INFINITY;
            let parents = (0..length as u32).map(|i| i.saturating_sub(1)).collect();
            let order = WoodOrder { parents, thresholds, ..WoodOrder::default() };
            assert_eq!(order.check(&wood(length)).is_ok(), is_sound, "{length}");
        }
    }

    #[cfg(feature = "simplify")]
    #[test]
    fn shortened_numbers_are_at_least_as_large_and_close() {
        for number in [1.0, 1.000_000_1, 0.1, 3.3e-20, 7e8] {
            let short = shortened(number);
            assert!(is_short(short) && short >= number && short <= number * 1.01, "{number} {short}");
        }
        assert_eq!(shortened(f32::INFINITY), f32::INFINITY);
        assert_eq!(shortened(f32::MAX), f32::INFINITY);
    }
}
