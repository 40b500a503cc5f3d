//! Outlines of cards: convex polygons around all that covers anything of a card's picture.
//!
//! A card is a quad that shows a rectangle of a texture. Most of it is transparent; a polygon of a
//! few corners around the rest has fewer pixels to test. An outline belongs to a rectangle of a
//! material, so cards with the same picture share one.

use super::{Broken, Checked, check};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Maximum number of outlines of a plant.
pub const MAX_OUTLINES: usize = 4096;
/// Fewest and most corners of an outline.
pub const OUTLINE_CORNERS: [u32; 2] = [4, 8];

/// Convex polygon around all texels that cover anything within a rectangle of a texture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// Index into the owner's materials.
    pub material: u32,
    /// Lowest and highest texture coordinates of the cards that have this outline.
    pub rect: [[f32; 2]; 2],
    /// Corners in texture coordinates, within `rect`, from the u axis towards the v axis.
    pub corners: Vec<[f32; 2]>,
    /// Coarsest mip level, filtered bilinearly, at which nothing outside the corners covers
    /// anything.
    pub level: u8,
}

impl Outline {
    /// Share of the rectangle's area that the outline takes.
    pub fn share(&self) -> f64 {
        let [low, high] = self.rect.map(|corner| corner.map(f64::from));
        area(&self.corners.iter().map(|corner| corner.map(f64::from)).collect::<Vec<_>>())
            / ((high[0] - low[0]) * (high[1] - low[1]))
    }

    /// The outline of the same picture, for a rectangle that was moved a little; `None` if it has
    /// too few corners then.
    pub(crate) fn moved(&self, rect: [[f32; 2]; 2]) -> Option<Self> {
        let inside = |corner: &[f32; 2]| [0, 1].map(|axis| corner[axis].max(rect[0][axis]).min(rect[1][axis]));
        let corners = rounded_hull(self.corners.iter().map(inside))?;
        Some(Self { rect, corners, ..self.clone() })
    }

    /// Checks invariant 13 of [`Plant`](super::Plant) for an outline of a plant with so many
    /// materials.
    fn check(&self, materials: usize) -> Checked {
        let [least, most] = OUTLINE_CORNERS.map(|count| count as usize);
        let [low, high] = self.rect;
        let numbers = self.corners.as_flattened().iter().chain(self.rect.as_flattened());
        let is_finite = numbers.clone().all(|number| number.is_finite());
        let is_rect = low[0] < high[0] && low[1] < high[1];
        let is_within = |corner: &[f32; 2]| (0..2).all(|axis| (low[axis]..=high[axis]).contains(&corner[axis]));
        let holds = (self.material as usize) < materials
            && (least..=most).contains(&self.corners.len())
            && is_finite
            && is_rect
            && self.corners.iter().all(is_within)
            && is_convex(&self.corners);
        check(13, holds, || format!("{self:?} is not a convex polygon within its rectangle, of {materials} materials"))
    }
}

/// Checks invariant 13 of [`Plant`](super::Plant).
pub(super) fn check_all(outlines: &[Outline], materials: usize) -> Result<(), Broken> {
    check(13, outlines.len() <= MAX_OUTLINES, || format!("{} outlines", outlines.len()))?;
    outlines.iter().try_for_each(|outline| outline.check(materials))
}

/// Outlines by material and rectangle.
#[derive(Debug, Default)]
pub(crate) struct Outlines<'a>(HashMap<Picture, &'a Outline>);

/// Material, and the bits of a rectangle.
pub(super) type Picture = (u32, [u32; 4]);

impl<'a> Outlines<'a> {
    pub(crate) fn new(outlines: &'a [Outline]) -> Self {
        Self(outlines.iter().map(|outline| (picture(outline.material, outline.rect), outline)).collect())
    }

    /// The outline of a leaf whose vertices have the texture coordinates `uvs`.
    pub(crate) fn find(&self, material: u32, uvs: impl Iterator<Item = [f32; 2]>) -> Option<&'a Outline> {
        if self.0.is_empty() {
            return None;
        }
        self.0.get(&picture(material, rect(uvs))).copied()
    }
}

pub(super) fn picture(material: u32, rect: [[f32; 2]; 2]) -> Picture {
    // Adding 0 turns -0 into 0.
    let [u0, v0, u1, v1] = bytemuck::cast::<_, [f32; 4]>(rect).map(|number| (number + 0.0).to_bits());
    (material, [u0, v0, u1, v1])
}

/// Lowest and highest coordinates.
pub(super) fn rect(uvs: impl Iterator<Item = [f32; 2]>) -> [[f32; 2]; 2] {
    uvs.fold([[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]], |[low, high], uv| {
        [[low[0].min(uv[0]), low[1].min(uv[1])], [high[0].max(uv[0]), high[1].max(uv[1])]]
    })
}

/// Twice the signed area of a triangle; positive from the first axis towards the second.
pub(super) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Area of a convex polygon.
pub(super) fn area(corners: &[[f64; 2]]) -> f64 {
    let Some((&first, rest)) = corners.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| turn(first, pair[0], pair[1])).sum::<f64>()
}

/// Whether every turn, and every triangle with the first corner, goes the same way round.
fn is_convex(corners: &[[f32; 2]]) -> bool {
    let at = |i: usize| corners[i % corners.len()].map(f64::from);
    let turns = (0..corners.len()).all(|i| turn(at(i), at(i + 1), at(i + 2)) >= 0.0);
    let fan = (1..corners.len().saturating_sub(1)).all(|i| turn(at(0), at(i), at(i + 1)) >= 0.0);
    turns && fan
}

/// Convex hull of points that are rounded already; `None` if it has too few corners.
pub(super) fn rounded_hull(points: impl Iterator<Item = [f32; 2]>) -> Option<Vec<[f32; 2]>> {
    let hull = hull(points.map(|point| point.map(f64::from)).collect());
    let is_enough = hull.len() >= OUTLINE_CORNERS[0] as usize;
    is_enough.then(|| hull.into_iter().map(|corner| corner.map(|number| number as f32)).collect())
}

/// Corners of the convex hull, without those on its edges: A. M. Andrew, *Another efficient
/// algorithm for convex hulls in two dimensions* (1979).
pub(super) fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut kept: Vec<[f64; 2]> = Vec::new();
        for &point in points {
            while let [.., a, b] = kept[..]
                && turn(a, b, point) <= 0.0
            {
                kept.pop();
            }
            kept.push(point);
        }
        kept.pop();
        kept
    };
    let lower = chain(&mut points.iter());
    let upper = chain(&mut points.iter().rev());
    [lower, upper].concat()
}

#[cfg(test)]
mod samples {
    use super::Outline;

    /// A hexagon in the middle of the whole texture of material 0.
    pub fn hexagon() -> Outline {
        let corners = vec![[0.25, 0.125], [0.75, 0.125], [0.875, 0.5], [0.75, 0.875], [0.25, 0.875], [0.125, 0.5]];
        Outline { material: 0, rect: [[0.0; 2], [1.0; 2]], corners, level: 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_that_break_a_rule_are_refused() {
        let is_sound = |change: &dyn Fn(&mut Outline)| {
            let mut outline = samples::hexagon();
            change(&mut outline);
            outline.check(1).is_ok()
        };
        assert!(is_sound(&|_| {}));
        assert!(!is_sound(&|outline| outline.material = 1));
        assert!(!is_sound(&|outline| outline.corners.truncate(3)));
        assert!(!is_sound(&|outline| outline.corners.extend_from_within(..3)));
        assert!(!is_sound(&|outline| outline.corners.reverse()));
        assert!(!is_sound(&|outline| outline.corners.swap(1, 2)));
        assert!(!is_sound(&|outline| outline.corners[0] = [0.5; 2]));
        assert!(!is_sound(&|outline| outline.corners[0][0] = -0.25));
        assert!(!is_sound(&|outline| outline.corners[3][1] = f32::NAN));
        assert!(!is_sound(&|outline| outline.rect[1][0] = f32::INFINITY));
        assert!(!is_sound(&|outline| outline.rect = [[0.0; 2], [0.0, 1.0]]));
        let star = [0, 2, 4, 1, 3].map(|i| [[0.5, 0.0], [1.0, 0.4], [0.8, 1.0], [0.2, 1.0], [0.0, 0.4]][i]);
        assert!(!is_sound(&|outline| outline.corners = star.to_vec()));
        assert!(check_all(&vec![samples::hexagon(); MAX_OUTLINES + 1], 1).is_err());
    }

    #[test]
    fn leaves_find_the_outline_of_their_picture_alone() {
        let hexagon = [samples::hexagon()];
        let outlines = Outlines::new(&hexagon);
        let of = |material, uvs: [[f32; 2]; 3]| outlines.find(material, uvs.into_iter()).is_some();
        assert!(of(0, [[1.0, -0.0], [0.5, 0.5], [0.0, 1.0]]));
        assert!(!of(1, [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]));
        assert!(!of(0, [[1.0, 0.0], [0.5, 0.5], [0.0, 0.99]]));
        assert!((hexagon[0].share() - 0.46875).abs() < 1e-12);
    }

    #[test]
    fn a_moved_outline_stays_within_its_rectangle() {
        let moved = samples::hexagon().moved([[0.2, 0.0], [0.8, 1.0]]).unwrap();
        assert!(moved.check(1).is_ok(), "{moved:?}");
        assert!(samples::hexagon().moved([[0.0; 2], [0.1; 2]]).is_none());
    }
}
