//! Where a leaf is attached: the point that stays when it is scaled.
//!
//! The candidates are a leaf's positions and the middles of its edges. The one nearest to the wood is the pivot when it is
//! near, within [`TOUCHES`] of the leaf's size, and the leaf's far end is clearly farther from the wood, by
//! [`CLEARS`] of its size. Otherwise (no wood, a leaf in the air, a leaf that lies along a branch or goes through it) the
//! mesh does not tell, and the pivot is the centroid of the leaf's surface.
//!
//! Distances are exact; triangles of the wood are looked up in a grid of cells, where samples of their surface lie.
//!
//! Limits: where the wood's surface is so large that [`MAX_SAMPLES`] would not cover it, cells are wider.

use crate::leaf::Vertex;
use glam::{DVec3, Vec3};

/// Greatest distance of an attached point to the wood, in leaf sizes.
const TOUCHES: f64 = 0.15;
/// How much farther from the wood the far end must be, in leaf sizes.
const CLEARS: f64 = 0.25;
/// The far end is the middle of the corners of at least this part of the greatest distance.
const ALIKE: f64 = 1.0 - 1e-4;
/// Distance between samples of the wood, in median leaf sizes: the wider, the more cells a query looks through.
const SAMPLE: f64 = 0.12;
/// Farthest that a point of a triangle is from the nearest sample, in that distance: half a diagonal.
const REACH: f64 = 0.75;
/// About the most samples that are taken, besides a few for each triangle.
const MAX_SAMPLES: f64 = 3e5;

/// Samples along one side of a cell. With [`SAMPLE`] a cell is 0.48 median leaf sizes wide: distances up to
/// [`TOUCHES`] + [`CLEARS`] are found in a cell and its neighbours.
const CELL: f64 = 4.0;
/// Cells along one axis, so that three places fit a key.
const MAX_CELLS: i64 = 1 << 18;

/// The wood's triangles in a grid of cells.
pub(super) struct WoodSurface {
    /// Least corner of the grid.
    origin: DVec3,
    /// Distance between samples.
    spacing: f64,
    /// Relative to the origin.
    triangles: Vec<Triangle>,
    /// Key of each cell that triangles have samples in, rising.
    cells: Vec<u64>,
    /// Where each cell's triangles start, then their number.
    starts: Vec<usize>,
    /// Triangles by cell.
    filed: Vec<u32>,
}

/// A triangle in a sphere about its middle.
struct Triangle {
    corners: [DVec3; 3],
    middle: DVec3,
    radius: f64,
}

impl WoodSurface {
    /// Files the triangles `wood` for leaves whose median size is `leaf_size`.
    pub(super) fn new(wood: &[[DVec3; 3]], leaf_size: f64) -> Self {
        let corners = || wood.iter().flatten();
        let origin = corners().copied().reduce(DVec3::min).unwrap_or_default();
        let widest = corners().map(|corner| (*corner - origin).max_element()).fold(0.0, f64::max);
        let [length, area] =
            wood.iter().map(extents).fold([0.0; 2], |[l, a], [length, height]| [l + length, a + length * height]);
        // Samples are about area / spacing^2 + length / spacing: neither term may exceed the limit.
        let coarsest = (area / MAX_SAMPLES).sqrt().max(length / MAX_SAMPLES);
        let finest = widest / ((MAX_CELLS - 1) as f64 * CELL);
        let spacing = (leaf_size * SAMPLE).max(coarsest).max(finest).max(f64::MIN_POSITIVE);
        let triangles: Vec<Triangle> = wood.iter().map(|corners| Triangle::new(corners.map(|c| c - origin))).collect();
        let cells_of = |(number, triangle): (u32, &Triangle)| {
            samples(&triangle.corners, spacing).map(move |sample| (cell_of(sample, spacing), number))
        };
        let mut filed: Vec<(u64, u32)> = (0..).zip(&triangles).flat_map(cells_of).collect();
        filed.sort_unstable();
        filed.dedup();
        let mut surface = Self {
            origin,
            spacing,
            triangles,
            cells: Vec::new(),
            starts: Vec::new(),
            filed: filed.iter().map(|&(_, triangle)| triangle).collect(),
        };
        for (i, (cell, _)) in filed.iter().enumerate() {
            if surface.cells.last() != Some(cell) {
                surface.cells.push(*cell);
                surface.starts.push(i);
            }
        }
        surface.starts.push(filed.len());
        surface
    }

    /// Distance from `point` to the wood; infinite when that is farther than `bound` or a cell's width.
    fn distance(&self, point: DVec3, bound: f64) -> f64 {
        let point = point - self.origin;
        let width = self.spacing * CELL;
        let bound = bound.min(width);
        let around = bound + self.spacing * REACH;
        let [least, greatest] = [place(point - around, width), place(point + around, width)];
        let along = |axis: usize| least[axis].max(0)..=greatest[axis].min(MAX_CELLS - 1);
        let mut nearest = bound;
        let mut found = false;
        let rows = along(0).flat_map(|x| along(1).map(move |y| [x, y])).filter(|_| !along(2).is_empty());
        for [x, y] in rows {
            let [from, to] = [along(2).start(), along(2).end()].map(|&z| key([x, y, z]));
            let first = self.cells.partition_point(|&cell| cell < from);
            let last = first + self.cells[first..].iter().take_while(|&&cell| cell <= to).count();
            for &triangle in &self.filed[self.starts[first]..self.starts[last]] {
                let triangle = &self.triangles[triangle as usize];
                if triangle.middle.distance(point) - triangle.radius <= nearest {
                    let distance = closest(point, &triangle.corners).distance(point);
                    found |= distance <= nearest;
                    nearest = nearest.min(distance);
                }
            }
        }
        if found { nearest } else { f64::INFINITY }
    }
}

impl Triangle {
    fn new(corners: [DVec3; 3]) -> Self {
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        let radius = corners.map(|corner| corner.distance(middle)).into_iter().fold(0.0, f64::max);
        Self { corners, middle, radius }
    }
}

/// The point of a triangle nearest to `point`, by the region of its corners, edges or face in which that lies (Ericson,
/// Real-Time Collision Detection, 2005, section 5.1.5).
fn closest(point: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let from = |corner: DVec3| [ab.dot(point - corner), ac.dot(point - corner)];
    let ([ab_a, ac_a], [ab_b, ac_b], [ab_c, ac_c]) = (from(a), from(b), from(c));
    // Twice the areas over the edges bc, ca and ab, each times that of the triangle.
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

/// The key of the cell that a point is in.
fn cell_of(point: DVec3, spacing: f64) -> u64 {
    key(place(point, spacing * CELL).map(|i| i.clamp(0, MAX_CELLS - 1)))
}

fn place(point: DVec3, width: f64) -> [i64; 3] {
    point.to_array().map(|value| (value / width).floor() as i64)
}

/// One number for three below [`MAX_CELLS`]; neighbours along z follow one another.
fn key([x, y, z]: [i64; 3]) -> u64 {
    ((x * MAX_CELLS + y) * MAX_CELLS + z) as u64
}

/// The pivot of a leaf in canonical form, of size `size` (its box's diagonal).
pub(super) fn pivot(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> [f32; 3] {
    let point = if wood.triangles.is_empty() { None } else { attached(vertices, indices, size, wood) };
    point.unwrap_or_else(|| centroid(vertices, indices)).as_vec3().to_array()
}

fn attached(vertices: &[Vertex], indices: &[u32], size: f64, wood: &WoodSurface) -> Option<DVec3> {
    let position = |index: u32| Vec3::from(vertices[index as usize].position).as_dvec3();
    let edges = indices.chunks_exact(3).flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    let middles = edges.map(|[a, b]| (position(a) + position(b)) * 0.5);
    let corners = (0..vertices.len() as u32).map(position);
    let mut nearest = None;
    let mut bound = size * TOUCHES;
    for point in corners.clone().chain(middles) {
        let distance = wood.distance(point, bound);
        if distance < bound || nearest.is_none() && distance == bound {
            nearest = Some(point);
            bound = distance;
        }
    }
    let point = nearest?;
    // Of a card that is attached in the middle of an edge two corners are equally far, but for rounding.
    let farthest = corners.clone().map(|corner| corner.distance(point)).fold(0.0, f64::max);
    let far: Vec<DVec3> = corners.filter(|corner| corner.distance(point) >= farthest * ALIKE).collect();
    let far_end = far.iter().sum::<DVec3>() / far.len() as f64;
    let clear = bound + size * CLEARS;
    (wood.distance(far_end, clear) >= clear).then_some(point)
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

/// Points on a triangle, at most about `spacing` apart and half of that from its border.
fn samples(corners: &[DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> + use<> {
    let [a, b, c] = longest_first(corners);
    let [columns, rows] = extents(corners).map(|extent| (extent / spacing).ceil().clamp(1.0, MAX_SAMPLES));
    (0..rows as u32).flat_map(move |row| {
        let up = (f64::from(row) + 0.5) / rows;
        let [left, right] = [a.lerp(c, up), b.lerp(c, up)];
        (0..columns as u32).map(move |column| left.lerp(right, (f64::from(column) + 0.5) / columns))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn card(corners: [[f32; 3]; 4]) -> (Vec<Vertex>, Vec<u32>) {
        let vertex = |position| Vertex { position, ..bytemuck::Zeroable::zeroed() };
        (corners.map(vertex).to_vec(), vec![0, 1, 2, 0, 2, 3])
    }

    /// A twig along z through (0, 0), as a thin strip.
    fn twig() -> WoodSurface {
        let strip = [[-0.01, -9.0], [0.01, -9.0], [0.01, 9.0], [-0.01, 9.0]].map(|[x, z]| DVec3::new(x, 0.0, z));
        let [a, b, c, d] = strip;
        WoodSurface::new(&[[a, b, c], [a, c, d]], 1.4)
    }

    proptest::proptest! {
        /// No point of many over a triangle is nearer than the closest one, and one of them is hardly farther. Whole numbers,
        /// so that many triangles are lines or points.
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
        let none = WoodSurface::new(&[], 1.0);
        let (needle, indices) = card([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        assert_eq!(pivot(&needle, &indices, 4.0, &none), [2.0, 0.0, 0.0]);
    }

    #[test]
    fn extreme_wood_takes_bounded_samples() {
        let [a, b, c] = [[-3e38, 0.0, 0.0], [3e38, 0.0, 0.0], [0.0, 3e38, 0.0]].map(DVec3::from_array);
        for leaf_size in [0.0, 1e-30, 1.0, 1e38] {
            let surface = WoodSurface::new(&[[a, b, c], [a, a, a], [a, b, b]], leaf_size);
            assert!(surface.filed.len() < 4 * MAX_SAMPLES as usize, "{}", surface.filed.len());
        }
    }
}
