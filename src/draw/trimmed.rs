//! Leaves whose quads are drawn within an outline.
//!
//! A corner of a trimmed quad is two weights, by which the vertex shader places it on one of the
//! quad's two triangles: bytes are spent per picture, not per leaf. A quad that bends along its
//! diagonal, or is no parallelogram, is trimmed so that the diagonal stays an edge: its pixels show
//! what they show of the whole quad.
//!
//! The outline of a quad depends on the mip level, which the shader finds from the quad's size on
//! the screen. A leaf with a quad of any other kind is drawn whole.

use super::{
    quads::Quads,
    records::{LeafRecord, LeafVertex, NO_EXTRA, TRIMMED_CORNERS},
};
use crate::plant::{Card, Outline, Outlines, Point, at_level, cards, clipped, crossing, cut, is_convex, turn};
use glam::Vec3;
use std::collections::HashMap;

/// Pixels along the shorter side of the median quad from which on outlines are drawn. Smaller ones
/// cost more for their corners than they save: on software Vulkan an oak took 1.24 times as long at
/// 28 pixels.
const LEAST_QUAD_PX: f32 = 96.0;
/// How far a quad may be from a parallelogram, as a share of its diagonal, and its normals and
/// colours from being affine.
const FLATNESS: f32 = 1.0 / 256.0;
/// Steps of a corner's weights.
const WEIGHT_STEPS: f64 = 32767.0;
/// Area in texture coordinates by which a corner may be outside its quad.
const ROUNDING: f64 = 1e-9;
/// Mip levels that a quad may have an outline for.
const LEVELS: u32 = 8;
/// Four bits for a level without an outline.
const NO_ROW: u32 = 15;
/// Most extras for the outlines of one model.
const MAX_EXTRAS: usize = 1 << 22;
/// Corners of a trimmed quad.
const CORNERS: usize = TRIMMED_CORNERS as usize;

/// Outlines of a model's leaves, and the sizes of their quads.
#[derive(Debug, Clone, Default)]
pub(super) struct Trimmed {
    /// For each leaf, the first of its quads in `extras`; [`NO_EXTRA`] if they are drawn whole.
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only packing needs them"))]
    pub(super) leaves: Vec<u32>,
    /// See [`LookRecord::outline`](super::records::LookRecord::outline).
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only packing needs them"))]
    pub(super) extras: Vec<u32>,
    /// Pixels per unit of length from which on outlines are drawn; infinite without any.
    pub(super) least_pixels_per_unit: f32,
}

impl Trimmed {
    pub(super) fn new(outlines: &[Outline], leaves: &[LeafRecord], vertices: &[LeafVertex], quads: &Quads) -> Self {
        let whole =
            Self { leaves: vec![NO_EXTRA; leaves.len()], extras: Vec::new(), least_pixels_per_unit: f32::INFINITY };
        if outlines.is_empty() {
            return whole;
        }
        let found = Outlines::new(outlines);
        let mut trimmer = Trimmer {
            outlines: found,
            vertices,
            extras: Vec::new(),
            of_quads: HashMap::new(),
            of_leaves: HashMap::new(),
        };
        let mut sides = Vec::new();
        let of_leaf = |(leaf, ends): (&LeafRecord, &[u32])| {
            let quads = &quads.corners[ends[0] as usize..ends[1] as usize];
            let first = trimmer.leaf(leaf.material, quads)?;
            sides.extend(quads.iter().map(|quad| shorter_side(quad.map(|index| &vertices[index as usize]))));
            Some(first)
        };
        let leaves = leaves.iter().zip(quads.ends.windows(2)).map(of_leaf).map(|first| first.unwrap_or(NO_EXTRA));
        let leaves = leaves.collect();
        sides.sort_unstable_by(f32::total_cmp);
        let least_pixels_per_unit = sides.get(sides.len() / 2).map_or(f32::INFINITY, |side| LEAST_QUAD_PX / side);
        Self { leaves, extras: trimmer.extras, least_pixels_per_unit }
    }
}

/// What the outlines of a quad depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Kind {
    /// Its picture: the address of the outlines.
    outlines: *const Outline,
    uvs: [[u32; 2]; 4],
    is_affine: bool,
    is_alone: bool,
}

/// Collects the extras of a model's outlines.
struct Trimmer<'a> {
    outlines: Outlines<'a>,
    vertices: &'a [LeafVertex],
    extras: Vec<u32>,
    of_quads: HashMap<Kind, Option<u32>>,
    of_leaves: HashMap<Vec<u32>, u32>,
}

impl Trimmer<'_> {
    /// First extra of the quads of a leaf.
    fn leaf(&mut self, material: u32, quads: &[[u32; 4]]) -> Option<u32> {
        let vertices = self.vertices;
        let place = |index: u32| (vertices[index as usize].position, vertices[index as usize].uv);
        let cards = cards(quads, place)?;
        let own: Vec<_> = cards.iter().map(|card| self.outlines.find(material, card.rect)).collect();
        if own.iter().all(|outlines| outlines.is_empty()) || self.extras.len() > MAX_EXTRAS {
            return None;
        }
        let is_alone = |card: &Card| cards.iter().filter(|other| other.first == card.first).count() == 1;
        let of_quad = |((quad, outlines), card): ((&[u32; 4], &&[Outline]), &Card)| {
            self.quad(quad.map(|index| &vertices[index as usize]), quad[2] == quad[3], outlines, is_alone(card))
        };
        let entries = quads.iter().zip(&own).zip(&cards).map(of_quad).collect::<Option<Vec<u32>>>()?;
        let extras = &mut self.extras;
        Some(*self.of_leaves.entry(entries).or_insert_with_key(|entries| appended(extras, entries)))
    }

    /// First extra of the outlines of a quad; `None` if it cannot be trimmed.
    fn quad(&mut self, quad: [&LeafVertex; 4], is_triangle: bool, outlines: &[Outline], is_alone: bool) -> Option<u32> {
        let is_affine = is_triangle || is_affine(quad);
        let uvs = quad.map(|corner| corner.uv);
        let kind = Kind { outlines: outlines.as_ptr(), uvs: uvs.map(|uv| uv.map(f32::to_bits)), is_affine, is_alone };
        if let Some(&known) = self.of_quads.get(&kind) {
            return known;
        }
        let shape = Shape::new(uvs, is_triangle);
        let rows = shape.and_then(|shape| shape.rows(outlines, is_affine, is_alone));
        let first = rows.map(|rows| appended(&mut self.extras, &rows));
        self.of_quads.insert(kind, first);
        first
    }
}

/// Appends rows to the extras, and returns where they begin.
fn appended(extras: &mut Vec<u32>, rows: &[u32]) -> u32 {
    extras.extend_from_slice(rows);
    (extras.len() - rows.len()) as u32
}

/// A quad in its texture: convex, and cut into two triangles by the diagonal from its first to its
/// third corner.
struct Shape {
    /// First corner, third corner, and the corners between them either way.
    ends: [Point; 2],
    between: [Point; 2],
    /// Its corners from the u axis towards the v axis.
    polygon: Vec<Point>,
}

impl Shape {
    fn new(uvs: [[f32; 2]; 4], is_triangle: bool) -> Option<Self> {
        let [a, b, c, d] = uvs.map(|uv| uv.map(f64::from));
        let mut polygon = if is_triangle { vec![a, b, c] } else { vec![a, b, c, d] };
        if turn(a, b, c) < 0.0 {
            polygon.reverse();
        }
        let has_area = turn(a, b, c) != 0.0 && (is_triangle || turn(a, c, d) != 0.0);
        (has_area && is_convex(&polygon)).then_some(Self { ends: [a, c], between: [b, d], polygon })
    }

    /// Four bits for each level, with the number of its row; then the rows, of the corners of an
    /// outline each. `None` if one has too many corners.
    fn rows(&self, outlines: &[Outline], is_affine: bool, is_alone: bool) -> Option<Vec<u32>> {
        let mut rows: Vec<(u8, [u32; CORNERS])> = Vec::new();
        let mut numbers = 0;
        for level in 0..LEVELS {
            let outline = at_level(outlines, level as u8);
            if let Some(outline) = outline.filter(|outline| rows.last().is_none_or(|(last, _)| *last != outline.level))
            {
                rows.push((outline.level, self.row(outline, is_affine, is_alone)?));
            }
            numbers |= outline.map_or(NO_ROW, |_| rows.len() as u32 - 1) << (4 * level);
        }
        Some(std::iter::once(numbers).chain(rows.into_iter().flat_map(|(_, corners)| corners)).collect())
    }

    /// Corners of the part of the quad within an outline; the last one is repeated.
    fn row(&self, outline: &Outline, is_affine: bool, is_alone: bool) -> Option<[u32; CORNERS]> {
        let shown = clipped(&outline.points(), &self.polygon);
        let finished = |corners| if is_affine { corners } else { self.split(corners) };
        let mut corners = finished(shown.clone());
        // Quads that share an edge must be cut at the same points of it.
        if corners.len() > CORNERS && is_alone {
            let most = if is_affine { CORNERS } else { CORNERS - 2 };
            corners = finished(cut(shown, most, |point| self.holds(point).then_some(point))?);
        }
        let last = corners.last().copied();
        let word = |i: usize| corners.get(i).copied().or(last).map_or(0, |corner| self.word(corner));
        (corners.len() <= CORNERS).then(|| std::array::from_fn(word))
    }

    fn holds(&self, point: Point) -> bool {
        let count = self.polygon.len();
        (0..count).all(|i| turn(self.polygon[i], self.polygon[(i + 1) % count], point) >= -ROUNDING)
    }

    /// The corners of a convex polygon, with those where it crosses the diagonal. Begins with one
    /// of these, so that a fan of triangles has the diagonal for an edge.
    fn split(&self, corners: Vec<Point>) -> Vec<Point> {
        let [a, c] = self.ends;
        let side = |point| turn(a, c, point);
        let count = corners.len();
        let mut split = Vec::with_capacity(count + 2);
        let mut first = None;
        for (i, &corner) in corners.iter().enumerate() {
            if side(corner) == 0.0 {
                first = Some(split.len());
            }
            split.push(corner);
            let next = corners[(i + 1) % count];
            if let Some(on_diagonal) = crossing(corner, next, [side(corner), side(next)]) {
                first = Some(split.len());
                split.push(on_diagonal);
            }
        }
        split.rotate_left(first.unwrap_or(0));
        split
    }

    /// Weights of a corner: of the second or the fourth corner of the quad, of the third one, and
    /// which.
    fn word(&self, corner: Point) -> u32 {
        let ([a, c], [b, d]) = (self.ends, self.between);
        let is_second = self.polygon.len() == 3 || turn(a, c, corner) * turn(a, c, b) >= 0.0;
        let middle = if is_second { b } else { d };
        let whole = turn(a, middle, c);
        let steps = |share: f64| (share * WEIGHT_STEPS).round().clamp(0.0, WEIGHT_STEPS) as u32;
        let of_middle = steps(turn(a, corner, c) / whole);
        let of_third = steps(turn(a, middle, corner) / whole).min(WEIGHT_STEPS as u32 - of_middle);
        of_middle | of_third << 15 | u32::from(!is_second) << 30
    }
}

/// Whether all that a quad interpolates is affine, so that it may be cut into any triangles.
fn is_affine(quad: [&LeafVertex; 4]) -> bool {
    let [a, b, c, d] = quad;
    let [uv_a, uv_b, uv_c, uv_d] = quad.map(|corner| corner.uv.map(f64::from));
    let whole = turn(uv_a, uv_b, uv_c);
    let [of_b, of_c] = [turn(uv_a, uv_d, uv_c) / whole, turn(uv_a, uv_b, uv_d) / whole].map(|share| share as f32);
    let miss = |of: fn(&LeafVertex) -> [f32; 3]| {
        let [a, b, c, d] = [a, b, c, d].map(|corner| Vec3::from(of(corner)));
        (a + (b - a) * of_b + (c - a) * of_c - d).length()
    };
    let diagonal = Vec3::from(a.position).distance(c.position.into());
    let is_near = |miss: f32, size: f32| miss <= FLATNESS * size;
    is_near(miss(|corner| corner.position), diagonal)
        && is_near(miss(|corner| corner.normal), 1.0)
        && is_near(miss(|corner| corner.color), 1.0)
}

fn shorter_side([a, b, _, d]: [&LeafVertex; 4]) -> f32 {
    let from_a = |corner: &LeafVertex| Vec3::from(corner.position).distance(a.position.into());
    from_a(b).min(from_a(d))
}
