//! Leaves cut into quads, which all leaf draws are made of.
//!
//! Two triangles with a common edge are one quad of four corners; a triangle without such a
//! partner is a quad whose last two corners coincide. All quads have the same six indices, so that
//! one short index buffer serves every leaf of every model.
//!
//! Limits: partners are found first come, first served; a mesh may be cut into more quads than
//! necessary, at most one per triangle.

#[cfg(feature = "render")]
use super::records::{RUN_QUADS, TRIMMED_CORNERS};
use std::collections::HashMap;

/// Corners of a quad that its six indices refer to, triangle by triangle.
pub(crate) const QUAD: [u16; 6] = [0, 1, 2, 0, 2, 3];

/// Indices of a run: first those of quads, then those of trimmed cards, whose corners are numbered
/// from the last quad's on.
#[cfg(feature = "render")]
pub(crate) fn run_indices() -> Vec<u16> {
    let (quads, trimmed) = (RUN_QUADS as u16, TRIMMED_CORNERS as u16);
    let whole = (0..quads).flat_map(|quad| QUAD.map(|corner| 4 * quad + corner));
    let fan = |first: u16| (1..trimmed - 1).flat_map(move |i| [first, first + i, first + i + 1]);
    whole.chain((0..quads).flat_map(|quad| fan(4 * quads + trimmed * quad))).collect()
}

/// Number of indices of a run of quads.
#[cfg(feature = "render")]
pub(crate) const RUN_INDICES: u32 = RUN_QUADS * QUAD.len() as u32;
/// Number of indices of a run of trimmed cards.
#[cfg(feature = "render")]
pub(crate) const TRIMMED_RUN_INDICES: u32 = RUN_QUADS * 3 * (TRIMMED_CORNERS - 2);

/// The quads of all leaves, in drawing order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Quads {
    /// Vertices at the corners of each quad.
    pub(super) corners: Vec<[u32; 4]>,
    /// Entry n: number of quads of the first n leaves.
    pub(super) ends: Vec<u32>,
}

impl Quads {
    /// Cuts the leaves whose triangles have the corners `indices[range]`. Vertices with the same
    /// bits count as one. O(indices).
    pub(super) fn new<V: bytemuck::Pod>(
        vertices: &[V],
        indices: &[u32],
        leaves: impl Iterator<Item = [u32; 2]>,
    ) -> Self {
        let mut quads = Self { corners: Vec::with_capacity(indices.len() / QUAD.len()), ends: vec![0] };
        let (mut first_of, mut open) = (HashMap::new(), HashMap::new());
        for [first, end] in leaves {
            first_of.clear();
            open.clear();
            let mut joined =
                |index: u32| *first_of.entry(bytemuck::bytes_of(&vertices[index as usize])).or_insert(index);
            for corner in indices[first as usize..end as usize].chunks_exact(3) {
                quads.add([corner[0], corner[1], corner[2]].map(&mut joined), &mut open);
            }
            quads.ends.push(quads.corners.len() as u32);
        }
        quads
    }

    /// Adds a triangle. `open` holds the quads of its leaf by the edges of their first triangles.
    fn add(&mut self, triangle: [u32; 3], open: &mut HashMap<[u32; 2], usize>) {
        for ([p, q], y) in edges(triangle) {
            let Some(corners) = open.get(&[p, q]).map(|&quad| &mut self.corners[quad]) else { continue };
            let [a, b, c, d] = *corners;
            if c == d {
                let x = [a, b, c].into_iter().find(|&corner| corner != p && corner != q).unwrap_or(p);
                *corners = [p, x, q, y];
                return;
            }
        }
        open.extend(edges(triangle).map(|(edge, _)| (edge, self.corners.len())));
        let [a, b, c] = triangle;
        self.corners.push([a, b, c, c]);
    }
}

/// The edges of a triangle, each with the corner that is not on it.
fn edges([a, b, c]: [u32; 3]) -> [([u32; 2], u32); 3] {
    [([a, b], c), ([b, c], a), ([c, a], b)].map(|([p, q], far)| ([p.min(q), p.max(q)], far))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of quads, without those that have no area, each with sorted corners.
    fn triangles(quads: &[[u32; 4]]) -> Vec<[u32; 3]> {
        let halves = quads.iter().flat_map(|quad| {
            let at = QUAD.map(|corner| quad[usize::from(corner)]);
            [[at[0], at[1], at[2]], [at[3], at[4], at[5]]]
        });
        sorted(halves.filter(|[a, b, c]| a != b && b != c && c != a).collect())
    }

    fn sorted(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
        triangles.iter_mut().for_each(|triangle| triangle.sort_unstable());
        triangles.sort_unstable();
        triangles
    }

    #[test]
    fn quads_have_the_triangles_of_the_leaves_and_two_neighbours_share_one() {
        // A quad wound either way, a hexagon, a crossed card, one triangle, three in a row.
        let leaves: [(&[u32], u32); 6] = [
            (&[0, 1, 2, 0, 2, 3], 1),
            (&[0, 1, 2, 3, 1, 2], 1),
            (&[0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5], 2),
            (&[0, 1, 2, 0, 2, 3, 4, 5, 6, 6, 5, 7], 2),
            (&[5, 3, 1], 1),
            (&[0, 1, 2, 1, 2, 3, 2, 3, 4], 2),
        ];
        let vertices: Vec<f32> = (0..8).map(|i| i as f32).collect();
        for (indices, count) in leaves {
            let quads = Quads::new(&vertices, indices, std::iter::once([0, indices.len() as u32]));
            assert_eq!(quads.ends, [0, count], "{indices:?}");
            let expected = indices.chunks_exact(3).map(|corner| [corner[0], corner[1], corner[2]]).collect();
            assert_eq!(triangles(&quads.corners), sorted(expected), "{indices:?}");
        }
    }

    #[test]
    fn equal_vertices_count_as_one_and_leaves_share_no_quad() {
        let vertices = [0.0_f32, 1.0, 2.0, 0.0, 2.0, 3.0];
        let indices = [0, 1, 2, 3, 4, 5];
        assert_eq!(Quads::new(&vertices, &indices, std::iter::once([0, 6])).ends, [0, 1]);
        assert_eq!(Quads::new(&vertices, &indices, [[0, 3], [3, 6]].into_iter()).ends, [0, 1, 2]);
        assert_eq!(Quads::new(&vertices, &indices, [[0, 0], [0, 6]].into_iter()).ends, [0, 0, 1]);
    }

    #[test]
    fn a_mesh_of_a_hundred_triangles_has_little_more_than_fifty_quads() {
        let row: Vec<u32> = (0..100).flat_map(|i| [i, i + 1, i + 2]).collect();
        let vertices: Vec<u32> = (0..102).collect();
        assert_eq!(Quads::new(&vertices, &row, std::iter::once([0, 300])).corners.len(), 50);
    }
}
