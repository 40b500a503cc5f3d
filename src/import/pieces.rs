//! Pieces: sets of triangles connected over shared edges once vertices at exactly equal positions
//! are welded.
//!
//! Exporters split vertices at seams of uv or normals, so components of the index list are
//! meaningless; joining over a shared corner would merge leaves that merely touch. Coincident
//! triangles of opposite winding share their edges and fall into one piece.

use crate::leaf::Vertex;
use std::collections::HashMap;

/// The triangles of each piece, ascending; pieces are in the order of their first triangles.
///
/// A triangle with two corners at the same position is degenerate: it joins nothing and belongs to
/// no piece. Cost: linear.
pub(super) fn pieces(vertices: &[Vertex], indices: &[u32]) -> Vec<Vec<u32>> {
    let welded = weld(vertices);
    let corners = |triangle: usize| [0, 1, 2].map(|i| welded[indices[triangle * 3 + i] as usize]);
    let triangles = indices.len() / 3;
    let mut sets = Sets::new(triangles);
    let mut first_on_edge: HashMap<[u32; 2], u32> = HashMap::with_capacity(triangles * 2);
    let stands = |[a, b, c]: [u32; 3]| a != b && b != c && c != a;
    for triangle in (0..triangles).filter(|&triangle| stands(corners(triangle))) {
        let [a, b, c] = corners(triangle);
        for edge in [[a.min(b), a.max(b)], [b.min(c), b.max(c)], [c.min(a), c.max(a)]] {
            let first = *first_on_edge.entry(edge).or_insert(triangle as u32);
            sets.join(first, triangle as u32);
        }
    }
    let standing = (0..triangles).filter(|&triangle| stands(corners(triangle)));
    sets.members(standing.map(|triangle| triangle as u32))
}

/// The first vertex at the position of each vertex; -0 equals 0.
fn weld(vertices: &[Vertex]) -> Vec<u32> {
    let mut first_at: HashMap<[u32; 3], u32> = HashMap::with_capacity(vertices.len());
    let key = |vertex: &Vertex| vertex.position.map(|value| (value + 0.0).to_bits());
    vertices.iter().enumerate().map(|(i, vertex)| *first_at.entry(key(vertex)).or_insert(i as u32)).collect()
}

/// Disjoint sets (union-find). The least member identifies its set, so the result does not depend
/// on the order of joins.
pub(super) struct Sets(Vec<u32>);

impl Sets {
    /// `count` sets of one member each.
    pub(super) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn find(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let parent = self.0[member as usize];
            self.0[member as usize] = self.0[parent as usize];
            member = parent;
        }
        member
    }

    /// Makes the sets of `a` and `b` one.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [self.find(a), self.find(b)];
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Those of `members` that belong to each set, in the order given; sets are in the order of
    /// their first members.
    pub(super) fn members(&mut self, members: impl Iterator<Item = u32>) -> Vec<Vec<u32>> {
        let mut number_of: HashMap<u32, usize> = HashMap::new();
        let mut sets: Vec<Vec<u32>> = Vec::new();
        for member in members {
            let number = *number_of.entry(self.find(member)).or_insert(sets.len());
            if number == sets.len() {
                sets.push(Vec::new());
            }
            sets[number].push(member);
        }
        sets
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertices(positions: &[[f32; 3]]) -> Vec<Vertex> {
        positions.iter().map(|&position| Vertex { position, ..bytemuck::Zeroable::zeroed() }).collect()
    }

    #[test]
    fn a_seam_does_not_cut_and_a_shared_corner_does_not_join() {
        let at = vertices(&[
            // Two triangles that share an edge, each with its own vertices; -0 equals 0.
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, -0.0, 0.0],
            [0.0, 1.0, -0.0],
            [1.0, 1.0, 0.0],
            // A third that touches at a corner.
            [1.0, 1.0, 0.0],
            [2.0, 1.0, 0.0],
            [2.0, 2.0, 0.0],
        ]);
        assert_eq!(pieces(&at, &[0, 1, 2, 6, 7, 8, 3, 5, 4]), [vec![0, 2], vec![1]]);
    }

    #[test]
    fn reversed_twins_are_one_piece() {
        let at = vertices(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(pieces(&at, &[0, 1, 2, 0, 2, 1]), [[0, 1]]);
    }

    #[test]
    fn collapsed_triangles_join_nothing() {
        let at =
            vertices(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]]);
        assert_eq!(pieces(&at, &[0, 1, 2, 2, 2, 3, 2, 3, 3, 3, 4, 5]), [[0], [3]]);
        assert!(pieces(&at, &[0, 0, 0]).is_empty());
        assert!(pieces(&[], &[]).is_empty());
    }
}
