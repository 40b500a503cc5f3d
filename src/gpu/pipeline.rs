//! Render pipelines: target formats, and pass descriptions from which pipelines are created.

use super::shadow_map::ShadowMap;
use crate::{Depth, draw::look::Coloring};

/// Formats and sample count of a render target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TargetFormat {
    /// Colour format. For a format that is not sRGB, the shaders encode the colour as sRGB.
    pub color: wgpu::TextureFormat,
    /// Depth format. Clear the depth buffer to [`Depth::clear_value`] of the camera's convention.
    pub depth: wgpu::TextureFormat,
    /// Number of samples per pixel, 1 to 16. With more than one, alpha determines how many of them
    /// a leaf covers (alpha to coverage).
    pub samples: u32,
}

/// Kind of target that a pass draws into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Target {
    /// A picture.
    Picture(TargetFormat),
    /// The shadow map: depth only; smaller values are closer to the sun.
    Shadow,
    /// Motion vectors: two components per pixel.
    Motion(TargetFormat),
}

/// What a pass draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surface {
    /// What lies behind everything: neither tests nor writes depth.
    Backdrop,
    /// Ground with heights, under a depth convention.
    Ground(Depth),
    /// Plants, in some colouring, under a depth convention.
    Plants(Coloring, Depth),
}

/// Description of a pass, from which its pipeline is created.
pub(super) struct PassDescription<'a> {
    pub(super) name: &'a str,
    pub(super) wgsl: String,
    /// Names of the vertex and the fragment entry point.
    pub(super) entry_points: [&'a str; 2],
    pub(super) layouts: Vec<Option<&'a wgpu::BindGroupLayout>>,
    pub(super) vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(super) surface: Surface,
}

impl PassDescription<'_> {
    pub(super) fn pipeline(self, device: &wgpu::Device, target: impl Into<Target>) -> wgpu::RenderPipeline {
        let target = target.into();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.wgsl.into()),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.name),
            bind_group_layouts: &self.layouts,
            immediate_size: 0,
        });
        let (color, depth, samples) = match target {
            Target::Picture(TargetFormat { color, depth, samples })
            | Target::Motion(TargetFormat { color, depth, samples }) => (Some(color), depth, samples),
            Target::Shadow => (None, ShadowMap::FORMAT, 1),
        };
        let is_encoded = color.is_some_and(|color| !color.is_srgb());
        let (coloring, depth_order) = match self.surface {
            Surface::Backdrop => (Coloring::Picture, None),
            Surface::Ground(depth) => (Coloring::Picture, Some(depth)),
            Surface::Plants(coloring, depth) => (coloring, Some(depth)),
        };
        let constants = [
            ("ENCODE_SRGB", f64::from(u8::from(is_encoded))),
            ("SAMPLES", f64::from(samples)),
            ("COLORING", f64::from(coloring.number())),
        ];
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: match (self.surface, target) {
                (Surface::Plants(..), _) => &constants,
                (Surface::Backdrop, Target::Motion(_)) => &[],
                _ => &constants[..1],
            },
            ..Default::default()
        };
        let compare = match depth_order {
            None => wgpu::CompareFunction::Always,
            Some(Depth::Reversed) => wgpu::CompareFunction::Greater,
            Some(Depth::Standard) => wgpu::CompareFunction::Less,
        };
        // Plants write an alpha of 1 to the samples that they cover.
        let write_mask = wgpu::ColorWrites::ALL;
        let color_target = color.map(|format| wgpu::ColorTargetState { format, blend: None, write_mask });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(self.entry_points[0]),
                compilation_options: compilation_options.clone(),
                buffers: self.vertex_buffers,
            },
            primitive: wgpu::PrimitiveState { polygon_mode: polygon_mode(coloring, device), ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth,
                depth_write_enabled: Some(depth_order.is_some()),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(self.entry_points[1]),
                compilation_options,
                targets: if color_target.is_some() { std::slice::from_ref(&color_target) } else { &[] },
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

impl From<TargetFormat> for Target {
    fn from(format: TargetFormat) -> Self {
        Self::Picture(format)
    }
}

fn polygon_mode(coloring: Coloring, device: &wgpu::Device) -> wgpu::PolygonMode {
    let has_lines = device.features().contains(wgpu::Features::POLYGON_MODE_LINE);
    if coloring == Coloring::Wire && has_lines { wgpu::PolygonMode::Line } else { wgpu::PolygonMode::Fill }
}
