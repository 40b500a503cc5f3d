//! Draws trunks and branches of all plants of one model at once.

use super::{
    look::{self, Look, Variant, bound},
    model_buffers::WoodVertex,
    surface::{Coloring, PassDescription, TargetFormat},
};

/// The pass's shader, put together for a look and a variant.
pub fn wgsl(look: &Look, variant: Variant) -> String {
    look::wgsl(include_str!("../../shaders/wood_pass.wgsl"), look, variant)
}

pub(super) fn pipeline(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout],
    target: TargetFormat,
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
        wgsl: wgsl(look, variant),
        entry_points: ["wood_corner", "wood_color"],
        layouts: bound(layouts, variant),
        vertex_buffers: &[Some(vertices)],
        surface: Some(Coloring::Picture),
    }
    .pipeline(device, target)
}
