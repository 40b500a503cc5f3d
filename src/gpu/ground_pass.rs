//! Ground pass: draws ground with heights in the picture, the shadow map and the motion vectors.

use super::{
    bindings::{buffer_binding, layout, map_layout},
    buffers::{buffer, grow},
    landscape_pass::LandscapePass,
    pipeline::{PassDescription, Surface, Target},
};
use crate::{
    Depth, Error, Result,
    draw::{
        ground::GroundPages,
        instance::{Frame, GroundCounts},
        landscape::REACH,
        look::Look,
        mips::SrgbTable,
        records::{GroundRecord, bindings},
        shaders,
    },
    material::Pixels,
    terrain::{GroundMesh, GroundPoint, Terrain},
};
use glam::DMat4;
use half::f16;
use std::{collections::HashMap, sync::Arc};

/// Attributes of a [`GroundPoint`].
const POINT: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x2];

/// Pipelines, buffers and pictures of ground with heights.
pub(super) struct GroundPass {
    terrain: Arc<Terrain>,
    mesh: GroundMesh,
    points: wgpu::Buffer,
    record: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    bindings: wgpu::BindGroup,
    pipelines: HashMap<(Target, Depth), wgpu::RenderPipeline>,
}

impl GroundPass {
    /// # Errors
    /// [`Error::TooLarge`] for pictures that are larger than the device's largest texture.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue, terrain: Arc<Terrain>) -> Result<Self> {
        use wgpu::{BufferUsages as Usage, ShaderStages as Stages};
        let pages = GroundPages::new(&terrain);
        let colors: Vec<Pixels> = match &pages.colors {
            Some(mips) => mips.premultiplied(&SrgbTable::new()).collect(),
            None => vec![Pixels { width: 1, height: 1, rgba: vec![255; 4] }],
        };
        let sides = pages.slopes[0].size.into_iter().chain([colors[0].width, colors[0].height]);
        let (value, limit) = (sides.max().unwrap_or(0).into(), device.limits().max_texture_dimension_2d.into());
        if value > limit {
            let (what, fix) = ("texels on a side of a picture of the ground".into(), "make the picture smaller".into());
            return Err(Error::TooLarge { what, value, limit, fix });
        }
        let picture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
        let (vertex, fragment) = (Stages::VERTEX, Stages::FRAGMENT);
        let entries = [
            (bindings::GROUND, vertex | fragment, uniform),
            (bindings::GROUND_COLORS, fragment, picture),
            (bindings::GROUND_SLOPES, fragment, picture),
            (bindings::GROUND_SAMPLER, fragment, sampler),
        ];
        let layout = layout(device, "ground", &entries);
        let record = buffer(device, "ground", Usage::UNIFORM | Usage::COPY_DST, size_of::<GroundRecord>() as u64);
        let color_levels = colors.iter().map(|level| ([level.width, level.height], &level.rgba[..]));
        let slopes: Vec<([u32; 2], Vec<u16>)> = pages
            .slopes
            .iter()
            .map(|level| {
                (level.size, level.texels.iter().flat_map(|s| [s.x, s.y]).map(|x| f16::from_f32(x).to_bits()).collect())
            })
            .collect();
        let slope_levels = slopes.iter().map(|(size, texels)| (*size, bytemuck::cast_slice(texels)));
        let views = [
            uploaded(device, queue, wgpu::TextureFormat::Rgba8UnormSrgb, color_levels),
            uploaded(device, queue, wgpu::TextureFormat::Rg16Float, slope_levels),
        ];
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("ground"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("ground"),
            layout: &layout,
            entries: &[
                entry(bindings::GROUND, record.as_entire_binding()),
                entry(bindings::GROUND_COLORS, wgpu::BindingResource::TextureView(&views[0])),
                entry(bindings::GROUND_SLOPES, wgpu::BindingResource::TextureView(&views[1])),
                entry(bindings::GROUND_SAMPLER, wgpu::BindingResource::Sampler(&sampler)),
            ],
        });
        Ok(Self {
            terrain,
            mesh: GroundMesh::default(),
            points: buffer(device, "ground points", Usage::VERTEX | Usage::COPY_DST, size_of::<GroundPoint>() as u64),
            record,
            layout,
            bindings,
            pipelines: HashMap::new(),
        })
    }

    /// Makes and uploads the triangles for a frame, and compiles missing pipelines for `targets`,
    /// each with its depth convention.
    pub(super) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        look: &Look,
        landscape: &LandscapePass,
        targets: impl Iterator<Item = (Target, Depth)>,
    ) -> GroundCounts {
        let camera = frame.camera;
        let reach = REACH * look.ground.map_or(0.0, |ground| ground.haze);
        if self.mesh.update(&self.terrain, &camera, reach) {
            grow(device, &mut self.points, size_of_val(&self.mesh.points[..]) as u64);
            queue.write_buffer(&self.points, 0, bytemuck::cast_slice(&self.mesh.points));
        }
        let from_eye = |clip_from_world: DMat4| {
            (clip_from_world * DMat4::from_translation(camera.eye)).as_mat4().to_cols_array_2d()
        };
        let (before, _) = frame.before.unwrap_or((camera, frame.seconds));
        let record = GroundRecord {
            clip_from_eye: from_eye(frame.jittered().clip_from_world),
            clip_from_eye_before: from_eye(before.clip_from_world),
            jitter: frame.jitter().as_vec2().to_array(),
            has_colors: u32::from(self.terrain.colors().is_some()),
            padding: 0,
        };
        queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
        for (target, depth) in targets {
            let pipeline = || pipeline(device, look, landscape.layout(), &self.layout, target, depth);
            self.pipelines.entry((target, depth)).or_insert_with(pipeline);
        }
        GroundCounts::of(&self.mesh)
    }

    /// Draws the prepared triangles into a kind of target. The caller sets the bind group of the
    /// shadow map, if the picture has one.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>, target: Target, depth: Depth, behind: &LandscapePass) {
        let Some(pipeline) = self.pipelines.get(&(target, depth)) else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, behind.bindings(), &[]);
        pass.set_bind_group(1, &self.bindings, &[]);
        pass.set_vertex_buffer(0, self.points.slice(..));
        pass.draw(0..self.mesh.points.len() as u32, 0..1);
    }
}

fn pipeline(
    device: &wgpu::Device,
    look: &Look,
    landscape: &wgpu::BindGroupLayout,
    own: &wgpu::BindGroupLayout,
    target: Target,
    depth: Depth,
) -> wgpu::RenderPipeline {
    let map = map_layout(device);
    let mut layouts = vec![Some(landscape), Some(own)];
    let entry_points = match target {
        Target::Picture(_) => {
            layouts.extend(look.effects.shadow.map(|_| Some(&map)));
            ["ground_corner", "ground_color"]
        }
        Target::Shadow => ["ground_towards_sun", "cast_by_ground"],
        Target::Motion(_) => ["ground_motion", "motion_of_ground"],
    };
    let points = wgpu::VertexBufferLayout {
        array_stride: size_of::<GroundPoint>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &POINT,
    };
    let wgsl = shaders::ground_pass(look);
    let (vertex_buffers, surface) = (&[Some(points)], Surface::Ground(depth));
    PassDescription { name: "ground_pass", wgsl, entry_points, layouts, vertex_buffers, surface }
        .pipeline(device, target)
}

/// Creates a texture with the given levels, each of a size and with texels of the format.
fn uploaded<'a>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    format: wgpu::TextureFormat,
    levels: impl ExactSizeIterator<Item = ([u32; 2], &'a [u8])>,
) -> wgpu::TextureView {
    let mip_level_count = levels.len() as u32;
    let mut levels = levels.peekable();
    let [width, height] = levels.peek().map_or([1, 1], |(size, _)| *size);
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("ground"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (mip_level, ([width, height], texels)) in (0..).zip(levels) {
        let (origin, aspect) = (wgpu::Origin3d::ZERO, wgpu::TextureAspect::All);
        let destination = wgpu::TexelCopyTextureInfo { texture: &texture, mip_level, origin, aspect };
        let bytes_per_row = Some(4 * width);
        let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        queue.write_texture(destination, texels, rows, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
    }
    texture.create_view(&Default::default())
}
