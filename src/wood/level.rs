//! Wood at an error, as drawers need it: triangles in the order in which they go, and vertices on
//! their way, widened.

use super::{
    measure::stems,
    order::WoodOrder,
    slide::{Slides, vanishing},
};
use crate::{leaf::Vertex, plant::Wood};
use glam::Vec3;
use std::collections::HashMap;

/// The triangles of wood in the order in which they go, the last one first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WoodLevels {
    /// Index and material of each corner, three per triangle.
    pub corners: Vec<(u32, u32)>,
    /// Of each vertex, its stem: where stems meet in one point, the first.
    pub vertex_stems: Vec<u32>,
    /// Of each stem, its width in the plant's units.
    pub widths: Vec<f32>,
    /// Errors from which on triangles are not drawn, falling.
    ends: Vec<f32>,
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
    /// Three indices and one material for each triangle.
    pub triangles: Vec<([u32; 3], u32)>,
}

impl WoodLevels {
    /// Sorts the triangles of wood, given an order that is valid for it. O(n log n).
    pub fn new(wood: &Wood, order: &WoodOrder) -> Self {
        let ends = vanishing(wood, order);
        let mut materials = vec![0; wood.triangles()];
        for part in &wood.parts {
            let range = part.indices[0] as usize / 3..part.indices[1] as usize / 3;
            materials.get_mut(range).into_iter().flatten().for_each(|material| *material = part.material);
        }
        let mut sorted: Vec<usize> = (0..ends.len()).collect();
        sorted.sort_by(|&a, &b| ends[b].total_cmp(&ends[a]).then(a.cmp(&b)));
        let corners = sorted.iter().flat_map(|&i| [0, 1, 2].map(|corner| (wood.indices[3 * i + corner], materials[i])));
        Self {
            corners: corners.collect(),
            vertex_stems: vertex_stems(wood, order),
            widths: stems(wood, order).iter().map(|stem| stem.width).collect(),
            ends: sorted.iter().map(|&i| ends[i]).collect(),
        }
    }

    /// Number of triangles that are drawn at an error in the plant's units; those after them have
    /// no area there.
    pub fn drawn(&self, error: f32) -> u32 {
        self.ends.partition_point(|&end| end > error) as u32
    }

    /// Errors from which on triangles are not drawn, falling.
    pub fn ends(&self) -> &[f32] {
        &self.ends
    }

    /// Where the vertices are, given the wood and the order that these are the levels of.
    pub fn slides<'a>(&'a self, wood: &'a Wood, order: &'a WoodOrder) -> Slides<'a> {
        Slides { vertices: &wood.vertices, order, stems: &self.vertex_stems, widths: &self.widths }
    }

    /// The wood at an error, given the wood and the order that these are the levels of.
    pub fn at(&self, wood: &Wood, order: &WoodOrder, error: f32) -> WoodLevel {
        let slides = self.slides(wood, order);
        let mut numbers = vec![u32::MAX; wood.vertices.len()];
        let mut level = WoodLevel::default();
        for of in self.corners[..3 * self.drawn(error) as usize].chunks_exact(3) {
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
                    level.numbers.push(of[i].0);
                }
                *number
            });
            level.triangles.push((triangle, of[0].1));
        }
        level
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
        };
        let levels = WoodLevels::new(&wood, &order);
        assert_eq!(levels.corners, [(0, 5), (1, 5), (2, 5), (1, 7), (3, 7), (2, 7)]);
        assert_eq!([0.0, 1.9, 2.0, 9.0].map(|error| levels.drawn(error)), [2, 2, 1, 1]);
        let level = levels.at(&wood, &order, 0.0);
        assert_eq!((level.triangles[0], level.widened[0]), (([0, 1, 2], 5), Vec3::ZERO));
        // Half of the error along the normal.
        let level = levels.at(&wood, &order, 1.0);
        assert_eq!((level.vertices[0].position, level.widened[0]), ([0.0, 0.0, 0.5], Vec3::Z * 0.5));
        assert_eq!(levels.at(&wood, &order, 1.8).vertices[3].position, [1.0, 0.5, 0.9]);
        assert_eq!(levels.at(&wood, &order, 2.0).triangles, [([0, 1, 2], 5)]);
    }
}
