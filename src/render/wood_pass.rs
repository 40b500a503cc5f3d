//! Draws trunks and branches of all plants of one model at once.

use super::{
    look::{self, Look, Variant, bound},
    model_buffers::WoodVertex,
    surface::{Coloring, PassDescription, Target},
};

/// The pass's shader, put together for a look and a variant.
pub fn wgsl(look: &Look, variant: Variant) -> String {
    look::wgsl(include_str!("../../shaders/wood_pass.wgsl"), look, variant)
}

/// As [`wgsl`], into the shadow map.
pub fn shadow_wgsl(look: &Look, variant: Variant) -> String {
    wgsl(look, variant) + include_str!("../../shaders/shadow_pass.wgsl")
}

/// As [`wgsl`], for motion vectors.
pub fn motion_wgsl(look: &Look, variant: Variant) -> String {
    wgsl(look, variant)
        + include_str!("../../shaders/motion_pass.wgsl")
        + include_str!("../../shaders/wood_motion.wgsl")
}

pub(super) fn pipeline(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout],
    target: Target,
    look: &Look,
    variant: Variant,
) -> wgpu::RenderPipeline {
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<WoodVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &WoodVertex::ATTRIBUTES,
    };
    let (wgsl, entry_points) = match target {
        Target::Picture(_) => (wgsl(look, variant), ["wood_corner", "wood_color"]),
        Target::Shadow => (shadow_wgsl(look, variant), ["wood_corner", "cast_shadow"]),
        Target::Motion(_) => (motion_wgsl(look, variant), ["wood_motion", "motion"]),
    };
    PassDescription {
        name: "wood_pass",
        wgsl,
        entry_points,
        layouts: bound(layouts, look, variant),
        vertex_buffers: &[Some(vertices)],
        surface: Some(Coloring::Picture),
    }
    .pipeline(device, target)
}
