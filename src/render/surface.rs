//! What the passes that draw plants share: the target, the bindings, and how a pass becomes a pipeline.

use super::{buffers::buffer, effect_buffers::ShadowMap};
use crate::effects::Effects;

/// What the passes draw into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TargetFormat {
    /// Colour format. Into one that is not sRGB the passes write sRGB-encoded bytes themselves.
    pub color: wgpu::TextureFormat,
    /// Depth format. Depth is reversed: clear to 0, nearer is greater.
    pub depth: wgpu::TextureFormat,
    /// Samples in a pixel, at most 16. With more than one, alpha chooses how many of them a leaf covers (alpha to coverage).
    pub samples: u32,
}

/// What a pass draws into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// A picture.
    Picture(TargetFormat),
    /// The shadow map: depth alone, less is nearer to the sun.
    Shadow,
    /// Motion vectors: two numbers a pixel.
    Motion(TargetFormat),
}

/// What leaves look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coloring {
    /// Themselves, lit.
    #[default]
    Picture,
    /// Each in a colour of its own.
    Flat,
    /// From blue for the leaf that stays longest to orange for the one that goes first.
    PruneOrder,
    /// Edges of triangles, each leaf in a colour of its own. Needs `Features::POLYGON_MODE_LINE`; [`Flat`](Self::Flat)
    /// without it.
    Wire,
}

impl Coloring {
    /// The number by which shaders know it.
    pub(super) const fn number(self) -> u32 {
        match self {
            Self::Picture => 0,
            Self::Flat | Self::Wire => 1,
            Self::PruneOrder => 2,
        }
    }

    pub(super) fn polygon_mode(self, device: &wgpu::Device) -> wgpu::PolygonMode {
        let has_lines = device.features().contains(wgpu::Features::POLYGON_MODE_LINE);
        if self == Self::Wire && has_lines { wgpu::PolygonMode::Line } else { wgpu::PolygonMode::Fill }
    }
}

/// One plant on screen, as the shaders read it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct InstanceRecord {
    /// From local space (plant space moved to the middle of the plant) to clip space.
    pub clip_from_local: [[f32; 4]; 4],
    /// The camera in local space.
    pub eye_local: [f32; 3],
    /// Fraction of the active count.
    pub fraction: f32,
    /// Unit vector towards the sun, as local space sees it.
    pub sun_local: [f32; 3],
    /// Whole leaves of the active count.
    pub active_count: u32,
    /// Unit vector upwards, as local space sees it.
    pub up_local: [f32; 3],
    /// One past the last index of the last leaf drawn.
    pub index_end: u32,
    /// First of this plant's own drawn scales, or [`NO_SCALES`].
    pub first_scale: u32,
    /// The first leaf that may not be wholly there.
    pub first_partial: u32,
    /// Leaves to draw.
    pub drawn: u32,
    /// How many leaves come and go at once.
    pub window: f32,
    /// Factor on every leaf's drawn scale.
    pub leaf_scale: f32,
    /// Number of the record that tells where the plant was in the frame before; 0 where no motion vectors are drawn.
    pub before: u32,
    /// How far the picture is shifted, in clip space.
    pub jitter: [f32; 2],
}

/// The plant keeps no drawn scales of its own: the timeline tells them.
pub const NO_SCALES: u32 = u32::MAX;

/// Indices of one run: what one instance of a draw covers. Two-triangle leaves go 64 to a run.
pub const RUN_INDICES: u32 = 384;

/// Bindings of a model (group 0), of a frame (group 1) and of the effects that have buffers (group 2): contrast at 0, wind
/// at 1, shadow from 2.
pub(super) fn layouts(device: &wgpu::Device, effects: &Effects) -> Vec<wgpu::BindGroupLayout> {
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let storage = buffer_binding(wgpu::BufferBindingType::Storage { read_only: true });
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let model = [
        (0, fragment, uniform),
        (1, fragment, storage),
        (2, fragment, texture),
        (3, fragment, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        (4, vertex, storage),
        (5, vertex, storage),
        (6, vertex, storage),
        (7, vertex, storage),
    ];
    let frame = [(0, vertex | fragment, storage), (1, vertex, storage)];
    let mut of_effects = Vec::new();
    if effects.contrast.is_some() {
        of_effects.push((TONES, fragment, storage));
    }
    if effects.wind.is_some() {
        of_effects.push((SWAYS, vertex, storage));
    }
    let mut layouts = vec![layout(device, "foliage model", &model), layout(device, "foliage frame", &frame)];
    if effects.shadow.is_some() {
        of_effects.push((LIGHTS, fragment, storage));
        of_effects.extend(MAP_BINDINGS);
    }
    if !of_effects.is_empty() {
        layouts.push(layout(device, "foliage effects", &of_effects));
    }
    layouts
}

/// Bindings of the effects.
pub(super) const TONES: u32 = 0;
pub(super) const SWAYS: u32 = 1;
pub(super) const LIGHTS: u32 = 2;
pub(super) const SHADOW_MAP: u32 = 3;
pub(super) const SHADOW_SAMPLER: u32 = 4;

const MAP_BINDINGS: [(u32, wgpu::ShaderStages, wgpu::BindingType); 2] = [
    (
        SHADOW_MAP,
        wgpu::ShaderStages::FRAGMENT,
        wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    ),
    (SHADOW_SAMPLER, wgpu::ShaderStages::FRAGMENT, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison)),
];

/// Bindings of the shadow map alone.
pub(super) fn map_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    layout(device, "shadow map", &MAP_BINDINGS)
}

pub(super) fn buffer_binding(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A uniform buffer of `bytes` with bindings of its own.
pub(super) fn uniform(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    bytes: usize,
) -> (wgpu::BindGroupLayout, wgpu::Buffer, wgpu::BindGroup) {
    let layout = layout(device, label, &[(0, visibility, buffer_binding(wgpu::BufferBindingType::Uniform))]);
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let buffer = buffer(device, label, usage, bytes as u64);
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    });
    (layout, buffer, bindings)
}

pub(super) fn layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entry = |&(binding, visibility, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = bindings.iter().map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// How one pass becomes a pipeline.
pub(super) struct PassDescription<'a> {
    pub(super) name: &'a str,
    pub(super) wgsl: String,
    /// Of the vertex and of the fragment shader.
    pub(super) entry_points: [&'a str; 2],
    pub(super) layouts: Vec<Option<&'a wgpu::BindGroupLayout>>,
    pub(super) vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// Depth is tested and written, alpha covers samples, and leaves look like this; `None` for what lies behind.
    pub(super) surface: Option<Coloring>,
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
        let coloring = self.surface.unwrap_or_default();
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
        // Coverage goes to samples, not to the target's alpha.
        let write_mask = if is_surface { wgpu::ColorWrites::COLOR } else { wgpu::ColorWrites::ALL };
        let compare = match (is_surface, color) {
            (false, _) => wgpu::CompareFunction::Always,
            (true, Some(_)) => wgpu::CompareFunction::Greater,
            (true, None) => wgpu::CompareFunction::Less,
        };
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
            primitive: wgpu::PrimitiveState { polygon_mode: coloring.polygon_mode(device), ..Default::default() },
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
