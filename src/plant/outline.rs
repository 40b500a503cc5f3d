//! Outlines of cards: convex polygons around all that covers anything of a card's picture.
//!
//! A card is a piece of a leaf, of one or a few triangles, that shows a part of a texture. Most of
//! it is transparent; a polygon of a few corners around the rest has fewer pixels to test. An
//! outline belongs to a material and the rectangle of texture coordinates that a card spans, so
//! cards with the same picture share one. Coarser mip levels reach farther, so a picture may have
//! an outline for each of several levels.

use super::{
    Broken, Checked,
    cards::Rect,
    check,
    convex::{Point, hull, is_convex},
};
#[cfg(feature = "software")]
use super::{LeafGeometry, Vertex, cards::cards};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};

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
    /// The corners.
    pub(crate) fn points(&self) -> Vec<Point> {
        self.corners.iter().map(|corner| corner.map(f64::from)).collect()
    }

    /// The outline of the same picture, for a rectangle that was moved a little; `None` if it has
    /// too few corners then.
    fn moved(&self, rect: [[f32; 2]; 2]) -> Option<Self> {
        let inside = |corner: &[f32; 2]| [0, 1].map(|axis| corner[axis].max(rect[0][axis]).min(rect[1][axis]));
        let corners = rounded_hull(self.corners.iter().map(inside))?;
        Some(Self { rect, corners, ..self.clone() })
    }

    fn picture(&self) -> Picture {
        picture(self.material, self.rect)
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
            && is_convex(&self.points());
        check(13, holds, || format!("{self:?} is not a convex polygon within its rectangle, of {materials} materials"))
    }
}

/// Checks invariant 13 of [`Plant`](super::Plant).
pub(super) fn check_all(outlines: &[Outline], materials: usize) -> Result<(), Broken> {
    check(13, outlines.len() <= MAX_OUTLINES, || format!("{} outlines", outlines.len()))?;
    outlines.iter().try_for_each(|outline| outline.check(materials))
}

/// Outlines by material and rectangle, those of all levels of a picture in a row.
#[derive(Debug, Default)]
pub(crate) struct Outlines<'a>(HashMap<Picture, &'a [Outline]>);

/// Material, and the bits of a rectangle.
pub(crate) type Picture = (u32, [u32; 4]);

impl<'a> Outlines<'a> {
    pub(crate) fn new(outlines: &'a [Outline]) -> Self {
        let pictures = outlines.chunk_by(|a, b| a.picture() == b.picture());
        Self(pictures.map(|outlines| (outlines[0].picture(), outlines)).collect())
    }

    /// The outlines of a card that spans a rectangle.
    pub(crate) fn find(&self, material: u32, rect: Rect) -> &'a [Outline] {
        self.0.get(&picture(material, rect)).copied().unwrap_or_default()
    }

    /// The outlines of each triangle of a leaf; `None` if no triangle has any.
    #[cfg(feature = "software")]
    pub(crate) fn of_leaf(
        &self,
        leaf: &LeafGeometry,
        vertices: &[Vertex],
        indices: &[u32],
    ) -> Option<Vec<&'a [Outline]>> {
        if self.0.is_empty() {
            return None;
        }
        let cards = cards(indices.as_chunks::<3>().0, |index| {
            vertices.get(index as usize).map_or_else(Default::default, |vertex| (vertex.position, vertex.uv))
        })?;
        let outlines: Vec<_> = cards.into_iter().map(|card| self.find(leaf.material, card.rect)).collect();
        outlines.iter().any(|outlines| !outlines.is_empty()).then_some(outlines)
    }
}

/// The tightest outline of a picture that suffices for a mip level.
pub(crate) fn at_level(outlines: &[Outline], level: u8) -> Option<&Outline> {
    outlines.iter().filter(|outline| outline.level >= level).min_by_key(|outline| outline.level)
}

pub(super) fn picture(material: u32, rect: Rect) -> Picture {
    // Adding 0 turns -0 into 0.
    let [u0, v0, u1, v1] = bytemuck::cast::<_, [f32; 4]>(rect).map(|number| (number + 0.0).to_bits());
    (material, [u0, v0, u1, v1])
}

/// Convex hull of points that are rounded already; `None` if it has too few corners.
pub(super) fn rounded_hull(points: impl Iterator<Item = [f32; 2]>) -> Option<Vec<[f32; 2]>> {
    let hull = hull(points.map(|point| point.map(f64::from)).collect());
    let is_enough = hull.len() >= OUTLINE_CORNERS[0] as usize;
    is_enough.then(|| hull.into_iter().map(|corner| corner.map(|number| number as f32)).collect())
}

/// The outlines with their rectangles moved a little. Pictures whose rectangles become the same are
/// joined; a level at which that takes too many corners is left out.
pub(crate) fn moved(outlines: &[Outline], to: impl Fn([f32; 2]) -> [f32; 2]) -> Vec<Outline> {
    let mut groups: Vec<Vec<Vec<Outline>>> = Vec::new();
    let mut places = HashMap::new();
    for of_picture in outlines.chunk_by(|a, b| a.picture() == b.picture()) {
        let rect = of_picture[0].rect.map(&to);
        let moved = of_picture.iter().filter_map(|outline| outline.moved(rect)).collect();
        let place = *places.entry(picture(of_picture[0].material, rect)).or_insert(groups.len());
        match groups.get_mut(place) {
            Some(group) => group.push(moved),
            None => groups.push(vec![moved]),
        }
    }
    groups.iter().flat_map(|group| joined(group)).collect()
}

/// Outlines around those of all of several pictures, at each level.
fn joined(pictures: &[Vec<Outline>]) -> Vec<Outline> {
    if let [only] = pictures {
        return only.clone();
    }
    let levels: BTreeSet<u8> = pictures.iter().flatten().map(|outline| outline.level).collect();
    let at = |level| {
        let outlines: Vec<_> = pictures.iter().map(|picture| at_level(picture, level)).collect::<Option<_>>()?;
        let corners = rounded_hull(outlines.iter().flat_map(|outline| outline.corners.iter().copied()))?;
        let is_few = corners.len() <= OUTLINE_CORNERS[1] as usize;
        is_few.then(|| Outline { corners, level, ..outlines[0].clone() })
    };
    levels.into_iter().filter_map(at).collect()
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

    #[cfg(feature = "software")]
    #[test]
    fn leaves_find_the_outlines_of_their_cards_alone() {
        let finer = Outline { level: 0, ..samples::hexagon() };
        let hexagons = [finer.clone(), samples::hexagon(), Outline { material: 1, ..finer }];
        let outlines = Outlines::new(&hexagons);
        let vertex = |uv: [f32; 2]| Vertex { position: [uv[0], uv[1], 0.0], normal: [0.0; 3], uv, color: [1.0; 4] };
        let of = |material, uvs: &[[f32; 2]; 6]| {
            let leaf = LeafGeometry { material, vertices: [0, 6], indices: [0, 6], pivot: [0.0; 3] };
            let found = outlines.of_leaf(&leaf, &uvs.map(vertex), &[0, 1, 2, 3, 4, 5]);
            found.map(|found| found.iter().map(|outlines| outlines.len()).collect::<Vec<_>>())
        };
        let quad = [[0.0, 0.0], [1.0, -0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(of(0, &quad), Some(vec![2, 2]));
        assert_eq!(of(1, &quad), Some(vec![1, 1]));
        assert_eq!(of(2, &quad), None);
        let mut apart = quad;
        apart[3] = [-0.5, 0.0];
        apart[4] = [1.0, 1.5];
        assert_eq!(of(0, &apart), Some(vec![2, 0]));
        let at = |level| at_level(&hexagons[..2], level).map(|outline| outline.level);
        assert_eq!([at(0), at(1), at(2)], [Some(0), Some(1), None]);
    }

    #[test]
    fn a_moved_outline_stays_within_its_rectangle_and_equal_pictures_are_joined() {
        let within = samples::hexagon().moved([[0.2, 0.0], [0.8, 1.0]]).unwrap();
        assert!(within.check(1).is_ok(), "{within:?}");
        assert!(samples::hexagon().moved([[0.0; 2], [0.1; 2]]).is_none());
        let mut other = samples::hexagon();
        other.rect[1] = [1.0625, 1.0];
        other.corners[2] = [1.0, 0.5];
        other.level = 2;
        let all = [samples::hexagon(), Outline { level: 3, ..samples::hexagon() }, other];
        let joined = moved(&all, |corner| corner.map(f32::round));
        // The second picture has no outline that suffices for level 3.
        assert_eq!(joined.iter().map(|outline| outline.level).collect::<Vec<_>>(), [1, 2]);
        assert!(check_all(&joined, 1).is_ok() && joined.iter().all(|outline| outline.corners.contains(&[1.0, 0.5])));
        assert_eq!(moved(&all, |corner| corner).len(), 3);
    }
}
