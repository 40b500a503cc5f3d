//! A model on the GPU: uploaded once, read by any number of instances at any active count.
//!
//! Positions are relative to the middle of the plant (*local space*), so that `f32` keeps its digits wherever a file put
//! the plant. All textures of a model are layers of one array, scaled to one size.

use super::{buffers::filled, light::Lighting, stems::Stems, texture_layers::Layers};
use crate::{
    Error, Result,
    bounds::Aabb,
    leaf::Vertex,
    model::{FoliageModel, Timeline},
};
use glam::{DVec3, Vec3};

/// One vertex of a leaf as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LeafVertex {
    /// Local space.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Linear colour factor.
    pub color: [f32; 3],
    /// The leaf that it belongs to.
    pub leaf: u32,
}

/// One leaf as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LeafRecord {
    /// Local space.
    pub pivot: [f32; 3],
    /// Index into the materials.
    pub material: u32,
    /// First of the leaf's events in the timeline.
    pub first_event: u32,
    /// One past the last.
    pub end_event: u32,
}

/// One event of the timeline as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Event {
    /// The leaf that goes.
    pub leaf: u32,
    /// The drawn scale of the event's owner once it is gone.
    pub scale: f32,
}

/// One vertex of the wood as `wood_pass.wgsl` takes it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct WoodVertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 3],
    material: u32,
}

impl WoodVertex {
    /// How a pipeline reads it.
    pub(super) const ATTRIBUTES: [wgpu::VertexAttribute; 5] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Float32x3, 4 => Uint32];
}

/// One material as `surface.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MaterialRecord {
    /// Linear colour factor.
    pub base_color: [f32; 4],
    /// Alpha from which a texel covers; 0 where every one does.
    pub cutoff: f32,
    /// Layer of the texture array.
    pub layer: u32,
    /// Wrap modes along u and v, by number.
    pub wrap: [u32; 2],
    /// 1 where both sides are drawn.
    pub is_two_sided: u32,
    /// Up to a multiple of 16 bytes.
    pub padding: [u32; 3],
}

/// Where the crown is, as `surface.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct CrownRecord {
    /// Middle of the box around all leaves, local space.
    pub center_local: [f32; 3],
    /// Up to a multiple of 16 bytes.
    pub padding: f32,
    /// One over half the box's size.
    pub inverse_half_size: [f32; 3],
    /// Up to a multiple of 16 bytes.
    pub end: f32,
}

/// A model's buffers, textures and bindings.
pub(super) struct ModelBuffers {
    pub(super) bindings: wgpu::BindGroup,
    pub(super) wood: Option<WoodBuffers>,
}

/// What draws a model's wood.
pub(super) struct WoodBuffers {
    pub(super) vertices: wgpu::Buffer,
    /// Thickest stems first.
    pub(super) indices: wgpu::Buffer,
}

impl ModelBuffers {
    /// Uploads `model`.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for a model beyond the device's limits, [`Error::Unreadable`] for a damaged texture.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
        model: &FoliageModel,
        stems: &Stems,
    ) -> Result<Self> {
        let center = model.sphere().center();
        let layers = Layers::new(device, model)?;
        let crown = crown_record(model, center);
        let materials: Vec<MaterialRecord> =
            (0..).zip(&model.materials).map(|(i, material)| layers.material(i, material)).collect();
        let (leaves, events) = leaf_records(model, center);
        let vertices = leaf_vertices(model, center);
        let upload = Upload { device };
        let buffers = [
            upload.buffer("crown", wgpu::BufferUsages::UNIFORM, &[crown])?,
            upload.storage("materials", &materials)?,
            upload.storage("leaf vertices", &vertices)?,
            upload.storage("leaf indices", &model.indices)?,
            upload.storage("leaves", &leaves)?,
            upload.storage("timeline events", &events)?,
        ];
        let textures = layers.upload(device, queue);
        let [crown, materials, rest @ ..] = &buffers;
        let mut resources = vec![crown.as_entire_binding(), materials.as_entire_binding()];
        resources.extend([wgpu::BindingResource::TextureView(&textures), wgpu::BindingResource::Sampler(sampler)]);
        resources.extend(rest.iter().map(|buffer| buffer.as_entire_binding()));
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("foliage model"),
            layout,
            entries: &entries,
        });
        Ok(Self { bindings, wood: wood(&upload, model, center, stems)? })
    }
}

fn local(position: [f32; 3], center: DVec3) -> [f32; 3] {
    (Vec3::from(position).as_dvec3() - center).as_vec3().to_array()
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

fn leaf_vertices(model: &FoliageModel, center: DVec3) -> Vec<LeafVertex> {
    let vertices = |(number, leaf): (u32, &crate::model::Leaf)| {
        let vertices = model.vertices[leaf.geometry().vertex_range()].iter();
        vertices.map(move |&Vertex { position, normal, uv, color }| LeafVertex {
            position: local(position, center),
            normal,
            uv,
            color: rgb(color),
            leaf: number,
        })
    };
    (0..).zip(&model.leaves).flat_map(vertices).collect()
}

fn leaf_records(model: &FoliageModel, center: DVec3) -> (Vec<LeafRecord>, Vec<Event>) {
    let timeline = Timeline::new(model);
    let leaves = model.leaves.iter().zip(timeline.starts().windows(2)).map(|(leaf, events)| LeafRecord {
        pivot: local(leaf.pivot, center),
        material: leaf.material,
        first_event: events[0],
        end_event: events[1],
    });
    let events = timeline.events().iter().zip(timeline.scales()).map(|(&leaf, &scale)| Event { leaf, scale });
    (leaves.collect(), events.collect())
}

fn crown_record(model: &FoliageModel, center: DVec3) -> CrownRecord {
    let crown = Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position));
    let light = super::light::Light::new(&crown, center, &Lighting::default());
    CrownRecord {
        center_local: light.crown_center_from_eye.to_array(),
        padding: 0.0,
        inverse_half_size: light.inverse_half_size.to_array(),
        end: 0.0,
    }
}

/// The wood with a material at each vertex: vertices that parts of several materials share are there once for each.
fn wood(upload: &Upload<'_>, model: &FoliageModel, center: DVec3, stems: &Stems) -> Result<Option<WoodBuffers>> {
    let mut copies = std::collections::HashMap::new();
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for &(index, material) in &stems.corners {
        let copy = *copies.entry((index, material)).or_insert_with(|| {
            let Vertex { position, normal, uv, color } = model.wood.vertices[index as usize];
            vertices.push(WoodVertex { position: local(position, center), normal, uv, color: rgb(color), material });
            vertices.len() as u32 - 1
        });
        indices.push(copy);
    }
    if indices.is_empty() {
        return Ok(None);
    }
    Ok(Some(WoodBuffers {
        vertices: upload.buffer("wood vertices", wgpu::BufferUsages::VERTEX, &vertices)?,
        indices: upload.buffer("wood indices", wgpu::BufferUsages::INDEX, &indices)?,
    }))
}

/// Fills new buffers, within the device's limits.
struct Upload<'a> {
    device: &'a wgpu::Device,
}

impl Upload<'_> {
    fn storage<T: bytemuck::Pod>(&self, label: &str, contents: &[T]) -> Result<wgpu::Buffer> {
        self.buffer(label, wgpu::BufferUsages::STORAGE, contents)
    }

    fn buffer<T: bytemuck::Pod>(&self, label: &str, usage: wgpu::BufferUsages, contents: &[T]) -> Result<wgpu::Buffer> {
        let limits = self.device.limits();
        let limit = match usage {
            wgpu::BufferUsages::STORAGE => limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            _ => limits.max_buffer_size,
        };
        let value = size_of_val(contents) as u64;
        if value > limit {
            let fix = "use a plant with fewer or simpler leaves".into();
            return Err(Error::TooLarge { what: format!("bytes of {label}"), value, limit, fix });
        }
        // A binding is never empty.
        let nothing = [T::zeroed()];
        let contents = bytemuck::cast_slice(if contents.is_empty() { &nothing } else { contents });
        Ok(filled(self.device, label, usage, contents))
    }
}
