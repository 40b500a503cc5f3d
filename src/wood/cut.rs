//! Cuts wood into stems: tubes, from the foot up.
//!
//! Each connected piece is spread into layers by the number of edges from its foot, an open ring or
//! its wider end. In a tube a layer is a ring. Where a layer falls into several rings the tube
//! branches: the widest goes on, each other that leads farther than its parent is wide is a new
//! stem. What has no rings, such as soup, stays one stem.
//!
//! Limits: rings are recognised by their edges; a tube of very uneven triangles may be cut into
//! more stems than it has arms.

use super::mesh::{Lists, Mesh, Sets};
use glam::Vec3;
use std::collections::VecDeque;

/// Length of a side branch, in radii of what it grows on, from which on it is a stem.
const LEAST_REACH: f32 = 1.5;
/// Extent of an open ring over its piece's, up to which it may be a foot: a longer one is a seam.
const LARGEST_RING: f32 = 0.5;
/// Ratio of the widths of a closed piece's ends from which on the wider one is its foot.
const CLEARLY_WIDER: f32 = 1.1;
/// Layer of a point that is not reached.
const NOT_YET: u32 = u32::MAX;

/// Part of the axis of a stem: the middles and radii of two rings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) stem: u32,
    pub(super) ends: [Vec3; 2],
    pub(super) radii: [f32; 2],
}

/// A stem that was cut out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arm {
    /// The stem of the same piece that it branches from.
    pub(super) parent: Option<u32>,
    /// Middle of its first ring, or of the ring that it branches from.
    pub(super) foot: Vec3,
    /// Radius of its first ring.
    pub(super) radius: f32,
    /// Least point of its piece.
    pub(super) piece: u32,
}

/// Wood cut into stems.
pub(super) struct Cut {
    /// The stem of each triangle.
    pub(super) of_triangle: Vec<u32>,
    /// The stems; those of one piece come after their parents.
    pub(super) arms: Vec<Arm>,
    pub(super) segments: Vec<Segment>,
}

impl Cut {
    /// Cuts the wood. O(n log n).
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut pieces = Sets::new(mesh.points.len());
        for &[a, b, c] in &mesh.triangles {
            pieces.join(a, b);
            pieces.join(b, c);
        }
        let layers = layers(mesh, &mut pieces);
        let rings = Rings::new(mesh, &layers);
        let pieces: Vec<u32> = rings.all.iter().map(|ring| pieces.find(ring.first)).collect();
        let (of_ring, arms, segments) = rings.arms(&pieces);
        // Later rings are farther from the foot: of a triangle at a fork, that of the arm.
        let farthest = |corners: &[u32; 3]| corners.map(|point| rings.of_point[point as usize]).into_iter().max();
        let of_triangle = mesh.triangles.iter().map(|corners| of_ring[farthest(corners).unwrap_or_default() as usize]);
        Self { of_triangle: of_triangle.collect(), arms, segments }
    }
}

/// Number of edges between each point and the foot of its piece.
fn layers(mesh: &Mesh, pieces: &mut Sets) -> Vec<u32> {
    let mut layers = vec![NOT_YET; mesh.points.len()];
    let mut next = VecDeque::new();
    for point in feet(mesh, pieces) {
        layers[point as usize] = 0;
        next.push_back(point);
    }
    spread(mesh, &mut layers, next);
    layers
}

/// Spreads layers from the points in `next`; returns the last point reached.
fn spread(mesh: &Mesh, layers: &mut [u32], mut next: VecDeque<u32>) -> Option<u32> {
    let mut last = None;
    while let Some(point) = next.pop_front() {
        last = Some(point);
        for &neighbor in mesh.neighbors.of(point) {
            if layers[neighbor as usize] == NOT_YET {
                layers[neighbor as usize] = layers[point as usize] + 1;
                next.push_back(neighbor);
            }
        }
    }
    last
}

/// Box around points, and a length.
#[derive(Clone, Copy)]
struct Extent {
    low: Vec3,
    high: Vec3,
    length: f32,
}

impl Extent {
    const NONE: Self = Self { low: Vec3::MAX, high: Vec3::MIN, length: 0.0 };

    fn add(&mut self, point: Vec3) {
        (self.low, self.high) = (self.low.min(point), self.high.max(point));
    }

    fn size(&self) -> f32 {
        (self.high - self.low).length()
    }
}

/// Points of the feet of all pieces: of each its longest open ring or, without one, the point at
/// its wider end.
fn feet(mesh: &Mesh, pieces: &mut Sets) -> Vec<u32> {
    let count = mesh.points.len();
    let of_piece: Vec<u32> = (0..count as u32).map(|point| pieces.find(point)).collect();
    let mut sizes = vec![Extent::NONE; count];
    (0..count).for_each(|point| sizes[of_piece[point] as usize].add(mesh.points[point]));
    let mut loops = Sets::new(count);
    mesh.borders.iter().for_each(|&[a, b]| loops.join(a, b));
    let mut rings = vec![Extent::NONE; count];
    for &[a, b] in &mesh.borders {
        let ring = &mut rings[loops.find(a) as usize];
        let [a, b] = [a, b].map(|point| mesh.points[point as usize]);
        ring.add(a);
        ring.add(b);
        ring.length += a.distance(b);
    }
    // Of each piece, its best ring.
    let mut best = vec![NOT_YET; count];
    for ring in (0..count).filter(|&ring| rings[ring].length > 0.0) {
        let piece = of_piece[ring] as usize;
        let is_ring = rings[ring].size() <= LARGEST_RING * sizes[piece].size();
        if is_ring && rings.get(best[piece] as usize).is_none_or(|best| best.length < rings[ring].length) {
            best[piece] = ring as u32;
        }
    }
    let mut feet: Vec<u32> = Vec::new();
    for &[a, b] in &mesh.borders {
        let ring = loops.find(a);
        if best[of_piece[a as usize] as usize] == ring {
            feet.extend([a, b]);
        }
    }
    feet.sort_unstable();
    feet.dedup();
    let closed = (0..count).filter(|&piece| of_piece[piece] == piece as u32 && best[piece] == NOT_YET);
    let mut hops = vec![NOT_YET; count];
    feet.extend(closed.map(|piece| wider_end(mesh, piece as u32, &mut hops)));
    feet
}

/// The end of a closed piece that is its foot: the wider one or, if they are alike, the lower one.
/// Leaves `hops` as it was.
fn wider_end(mesh: &Mesh, piece: u32, hops: &mut [u32]) -> u32 {
    let mut last = [piece; 2];
    let mut points = Vec::new();
    for end in 0..2 {
        let start = if end == 0 { piece } else { last[0] };
        points = reached(mesh, start, hops);
        last[end] = points.last().copied().unwrap_or(start);
    }
    let [b, a] = last;
    let [at_a, at_b] = [a, b].map(|point| mesh.points[point as usize]);
    let along = at_b - at_a;
    let mut wide = [[0.0_f32; 2]; 2];
    for &point in &points {
        let offset = mesh.points[point as usize] - at_a;
        let share = offset.dot(along) / along.length_squared();
        let width = (offset - along * share).length();
        if let Some(end) = [share < 0.25, share > 0.75].iter().position(|&is_in| is_in) {
            wide[end] = [wide[end][0] + width, wide[end][1] + 1.0];
        }
    }
    let [wide_a, wide_b] = wide.map(|[sum, count]| sum / count.max(1.0));
    match (wide_a > CLEARLY_WIDER * wide_b, wide_b > CLEARLY_WIDER * wide_a) {
        (true, _) => a,
        (_, true) => b,
        _ if at_b.y < at_a.y => b,
        _ => a,
    }
}

/// Points of a piece by their number of edges from `start`.
fn reached(mesh: &Mesh, start: u32, hops: &mut [u32]) -> Vec<u32> {
    let mut points = vec![start];
    hops[start as usize] = 0;
    let mut at = 0;
    while let Some(&point) = points.get(at) {
        for &neighbor in mesh.neighbors.of(point) {
            if hops[neighbor as usize] == NOT_YET {
                hops[neighbor as usize] = 0;
                points.push(neighbor);
            }
        }
        at += 1;
    }
    points.iter().for_each(|&point| hops[point as usize] = NOT_YET);
    points
}

/// Connected points of one layer.
struct Ring {
    /// Its least point.
    first: u32,
    layer: u32,
    middle: Vec3,
    radius: f32,
    points: u32,
    /// The widest ring of the layer below that it is joined with.
    below: Option<u32>,
    /// Length of the longest way up, and number of points on all ways up.
    reach: f32,
    above: u32,
}

/// All rings, layer by layer.
struct Rings {
    all: Vec<Ring>,
    of_point: Vec<u32>,
}

impl Rings {
    fn new(mesh: &Mesh, layers: &[u32]) -> Self {
        let count = mesh.points.len();
        let mut sets = Sets::new(count);
        for point in 0..count as u32 {
            let alike =
                mesh.neighbors.of(point).iter().filter(|&&other| layers[other as usize] == layers[point as usize]);
            alike.for_each(|&other| sets.join(point, other));
        }
        let mut firsts: Vec<u32> = (0..count as u32).filter(|&point| sets.find(point) == point).collect();
        firsts.sort_by_key(|&point| (layers[point as usize], point));
        let mut number = vec![0; count];
        (0..).zip(&firsts).for_each(|(ring, &first)| number[first as usize] = ring);
        let of_point: Vec<u32> = (0..count as u32).map(|point| number[sets.find(point) as usize]).collect();
        let ring = |first: u32| Ring {
            first,
            layer: layers[first as usize],
            middle: Vec3::ZERO,
            radius: 0.0,
            points: 0,
            below: None,
            reach: 0.0,
            above: 0,
        };
        let mut all: Vec<Ring> = firsts.into_iter().map(ring).collect();
        for (point, &ring) in of_point.iter().enumerate() {
            all[ring as usize].middle += mesh.points[point];
            all[ring as usize].points += 1;
        }
        all.iter_mut().for_each(|ring| ring.middle /= ring.points as f32);
        for (point, &ring) in of_point.iter().enumerate() {
            let ring = &mut all[ring as usize];
            ring.radius += mesh.points[point].distance(ring.middle) / ring.points as f32;
        }
        let mut rings = Self { all, of_point };
        rings.join(mesh, layers);
        rings
    }

    /// Finds the ring below each ring, and what is above it.
    fn join(&mut self, mesh: &Mesh, layers: &[u32]) {
        let Self { all, of_point } = self;
        for (point, &ring) in of_point.iter().enumerate() {
            for &other in mesh.neighbors.of(point as u32) {
                if layers[other as usize] + 1 == layers[point] {
                    let found = of_point[other as usize];
                    let radius = |ring: u32| (all[ring as usize].radius, std::cmp::Reverse(ring));
                    if all[ring as usize].below.is_none_or(|below| radius(below) < radius(found)) {
                        all[ring as usize].below = Some(found);
                    }
                }
            }
        }
        for ring in (0..all.len()).rev() {
            let Ring { below, reach, above, points, middle, .. } = all[ring];
            if let Some(below) = below {
                let below = &mut all[below as usize];
                below.reach = below.reach.max(reach + below.middle.distance(middle));
                below.above += above + points;
            }
        }
    }

    /// The stem of each ring, the stems, and their axes. `pieces` are those of the rings.
    fn arms(&self, pieces: &[u32]) -> (Vec<u32>, Vec<Arm>, Vec<Segment>) {
        let joined = (0..).zip(&self.all).filter_map(|(number, ring)| Some((ring.below?, number)));
        let above = Lists::new(self.all.len(), joined);
        let mut of_ring = vec![NOT_YET; self.all.len()];
        let (mut arms, mut segments): (Vec<Arm>, Vec<Segment>) = Default::default();
        let mut of_piece = std::collections::HashMap::new();
        for (number, ring) in self.all.iter().enumerate() {
            if ring.layer == 0 || ring.below.is_none() {
                of_ring[number] = *of_piece.entry(pieces[number]).or_insert_with(|| {
                    arms.push(Arm { parent: None, foot: ring.middle, radius: ring.radius, piece: pieces[number] });
                    arms.len() as u32 - 1
                });
            }
            let stem = of_ring[number];
            let on = above.of(number as u32);
            let reaches = |&&next: &&u32| {
                let next = &self.all[next as usize];
                next.reach + next.middle.distance(ring.middle) > LEAST_REACH * ring.radius
            };
            let width = |&&next: &&u32| (self.all[next as usize].radius, self.all[next as usize].above);
            let widest = |a: &&u32, b: &&u32| width(a).partial_cmp(&width(b)).unwrap_or(std::cmp::Ordering::Equal);
            let goes_on = on.iter().filter(reaches).max_by(widest).copied();
            for next in on {
                let Ring { middle, radius, .. } = self.all[*next as usize];
                let is_new = goes_on.is_some_and(|goes_on| goes_on != *next) && reaches(&next);
                let mut from = ring.radius;
                of_ring[*next as usize] = stem;
                if is_new {
                    from = radius;
                    of_ring[*next as usize] = arms.len() as u32;
                    arms.push(Arm { parent: Some(stem), foot: ring.middle, radius, piece: pieces[number] });
                }
                let stem = of_ring[*next as usize];
                segments.push(Segment { stem, ends: [ring.middle, middle], radii: [from, radius] });
            }
        }
        (of_ring, arms, segments)
    }
}
