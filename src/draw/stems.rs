//! Wood of a model sorted so that stems too thin to be seen need not be drawn.
//!
//! A stem is a connected piece of wood. Its width is that of a tube with the same length and
//! surface area. Stems thinner than a given width are drawn with a probability of their width over
//! the given one, and as wide as that: fewer stems cover as much as all of them would, as in R.
//! Cook et al., *Stochastic Simplification of Aggregate Detail* (2007), for leaves. A stem's random
//! number is fixed, and divides its width when stems are sorted, so that the stems drawn are a
//! prefix at any width. The widest stem is always drawn.
//!
//! Limits: plants whose wood is a single piece keep all of it. Stems widen along their normals.

use super::wood::{error_of, stepped};
use crate::{bounds::Aabb, model::FoliageModel, plant::Wood, wood::DrawnWood};
use glam::{DVec3, Vec3};
use std::{collections::HashMap, ops::Range};

/// Levels per octave: consecutive levels differ by a factor of the square root of two.
const STEPS_PER_OCTAVE: f32 = 2.0;
/// Step between the random numbers of stems of successive width, modulo 1: the golden ratio spreads
/// them evenly, so that among stems of about the same width the right share is drawn.
const RANDOM_STEP: f64 = 0.618_033_988_749_894_9;

/// Wood in drawing order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stems {
    /// Index and material of each corner, three per triangle.
    pub corners: Vec<(u32, u32)>,
    /// Width of the stem of each wood vertex. Negative for the stem that is always drawn, which is
    /// widened but covers only as much as it would at its own width; infinite if it branches, and
    /// is not widened.
    pub widths: Vec<f32>,
    /// Stems to draw for each width.
    pub levels: Levels,
}

/// Stems to draw for each width.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Levels {
    /// A level, and the number of corners of all stems above it; in descending order.
    cuts: Vec<(i32, u32)>,
    all: u32,
    /// Which triangles are drawn at an error, of wood whose vertices slide.
    sliding: Option<DrawnWood>,
}

/// Stems that are drawn for a least width.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnStems {
    /// Corners to draw.
    pub corners: Range<u32>,
    /// Width of the drawn stems that are thinner than this, in plant units.
    pub width: f32,
}

impl Stems {
    /// Sorts the stems of a model. O(n log n) in the number of wood triangles.
    pub fn new(model: &FoliageModel) -> Self {
        let wood = &model.wood;
        let triangles: Vec<([u32; 3], u32)> = wood.parts.iter().flat_map(|part| of_part(wood, part)).collect();
        let stem_of = stems(wood, &triangles);
        let measures = measures(wood, &triangles, &stem_of);
        let level_of = sorting_levels(&measures);
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(level_of[&stem_of[i]]));
        let corners = order.iter().flat_map(|&i| triangles[i].0.map(|index| (index, triangles[i].1))).collect();
        let mut cuts: Vec<(i32, u32)> = Vec::new();
        for (place, &i) in order.iter().enumerate() {
            let level = level_of[&stem_of[i]];
            if cuts.last().is_none_or(|cut| cut.0 != level) {
                cuts.push((level, 3 * place as u32));
            }
        }
        let mut widths = vec![f32::INFINITY; wood.vertices.len()];
        for ((corners, _), stem) in triangles.iter().zip(&stem_of) {
            let Measure { width, is_tube } = measures[stem];
            let width = match (level_of[stem] == ALWAYS, is_tube) {
                (false, _) => width,
                (true, true) => -width,
                (true, false) => f32::INFINITY,
            };
            corners.iter().for_each(|&corner| widths[corner as usize] = width);
        }
        Self { corners, widths, levels: Levels { cuts, all: 3 * triangles.len() as u32, sliding: None } }
    }
}

/// Level of the stem that is always drawn.
const ALWAYS: i32 = i32::MAX;

/// For each stem, the level of its width over its random number.
fn sorting_levels(measures: &HashMap<u32, Measure>) -> HashMap<u32, i32> {
    let mut by_width: Vec<(u32, f32)> = measures.iter().map(|(&stem, measure)| (stem, measure.width)).collect();
    by_width.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let level = |(rank, (stem, width)): (usize, (u32, f32))| {
        let random = (rank as f64 * RANDOM_STEP).fract() as f32;
        (stem, if rank == 0 { ALWAYS } else { level(width / random) })
    };
    by_width.into_iter().enumerate().map(level).collect()
}

/// Level of a width, rounded up.
fn level(width: f32) -> i32 {
    (width.max(f32::MIN_POSITIVE).log2() * STEPS_PER_OCTAVE).ceil() as i32
}

impl Levels {
    /// Levels of wood whose vertices slide.
    pub(super) fn sliding(drawn: DrawnWood) -> Self {
        Self { cuts: Vec::new(), all: 3 * drawn.all(), sliding: Some(drawn) }
    }

    /// Whether vertices slide: widths are then errors, rounded down.
    pub(super) fn slides(&self) -> bool {
        self.sliding.is_some()
    }

    /// The stems to draw so that those at least `width` wide, in plant units, are all drawn, and
    /// the thinner ones cover as much as all of them would.
    pub fn drawn(&self, width: f32) -> DrawnStems {
        let (number, width) = self.numbered(width);
        DrawnStems { corners: self.corners(number), width }
    }

    /// Number of the cut that a width leads to, and the width of the drawn stems that are thinner.
    pub(super) fn numbered(&self, width: f32) -> (u32, f32) {
        if self.slides() {
            return stepped(width);
        }
        let least = level(width);
        let number = self.cuts.partition_point(|cut| cut.0 >= least) as u32;
        // A stem is drawn if its width over its random number exceeds the level below.
        (number, ((least - 1) as f32 / STEPS_PER_OCTAVE).exp2())
    }

    /// Corners of the stems above a cut.
    pub(super) fn corners(&self, number: u32) -> Range<u32> {
        if let Some(sliding) = &self.sliding {
            let Range { start, end } = sliding.at(error_of(number));
            return 3 * start..3 * end;
        }
        0..self.cuts.get(number as usize).map_or(self.all, |cut| cut.1)
    }
}

fn of_part<'a>(wood: &'a Wood, part: &'a crate::plant::WoodPart) -> impl Iterator<Item = ([u32; 3], u32)> + 'a {
    let indices = wood.indices.get(part.indices[0] as usize..part.indices[1] as usize).unwrap_or_default();
    indices.chunks_exact(3).map(|corner| ([corner[0], corner[1], corner[2]], part.material))
}

/// Stem number of each triangle; vertices at the same position count as one.
fn stems(wood: &Wood, triangles: &[([u32; 3], u32)]) -> Vec<u32> {
    let mut first_at = HashMap::new();
    let mut parent: Vec<u32> = (0..wood.vertices.len() as u32).collect();
    for (i, vertex) in (0..).zip(&wood.vertices) {
        parent[i as usize] = *first_at.entry(vertex.position.map(f32::to_bits)).or_insert(i);
    }
    for (corners, _) in triangles {
        let [a, b, c] = corners.map(|corner| root(&mut parent, corner));
        parent[b as usize] = a;
        let c = root(&mut parent, c);
        parent[c as usize] = a;
    }
    triangles.iter().map(|(corners, _)| root(&mut parent, corners[0])).collect()
}

/// Finds the root of the piece that a vertex belongs to (union-find with path halving).
fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}

/// Width of a stem, and whether it is a single tube.
#[derive(Debug, Clone, Copy)]
struct Measure {
    width: f32,
    is_tube: bool,
}

/// Range of the width computed from a stem's volume over that from its length for a single tube. An
/// open tube encloses two thirds of its volume as seen from its middle; branches add area but no
/// length. A square tube's ratio is four fifths of a round one's.
const TUBE: std::ops::Range<f64> = 0.4..1.5;

/// Sums over the triangles of a stem.
#[derive(Debug, Clone, Copy)]
struct Totals {
    area: f64,
    bounds: Aabb,
    /// Six times the volume as seen from the origin, and the sum of the doubled area vectors.
    volume: (f64, DVec3),
}

impl Totals {
    fn add(&mut self, corners: [Vec3; 3]) {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let across = (b - a).cross(c - a);
        self.area += 0.5 * across.length();
        self.volume.0 += a.dot(across);
        self.volume.1 += across;
        corners.iter().for_each(|corner| self.bounds.add(corner.to_array()));
    }

    /// Width from surface area over pi times length, the diagonal of the bounding box.
    fn measure(&self) -> Measure {
        let width = self.area / (std::f64::consts::PI * self.bounds.size().as_dvec3().length());
        let volume = (self.volume.0 - self.bounds.center().dot(self.volume.1)).abs() / 6.0;
        let is_tube = TUBE.contains(&(4.0 * volume / self.area / width));
        Measure { width: if width.is_finite() { width as f32 } else { f32::MAX }, is_tube }
    }
}

fn measures(wood: &Wood, triangles: &[([u32; 3], u32)], stem_of: &[u32]) -> HashMap<u32, Measure> {
    let mut totals: HashMap<u32, Totals> = HashMap::new();
    for ((corners, _), &stem) in triangles.iter().zip(stem_of) {
        let corners = corners.map(|corner| Vec3::from(wood.vertices[corner as usize].position));
        let none = Totals { area: 0.0, bounds: Aabb::EMPTY, volume: (0.0, DVec3::ZERO) };
        totals.entry(stem).or_insert(none).add(corners);
    }
    totals.into_iter().map(|(stem, totals)| (stem, totals.measure())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{leaf::Vertex, plant::WoodPart};

    /// Square tubes along +Y, side by side, each with its own thickness and length.
    fn tubes(sizes: &[(f32, f32)]) -> FoliageModel {
        let mut wood = Wood::default();
        for (number, &(side, length)) in (0_u32..).zip(sizes) {
            let first = wood.vertices.len() as u32;
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            for y in [0.0, length] {
                wood.vertices.extend(corners.map(|[x, z]| Vertex {
                    position: [x * side + 10.0 * number as f32, y, z * side],
                    normal: [1.0, 0.0, 0.0],
                    uv: [0.0; 2],
                    color: [1.0; 4],
                }));
            }
            for i in 0..4 {
                let [a, b] = [first + i, first + (i + 1) % 4];
                wood.indices.extend([a, b, b + 4, a, b + 4, a + 4]);
            }
        }
        wood.parts = vec![WoodPart { indices: [0, wood.indices.len() as u32], material: 0 }];
        FoliageModel { plant: crate::plant::PlantOf { wood, ..Default::default() }, ..Default::default() }
    }

    /// Stems of widths from 0.01 to 1, each 10 long.
    fn many() -> (FoliageModel, Vec<f32>) {
        let sizes: Vec<(f32, f32)> = (0..400).map(|i| (0.01 * 100_f32.powf(i as f32 / 399.0), 10.0)).collect();
        let model = tubes(&sizes);
        let stems = Stems::new(&model);
        let widths = (0..400).map(|i| 4.0 * sizes[i].0 / std::f32::consts::PI).collect();
        assert_eq!(stems.widths.len(), model.wood.vertices.len());
        (model, widths)
    }

    #[test]
    fn drawn_stems_cover_what_all_of_them_would() {
        let (model, widths) = many();
        let stems = Stems::new(&model);
        let all: f32 = widths.iter().sum();
        for least in [0.003, 0.02, 0.1, 0.5, 1.0] {
            let DrawnStems { corners, width } = stems.levels.drawn(least);
            assert!(width < least && width * 1.42 > least, "{width} for {least}");
            let drawn: Vec<usize> =
                stems.corners[..corners.end as usize].iter().map(|corner| corner.0 as usize / 8).collect();
            let mut drawn: Vec<usize> = drawn;
            drawn.dedup();
            let covered: f32 =
                drawn.iter().map(|&stem| if stem == 399 { widths[stem] } else { widths[stem].max(width) }).sum();
            assert!((covered - all).abs() < 0.05 * all, "{least}: {covered} of {all}");
            let missing = (0..400).filter(|&stem| widths[stem] > least && !drawn.contains(&stem)).count();
            assert_eq!(missing, 0, "{least}");
        }
        assert_eq!(stems.levels.drawn(0.0).corners, 0..400 * 24);
    }

    #[test]
    fn the_widest_stem_is_drawn_at_any_width() {
        let (model, _) = many();
        let stems = Stems::new(&model);
        assert_eq!(stems.levels.drawn(1e9).corners, 0..24);
        assert!(stems.corners[..24].iter().all(|&(corner, _)| stems.widths[corner as usize] < 0.0));
    }

    #[test]
    fn every_triangle_stays_and_no_wood_is_fine() {
        let model = tubes(&[(0.2, 1.0), (0.0, 0.0), (0.3, 2.0)]);
        let mut sorted: Vec<u32> = Stems::new(&model).corners.iter().map(|&(corner, _)| corner).collect();
        let mut all = model.wood.indices.clone();
        sorted.sort_unstable();
        all.sort_unstable();
        assert_eq!(sorted, all);
        assert_eq!(Stems::new(&FoliageModel::default()).levels.drawn(0.0).corners, 0..0);
    }
}
