//! Wood as a mesh of points: vertices at the same position are one point.
//!
//! Positions along open borders are also one point if they are nearly equal: seams of tubes that
//! rounding tore apart.

use crate::plant::Wood;
use glam::Vec3;
use std::collections::HashMap;

/// Lists of numbers, one after another.
pub(super) struct Lists {
    /// Entry n: the first of list n in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Sorts pairs of a list and an item into `count` lists; each keeps the order of the pairs.
    pub(super) fn new(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        pairs.clone().for_each(|(list, _)| starts[list as usize + 1] += 1);
        for list in 0..count {
            starts[list + 1] += starts[list];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        for (list, item) in pairs {
            items[next[list as usize] as usize] = item;
            next[list as usize] += 1;
        }
        Self { starts, items }
    }

    /// One list.
    pub(super) fn of(&self, list: u32) -> &[u32] {
        &self.items[self.starts[list as usize] as usize..self.starts[list as usize + 1] as usize]
    }
}

/// Sets of numbers that are joined (union-find with path halving).
pub(super) struct Sets(Vec<u32>);

impl Sets {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The least number of the set that `of` is in.
    pub(super) fn find(&mut self, mut of: u32) -> u32 {
        while self.0[of as usize] != of {
            self.0[of as usize] = self.0[self.0[of as usize] as usize];
            of = self.0[of as usize];
        }
        of
    }

    pub(super) fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [self.find(a), self.find(b)];
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// The mesh.
pub(super) struct Mesh {
    /// Point of each vertex.
    pub(super) of_vertex: Vec<u32>,
    pub(super) points: Vec<Vec3>,
    /// Points of each triangle; those of a triangle without area may be equal.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Points that share an edge with each point, once for each triangle of that edge.
    pub(super) neighbors: Lists,
    /// Edges of one triangle only, each with its lower point first.
    pub(super) borders: Vec<[u32; 2]>,
}

/// Distance up to which positions along open borders are one point, over the size of the wood.
const NEARLY: f32 = 1e-6;

impl Mesh {
    /// Welds valid wood. O(n log n).
    pub(super) fn new(wood: &Wood) -> Self {
        let mut numbers = HashMap::with_capacity(wood.vertices.len());
        let mut points = Vec::new();
        let weld = |vertex: &crate::leaf::Vertex| {
            // 0 and -0 are the same place.
            let position = vertex.position.map(|x| x + 0.0);
            *numbers.entry(position.map(f32::to_bits)).or_insert_with(|| {
                points.push(Vec3::from(position));
                points.len() as u32 - 1
            })
        };
        let mut of_vertex: Vec<u32> = wood.vertices.iter().map(weld).collect();
        let triangles = triangles(wood, &of_vertex);
        let (of_point, points) = mended(points, &borders(&triangles));
        of_vertex.iter_mut().for_each(|point| *point = of_point[*point as usize]);
        let triangles = self::triangles(wood, &of_vertex);
        let edges = || triangles.iter().copied().flat_map(edges);
        let neighbors = Lists::new(points.len(), edges().flat_map(|[a, b]| [(a, b), (b, a)]));
        let borders = borders(&triangles);
        Self { of_vertex, points, triangles, neighbors, borders }
    }
}

fn triangles(wood: &Wood, of_vertex: &[u32]) -> Vec<[u32; 3]> {
    let point = |index: u32| of_vertex[index as usize];
    wood.indices.chunks_exact(3).map(|of| [point(of[0]), point(of[1]), point(of[2])]).collect()
}

/// Edges of a triangle that have a length.
fn edges([a, b, c]: [u32; 3]) -> impl Iterator<Item = [u32; 2]> + Clone {
    [[a, b], [b, c], [c, a]].into_iter().filter(|[a, b]| a != b)
}

/// Edges of one triangle only, each with its lower point first.
fn borders(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let edges = triangles.iter().copied().flat_map(edges);
    let mut sorted: Vec<[u32; 2]> = edges.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sorted.sort_unstable();
    sorted.chunk_by(|a, b| a == b).filter(|of| of.len() == 1).map(|of| of[0]).collect()
}

/// Joins nearly equal points of borders: returns the new number of each point, and the positions.
fn mended(points: Vec<Vec3>, borders: &[[u32; 2]]) -> (Vec<u32>, Vec<Vec3>) {
    let low = points.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = points.iter().copied().reduce(Vec3::max).unwrap_or_default();
    let near = NEARLY * (high - low).length();
    let mut sets = Sets::new(points.len());
    let cell = |at: Vec3| ((at - low) / near).floor().to_array().map(|x| x as i32);
    let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
    let mut ends: Vec<u32> = borders.as_flattened().to_vec();
    ends.sort_unstable();
    ends.dedup();
    for &point in ends.iter().filter(|_| near > 0.0) {
        let at = points[point as usize];
        let center = cell(at);
        for step in 0..27 {
            let beside = [0, 1, 2].map(|axis| center[axis] + step / [1, 3, 9][axis] % 3 - 1);
            for &other in cells.get(&beside).into_iter().flatten() {
                if points[other as usize].distance(at) <= near {
                    sets.join(point, other);
                }
            }
        }
        cells.entry(center).or_default().push(point);
    }
    let mut numbers = vec![0; points.len()];
    let mut left = Vec::with_capacity(points.len());
    for (point, position) in points.iter().enumerate() {
        let first = sets.find(point as u32) as usize;
        if first == point {
            numbers[point] = left.len() as u32;
            left.push(*position);
        }
        numbers[point] = numbers[first];
    }
    (numbers, left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Vertex;

    #[test]
    fn torn_seams_are_joined_and_what_is_apart_is_not() {
        let vertex = |position| Vertex { position, normal: [0.0; 3], uv: [0.0; 2], color: [1.0; 4] };
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-0.0, 0.0, 1e-8],
            [0.0, 1.0, -1e-8],
            [-1.0, 0.0, 0.0],
            [-1.0, 1e-4, 0.0],
        ];
        let wood = Wood {
            vertices: positions.map(vertex).to_vec(),
            indices: vec![0, 1, 2, 3, 4, 5, 3, 5, 6],
            parts: Vec::new(),
        };
        let mesh = Mesh::new(&wood);
        assert_eq!(mesh.of_vertex, [0, 1, 2, 0, 2, 3, 4]);
        assert_eq!(mesh.borders, [[0, 1], [0, 4], [1, 2], [2, 3], [3, 4]]);
        assert_eq!(mesh.neighbors.of(0), [1, 2, 2, 3, 3, 4]);
    }
}
