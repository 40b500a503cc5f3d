//! Draws trunks and branches of all plants of one model at once.

use super::{
    model_buffers::WoodVertex,
    surface::{self, Coloring, PassDescription, TargetFormat},
};

/// The pass's shader with its constants.
pub fn wgsl() -> String {
    surface::wgsl(include_str!("../../shaders/wood_pass.wgsl"))
}

pub(super) fn pipeline(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout],
    target: TargetFormat,
) -> wgpu::RenderPipeline {
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<WoodVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &WoodVertex::ATTRIBUTES,
    };
    PassDescription {
        name: "wood_pass",
        wgsl: wgsl(),
        entry_points: ["wood_corner", "wood_color"],
        layouts,
        vertex_buffers: &[Some(vertices)],
        surface: Some(Coloring::Picture),
    }
    .pipeline(device, target)
}
