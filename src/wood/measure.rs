//! Stems as they are seen: foot, tip, radii and width, measured on their triangles.

use super::{grid::Grid, order::WoodOrder};
use crate::plant::Wood;
use glam::Vec3;
use std::f32::consts::PI;

/// Share of a stem's length at each end that its foot and its tip are measured over.
const END: f32 = 0.06;

/// Ratio of the radii of a stem's ends from which on the wider one is its foot.
const CLEARLY_WIDER: f32 = 1.25;

/// A stem: a tube of wood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stem {
    /// The stem that it grows on, which has a lower number; `None` for a trunk.
    pub parent: Option<u32>,
    /// Middle of its lower end, in plant space.
    pub foot: Vec3,
    /// Middle of its upper end.
    pub tip: Vec3,
    /// Radii at foot and tip; 0 where it ends in a point.
    pub radius: [f32; 2],
    /// Mean width: the surface over pi times the length.
    pub width: f32,
    /// Number of stems below it, at most 255; 0 for a trunk.
    pub level: u8,
}

/// Measures the stems of a plant's wood. The order must be valid for the wood. O(n log n).
pub fn stems(wood: &Wood, order: &WoodOrder) -> Vec<Stem> {
    let by_stem = ByStem::new(wood, &order.triangle_stems, order.stems.len());
    let mut stems: Vec<Stem> = Vec::with_capacity(order.stems.len());
    for (number, link) in order.stems.iter().enumerate() {
        let parent = link.parent.and_then(|parent| stems.get(parent as usize));
        let ends = Ends::of(by_stem.points(number));
        let [foot, tip] = ends.foot_first(parent);
        let width = by_stem.width(number, foot.middle.distance(tip.middle));
        stems.push(Stem {
            parent: link.parent,
            foot: foot.middle,
            tip: tip.middle,
            radius: [foot.radius, tip.radius],
            width,
            level: link.level,
        });
    }
    stems
}

/// Mean width of each stem, given the stem of each triangle: all that [`stems`] needs the links
/// for is left out.
#[cfg(feature = "simplify")]
pub(super) fn stem_widths(wood: &Wood, triangle_stems: &[u32], stems: usize) -> Vec<f32> {
    let by_stem = ByStem::new(wood, triangle_stems, stems);
    let width = |number| {
        let [a, b] = Ends::of(by_stem.points(number)).0;
        by_stem.width(number, a.middle.distance(b.middle))
    };
    (0..stems).map(width).collect()
}

/// For each point the stem whose surface is nearest, or `None` if there is no wood. The order must
/// be valid for the wood. O(n log n) for wood that is spread evenly.
pub fn nearest_stems(wood: &Wood, order: &WoodOrder, points: impl Iterator<Item = [f32; 3]>) -> Vec<Option<u32>> {
    let stem = |found: Option<(u32, Vec3)>| Some(order.triangle_stems[found?.0 as usize]);
    nearest_triangles(wood, points).into_iter().map(stem).collect()
}

/// For each point the nearest triangle of valid wood, and the nearest point on it; `None` without
/// wood. O(n log n) for wood that is spread evenly.
pub fn nearest_triangles(wood: &Wood, points: impl Iterator<Item = [f32; 3]>) -> Vec<Option<(u32, Vec3)>> {
    let corner = |index: u32| Vec3::from(wood.vertices[index as usize].position);
    let triangles: Vec<[Vec3; 3]> =
        wood.indices.chunks_exact(3).map(|of| [corner(of[0]), corner(of[1]), corner(of[2])]).collect();
    let boxes: Vec<[Vec3; 2]> = triangles.iter().map(|&[a, b, c]| [a.min(b).min(c), a.max(b).max(c)]).collect();
    let grid = Grid::new(&boxes);
    let nearest = |point: Vec3| {
        let value = |triangle: u32| Some(from_triangle(point, triangles[triangle as usize]));
        let (_, triangle) = grid.least(point, 0.0, value)?;
        Some((triangle, on_triangle(point, triangles[triangle as usize])))
    };
    points.map(|point| nearest(point.into())).collect()
}

/// Triangles of each stem.
pub(super) struct ByStem<'a> {
    wood: &'a Wood,
    /// Entry n: the first of the stem's `triangles`.
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl<'a> ByStem<'a> {
    pub(super) fn new(wood: &'a Wood, triangle_stems: &[u32], stems: usize) -> Self {
        let mut starts = vec![0; stems + 1];
        triangle_stems.iter().for_each(|&stem| starts[stem as usize + 1] += 1);
        for stem in 0..stems {
            starts[stem + 1] += starts[stem];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; triangle_stems.len()];
        for (triangle, &stem) in (0..).zip(triangle_stems) {
            triangles[next[stem as usize] as usize] = triangle;
            next[stem as usize] += 1;
        }
        Self { wood, starts, triangles }
    }

    pub(super) fn of(&self, stem: usize) -> &[u32] {
        &self.triangles[self.starts[stem] as usize..self.starts[stem + 1] as usize]
    }

    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let first = 3 * triangle as usize;
        [0, 1, 2].map(|i| Vec3::from(self.wood.vertices[self.wood.indices[first + i] as usize].position))
    }

    /// Corners of all triangles of a stem: points that several share occur several times.
    fn points(&self, stem: usize) -> Vec<Vec3> {
        self.of(stem).iter().flat_map(|&triangle| self.corners(triangle)).collect()
    }

    /// Mean width of a stem of the given length.
    fn width(&self, stem: usize, length: f32) -> f32 {
        let area = |&triangle: &u32| {
            let [a, b, c] = self.corners(triangle);
            0.5 * (b - a).cross(c - a).length()
        };
        let area: f32 = self.of(stem).iter().map(area).sum();
        let width = area / (PI * length);
        if width.is_finite() { width } else { f32::MAX }
    }
}

/// One end of a stem.
#[derive(Clone, Copy, Default)]
struct End {
    middle: Vec3,
    radius: f32,
}

/// Both ends of a stem, in any order.
struct Ends([End; 2]);

impl Ends {
    /// The ends of the longest way through the points, found from their middle.
    fn of(points: Vec<Vec3>) -> Self {
        if points.is_empty() {
            return Self([End::default(); 2]);
        }
        let middle = points.iter().copied().sum::<Vec3>() / points.len() as f32;
        let farthest = |from: Vec3| {
            let far = |of: &Vec3| of.distance_squared(from);
            points.iter().copied().fold(points[0], |best, point| if far(&point) > far(&best) { point } else { best })
        };
        let a = farthest(middle);
        let b = farthest(a);
        let length = a.distance(b);
        let along = (b - a) / length.max(f32::MIN_POSITIVE);
        let end = |keeps: &dyn Fn(f32) -> bool| {
            let kept = || points.iter().filter(|&&point| keeps((point - a).dot(along)));
            let count = kept().count().max(1) as f32;
            let middle = kept().copied().sum::<Vec3>() / count;
            End { middle, radius: kept().map(|point| point.distance(middle)).sum::<f32>() / count }
        };
        Self([end(&|at| at <= END * length), end(&|at| at >= (1.0 - END) * length)])
    }

    /// Foot and tip: the foot is the wider end or, if they are alike, nearer to the parent or, of a
    /// trunk, lower.
    fn foot_first(&self, parent: Option<&Stem>) -> [End; 2] {
        let [a, b] = self.0;
        let rank = |end: End| match parent {
            Some(parent) => from_segment(end.middle, parent.foot, parent.tip),
            None => end.middle.y,
        };
        let is_first = match (a.radius > CLEARLY_WIDER * b.radius, b.radius > CLEARLY_WIDER * a.radius) {
            (false, false) => rank(a) <= rank(b),
            (is_wider, _) => is_wider,
        };
        if is_first { [a, b] } else { [b, a] }
    }
}

/// Distance of a point from a segment.
pub(super) fn from_segment(point: Vec3, a: Vec3, b: Vec3) -> f32 {
    point.distance(on_segment(point, a, b))
}

/// Nearest point of a segment.
fn on_segment(point: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let along = b - a;
    let at = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    a + along * if at.is_nan() { 0.0 } else { at }
}

/// Distance of a point from a triangle.
pub(super) fn from_triangle(point: Vec3, triangle: [Vec3; 3]) -> f32 {
    match inside(point, triangle) {
        Some((normal, squared)) => (point - triangle[0]).dot(normal).abs() / squared.sqrt(),
        None => sides(triangle).map(|[a, b]| from_segment(point, a, b)).into_iter().fold(f32::INFINITY, f32::min),
    }
}

/// Nearest point of a triangle.
fn on_triangle(point: Vec3, triangle: [Vec3; 3]) -> Vec3 {
    if let Some((normal, squared)) = inside(point, triangle) {
        return point - normal * ((point - triangle[0]).dot(normal) / squared);
    }
    let [a, b, c] = sides(triangle).map(|[a, b]| on_segment(point, a, b));
    let nearer = |a: Vec3, b: Vec3| if a.distance_squared(point) <= b.distance_squared(point) { a } else { b };
    nearer(nearer(a, b), c)
}

fn sides([a, b, c]: [Vec3; 3]) -> [[Vec3; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Normal of a triangle above or below which a point is, and the square of its length.
fn inside(point: Vec3, triangle: [Vec3; 3]) -> Option<(Vec3, f32)> {
    let [a, b, c] = triangle;
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    let is_inside = |[from, to]: [Vec3; 2]| (to - from).cross(point - from).dot(normal) >= 0.0;
    (squared > 0.0 && sides(triangle).into_iter().all(is_inside)).then_some((normal, squared))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::StemLink;

    /// A square tube from `foot` to `tip`, of the given half side.
    fn tube(wood: &mut Wood, foot: Vec3, tip: Vec3, half: f32) {
        let first = wood.vertices.len() as u32;
        let (side, up) = (tip - foot).any_orthonormal_pair_of();
        for middle in [foot, tip] {
            for [x, y] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                let position = (middle + (side * x + up * y) * half).to_array();
                wood.vertices.push(crate::leaf::Vertex { position, normal: [0.0; 3], uv: [0.0; 2], color: [1.0; 4] });
            }
        }
        for i in 0..4 {
            let [a, b] = [first + i, first + (i + 1) % 4];
            wood.indices.extend([a, b, b + 4, a, b + 4, a + 4]);
        }
    }

    trait Pair {
        fn any_orthonormal_pair_of(self) -> (Vec3, Vec3);
    }

    impl Pair for Vec3 {
        fn any_orthonormal_pair_of(self) -> (Vec3, Vec3) {
            self.normalize().any_orthonormal_pair()
        }
    }

    #[test]
    fn stems_are_measured_from_the_foot_up() {
        let mut wood = Wood::default();
        tube(&mut wood, Vec3::ZERO, Vec3::Y * 10.0, 0.5);
        // Its mesh starts at the tip.
        tube(&mut wood, Vec3::new(5.0, 8.0, 0.0), Vec3::Y * 5.0, 0.1);
        let link = |parent, level| StemLink { parent, level };
        let order = WoodOrder {
            stems: vec![link(None, 0), link(Some(0), 1)],
            triangle_stems: (0..16).map(|i| i / 8).collect(),
            ..WoodOrder::default()
        };
        let found = stems(&wood, &order);
        assert!(found[0].foot.distance(Vec3::ZERO) < 1e-5 && found[0].tip.distance(Vec3::Y * 10.0) < 1e-5);
        assert!(found[1].foot.distance(Vec3::Y * 5.0) < 0.05, "{}", found[1].foot);
        assert!((found[0].radius[0] - 0.5_f32.sqrt() * 1.0).abs() < 1e-3, "{:?}", found[0].radius);
        // Four sides of 1 around a tube of the same surface: a diameter of 4 over pi.
        assert!((found[0].width - 4.0 / PI).abs() < 1e-4 && (found[1].width - 0.8 / PI).abs() < 1e-2);
        let near = [[0.5, 1.0, 0.6], [4.0, 7.5, 0.0], [9.0, 9.0, 9.0]];
        assert_eq!(nearest_stems(&wood, &order, near.into_iter()), [Some(0), Some(1), Some(1)]);
        assert_eq!(nearest_stems(&Wood::default(), &WoodOrder::default(), near.into_iter()), [None; 3]);
        #[cfg(feature = "simplify")]
        assert!(stem_widths(&wood, &order.triangle_stems, 2).iter().zip(&found).all(|(w, stem)| *w == stem.width));
    }

    #[test]
    fn distances_from_a_triangle_are_to_its_nearest_point() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (point, distance) in [
            (Vec3::new(0.2, 0.2, 3.0), 3.0),
            (Vec3::new(-1.0, 0.5, 0.0), 1.0),
            (Vec3::new(2.0, 0.0, 0.0), 1.0),
            (Vec3::new(1.0, 1.0, 0.0), 0.5_f32.sqrt()),
        ] {
            assert!((from_triangle(point, triangle) - distance).abs() < 1e-6, "{point}");
            let nearest = on_triangle(point, triangle);
            assert!((nearest.distance(point) - distance).abs() < 1e-6, "{point}");
            assert!(from_triangle(nearest, triangle) < 1e-6, "{point}");
        }
        assert_eq!(from_triangle(Vec3::Z, [Vec3::ZERO; 3]), 1.0);
    }
}
