//! Canonical form of a leaf: the same bytes regardless of the order of triangles and vertices in
//! the file.

use super::Plant;
use crate::leaf::Vertex;

impl Plant {
    /// Converts every leaf to canonical form. The plant looks the same, and leaf order, pivots and
    /// wood are unchanged.
    ///
    /// Within each leaf, bitwise equal vertices are merged and unreferenced ones removed. Vertices
    /// are sorted by position, uv, normal and colour (compared as unsigned bits). Triangles are
    /// rotated to start with their smallest index, keeping the winding, and then sorted.
    /// Idempotent. Cost: one sort per leaf.
    pub fn canonicalize(&mut self) {
        self.sort_leaves(key);
    }

    /// Sorts vertices by uv first, otherwise as [`canonicalize`](Self::canonicalize): leaves that
    /// are one leaf turned and moved, with another uv at each vertex, then have the same indices.
    #[cfg(feature = "simplify")]
    pub(crate) fn sort_by_uv(&mut self) {
        self.sort_leaves(uv_key);
    }

    fn sort_leaves(&mut self, key: fn(&Vertex) -> [u32; 12]) {
        let source = std::mem::take(self);
        let leaves = source.leaves.iter().map(|leaf| {
            let first = leaf.vertices[0];
            let indices: Vec<u32> = source.indices[leaf.index_range()].iter().map(|index| index - first).collect();
            (sorted_by(key, &source.vertices[leaf.vertex_range()], &indices), leaf)
        });
        for ((vertices, indices), leaf) in leaves {
            self.push_leaf(&vertices, &indices, leaf.pivot, leaf.material);
        }
        let Plant { name, wood, materials, textures, outlines, .. } = source;
        *self = Plant { name, wood, materials, textures, outlines, ..std::mem::take(self) };
    }
}

/// Canonical form of one leaf. `indices` are relative to `vertices` and less than their count.
#[cfg(any(test, feature = "simplify"))]
pub(crate) fn canonical(vertices: &[Vertex], indices: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
    sorted_by(key, vertices, indices)
}

fn sorted_by(key: fn(&Vertex) -> [u32; 12], vertices: &[Vertex], indices: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
    let mut order: Vec<u32> = indices.to_vec();
    order.sort_unstable();
    order.dedup();
    order.sort_by_key(|&vertex| key(&vertices[vertex as usize]));
    let mut renumbered = vec![0; vertices.len()];
    let mut sorted: Vec<Vertex> = Vec::with_capacity(order.len());
    for vertex in order {
        let content = vertices[vertex as usize];
        if sorted.last().is_none_or(|last| key(last) != key(&content)) {
            sorted.push(content);
        }
        renumbered[vertex as usize] = sorted.len() as u32 - 1;
    }
    let mut triangles: Vec<[u32; 3]> = indices
        .chunks_exact(3)
        .map(|corners| least_rotation([0, 1, 2].map(|i| renumbered[corners[i] as usize])))
        .collect();
    triangles.sort_unstable();
    (sorted, triangles.into_flattened())
}

fn key(vertex: &Vertex) -> [u32; 12] {
    let [x, y, z] = vertex.position.map(f32::to_bits);
    let [u, v] = vertex.uv.map(f32::to_bits);
    let [i, j, k] = vertex.normal.map(f32::to_bits);
    let [r, g, b, a] = vertex.color.map(f32::to_bits);
    [x, y, z, u, v, i, j, k, r, g, b, a]
}

#[cfg(any(test, feature = "simplify"))]
fn uv_key(vertex: &Vertex) -> [u32; 12] {
    let [x, y, z, u, v, rest @ ..] = key(vertex);
    let [i, j, k, r, g, b, a] = rest;
    [u, v, x, y, z, i, j, k, r, g, b, a]
}

fn least_rotation([a, b, c]: [u32; 3]) -> [u32; 3] {
    [a, b, c].min([b, c, a]).min([c, a, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;

    fn vertex(x: f32, y: f32) -> Vertex {
        Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [x, y], color: [1.0; 4] }
    }

    #[test]
    fn order_and_duplicates_within_a_leaf_leave_no_trace() {
        let corners = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(1.0, 1.0), vertex(0.0, 1.0)];
        let listed = canonical(&corners, &[0, 1, 2, 0, 2, 3]);
        let split = [corners[3], corners[2], corners[0], corners[0], corners[1], corners[2], vertex(9.0, 9.0)];
        assert_eq!(canonical(&split, &[1, 0, 2, 4, 5, 3]), listed);
        assert_eq!(canonical(&listed.0, &listed.1), listed);
        assert_eq!(listed.0.len(), 4);
    }

    #[test]
    fn winding_is_kept() {
        let corners = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(1.0, 1.0)];
        assert_ne!(canonical(&corners, &[0, 1, 2]), canonical(&corners, &[0, 2, 1]));
        assert_eq!(canonical(&corners, &[0, 1, 2]), canonical(&corners, &[2, 0, 1]));
    }

    #[test]
    fn a_leaf_that_is_turned_and_moved_keeps_its_order_by_uv() {
        let corners = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(1.0, 2.0), vertex(0.0, 1.0)];
        let turn = |vertex: Vertex| {
            let [x, y, z] = vertex.position;
            Vertex { position: [5.0 - x, z, 3.0 - y], ..vertex }
        };
        let sorted = |leaf: [Vertex; 4]| sorted_by(uv_key, &leaf, &[0, 1, 2, 0, 2, 3]);
        let [(one, indices), (other, same)] = [corners, corners.map(turn)].map(sorted);
        assert_eq!(indices, same);
        assert!(one.iter().zip(&other).all(|(a, b)| a.uv == b.uv));
    }

    #[test]
    fn a_plant_keeps_its_leaves_and_wood() {
        let mut plant = Plant { name: "p".into(), materials: vec![Material::default()], ..Plant::default() };
        plant.push_leaf(&[vertex(1.0, 1.0), vertex(0.0, 0.0), vertex(1.0, 0.0)], &[2, 0, 1], [1.0; 3], 0);
        plant.push_leaf(&[vertex(3.0, 0.0), vertex(4.0, 0.0), vertex(3.0, 1.0)], &[0, 1, 2], [2.0; 3], 0);
        plant.canonicalize();
        plant.validate().unwrap();
        assert_eq!((plant.leaves.len(), plant.leaves[1].pivot, plant.materials.len()), (2, [2.0; 3], 1));
        assert_eq!(plant.vertices[0].position, [0.0; 3]);
        assert_eq!(plant.indices[..3], [0, 1, 2]);
    }
}
