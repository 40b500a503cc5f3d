//! Where a leaf is attached: the point that stays when it is scaled.
//!
//! The candidates are a leaf's positions and the middles of its edges. The one nearest to the wood is the pivot when it is
//! near, within [`TOUCHES`] of the leaf's size, and the leaf's far end is clearly farther from the wood, by
//! [`CLEARS`] of its size. Otherwise (no wood, a leaf in the air, a leaf that lies along a branch or goes through it) the
//! mesh does not tell, and the pivot is the centroid of the leaf's surface.
//!
//! The wood is sampled: a distance is right to within [`SAMPLE`] of the median leaf's size, and to within more only where
//! the wood's surface is so large that [`MAX_SAMPLES`] would not cover it.

use crate::leaf::Vertex;
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// Greatest distance of an attached point to the wood, in leaf sizes.
const TOUCHES: f64 = 0.15;
/// How much farther from the wood the far end must be, in leaf sizes.
const CLEARS: f64 = 0.25;
/// Distance between samples of the wood, in median leaf sizes.
const SAMPLE: f64 = 0.06;
/// About the most samples that are taken, besides a few for each triangle.
const MAX_SAMPLES: f64 = 1e6;

/// Sampled surface of the wood, filed in cells.
pub(super) struct WoodSurface {
    cell: f64,
    samples: HashMap<[i64; 3], Vec<DVec3>>,
}

impl WoodSurface {
    /// Samples the triangles `wood` for leaves whose median size is `leaf_size`.
    pub(super) fn new(wood: &[[DVec3; 3]], leaf_size: f64) -> Self {
        let extents = wood.iter().map(extents);
        let [length, area] = extents.fold([0.0; 2], |[l, a], [length, height]| [l + length, a + length * height]);
        // Samples are about area / spacing^2 + length / spacing: neither term may exceed the limit.
        let coarsest = (area / MAX_SAMPLES).sqrt().max(length / MAX_SAMPLES);
        let spacing = (leaf_size * SAMPLE).max(coarsest).max(f64::MIN_POSITIVE);
        let mut surface = Self { cell: (leaf_size * (TOUCHES + CLEARS)).max(spacing * 2.0), samples: HashMap::new() };
        let mut taken: HashSet<[i64; 3]> = HashSet::new();
        for corners in wood {
            for sample in samples(corners, spacing) {
                if taken.insert(cell_of(sample, spacing)) {
                    surface.samples.entry(cell_of(sample, surface.cell)).or_default().push(sample);
                }
            }
        }
        surface
    }

    /// Distance from `point` to the wood; infinite beyond the width of a cell.
    fn distance(&self, point: DVec3) -> f64 {
        let [x, y, z] = cell_of(point, self.cell);
        let mut nearest = self.cell * self.cell;
        let mut found = f64::INFINITY;
        for i in -1..=1 {
            for j in -1..=1 {
                for k in -1..=1 {
                    let cell = [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)];
                    for sample in self.samples.get(&cell).into_iter().flatten() {
                        let squared = sample.distance_squared(point);
                        if squared <= nearest {
                            nearest = squared;
                            found = squared;
                        }
                    }
                }
            }
        }
        found.sqrt()
    }
}

/// The pivot of a leaf in canonical form, of size `size` (its box's diagonal).
pub(super) fn pivot(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> [f32; 3] {
    let point = if wood.samples.is_empty() { None } else { attached(vertices, indices, size, wood) };
    point.unwrap_or_else(|| centroid(vertices, indices)).as_vec3().to_array()
}

fn attached(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> Option<DVec3> {
    let position = |index: u32| Vec3::from(vertices[index as usize].position).as_dvec3();
    let edges = indices.chunks_exact(3).flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let middles = edges.filter(|[a, b]| a < b).map(|[a, b]| (position(a) + position(b)) * 0.5);
    let corners = (0..vertices.len() as u32).map(position);
    let mut best = (f64::INFINITY, DVec3::ZERO);
    for point in corners.clone().chain(middles) {
        let distance = wood.distance(point);
        if distance < best.0 {
            best = (distance, point);
        }
    }
    let (near, point) = best;
    let far_end = corners.max_by(|a, b| a.distance_squared(point).total_cmp(&b.distance_squared(point)))?;
    (near <= size * TOUCHES && wood.distance(far_end) >= near + size * CLEARS).then_some(point)
}

/// Centre of the surface; of the positions' box where the surface has no area.
pub(super) fn centroid(vertices: &[Vertex], indices: &[u32]) -> DVec3 {
    let mut weighted = DVec3::ZERO;
    let mut weight = 0.0;
    for corners in indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(vertices[corners[i] as usize].position).as_dvec3());
        let area = (b - a).cross(c - a).length();
        weighted += (a + b + c) / 3.0 * area;
        weight += area;
    }
    let center = weighted / weight;
    if center.is_finite() {
        center
    } else {
        crate::bounds::Aabb::of_points(vertices.iter().map(|v| v.position)).center()
    }
}

fn cell_of(point: DVec3, width: f64) -> [i64; 3] {
    point.to_array().map(|value| (value / width).floor() as i64)
}

/// Length of the longest side of a triangle, and the height above it.
fn extents(corners: &[DVec3; 3]) -> [f64; 2] {
    let [a, b, c] = longest_first(corners);
    let length = a.distance(b);
    [length, if length > 0.0 { (b - a).cross(c - a).length() / length } else { 0.0 }]
}

fn longest_first(&[a, b, c]: &[DVec3; 3]) -> [DVec3; 3] {
    let [ab, bc, ca] = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Points on a triangle, at most about `spacing` apart.
fn samples(corners: &[DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> + use<> {
    let [a, b, c] = longest_first(corners);
    let [n, m] = extents(corners).map(|extent| (extent / spacing).ceil().clamp(1.0, MAX_SAMPLES));
    (0..=m as u32).flat_map(move |j| {
        let up = f64::from(j) / m;
        let [left, right] = [a.lerp(c, up), b.lerp(c, up)];
        (0..=n as u32).map(move |i| left.lerp(right, f64::from(i) / n))
    })
}
