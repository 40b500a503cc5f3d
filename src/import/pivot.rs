//! The pivot of a leaf: the point where it is attached, which stays fixed when the leaf is scaled.
//!
//! The candidates are the positions of a leaf and the midpoints of its edges. The candidate nearest
//! to the wood is the pivot if it is close, within [`TOUCHES`] of the size of the leaf, and the far
//! end of the leaf is clearly farther from the wood, by [`CLEARS`] of its size. Otherwise (no wood,
//! a leaf in the air, a leaf that lies along a branch or passes through it) the mesh does not
//! determine the attachment, and the pivot is the centroid of the surface of the leaf.
//!
//! Distances are exact: the triangles of the wood are in a bounding volume hierarchy (obvhs), which
//! is traversed here, nearer child first.
//!
//! Limits: for a triangle flatter than 1e-8 of its length, the distance may be overestimated.

use crate::leaf::Vertex;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};
use std::time::Duration;

/// Maximum distance of an attached point from the wood, in leaf sizes.
const TOUCHES: f64 = 0.15;
/// Minimum extra distance of the far end from the wood, in leaf sizes.
const CLEARS: f64 = 0.25;
/// The far end is the mean of the corners at a distance of at least this fraction of the greatest.
const ALIKE: f64 = 1.0 - 1e-4;

/// Number of points among which one is looked for again.
const ALIKE_EDGES: usize = 8;
/// Factor of squared distances that is more than their rounding.
const SLACK: f64 = 1.0 + 1e-12;

/// The triangles of the wood, in a bounding volume hierarchy.
pub(super) struct WoodSurface {
    triangles: Vec<[Vec3; 3]>,
    bvh: Bvh2,
}

impl WoodSurface {
    /// Builds the hierarchy of the triangles `wood`, whose corners are finite. Triangles on the
    /// same three corners, which would make the hierarchy deep, are stored once.
    pub(super) fn new(wood: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let key = |corner: &Vec3| corner.to_array().map(f32::to_bits);
        let mut triangles: Vec<[Vec3; 3]> = wood.collect();
        triangles.iter_mut().for_each(|corners| corners.sort_unstable_by_key(key));
        triangles.sort_unstable_by_key(|corners| corners.each_ref().map(key));
        triangles.dedup_by_key(|corners| corners.each_ref().map(key));
        let around = |[a, b, c]: &[Vec3; 3]| Aabb::new(Vec3A::from(a.min(*b).min(*c)), Vec3A::from(a.max(*b).max(*c)));
        let boxes: Vec<Aabb> = triangles.iter().map(around).collect();
        let bvh = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        Self { triangles, bvh }
    }

    /// Distance from `point` to the wood; infinite if it is greater than `bound`.
    fn distance(&self, point: DVec3, bound: f64) -> f64 {
        let mut nearest = f64::INFINITY;
        // Roots are taken only of what may be within the bound.
        let mut square = bound * bound * SLACK;
        let mut stack = Vec::new();
        stack.extend((!self.bvh.nodes.is_empty()).then_some((0.0, 0)));
        while let Some((of_box, node)) = stack.pop() {
            if of_box > square {
                continue;
            }
            let node = &self.bvh.nodes[node as usize];
            if node.is_leaf() {
                for slot in node.first_index..node.first_index + node.prim_count {
                    let corners = &self.triangles[self.bvh.primitive_indices[slot as usize] as usize];
                    let of_triangle = closest(point, &corners.map(|corner| corner.as_dvec3())).distance_squared(point);
                    if of_triangle <= square && of_triangle.sqrt() <= bound.min(nearest) {
                        nearest = of_triangle.sqrt();
                        square = of_triangle * SLACK;
                    }
                }
                continue;
            }
            let [left, right] = [node.first_index, node.first_index + 1].map(|child| {
                let Aabb { min, max } = self.bvh.nodes[child as usize].aabb;
                let [min, max] = [min, max].map(|corner| Vec3::from(corner).as_dvec3());
                (point.clamp(min, max).distance_squared(point), child)
            });
            stack.extend(if left.0 <= right.0 { [right, left] } else { [left, right] });
        }
        nearest
    }
}

/// The point of a triangle nearest to `point`, found from the Voronoi region (corner, edge or face)
/// that contains `point` (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
fn closest(point: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let from = |corner: DVec3| [ab.dot(point - corner), ac.dot(point - corner)];
    let ([ab_a, ac_a], [ab_b, ac_b], [ab_c, ac_c]) = (from(a), from(b), from(c));
    // Each is twice the signed area spanned by `point` and the edge bc, ca or ab, times twice the
    // area of the triangle.
    let over_bc = ab_b * ac_c - ab_c * ac_b;
    let over_ca = ab_c * ac_a - ab_a * ac_c;
    let over_ab = ab_a * ac_b - ab_b * ac_a;
    if ab_a <= 0.0 && ac_a <= 0.0 {
        a
    } else if ab_b >= 0.0 && ac_b <= ab_b {
        b
    } else if ac_c >= 0.0 && ab_c <= ac_c {
        c
    } else if over_ab <= 0.0 && ab_a >= 0.0 && ab_b <= 0.0 && ab_a > ab_b {
        a + ab * (ab_a / (ab_a - ab_b))
    } else if over_ca <= 0.0 && ac_a >= 0.0 && ac_c <= 0.0 && ac_a > ac_c {
        a + ac * (ac_a / (ac_a - ac_c))
    } else if over_bc <= 0.0 {
        let (toward_c, toward_b) = (ac_b - ab_b, ab_c - ac_c);
        b + (c - b) * (toward_c / (toward_c + toward_b))
    } else {
        let whole = over_bc + over_ca + over_ab;
        a + ab * (over_ca / whole) + ac * (over_ab / whole)
    }
}

/// The pivot of a leaf in canonical form; `size` is the diagonal of its bounding box.
pub(super) fn pivot(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> [f32; 3] {
    let point = if wood.triangles.is_empty() { None } else { attached(vertices, indices, size, wood) };
    point.unwrap_or_else(|| centroid(vertices, indices)).as_vec3().to_array()
}

fn attached(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> Option<DVec3> {
    let position = |index: u32| Vec3::from(vertices[index as usize].position).as_dvec3();
    let edges = indices.chunks_exact(3).flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let middles = edges.map(|[a, b]| (position(a) + position(b)) * 0.5);
    let corners = (0..vertices.len() as u32).map(position);
    let mut candidates: Vec<DVec3> = Vec::with_capacity(vertices.len() + indices.len());
    for point in corners.clone().chain(middles) {
        // Triangles share edges.
        if !candidates.iter().rev().take(ALIKE_EDGES).any(|other| *other == point) {
            candidates.push(point);
        }
    }
    let mut nearest = None;
    let mut bound = size * TOUCHES;
    for point in candidates {
        let distance = wood.distance(point, bound);
        if distance < bound || nearest.is_none() && distance == bound {
            nearest = Some(point);
            bound = distance;
        }
    }
    let point = nearest?;
    // If a card is attached at the middle of an edge, two corners are equally far, up to rounding.
    let farthest = corners.clone().map(|corner| corner.distance(point)).fold(0.0, f64::max);
    let far: Vec<DVec3> = corners.filter(|corner| corner.distance(point) >= farthest * ALIKE).collect();
    let far_end = far.iter().sum::<DVec3>() / far.len() as f64;
    let clear = bound + size * CLEARS;
    (wood.distance(far_end, clear) >= clear).then_some(point)
}

/// Centroid of the surface; the centre of the bounding box if the surface has no area.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn card(corners: [[f32; 3]; 4]) -> (Vec<Vertex>, Vec<u32>) {
        let vertex = |position| Vertex { position, ..bytemuck::Zeroable::zeroed() };
        (corners.map(vertex).to_vec(), vec![0, 1, 2, 0, 2, 3])
    }

    /// A twig along z through x = y = 0, as a thin strip.
    fn twig() -> WoodSurface {
        let strip = [[-0.01, -9.0], [0.01, -9.0], [0.01, 9.0], [-0.01, 9.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        let [a, b, c, d] = strip;
        WoodSurface::new([[a, b, c], [a, c, d]].into_iter())
    }

    proptest::proptest! {
        /// No sampled point of a triangle is nearer than the closest point, and one of them is only
        /// slightly farther. The coordinates are small integers, so many triangles degenerate to
        /// lines or points.
        #[test]
        fn no_point_of_a_triangle_is_nearer_than_the_closest(at in proptest::array::uniform12(-3..4_i8)) {
            let [a, b, c, point] = [0, 3, 6, 9].map(|i| DVec3::new(at[i].into(), at[i + 1].into(), at[i + 2].into()));
            let steps = 60;
            let grid = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| [i, j].map(|k| f64::from(k) / f64::from(steps))));
            let tried = grid.map(|[u, v]| (a + (b - a) * u + (c - a) * v).distance(point));
            let nearest = tried.fold(f64::INFINITY, f64::min);
            let found = closest(point, &[a, b, c]).distance(point);
            proptest::prop_assert!(found <= nearest + 1e-9 && nearest < found + 0.2, "{} for {}", found, nearest);
        }
    }

    proptest::proptest! {
        #[test]
        fn the_wood_is_as_near_as_its_nearest_triangle(at in proptest::collection::vec(-9..10_i8, 9..400), bound in 0.5..30.0_f64) {
            let corner = |at: &[i8]| Vec3::new(at[0].into(), at[1].into(), f32::from(at[2]) * 0.01);
            let triangles: Vec<[Vec3; 3]> =
                at.chunks_exact(9).map(|at| [&at[..3], &at[3..6], &at[6..]].map(corner)).collect();
            let surface = WoodSurface::new(triangles.iter().copied());
            for i in 0..7 {
                let point = corner(&at[i..i + 3]).as_dvec3() * 1.7 + DVec3::new(0.3, 0.1, 0.2);
                let distance = |corners: &[Vec3; 3]| closest(point, &corners.map(|corner| corner.as_dvec3())).distance(point);
                let nearest = triangles.iter().map(distance).fold(f64::INFINITY, f64::min);
                let expected = if nearest <= bound { nearest } else { f64::INFINITY };
                let found = surface.distance(point, bound);
                proptest::prop_assert!(found == expected || (found - expected).abs() < 1e-9, "{} for {}", found, expected);
            }
        }
    }

    #[test]
    fn a_card_on_a_twig_is_attached_at_the_middle_of_its_edge() {
        // Far from the ends of the twig's two long triangles.
        let (vertices, indices) = card([[-0.5, 0.0, 3.0], [0.5, 0.0, 3.0], [0.5, 1.0, 3.0], [-0.5, 1.0, 3.0]]);
        assert_eq!(pivot(&vertices, &indices, 1.4, &twig()), [0.0, 0.0, 3.0]);
    }

    #[test]
    fn a_card_in_the_air_or_along_the_twig_keeps_its_centroid() {
        let (air, indices) = card([[4.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 1.0, 0.0], [4.0, 1.0, 0.0]]);
        assert_eq!(pivot(&air, &indices, 1.4, &twig()), [4.5, 0.5, 0.0]);
        let (along, indices) = card([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 1.0], [-0.1, 0.0, 1.0]]);
        assert_eq!(pivot(&along, &indices, 1.02, &twig()), [0.0, 0.0, 0.5]);
        let (through, indices) = card([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]);
        assert_eq!(pivot(&through, &indices, 1.4, &twig()), [0.0; 3]);
    }

    #[test]
    fn without_wood_or_area_the_centre_remains() {
        let none = WoodSurface::new(std::iter::empty());
        let (needle, indices) = card([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        assert_eq!(pivot(&needle, &indices, 4.0, &none), [2.0, 0.0, 0.0]);
    }

    #[test]
    fn extreme_and_coincident_wood_is_found() {
        let [a, b, c] = [[-3e38, 0.0, 0.0], [3e38, 0.0, 0.0], [0.0, 3e38, 0.0]].map(Vec3::from_array);
        let flat = [[a, b, c], [a, a, a], [a, b, b], [c, a, b]];
        let surface = WoodSurface::new(flat.into_iter().cycle().take(100_000));
        assert_eq!(surface.triangles.len(), 3);
        assert_eq!(surface.distance(DVec3::new(0.0, 0.0, 5.0), 10.0), 5.0);
        assert_eq!(surface.distance(DVec3::new(0.0, 0.0, 5.0), 4.0), f64::INFINITY);
    }
}
