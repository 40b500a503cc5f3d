//! Draws the leaves of all plants of one model at once, each plant at its own active count.
//!
//! A plant's prefix is cut into runs of [`RUN_INDICES`] indices; the draw has one instance for each run of each plant. The
//! vertex shader fetches the corner by its number, and the leaf's drawn scale from the timeline (a short binary search) or
//! from the plant's own scales.

use super::{
    look::{self, Look, Variant, bound},
    surface::{PassDescription, RUN_INDICES, Target},
};

/// One instance of the draw: which plant, and which of its runs.
pub(super) type Run = [u32; 2];

/// The pass's shader, put together for a look and a variant.
pub fn wgsl(look: &Look, variant: Variant) -> String {
    look::wgsl(include_str!("../../shaders/leaf_pass.wgsl"), look, variant)
}

/// As [`wgsl`], into the shadow map.
pub fn shadow_wgsl(look: &Look, variant: Variant) -> String {
    wgsl(look, variant) + include_str!("../../shaders/shadow_pass.wgsl")
}

/// As [`wgsl`], for motion vectors.
pub fn motion_wgsl(look: &Look, variant: Variant) -> String {
    wgsl(look, variant)
        + include_str!("../../shaders/motion_pass.wgsl")
        + include_str!("../../shaders/leaf_motion.wgsl")
}

pub(super) fn pipeline(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout],
    target: Target,
    look: &Look,
    variant: Variant,
) -> wgpu::RenderPipeline {
    let runs = wgpu::VertexBufferLayout {
        array_stride: size_of::<Run>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![0 => Uint32x2],
    };
    let (wgsl, entry_points) = match target {
        Target::Picture(_) => (wgsl(look, variant), ["leaf_corner", "leaf_color"]),
        Target::Shadow => (shadow_wgsl(look, variant), ["leaf_corner", "cast_shadow"]),
        Target::Motion(_) => (motion_wgsl(look, variant), ["leaf_motion", "motion"]),
    };
    PassDescription {
        name: "leaf_pass",
        wgsl,
        entry_points,
        layouts: bound(layouts, look, variant),
        vertex_buffers: &[Some(runs)],
        surface: Some(look.coloring),
    }
    .pipeline(device, target)
}

/// Runs of a prefix that ends before index `index_end`.
pub(super) fn runs(index_end: u32) -> u32 {
    index_end.div_ceil(RUN_INDICES)
}
