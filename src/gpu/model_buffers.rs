//! GPU buffers of a model: uploaded once, read by any number of instances at any active count.
//!
//! Positions are relative to the plant's centre (*local space*), so that the precision of `f32`
//! does not depend on where a file places the plant. All textures of a model are layers of one
//! array, scaled to one size.

use super::{buffers::filled, impostor_buffers::ImpostorBuffers, texture_layers::Layers};
use crate::{
    Error, Result,
    draw::{
        packed::Packed,
        records::{LookRecord, MaterialRecord, bindings::*},
    },
    model::FoliageModel,
};

/// Bind group of a model, which keeps its buffers and textures alive, and its wood.
pub(super) struct ModelBuffers {
    pub(super) bindings: wgpu::BindGroup,
    pub(super) wood: Option<WoodBuffers>,
    pub(super) impostor: Option<ImpostorBuffers>,
    /// Bind group of its cards of clusters, if it has any, which takes the place of the model's.
    pub(super) cards: Option<wgpu::BindGroup>,
    /// Sizes in bytes of the buffers of the leaves and of the wood.
    bytes: [u64; 2],
    /// Size in bytes of the texture of the limbs.
    pub(super) limb_bytes: u64,
}

/// Vertex and index buffer of a model's wood.
pub(super) struct WoodBuffers {
    pub(super) vertices: WoodVertices,
    /// Indices of triangles, in the order in which they or their stems may be left out.
    pub(super) indices: wgpu::Buffer,
}

/// Vertices of a model's wood.
pub(super) enum WoodVertices {
    /// A vertex buffer.
    Still(wgpu::Buffer),
    /// A bind group that takes the place of the model's.
    Sliding(wgpu::BindGroup),
}

impl ModelBuffers {
    /// Uploads `model`, packed as `packed`.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if the model exceeds the device's limits, [`Error::Unreadable`] for a
    /// damaged texture.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        [layout, sliding_layout, card_layout]: &[wgpu::BindGroupLayout; 3],
        sampler: &wgpu::Sampler,
        model: &FoliageModel,
        packed: &Packed,
    ) -> Result<Self> {
        let layers = Layers::new(device, model)?;
        let materials: Vec<MaterialRecord> =
            (0..).zip(&model.materials).map(|(i, material)| layers.material(i, material)).collect();
        let looks: Vec<LookRecord> = packed.looks.iter().map(|look| layers.look(look)).collect();
        let fill = Fill { device };
        let buffers = [
            (CROWN, fill.buffer("crown", wgpu::BufferUsages::UNIFORM, &[packed.crown])?),
            (MATERIALS, fill.storage("materials", &materials)?),
            (PACKING, fill.buffer("packing", wgpu::BufferUsages::UNIFORM, &[packed.packing])?),
            (LEAF_CORNERS, fill.storage("leaf corners", &packed.corners)?),
            (LEAVES, fill.storage("leaves", &packed.leaves)?),
            (EVENTS, fill.storage("timeline events", &packed.events)?),
            (LOOKS, fill.storage("looks", &looks)?),
            (EXTRAS, fill.storage("extras of leaves", &packed.extras)?),
        ];
        let textures = layers.upload(device, queue);
        let limbs = packed.limbs.as_ref().map(|limbs| limb_texture(device, queue, limbs));
        let resources = [
            (TEXTURES, wgpu::BindingResource::TextureView(&textures)),
            (SAMPLER, wgpu::BindingResource::Sampler(sampler)),
        ];
        let group =
            |label, layout, buffers: &[&(u32, wgpu::Buffer)], resources: &[(u32, wgpu::BindingResource<'_>)]| {
                let of_buffers = buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
                let resources = resources.iter().cloned();
                let limbs = limbs.iter().map(|view| (LIMBS, wgpu::BindingResource::TextureView(view)));
                let entries = of_buffers.chain(resources).chain(limbs);
                let entries: Vec<_> =
                    entries.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
                device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
            };
        let bindings = group("foliage model", layout, &buffers.iter().collect::<Vec<_>>(), &resources);
        let slides = |wood: &[(u32, wgpu::Buffer); 2]| {
            let shared = buffers.iter().filter(|(binding, _)| [CROWN, MATERIALS, PACKING, LOOKS].contains(binding));
            group("foliage wood", sliding_layout, &shared.chain(wood).collect::<Vec<_>>(), &resources)
        };
        let cards = (!packed.cards.records.is_empty()).then(|| {
            let cards = (CARDS, fill.storage("cards of clusters", &packed.cards.records)?);
            let texels = (CARD_TEXELS, fill.storage("pictures of clusters", &packed.cards.texels)?);
            let shared = buffers.iter().filter(|(binding, _)| [CROWN, EVENTS].contains(binding));
            Ok(group("foliage cards", card_layout, &shared.chain([&cards, &texels]).collect::<Vec<_>>(), &[]))
        });
        let wood = wood(&fill, packed, slides)?;
        let limb_bytes = packed.limbs.as_ref().map_or(0, |limbs| size_of_val(&limbs.0[..]) as u64);
        Ok(Self {
            bindings,
            wood,
            impostor: None,
            cards: cards.transpose()?,
            bytes: packed.bytes(materials.len()),
            limb_bytes,
        })
    }

    /// Size in bytes of the impostor's pages.
    pub(super) fn impostor_bytes(&self) -> u64 {
        self.impostor.as_ref().map_or(0, |impostor| impostor.bytes)
    }

    /// Size in bytes of the buffers of the leaves and of the wood.
    pub(super) fn bytes(&self) -> [u64; 2] {
        self.bytes
    }
}

/// Uploads texels of limbs.
fn limb_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (texels, [width, height]): &(Vec<[u32; 4]>, [u32; 2]),
) -> wgpu::TextureView {
    let (width, height) = (*width, *height);
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("limbs"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let texel = size_of::<[u32; 4]>() as u32;
    let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(texel * width), rows_per_image: None };
    queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(texels), rows, size);
    texture.create_view(&Default::default())
}

/// Uploads the wood; `slides` binds vertices that slide and their stems.
fn wood(
    fill: &Fill<'_>,
    packed: &Packed,
    slides: impl Fn(&[(u32, wgpu::Buffer); 2]) -> wgpu::BindGroup,
) -> Result<Option<WoodBuffers>> {
    if packed.wood_indices.is_empty() {
        return Ok(None);
    }
    let vertices = if packed.sliding.is_empty() {
        WoodVertices::Still(fill.buffer("wood vertices", wgpu::BufferUsages::VERTEX, &packed.wood_vertices)?)
    } else {
        let vertices = (WOOD, fill.storage("wood vertices", &packed.sliding)?);
        WoodVertices::Sliding(slides(&[vertices, (STEMS, fill.storage("stems", &packed.stems)?)]))
    };
    Ok(Some(WoodBuffers {
        vertices,
        indices: fill.buffer("wood indices", wgpu::BufferUsages::INDEX, &packed.wood_indices)?,
    }))
}

/// Creates filled buffers within the device's limits.
struct Fill<'a> {
    device: &'a wgpu::Device,
}

impl Fill<'_> {
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
            return Err(Error::TooLarge { what: format!("size in bytes of {label}"), value, limit, fix });
        }
        // A binding must not be empty.
        let nothing = [T::zeroed()];
        let contents = bytemuck::cast_slice(if contents.is_empty() { &nothing } else { contents });
        Ok(filled(self.device, label, usage, contents))
    }
}
