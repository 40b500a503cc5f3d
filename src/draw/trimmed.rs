//! Leaves whose quads are drawn within an outline.
//!
//! The vertex shader places the corners of an outline on a quad by their texture coordinates, so
//! the outline costs no bytes per leaf. That takes plane quads whose four corners show the corners
//! of the outline's rectangle; leaves with any other quad are drawn whole.

use super::{
    quads::Quads,
    records::{LeafRecord, LeafVertex, TRIMMED_CORNERS},
};
use crate::plant::{Outline, Outlines};
use glam::Vec3;

/// Pixels along the shorter side of the median card from which on outlines are drawn. Smaller cards
/// show mip levels that reach beyond the margin of outlines.
const LEAST_CARD_PX: f32 = 96.0;
/// How far a quad may be from a parallelogram, as a share of its diagonal.
const FLATNESS: f32 = 1.0 / 256.0;

/// Outlines of a model's leaves, and the sizes of their cards.
#[derive(Debug, Clone, Default)]
pub(super) struct Trimmed<'a> {
    /// For each leaf, its outline if its quads are trimmed.
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only packing needs them"))]
    pub(super) outlines: Vec<Option<&'a Outline>>,
    /// Pixels per unit of length from which on outlines are drawn; infinite without any.
    pub(super) least_pixels_per_unit: f32,
}

impl<'a> Trimmed<'a> {
    pub(super) fn new(outlines: &'a [Outline], leaves: &[LeafRecord], vertices: &[LeafVertex], quads: &Quads) -> Self {
        let found = Outlines::new(outlines);
        let mut sides = Vec::new();
        let mut of_leaf = |(leaf, ends): (&LeafRecord, &[u32])| {
            let corners = &quads.corners[ends[0] as usize..ends[1] as usize];
            let corners = || corners.iter().map(|quad| quad.map(|index| &vertices[index as usize]));
            let outline = found.find(leaf.material, corners().flatten().map(|corner| corner.uv))?;
            let is_trimmed = outline.corners.len() <= TRIMMED_CORNERS as usize;
            let is_trimmed = is_trimmed && corners().all(|quad| is_card(quad, outline.rect));
            is_trimmed.then(|| {
                sides.extend(corners().map(shorter_side));
                outline
            })
        };
        let outlines = match outlines.is_empty() {
            true => vec![None; leaves.len()],
            false => leaves.iter().zip(quads.ends.windows(2)).map(&mut of_leaf).collect(),
        };
        sides.sort_unstable_by(f32::total_cmp);
        let least_pixels_per_unit = sides.get(sides.len() / 2).map_or(f32::INFINITY, |side| LEAST_CARD_PX / side);
        Self { outlines, least_pixels_per_unit }
    }
}

/// Whether a quad is a parallelogram whose corners show those of a rectangle, one after another.
fn is_card(quad: [&LeafVertex; 4], [low, high]: [[f32; 2]; 2]) -> bool {
    let [a, b, c, d] = quad.map(|corner| Vec3::from(corner.position));
    let is_flat = (a + c - b - d).length() <= FLATNESS * (c - a).length();
    let ends = quad.map(|corner| [0, 1].map(|axis| (corner.uv[axis] == low[axis], corner.uv[axis] == high[axis])));
    let is_corner = ends.iter().flatten().all(|(low, high)| low != high);
    let [a, b, c, d] = ends.map(|end| end.map(|(low, _)| low));
    is_flat && is_corner && a == c.map(|low| !low) && b == d.map(|low| !low) && a != b && a != d
}

fn shorter_side([a, b, _, d]: [&LeafVertex; 4]) -> f32 {
    let from_a = |corner: &LeafVertex| Vec3::from(corner.position).distance(a.position.into());
    from_a(b).min(from_a(d))
}
