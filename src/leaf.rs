//! Geometry of one leaf: vertices, and ranges into the arrays of the plant or model that owns it.

use serde::{Deserialize, Serialize};

/// One vertex of foliage or wood, 48 bytes, ready for upload.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// Position in the plant's space and units (glTF: metres, +Y up, right-handed).
    pub position: [f32; 3],
    /// Unit normal; the face normal if the file has none.
    pub normal: [f32; 3],
    /// Texture coordinates with the texture transform applied; (0, 0) is the first texel's corner.
    pub uv: [f32; 2],
    /// Linear colour factor, as in glTF's `COLOR_0`; may exceed 1. White if the file has none.
    pub color: [f32; 4],
}

/// Geometry of one leaf: its ranges in the owner's arrays, pivot and material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeafGeometry {
    /// First and one-past-last vertex.
    pub vertices: [u32; 2],
    /// First and one-past-last index; three per triangle, each an absolute vertex index.
    pub indices: [u32; 2],
    /// Fixed point of scaling: the leaf's attachment point if the mesh reveals it, else its
    /// centroid.
    pub pivot: [f32; 3],
    /// Index into the owner's materials.
    pub material: u32,
}

impl LeafGeometry {
    /// Vertex range for slicing.
    pub fn vertex_range(&self) -> std::ops::Range<usize> {
        self.vertices[0] as usize..self.vertices[1] as usize
    }

    /// Index range for slicing.
    pub fn index_range(&self) -> std::ops::Range<usize> {
        self.indices[0] as usize..self.indices[1] as usize
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.index_range().len() / 3
    }
}
