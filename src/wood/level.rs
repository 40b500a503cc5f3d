//! Wood at an error, as drawers need it: triangles in the order in which they go, and vertices on
//! their way, widened.

use super::{
    boost::{Factors, extent},
    measure::stems,
    order::{Swell, WoodOrder},
    ribbon::{RIBBON, Ribbon, facing, ribbon_swell, ribbons},
    slide::{Slides, vanishing},
};
use crate::{leaf::Vertex, plant::Wood};
use glam::Vec3;
use std::{collections::HashMap, ops::Range};

/// Wood at any error: its triangles in an order in which those that are drawn follow each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WoodLevels {
    /// Vertices of the wood and after them those of the ribbons, on their centre lines: their
    /// normals are along the line, turned round on one of both sides.
    pub vertices: Vec<Vertex>,
    /// Of each vertex, the one that it slides to.
    pub parents: Vec<u32>,
    /// Of each vertex, the error from which on it is drawn where its parent is.
    pub thresholds: Vec<f32>,
    /// Of each vertex of a ribbon, half of the ribbon's width there.
    pub halves: Vec<f32>,
    /// Index and material of each corner, three per triangle.
    pub corners: Vec<(u32, u32)>,
    /// Of each vertex, its stem: where stems meet in one point, the first.
    pub vertex_stems: Vec<u32>,
    /// Of each stem, its width in the plant's units.
    pub widths: Vec<f32>,
    /// How far each stem is widened.
    pub swells: Vec<Swell>,
    /// Which of the triangles are drawn.
    pub drawn: DrawnWood,
}

/// Which triangles of wood are drawn at an error: those of ribbons that have not yet gone, and next
/// to them those of tubes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrawnWood {
    /// Errors from which on triangles are not drawn: of ribbons, rising, and after them of tubes,
    /// falling.
    ends: Vec<f32>,
    ribbons: u32,
    /// Error from which on there are ribbons.
    start: f32,
}

impl DrawnWood {
    /// Range of the triangles that are drawn at an error in the plant's units; the others have no
    /// area there.
    pub fn at(&self, error: f32) -> Range<u32> {
        let (ribbons, tubes) = self.ends.split_at(self.ribbons as usize);
        let first = if error < self.start { ribbons.len() } else { ribbons.partition_point(|&end| end <= error) };
        first as u32..self.ribbons + tubes.partition_point(|&end| end > error) as u32
    }

    /// Number of triangles of ribbons and tubes.
    pub fn all(&self) -> u32 {
        self.ends.len() as u32
    }
}

/// Wood at an error.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WoodLevel {
    /// Vertices where they are drawn.
    pub vertices: Vec<Vertex>,
    /// Of each vertex, which of the wood's it is.
    pub numbers: Vec<u32>,
    /// Of each vertex, how far it is widened; depth is that of the vertex without it.
    pub widened: Vec<Vec3>,
    /// Of each vertex of a ribbon, along its centre line and as long as half of its width, turned
    /// round on one of both sides; 0 for others. See [`facing`](Self::facing).
    pub across: Vec<Vec3>,
    /// Three indices and one material for each triangle.
    pub triangles: Vec<([u32; 3], u32)>,
}

impl WoodLevels {
    /// Sorts the triangles of wood, given an order that is valid for it. O(n log n).
    pub fn new(wood: &Wood, order: &WoodOrder) -> Self {
        Self::of(wood, order, vanishing(wood, order), Vec::new())
    }

    /// Same as [`new`](Self::new), with ribbons that face the eye in place of stems whose width is
    /// at most four times the error, if the order has [boosts](WoodOrder::boosts) for them.
    pub fn with_ribbons(wood: &Wood, order: &WoodOrder) -> Self {
        let Some(boosts) = &order.boosts else { return Self::new(wood, order) };
        let mut ends = vanishing(wood, order);
        let ribbons = ribbons(wood, order, &ends);
        let starts: Vec<f32> = stems(wood, order).iter().map(|stem| RIBBON * stem.width).collect();
        let mut start = f32::INFINITY;
        for (end, &stem) in ends.iter_mut().zip(&order.triangle_stems) {
            if !ribbons[stem as usize].triangles.is_empty() {
                *end = end.min(starts[stem as usize]);
                start = start.min(starts[stem as usize]);
            }
        }
        let mut levels = Self::of(wood, order, ends, ribbons);
        levels.drawn.start = start;
        levels.boost(order, &Factors::of(extent(wood).1, boosts));
        levels
    }

    /// Widens ribbons by other factors.
    pub(super) fn boost(&mut self, order: &WoodOrder, factors: &Factors) {
        let first = self.vertices.len() - self.halves.len();
        for stem in self.vertex_stems[first..].iter().map(|&stem| stem as usize) {
            self.swells[stem] = ribbon_swell(&order.swells[stem], self.widths[stem], factors);
        }
    }

    fn of(wood: &Wood, order: &WoodOrder, ends: Vec<f32>, ribbons: Vec<Ribbon>) -> Self {
        let mut materials = vec![0; wood.triangles()];
        for part in &wood.parts {
            let range = part.indices[0] as usize / 3..part.indices[1] as usize / 3;
            materials.get_mut(range).into_iter().flatten().for_each(|material| *material = part.material);
        }
        let mut of_stems = vec![0; order.stems.len()];
        order.triangle_stems.iter().zip(&materials).for_each(|(&stem, &material)| of_stems[stem as usize] = material);
        let mut levels = Self {
            vertices: wood.vertices.clone(),
            parents: order.parents.clone(),
            thresholds: order.thresholds.clone(),
            vertex_stems: vertex_stems(wood, order),
            widths: stems(wood, order).iter().map(|stem| stem.width).collect(),
            swells: order.swells.clone(),
            ..Self::default()
        };
        let mut of_ribbons: Vec<(f32, [u32; 3], u32)> = Vec::new();
        for (stem, ribbon) in (0..).zip(ribbons) {
            let first = levels.vertices.len() as u32;
            levels.vertices.extend(ribbon.vertices);
            levels.halves.extend(ribbon.halves);
            levels.parents.extend(ribbon.slides.iter().map(|slide| first + slide.0));
            levels.thresholds.extend(ribbon.slides.iter().map(|slide| slide.1));
            levels.vertex_stems.resize(levels.vertices.len(), stem);
            let material = of_stems[stem as usize];
            of_ribbons.extend(ribbon.triangles.iter().map(|(of, end)| (*end, of.map(|i| first + i), material)));
        }
        let corners = wood.indices.chunks_exact(3).zip(materials).zip(ends);
        let mut of_tubes: Vec<(f32, [u32; 3], u32)> =
            corners.map(|((of, material), end)| (end, [of[0], of[1], of[2]], material)).collect();
        of_ribbons.sort_by(|a, b| a.0.total_cmp(&b.0));
        of_tubes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let triangles = || of_ribbons.iter().chain(&of_tubes);
        levels.corners = triangles().flat_map(|(_, of, material)| of.map(|index| (index, *material))).collect();
        let ends = triangles().map(|triangle| triangle.0).collect();
        levels.drawn = DrawnWood { ends, ribbons: of_ribbons.len() as u32, start: f32::INFINITY };
        levels
    }

    /// Half of the ribbon's width at a vertex; `None` if it is of no ribbon.
    pub fn half(&self, vertex: u32) -> Option<f32> {
        let first = self.vertices.len() - self.halves.len();
        Some(self.halves[(vertex as usize).checked_sub(first)?])
    }

    /// Where the vertices are.
    pub fn slides(&self) -> Slides<'_> {
        let Self { vertices, parents, thresholds, swells, halves, vertex_stems: stems, widths, .. } = self;
        Slides { vertices, parents, thresholds, swells, halves, stems, widths }
    }

    /// The wood at an error in the plant's units. Ribbons have no width until they are
    /// [turned](WoodLevel::facing) towards an eye.
    pub fn at(&self, error: f32) -> WoodLevel {
        let slides = self.slides();
        let mut numbers = vec![u32::MAX; self.vertices.len()];
        let mut level = WoodLevel::default();
        let drawn = self.drawn.at(error);
        for of in self.corners[3 * drawn.start as usize..3 * drawn.end as usize].chunks_exact(3) {
            let triangle = [0, 1, 2].map(|i| {
                let number = &mut numbers[of[i].0 as usize];
                if *number == u32::MAX {
                    *number = level.vertices.len() as u32;
                    let slid = slides.at(of[i].0, error);
                    level.vertices.push(Vertex {
                        position: (slid.position + slid.widened).to_array(),
                        normal: slid.normal.to_array(),
                        uv: slid.uv.to_array(),
                        color: slid.color.extend(1.0).to_array(),
                    });
                    level.widened.push(slid.widened);
                    level.across.push(slid.across);
                    level.numbers.push(of[i].0);
                }
                *number
            });
            level.triangles.push((triangle, of[0].1));
        }
        level
    }
}

impl WoodLevel {
    /// Turns the ribbons towards an eye.
    pub fn facing(mut self, eye: Vec3) -> Self {
        for (vertex, across) in self.vertices.iter_mut().zip(&self.across).filter(|(_, across)| **across != Vec3::ZERO)
        {
            let (side, normal) = facing(*across, eye - Vec3::from(vertex.position));
            vertex.position = (Vec3::from(vertex.position) + side).to_array();
            vertex.normal = normal.to_array();
        }
        self
    }
}

/// Stem of each vertex: where stems meet in one point, the first; 0 for those without triangles.
fn vertex_stems(wood: &Wood, order: &WoodOrder) -> Vec<u32> {
    let mut first = HashMap::new();
    let bits = |corner: u32| wood.vertices[corner as usize].position.map(|x| (x + 0.0).to_bits());
    for (corners, &stem) in wood.indices.chunks_exact(3).zip(&order.triangle_stems) {
        for &corner in corners {
            let least = first.entry(bits(corner)).or_insert(stem);
            *least = stem.min(*least);
        }
    }
    (0..wood.vertices.len() as u32).map(|corner| first.get(&bits(corner)).copied().unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        plant::WoodPart,
        wood::{NO_SWELL, SWELLS, StemLink},
    };

    #[test]
    fn levels_are_prefixes_and_every_triangle_left_out_has_no_area() {
        let vertex =
            |x: f32, y: f32| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [x, y], color: [1.0; 4] };
        let wood = Wood {
            vertices: vec![vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(0.0, 1.0), vertex(1.0, 1.0)],
            indices: vec![1, 3, 2, 0, 1, 2],
            parts: vec![WoodPart { indices: [0, 3], material: 7 }, WoodPart { indices: [3, 6], material: 5 }],
        };
        let order = WoodOrder {
            stems: vec![StemLink { parent: None, level: 0 }],
            triangle_stems: vec![0, 0],
            parents: vec![0, 1, 2, 1],
            thresholds: vec![f32::INFINITY, f32::INFINITY, f32::INFINITY, 2.0],
            swells: vec![[NO_SWELL + 32; SWELLS]],
            boosts: None,
        };
        let levels = WoodLevels::new(&wood, &order);
        assert_eq!(levels.corners, [(0, 5), (1, 5), (2, 5), (1, 7), (3, 7), (2, 7)]);
        assert_eq!([0.0, 1.9, 2.0, 9.0].map(|error| levels.drawn.at(error).len()), [2, 2, 1, 1]);
        let level = levels.at(0.0);
        assert_eq!((level.triangles[0], level.widened[0]), (([0, 1, 2], 5), Vec3::ZERO));
        // Half of the error along the normal.
        let level = levels.at(1.0);
        assert_eq!((level.vertices[0].position, level.widened[0]), ([0.0, 0.0, 0.5], Vec3::Z * 0.5));
        assert_eq!(levels.at(1.8).vertices[3].position, [1.0, 0.5, 0.9]);
        assert_eq!(levels.at(2.0).triangles, [([0, 1, 2], 5)]);
    }
}
