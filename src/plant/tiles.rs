//! Growth by tiling: an enlarged card shows more pictures of their original size, not a larger one.
//!
//! A card of linear scale s shows a part s x s pictures large of a grid of pictures, so that its
//! first picture stays where it was. Pictures at the edge of the card are squeezed into what the
//! card has of them, and widen as it grows: nothing appears suddenly, and the share of the card
//! that is opaque stays the same. Every second picture is mirrored, along each axis, and every
//! second column is shifted by half a picture, so that what is open between pictures forms no
//! lines.

use super::{cards, convex};
use crate::{
    leaf::{LeafGeometry, Vertex},
    material::Material,
};
use glam::Vec3;

/// The rectangle of a texture that all cards of a leaf show, and the point of it that stays where
/// it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tiles {
    /// Lowest texture coordinates.
    pub(crate) low: [f32; 2],
    /// Width and height in texture coordinates, above 0.
    pub(crate) size: [f32; 2],
    /// Point that stays fixed, as a fraction of the rectangle: from 0 to 1.
    pub(crate) anchor: [f32; 2],
}

/// Steps of [`Tiles::anchor`], so that leaves of one kind have it in common.
const ANCHOR_STEPS: f64 = 16.0;
/// Difference between the cards' area in texture coordinates and a multiple of the rectangle's, as
/// a fraction of the rectangle's, up to which the cards fill it.
const AREA_TOLERANCE: f64 = 0.01;

impl Tiles {
    /// The rectangle of a leaf that is cut out of its texture by alpha and whose cards, one or
    /// several, each fill it; `None` for other leaves, which grow by scale.
    pub(crate) fn of_leaf(
        leaf: &LeafGeometry,
        material: &Material,
        vertices: &[Vertex],
        indices: &[u32],
    ) -> Option<Self> {
        if material.texture.is_none() || material.cutoff().is_none() {
            return None;
        }
        let corners = vertices.get(leaf.vertex_range())?;
        let [low, high] = cards::rect(corners.iter().map(|vertex| vertex.uv));
        let size = [high[0] - low[0], high[1] - low[1]];
        let has_corner = |u: f32, v: f32| corners.iter().any(|vertex| vertex.uv == [u, v]);
        let is_rectangle = [low[0], high[0]].into_iter().all(|u| has_corner(u, low[1]) && has_corner(u, high[1]));
        if !(is_rectangle && size[0] > 0.0 && size[1] > 0.0 && size.iter().all(|side| side.is_finite())) {
            return None;
        }
        let mut of_texture = 0.0;
        let (mut weight, mut anchor) = (0.0, [0.0; 2]);
        for triangle in indices.get(leaf.index_range())?.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| vertices.get(triangle[i] as usize));
            let (a, b, c) = (a?, b?, c?);
            let [pa, pb, pc] = [a, b, c].map(|vertex| Vec3::from(vertex.position).as_dvec3());
            let [ua, ub, uc] = [a, b, c].map(|vertex| vertex.uv.map(f64::from));
            of_texture += convex::turn(ua, ub, uc).abs() * 0.5;
            let (ab, ac, to_pivot) = (pb - pa, pc - pa, Vec3::from(leaf.pivot).as_dvec3() - pa);
            let normal = ab.cross(ac);
            let squared = normal.length_squared();
            if squared > 0.0 {
                let along_ab = to_pivot.cross(ac).dot(normal) / squared;
                let along_ac = ab.cross(to_pivot).dot(normal) / squared;
                let area = squared.sqrt();
                let uv = |axis: usize| ua[axis] + along_ab * (ub[axis] - ua[axis]) + along_ac * (uc[axis] - ua[axis]);
                (0..2).for_each(|axis| anchor[axis] += area * uv(axis));
                weight += area;
            }
        }
        let cards = of_texture / (f64::from(size[0]) * f64::from(size[1]));
        if weight == 0.0 || cards < 0.5 || (cards - cards.round()).abs() > AREA_TOLERANCE {
            return None;
        }
        let fraction = |axis: usize| (anchor[axis] / weight - f64::from(low[axis])) / f64::from(size[axis]);
        let anchor = [0, 1].map(|axis| ((fraction(axis).clamp(0.0, 1.0) * ANCHOR_STEPS).round() / ANCHOR_STEPS) as f32);
        Some(Self { low, size, anchor })
    }

    /// What a card of this linear scale shows; `None` if that is one picture.
    #[cfg(feature = "software")]
    #[must_use]
    pub(crate) fn at(&self, scale: f32) -> Option<Tiling> {
        let axis = |axis: usize, shift| Axis::new(self.low[axis], self.size[axis], self.anchor[axis], scale, shift);
        (scale > 1.0).then(|| Tiling { u: axis(0, 0.0), v: [axis(1, 0.0), axis(1, 0.5)] })
    }
}

/// The pictures that an enlarged card shows. Twin of `tiled` in `shaders/tiles.wgsl`.
#[cfg(feature = "software")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tiling {
    u: Axis,
    /// In even columns, and in odd ones.
    v: [Axis; 2],
}

#[cfg(feature = "software")]
impl Tiling {
    /// Texture coordinates that the enlarged card shows where the unscaled one shows `uv`.
    #[inline]
    pub(crate) fn shown(&self, uv: [f32; 2]) -> [f32; 2] {
        let (u, is_odd) = self.u.shown(uv[0]);
        [u, self.v[usize::from(is_odd)].shown(uv[1]).0]
    }
}

/// A part of the rectangle that shows one whole picture: its lowest and highest texture
/// coordinates, and those that are shown there.
#[cfg(feature = "simplify")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    pub(crate) ends: [[f32; 2]; 2],
    pub(crate) shown: [[f32; 2]; 2],
}

#[cfg(feature = "simplify")]
impl Tiling {
    /// All parts, column by column.
    pub(crate) fn cells(&self) -> impl Iterator<Item = Cell> {
        self.u.spans().flat_map(|(u, is_odd)| {
            self.v[usize::from(is_odd)].spans().map(move |(v, _)| Cell {
                ends: [0, 1].map(|end| [u.ends[end], v.ends[end]]),
                shown: [0, 1].map(|end| [u.shown[end], v.shown[end]]),
            })
        })
    }
}

/// What a picture takes up along one axis.
#[cfg(feature = "simplify")]
struct Span {
    ends: [f32; 2],
    shown: [f32; 2],
}

#[cfg(feature = "simplify")]
impl Axis {
    /// The pictures, and whether each one's number is odd.
    fn spans(&self) -> impl Iterator<Item = (Span, bool)> {
        let uv = |at: f32| self.low + (at - self.edge) / self.per_uv;
        (0..=self.more).map(move |index| {
            let start = if index == 0 { self.low } else { uv(self.first + index as f32) };
            let end = if index == self.more { self.low + self.size } else { uv(self.first + index as f32 + 1.0) };
            let is_odd = (self.first as i32 + index) & 1 == 1;
            let [low, high] = [self.low, self.low + self.size];
            (Span { ends: [start, end], shown: if is_odd { [high, low] } else { [low, high] } }, is_odd)
        })
    }
}

/// Pictures along one axis. Lengths are in pictures, from the lower edge of the first one, which is
/// number 0.
#[cfg(feature = "software")]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    /// Lowest texture coordinate and size of a picture.
    low: f32,
    size: f32,
    /// Pictures per texture coordinate.
    per_uv: f32,
    /// Lower edge of the card.
    edge: f32,
    /// Number of the lowest picture, how many follow, and one over the part that shows of the
    /// lowest and of the highest.
    first: f32,
    more: i32,
    over_first: f32,
    over_last: f32,
}

#[cfg(feature = "software")]
impl Axis {
    fn new(low: f32, size: f32, anchor: f32, scale: f32, shift: f32) -> Self {
        let edge = anchor - scale * anchor + shift;
        let end = edge + scale;
        let (first, last) = (edge.floor(), end.ceil() - 1.0);
        let [over_first, over_last] = [first + 1.0 - edge, end - last].map(|part| 1.0 / part.max(1e-6));
        Self { low, size, per_uv: scale / size, edge, first, more: (last - first) as i32, over_first, over_last }
    }

    /// The texture coordinate that is shown, and whether the picture's number is odd.
    fn shown(&self, uv: f32) -> (f32, bool) {
        let at = self.edge + (uv - self.low) * self.per_uv;
        // Rounding towards 0 is one instruction on any machine.
        let index = ((at - self.first) as i32).max(0).min(self.more);
        let place = if index == 0 {
            (at - self.edge) * self.over_first
        } else {
            let place = at - (self.first + index as f32);
            if index == self.more { place * self.over_last } else { place }
        };
        let place = place.clamp(0.0, 1.0);
        let is_odd = (self.first as i32 + index) & 1 == 1;
        (self.low + self.size * if is_odd { 1.0 - place } else { place }, is_odd)
    }
}

#[cfg(all(test, feature = "software"))]
mod tests {
    use super::*;
    use crate::{material::AlphaMode, plant::Plant};
    use proptest::prelude::*;

    fn masked() -> Material {
        Material { texture: Some(0), alpha_mode: AlphaMode::Mask, ..Material::default() }
    }

    /// Cards between x = 0 and 1 and y = 0 and 1, one for each angle about the axis x = 1/4.
    fn cards(turns: &[f32], pivot: [f32; 3]) -> Plant {
        let mut plant = Plant::default();
        let corners = turns.iter().flat_map(|turn| {
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| {
                let away = x - 0.25;
                let position = [0.25 + away * libm::cosf(*turn), y, away * libm::sinf(*turn)];
                Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.5 + 0.5 * x, 0.75 - 0.5 * y], color: [1.0; 4] }
            })
        });
        let corners: Vec<Vertex> = corners.collect();
        let indices: Vec<u32> =
            (0..turns.len() as u32).flat_map(|card| [0, 1, 2, 0, 2, 3].map(|i| 4 * card + i)).collect();
        plant.push_leaf(&corners, &indices, pivot, 0);
        plant
    }

    fn tiles(plant: &Plant) -> Option<Tiles> {
        Tiles::of_leaf(&plant.leaves[0], &masked(), &plant.vertices, &plant.indices)
    }

    #[test]
    fn cards_that_fill_a_rectangle_of_their_texture_have_tiles_about_the_pivot() {
        let expected = Tiles { low: [0.5, 0.25], size: [0.5; 2], anchor: [0.25, 1.0] };
        for turns in [&[0.0][..], &[0.0, 1.5], &[0.3, 1.3, 2.3]] {
            assert_eq!(tiles(&cards(turns, [0.25, 0.0, 0.0])), Some(expected));
        }
        let beside = tiles(&cards(&[0.0], [-3.0, 0.5, 1.0])).unwrap();
        assert_eq!(beside.anchor, [0.0, 0.5]);
        let mut cut = cards(&[0.0], [0.0; 3]);
        cut.vertices[2].uv[0] = 0.9;
        assert_eq!(tiles(&cut), None, "no rectangle");
        let mut half = cards(&[0.0], [0.0; 3]);
        half.indices.truncate(3);
        half.leaves[0].indices[1] = 3;
        assert_eq!(tiles(&half), None, "half of a rectangle");
        let card = cards(&[0.0], [0.0; 3]);
        for material in [Material::default(), Material { texture: None, ..masked() }] {
            assert_eq!(Tiles::of_leaf(&card.leaves[0], &material, &card.vertices, &card.indices), None);
        }
    }

    fn place(at: f32, anchor: f32, scale: f32) -> f32 {
        Axis::new(0.0, 1.0, anchor, scale, 0.0).shown(at).0
    }

    proptest! {
        #[test]
        fn the_first_picture_keeps_its_place_and_all_of_a_picture_shows_as_much(
            anchor in 0.0_f32..=1.0, scale in 1.001_f32..9.0,
        ) {
            let steps = 20_000;
            let mut shown = [0_u32; 4];
            for i in 0..steps {
                let at = (i as f32 + 0.5) / steps as f32;
                let place = place(at, anchor, scale);
                prop_assert!((0.0..=1.0).contains(&place));
                shown[(place * 4.0).min(3.0) as usize] += 1;
                // In units of the unscaled card.
                let unscaled = anchor + scale * (at - anchor);
                if (0.001..0.999).contains(&unscaled) {
                    prop_assert!((place - unscaled).abs() < 1e-3, "{} {}", place, unscaled);
                }
            }
            prop_assert!(shown.iter().all(|&quarter| quarter.abs_diff(steps / 4) < steps / 100), "{:?}", shown);
        }

        #[test]
        fn cells_show_what_tiles_show(
            anchor in [0.0_f32..=1.0, 0.0_f32..=1.0], scale in 1.01_f32..6.0, at in [0.0_f32..1.0, 0.0_f32..1.0],
        ) {
            let tiling = Tiles { low: [0.25, 0.5], size: [0.5, 0.25], anchor }.at(scale).unwrap();
            let uv = [0.25 + 0.5 * at[0], 0.5 + 0.25 * at[1]];
            let is_in = |cell: &Cell| (0..2).all(|i| cell.ends[0][i] <= uv[i] && uv[i] < cell.ends[1][i]);
            let cells: Vec<Cell> = tiling.cells().filter(is_in).collect();
            prop_assert_eq!(cells.len(), 1);
            let [[low, high], shown] = [cells[0].ends, cells[0].shown];
            let mixed = |i: usize| {
                let part = (uv[i] - low[i]) / (high[i] - low[i]);
                shown[0][i] + part * (shown[1][i] - shown[0][i])
            };
            let expected = tiling.shown(uv);
            let is_near_edge = (0..2).any(|i| (uv[i] - low[i]).min(high[i] - uv[i]) < 1e-4);
            prop_assert!(is_near_edge || (0..2).all(|i| (mixed(i) - expected[i]).abs() < 2e-3), "{expected:?}");
        }

        #[test]
        fn pictures_change_continuously_with_the_scale(anchor in 0.0_f32..=1.0, scale in 1.01_f32..9.0) {
            // Opaque halves of pictures: little of the card changes between two close scales.
            let is_opaque = |at: f32, scale: f32| place(at, anchor, scale) < 0.5;
            let steps = 4000;
            let changed = (0..steps).filter(|i| {
                let at = (*i as f32 + 0.5) / steps as f32;
                is_opaque(at, scale) != is_opaque(at, scale + 0.001)
            });
            let share = changed.count() as f32 / steps as f32;
            prop_assert!(share < 0.02, "{}", share);
        }
    }
}
