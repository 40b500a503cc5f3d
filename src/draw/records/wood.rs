//! GPU records of the wood.

#[cfg(doc)]
use super::{LookRecord, PackingRecord};

/// Logarithm to the base 2 of the least width of a stem, in steps of the wood's grid: nothing.
pub const LEAST_WIDTH: f32 = -44.0;

/// Codes of widths per octave: 128 octaves in 15 bits.
pub const WIDTH_STEPS: f32 = 256.0;

/// Logarithm to the base 2 of the least half of a ribbon's width over its stem's that has a code.
pub const LEAST_HALF: f32 = -8.0;

/// Codes of halves of widths per octave: 8 to 2.6 octaves below and above a stem's width.
pub const HALF_STEPS: f32 = 24.0;

/// One vertex of the wood in an [`Upload`](crate::draw::Upload).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct WoodVertex {
    /// In local space.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Linear colour factor.
    pub color: [f32; 3],
    /// Index into the materials.
    pub material: u32,
    /// Width of the stem in local space; see [`Stems::widths`](crate::draw::Stems::widths).
    pub width: f32,
}

/// One vertex of the wood, as `wood_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedWood {
    /// Position along x and y, in steps from [`LookRecord::origin`], 16 bits each.
    pub position_xy: u32,
    /// Position along z, and the normal on an octahedron, two signed 8-bit fractions.
    pub position_z_normal: u32,
    /// Texture coordinates, unsigned 16-bit fractions of [`LookRecord::uv_size`].
    pub uv: u32,
    /// Number of the look, 16 bits, and the width of the stem: 15 bits of its logarithm, and its
    /// sign. With [`PackingRecord::widths_in_looks`], the number of the look alone.
    pub look_width: u32,
}

/// One vertex of wood that slides, as `wood_slides.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SlidingWood {
    /// Position along x and y, in steps from [`LookRecord::origin`], 16 bits each.
    pub position_xy: u32,
    /// Position along z, and the normal or the centre line of a ribbon on an octahedron, two signed
    /// 8-bit fractions.
    pub position_z_normal: u32,
    /// Texture coordinates, unsigned 16-bit fractions of [`LookRecord::uv_size`].
    pub uv: u32,
    /// Number of the look.
    pub look: u32,
    /// Vertex that it slides to, 24 bits, and 8 bits of the logarithm of half of a ribbon's width
    /// over its stem's; 0 for a vertex of no ribbon.
    pub parent_half: u32,
    /// Number of the stem, and the upper half of the error from which on the vertex is where its
    /// parent is; the largest finite one stands for never.
    pub stem_threshold: u32,
}

/// One stem of wood that slides, as `wood_slides.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct StemRecord {
    /// Mean width in local space; above 0.
    pub width: f32,
    /// How far it is widened; see [`Swell`](crate::wood::Swell).
    pub swells: [u8; 16],
}

/// How a vertex of the wood slides, in an [`Upload`](crate::draw::Upload).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WoodSlide {
    /// Vertex that it slides to.
    pub parent: u32,
    /// Error, in local space, from which on it is where its parent is; infinite for never.
    pub threshold: f32,
    /// Index of its stem.
    pub stem: u32,
    /// Of a vertex of a ribbon that faces the eye, half of the ribbon's width there, in local
    /// space; its normal is along the ribbon, turned round on one of both sides. Otherwise `None`.
    pub half: Option<f32>,
}
