//! Render pipelines: target formats, and pass descriptions from which pipelines are created.

use super::shadow_map::ShadowMap;
use crate::{Depth, draw::look::Coloring};

/// Formats and sample count of a render target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// A picture.
    Picture(TargetFormat),
    /// The shadow map: depth only; smaller values are closer to the sun.
    Shadow,
    /// Motion vectors: two components per pixel.
    Motion(TargetFormat),
}

/// Description of a pass, from which its pipeline is created.
pub(super) struct PassDescription<'a> {
    pub(super) name: &'a str,
    pub(super) wgsl: String,
    /// Names of the vertex and the fragment entry point.
    pub(super) entry_points: [&'a str; 2],
    pub(super) layouts: Vec<Option<&'a wgpu::BindGroupLayout>>,
    pub(super) vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// For plants: the colouring, and the depth convention of the depth test. `None` for
    /// backgrounds, which neither test nor write depth.
    pub(super) surface: Option<(Coloring, Depth)>,
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
        let is_surface = self.surface.is_some();
        let (coloring, depth_order) = self.surface.unwrap_or_default();
        let constants = [
            ("ENCODE_SRGB", f64::from(u8::from(is_encoded))),
            ("SAMPLES", f64::from(samples)),
            ("COLORING", f64::from(coloring.number())),
        ];
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: match (is_surface, target) {
                (true, _) => &constants,
                (false, Target::Motion(_)) => &[],
                (false, _) => &constants[..1],
            },
            ..Default::default()
        };
        let compare = match (is_surface, depth_order) {
            (false, _) => wgpu::CompareFunction::Always,
            (true, Depth::Reversed) => wgpu::CompareFunction::Greater,
            (true, Depth::Standard) => wgpu::CompareFunction::Less,
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
                depth_write_enabled: Some(is_surface),
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
