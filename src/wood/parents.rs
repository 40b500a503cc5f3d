//! Finds the stem that each piece of wood grows on: the one whose tube its foot is deepest in.

use super::{cut::Cut, grid::Grid, mesh::Mesh};
use glam::Vec3;

/// Distance of a foot from the nearest stem, over the size of the plant, beyond which it grows on
/// none.
const FARTHEST: f32 = 0.05;
/// Height of the foot of a trunk above the lowest point, over the height of the plant.
const LOW: f32 = 0.02;
/// Radius of the foot of a trunk over that of the largest piece.
const TRUNK: f32 = 0.25;

/// The parent of each stem.
pub(super) fn parents(mesh: &Mesh, cut: &Cut) -> Vec<Option<u32>> {
    let ranks = ranks(mesh, cut);
    let boxes: Vec<[Vec3; 2]> = cut
        .segments
        .iter()
        .map(|segment| {
            let [a, b] = segment.ends;
            let radius = segment.radii[0].max(segment.radii[1]);
            [a.min(b) - radius, a.max(b) + radius]
        })
        .collect();
    let grid = Grid::new(&boxes);
    let low = mesh.points.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let size = mesh.points.iter().copied().reduce(Vec3::max).unwrap_or_default() - low;
    let largest = cut.arms.iter().filter(|arm| ranks[arm.piece as usize] == 0).map(|arm| arm.radius).next();
    let parent = |arm: &super::cut::Arm| {
        let rank = ranks[arm.piece as usize];
        let is_trunk = arm.foot.y <= low.y + LOW * size.y && arm.radius >= TRUNK * largest.unwrap_or_default();
        if arm.parent.is_some() || rank == 0 || is_trunk {
            return arm.parent;
        }
        // How far the foot is outside a larger piece's tube.
        let outside = |segment: u32| {
            let segment = &cut.segments[segment as usize];
            let is_larger = ranks[cut.arms[segment.stem as usize].piece as usize] < rank;
            let [a, b] = segment.ends;
            let at = ((arm.foot - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let at = if at.is_nan() { 0.0 } else { at };
            let radius = segment.radii[0] + (segment.radii[1] - segment.radii[0]) * at;
            is_larger.then(|| arm.foot.distance(a + (b - a) * at) - radius)
        };
        let (distance, segment) = grid.least(arm.foot, 0.0, outside)?;
        (distance <= FARTHEST * size.length()).then(|| cut.segments[segment as usize].stem)
    };
    cut.arms.iter().map(parent).collect()
}

/// Rank of each piece by its surface, 0 for the largest; by its least point.
fn ranks(mesh: &Mesh, cut: &Cut) -> Vec<u32> {
    let mut areas = vec![0.0_f64; mesh.points.len()];
    for (corners, &stem) in mesh.triangles.iter().zip(&cut.of_triangle) {
        let [a, b, c] = corners.map(|point| mesh.points[point as usize].as_dvec3());
        areas[cut.arms[stem as usize].piece as usize] += (b - a).cross(c - a).length();
    }
    let mut order: Vec<usize> = (0..areas.len()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let mut ranks = vec![0; order.len()];
    (0..).zip(order).for_each(|(rank, piece)| ranks[piece] = rank);
    ranks
}
