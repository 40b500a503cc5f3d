//! Ribbons that face the eye, in place of stems about a pixel wide.
//!
//! A tube has at least three sides, of which the eye sees one or two. A stem whose width is at most
//! four times the error is drawn as a ribbon along its centre line: as wide as the tube on average,
//! turned towards the eye about that line. Of the line, a point goes once the error is its distance
//! from what is left (U. Ramer 1972; D. Douglas and T. Peucker 1973).
//!
//! Ribbons are derived from the wood and its [order](super::WoodOrder) and not stored.

use super::{
    boost::{Factors, nearest_boost},
    measure::{ByStem, Stem, from_segment, stems},
    order::{LEAST_SWELL, Swell, WoodOrder, swell_at},
};
use crate::{leaf::Vertex, plant::Wood};
use glam::Vec3;
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap},
    f32::consts::PI,
};

/// Error, in widths of a stem, from which on it is a ribbon: at half a pixel, of stems below two
/// pixels.
pub(crate) const RIBBON: f32 = 0.25;
/// Length of what one point of the centre line stands for, in widths.
const STEP: f32 = 1.5;
/// Most points of a centre line.
const MOST_POINTS: usize = 48;
/// Distance from the foot, in radii there, up to which a point belongs to the first ring.
const RING: f32 = 1.5;
/// Distance from the end, in widths, up to which a point belongs to the tip.
const TIP: f32 = 0.25;
/// Ratio of the radii of tip and foot below which a ribbon ends in a point.
const POINTED: f32 = 0.5;

/// How much more than its own a stem that is left must cover, at a ratio of the error to its width:
/// thinner ones are drawn as wide as the error.
pub(super) fn boost(ratio: f32) -> f32 {
    ratio.max(1.0)
}

/// Width that the ribbon of a stem is drawn with, over the stem's own, given its
/// [`ribbon_swell`]; 0 while the tube is drawn.
pub(super) fn breadth(swell: &Swell, width: f32, error: f32) -> f32 {
    let ratio = error / width;
    match boost(ratio) {
        _ if error < RIBBON * width => 0.0,
        boost if boost > 1.0 => boost * (1.0 + swell_at(swell, ratio)),
        _ => 1.0,
    }
}

/// The swell of a stem with a ribbon: of the tube up to where it is drawn, and of the ribbon from
/// the ratio of 1 on, by how much wider it is drawn.
pub(super) fn ribbon_swell(swell: &Swell, width: f32, factors: &Factors) -> Swell {
    let ratio = |i: usize| f32::from_bits(LEAST_SWELL.to_bits() + ((i as u32) << 22));
    std::array::from_fn(|i| if ratio(i) < 1.0 { swell[i] } else { nearest_boost(factors.at(ratio(i) * width)) })
}

/// From the centre line of a ribbon to one of its sides, and the normal there, which is round like
/// a tube's, given [`Slid::across`](super::Slid::across) and the way to the eye.
pub(crate) fn facing(across: Vec3, to_eye: Vec3) -> (Vec3, Vec3) {
    let towards = to_eye.normalize_or_zero();
    let side = across.cross(towards).normalize_or_zero();
    (side * across.length(), (side + towards).normalize_or_zero())
}

/// The ribbon of one stem.
#[derive(Debug, Clone, Default)]
pub(super) struct Ribbon {
    /// Its vertices, on the centre line; the normal is the unit vector along the line, turned round
    /// on one of both sides.
    pub(super) vertices: Vec<Vertex>,
    /// Of each vertex, half of the ribbon's width there.
    pub(super) halves: Vec<f32>,
    /// Of each vertex, the one of `vertices` that it slides to, and its threshold.
    pub(super) slides: Vec<(u32, f32)>,
    /// Three of `vertices` for each triangle, and the error from which on it is not drawn.
    pub(super) triangles: Vec<([u32; 3], f32)>,
}

/// The ribbons of all stems, given the error from which on each triangle of the wood is not drawn;
/// empty where a stem has none.
pub(super) fn ribbons(wood: &Wood, order: &WoodOrder, ends: &[f32]) -> Vec<Ribbon> {
    let by_stem = ByStem::new(wood, &order.triangle_stems, order.stems.len());
    let measured = stems(wood, order);
    let ribbon = |stem: usize| {
        let triangles = by_stem.of(stem);
        let end = triangles.iter().map(|&triangle| ends[triangle as usize]).fold(0.0, f32::max);
        let line = Line::of(wood, triangles, &measured[stem]).filter(|_| end > RIBBON * measured[stem].width);
        line.map(|line| line.ribbon(RIBBON * measured[stem].width, end)).unwrap_or_default()
    };
    (0..measured.len()).map(ribbon).collect()
}

/// The centre line of a stem from its foot to its tip.
struct Line {
    points: Vec<Vec3>,
    radii: Vec<f32>,
    /// A vertex of the wood that lends each point its texture coordinates and colour.
    like: Vec<Vertex>,
}

impl Line {
    /// Finds the centre line; `None` if the stem is no tube, or in several pieces.
    fn of(wood: &Wood, triangles: &[u32], stem: &Stem) -> Option<Self> {
        let surface = Surface::of(wood, triangles);
        let distances = surface.distances(stem)?;
        let length = distances.iter().copied().fold(0.0, f32::max);
        let count = ((length / (STEP * stem.width)).ceil()).clamp(2.0, MOST_POINTS as f32) as usize;
        let mut bins = vec![Bin::default(); count];
        for (vertex, &point) in surface.vertices.iter().zip(&surface.point_of) {
            let bin = (distances[point as usize] / length * count as f32) as usize;
            bins[bin.min(count - 1)].add(vertex, distances[point as usize]);
        }
        let mut line = Self { points: Vec::new(), radii: Vec::new(), like: Vec::new() };
        for bin in bins.iter().filter(|bin| bin.count > 0.0) {
            let share = bin.distance / bin.count / length;
            let expected = stem.radius[0] + (stem.radius[1] - stem.radius[0]) * share;
            let (center, radius) = bin.circle(expected.max(0.25 * stem.width));
            line.points.push(center);
            line.radii.push(radius);
            line.like.push(bin.like?);
        }
        // It reaches from end to end, not from the middle of the first bin to that of the last.
        let last = line.points.len().checked_sub(1).filter(|&last| last > 0)?;
        let [second, one_but_last] = [line.points[1], line.points[last - 1]];
        line.points[0] = surface.end(second, |point| distances[point] == 0.0);
        line.points[last] = surface.end(one_but_last, |point| distances[point] > length - TIP * stem.width);
        if line.radii[last] < POINTED * line.radii[0] || stem.radius[1] < POINTED * stem.radius[0] {
            line.radii[last] = 0.0;
        }
        let area: f32 = (0..last).map(|i| line.length(i) * (line.radii[i] + line.radii[i + 1])).sum();
        // The surface over pi: what a tube covers on average, seen from beside it.
        let factor = surface.area / (PI * area);
        line.radii.iter_mut().for_each(|radius| *radius *= factor);
        let is_sound = factor > 0.25 && factor < 4.0 && line.points.iter().all(|point| point.is_finite());
        is_sound.then_some(line)
    }

    fn length(&self, i: usize) -> f32 {
        self.points[i].distance(self.points[i + 1])
    }

    /// The error from which on each point may go; infinite for the ends.
    fn thresholds(&self) -> Vec<f32> {
        let last = self.points.len() - 1;
        let mut thresholds = vec![f32::INFINITY; last + 1];
        let mut parts = vec![[0, last]];
        while let Some([a, b]) = parts.pop() {
            let beside = |i: usize| from_segment(self.points[i], self.points[a], self.points[b]);
            let farthest = (a + 1..b).max_by(|&i, &j| beside(i).total_cmp(&beside(j)).then(j.cmp(&i)));
            if let Some(farthest) = farthest {
                thresholds[farthest] = beside(farthest).min(thresholds[a]).min(thresholds[b]);
                parts.extend([[a, farthest], [farthest, b]]);
            }
        }
        thresholds
    }

    /// The ribbon, drawn from the error `start` to `end`.
    fn ribbon(&self, start: f32, end: f32) -> Ribbon {
        let mut thresholds = self.thresholds();
        let kept: Vec<usize> = (0..self.points.len()).filter(|&i| thresholds[i] > start).collect();
        thresholds = kept.iter().map(|&i| thresholds[i].min(end)).collect();
        let last = kept.len() - 1;
        thresholds[0] = f32::INFINITY;
        let mut ribbon = Ribbon::default();
        let first_of: Vec<u32> = (0..=last as u32).map(|i| 2 * i).collect();
        for (at, &i) in kept.iter().enumerate() {
            let [before, after] = [at.saturating_sub(1), (at + 1).min(last)].map(|at| self.points[kept[at]]);
            let along = (after - before).normalize_or_zero();
            let parent = self.parent(&kept, &thresholds, at);
            let sides = if at == last && self.radii[i] == 0.0 { 1 } else { 2 };
            for side in 0..sides {
                let normal = if side == 0 { along } else { -along };
                ribbon.vertices.push(Vertex { position: self.points[i].into(), normal: normal.into(), ..self.like[i] });
                ribbon.halves.push(self.radii[i]);
                ribbon.slides.push((first_of[parent] + side, thresholds[at]));
            }
        }
        // A tip that is a single vertex stands for both sides.
        let most = ribbon.vertices.len() as u32 - 1;
        ribbon.slides.iter_mut().for_each(|slide| slide.0 = slide.0.min(most));
        for at in 0..last {
            let ends = self.meeting(&kept, &thresholds, at);
            let [a, b] = [first_of[at], first_of[at + 1]];
            ribbon.triangles.push(([a, a + 1, b], ends));
            if b < most {
                ribbon.triangles.push(([a + 1, b + 1, b], ends));
            }
        }
        ribbon
    }

    /// The point that one slides to: the nearer one of those beside it that stay longer.
    fn parent(&self, kept: &[usize], thresholds: &[f32], at: usize) -> usize {
        if thresholds[at] == f32::INFINITY {
            return at;
        }
        let stays = |&other: &usize| thresholds[other] > thresholds[at];
        let before = (0..at).rev().find(stays);
        let after = (at + 1..kept.len()).find(stays);
        let far = |other: &usize| self.points[kept[*other]].distance(self.points[kept[at]]);
        before.into_iter().chain(after).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0)
    }

    /// The error from which on two successive points are at the same place.
    fn meeting(&self, kept: &[usize], thresholds: &[f32], at: usize) -> f32 {
        let (mut a, mut b) = (at, at + 1);
        let mut error = 0.0_f32;
        while a != b {
            let next = if thresholds[a] <= thresholds[b] { &mut a } else { &mut b };
            error = error.max(thresholds[*next]);
            if error == f32::INFINITY {
                break;
            }
            *next = self.parent(kept, thresholds, *next);
        }
        error
    }
}

/// Vertices of a part of a stem.
#[derive(Clone, Default)]
struct Bin {
    count: f32,
    distance: f32,
    position: Vec3,
    normal: Vec3,
    product: f32,
    square: f32,
    like: Option<Vertex>,
}

impl Bin {
    fn add(&mut self, vertex: &Vertex, distance: f32) {
        let (position, normal) = (Vec3::from(vertex.position), Vec3::from(vertex.normal).normalize_or_zero());
        self.like.get_or_insert(*vertex);
        let from = position - self.like.map_or(position, |like| like.position.into());
        self.count += 1.0;
        self.distance += distance;
        self.position += from;
        self.normal += normal;
        self.product += from.dot(normal);
        self.square += normal.length_squared();
    }

    /// Centre and radius of the circle whose normals fit best, near the radius that is expected.
    fn circle(&self, expected: f32) -> (Vec3, f32) {
        let (position, normal) = (self.position / self.count, self.normal / self.count);
        let variance = self.square / self.count - normal.length_squared();
        let fitted = (self.product / self.count - position.dot(normal)) / variance;
        let is_known = variance > 0.1 && fitted.is_finite();
        let radius = if is_known { fitted.clamp(0.5 * expected, 2.0 * expected) } else { expected };
        let origin = self.like.map_or(Vec3::ZERO, |like| like.position.into());
        (origin + position - normal * radius, radius)
    }
}

/// The surface of a stem, with vertices at the same place joined to points.
struct Surface {
    vertices: Vec<Vertex>,
    point_of: Vec<u32>,
    positions: Vec<Vec3>,
    /// Points that share a triangle with each point.
    beside: Vec<Vec<u32>>,
    area: f32,
}

impl Surface {
    fn of(wood: &Wood, triangles: &[u32]) -> Self {
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut points: HashMap<[u32; 3], u32> = HashMap::new();
        let mut surface =
            Self { vertices: Vec::new(), point_of: Vec::new(), positions: Vec::new(), beside: Vec::new(), area: 0.0 };
        for &triangle in triangles {
            let corners = [0, 1, 2].map(|i| {
                let index = wood.indices[3 * triangle as usize + i];
                let vertex = wood.vertices[index as usize];
                let next = points.len() as u32;
                let point = *points.entry(vertex.position.map(|x| (x + 0.0).to_bits())).or_insert(next);
                if point == next {
                    surface.positions.push(vertex.position.into());
                    surface.beside.push(Vec::new());
                }
                let next = surface.vertices.len() as u32;
                if *numbers.entry(index).or_insert(next) == next {
                    surface.vertices.push(vertex);
                    surface.point_of.push(point);
                }
                point
            });
            let [a, b, c] = corners.map(|point| surface.positions[point as usize]);
            surface.area += 0.5 * (b - a).cross(c - a).length();
            for (from, to) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                surface.beside[corners[from] as usize].push(corners[to]);
            }
        }
        surface
    }

    /// The end of a line from a point through the middle of some others, beyond none of which it
    /// reaches.
    fn end(&self, from: Vec3, keeps: impl Fn(usize) -> bool) -> Vec3 {
        let kept = || (0..self.positions.len()).filter(|&point| keeps(point)).map(|point| self.positions[point]);
        let middle = kept().sum::<Vec3>() / kept().count() as f32;
        let along = (middle - from).normalize_or_zero();
        middle + along * kept().map(|point| (point - middle).dot(along)).fold(0.0, f32::max)
    }

    /// Length of the shortest way over edges from the first ring to each point; `None` if there is
    /// none to some.
    fn distances(&self, stem: &Stem) -> Option<Vec<f32>> {
        let from_foot = |point: usize| self.positions[point].distance(stem.foot);
        let nearest = (0..self.positions.len()).map(from_foot).fold(f32::INFINITY, f32::min);
        let ring = (RING * stem.radius[0]).max(1.01 * nearest);
        let mut distances = vec![f32::INFINITY; self.positions.len()];
        let first = (0..self.positions.len()).filter(|&point| from_foot(point) <= ring);
        let mut queue: BinaryHeap<Reverse<(u32, u32)>> = first.map(|point| Reverse((0, point as u32))).collect();
        while let Some(Reverse((bits, point))) = queue.pop() {
            if f32::from_bits(bits) >= distances[point as usize] {
                continue;
            }
            distances[point as usize] = f32::from_bits(bits);
            for &next in &self.beside[point as usize] {
                let way = f32::from_bits(bits) + self.positions[point as usize].distance(self.positions[next as usize]);
                if way < distances[next as usize] {
                    queue.push(Reverse((way.to_bits(), next)));
                }
            }
        }
        let length = distances.iter().copied().fold(0.0, f32::max);
        (length > 0.0 && length.is_finite()).then_some(distances)
    }
}
