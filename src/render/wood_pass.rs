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
    PassDescription {
        name: "wood_pass",
        wgsl: match target {
            Target::Picture(_) => wgsl(look, variant),
            Target::Shadow => shadow_wgsl(look, variant),
        },
        entry_points: ["wood_corner", if target == Target::Shadow { "cast_shadow" } else { "wood_color" }],
        layouts: bound(layouts, look, variant),
        vertex_buffers: &[Some(vertices)],
        surface: Some(Coloring::Picture),
    }
    .pipeline(device, target)
}
