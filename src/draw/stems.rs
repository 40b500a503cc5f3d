//! Wood of a model sorted by the thickness of its stems, so that stems too thin to be seen need not
//! be drawn.
//!
//! A stem is a connected piece of wood. Its thickness is that of a tube with the same length and
//! surface area. Plants whose wood is a single piece keep all of it.

use crate::{model::FoliageModel, plant::Wood};
use glam::Vec3;
use std::collections::HashMap;

/// Thickness levels per octave: consecutive levels differ by a factor of the square root of two.
const STEPS_PER_OCTAVE: f32 = 2.0;

/// Wood in order of decreasing thickness.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stems {
    /// Index and material of each corner, three per triangle.
    pub corners: Vec<(u32, u32)>,
    /// Number of wood corners to draw for each minimum thickness.
    pub levels: Levels,
}

/// Number of wood corners to draw for each minimum thickness.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Levels {
    /// A thickness, and the number of corners of all stems thicker than it; in order of decreasing
    /// thickness.
    cuts: Vec<(f32, u32)>,
    all: u32,
}

impl Stems {
    /// Sorts the stems of a model. O(n log n) in the number of wood triangles.
    pub fn new(model: &FoliageModel) -> Self {
        let wood = &model.wood;
        let triangles: Vec<([u32; 3], u32)> = wood.parts.iter().flat_map(|part| of_part(wood, part)).collect();
        let stem_of = stems(wood, &triangles);
        let steps: HashMap<u32, i32> = thicknesses(wood, &triangles, &stem_of)
            .into_iter()
            .map(|(stem, thickness)| (stem, (thickness.max(f32::MIN_POSITIVE).log2() * STEPS_PER_OCTAVE).ceil() as i32))
            .collect();
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(steps[&stem_of[i]]));
        let corners = order.iter().flat_map(|&i| triangles[i].0.map(|index| (index, triangles[i].1))).collect();
        let mut cuts: Vec<(f32, u32)> = Vec::new();
        for (place, &i) in order.iter().enumerate() {
            let thickness = (steps[&stem_of[i]] as f32 / STEPS_PER_OCTAVE).exp2();
            if cuts.last().is_none_or(|cut| cut.0 != thickness) {
                cuts.push((thickness, 3 * place as u32));
            }
        }
        let all = 3 * triangles.len() as u32;
        Self { corners, levels: Levels { cuts, all } }
    }
}

impl Levels {
    /// Number of corners of all stems at least as thick as `thickness`.
    pub fn at_least(&self, thickness: f32) -> u32 {
        let thin = self.cuts.partition_point(|cut| cut.0 >= thickness);
        self.cuts.get(thin).map_or(self.all, |cut| cut.1)
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

/// Thickness of each stem: surface area over pi times length, the diagonal of its bounding box.
fn thicknesses(wood: &Wood, triangles: &[([u32; 3], u32)], stem_of: &[u32]) -> HashMap<u32, f32> {
    let mut sums: HashMap<u32, (f32, Vec3, Vec3)> = HashMap::new();
    for ((corners, _), &stem) in triangles.iter().zip(stem_of) {
        let [a, b, c] = corners.map(|corner| Vec3::from(wood.vertices[corner as usize].position));
        let (area, low, high) = sums.entry(stem).or_insert((0.0, a, a));
        *area += 0.5 * (b - a).cross(c - a).length();
        *low = low.min(a).min(b).min(c);
        *high = high.max(a).max(b).max(c);
    }
    let thickness = |(area, low, high): (f32, Vec3, Vec3)| {
        let thickness = area / (std::f32::consts::PI * low.distance(high));
        if thickness.is_finite() { thickness } else { f32::MAX }
    };
    sums.into_iter().map(|(stem, sum)| (stem, thickness(sum))).collect()
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

    #[test]
    fn thin_stems_come_last_and_are_cut_off_first() {
        let model = tubes(&[(0.01, 5.0), (1.0, 30.0), (0.1, 10.0), (0.01, 3.0)]);
        let stems = Stems::new(&model);
        assert_eq!(stems.corners.len(), 4 * 24);
        let first_stem = stems.corners[..24].iter().all(|&(corner, _)| (8..16).contains(&corner));
        let second_stem = stems.corners[24..48].iter().all(|&(corner, _)| (16..24).contains(&corner));
        assert!(first_stem && second_stem);
        for thickness in [0.0, 0.005] {
            assert_eq!(stems.levels.at_least(thickness), 96, "{thickness}");
        }
        assert_eq!([0.05, 0.5, 5.0].map(|thickness| stems.levels.at_least(thickness)), [48, 24, 0]);
    }

    #[test]
    fn every_triangle_stays_and_no_wood_is_fine() {
        let model = tubes(&[(0.2, 1.0), (0.0, 0.0), (0.3, 2.0)]);
        let mut sorted: Vec<u32> = Stems::new(&model).corners.iter().map(|&(corner, _)| corner).collect();
        let mut all = model.wood.indices.clone();
        sorted.sort_unstable();
        all.sort_unstable();
        assert_eq!(sorted, all);
        assert_eq!(Stems::new(&FoliageModel::default()).levels.at_least(0.0), 0);
    }
}
