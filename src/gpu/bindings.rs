//! Bind group layouts.

use super::buffers::buffer;
use crate::draw::{
    look::{Look, Variant},
    records::bindings::*,
};

/// Creates the bind group layouts of a model, of a frame and, if an enabled effect has bindings or
/// there are tints, of the effects.
pub(super) fn layouts(device: &wgpu::Device, look: &Look) -> Vec<wgpu::BindGroupLayout> {
    let effects = &look.effects;
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let storage = buffer_binding(wgpu::BufferBindingType::Storage { read_only: true });
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let [textures, sampler] = TEXTURE_BINDINGS;
    let mut model = vec![
        (CROWN, vertex | fragment, uniform),
        (MATERIALS, fragment, storage),
        (TEXTURES, vertex | fragment, textures),
        (SAMPLER, fragment, sampler),
        (LEAF_CORNERS, vertex, storage),
        (PACKING, vertex, uniform),
        (LEAVES, vertex, storage),
        (EVENTS, vertex, storage),
        (LOOKS, vertex, storage),
        (EXTRAS, vertex, storage),
    ];
    let frame =
        [(INSTANCES, vertex | fragment, storage), (SCALES, vertex, storage), (SHARED, vertex | fragment, uniform)];
    let mut of_effects = Vec::new();
    if effects.contrast.is_some() {
        of_effects.push((TONES, fragment, storage));
    }
    model.extend(limbs(look));
    if effects.wind.is_some() {
        of_effects.push((SWAYS, vertex | fragment, storage));
    }
    if look.has_tints() {
        of_effects.push((TINTS, fragment, storage));
    }
    let mut layouts = vec![layout(device, "foliage model", &model), layout(device, "foliage frame", &frame)];
    if effects.shadow.is_some() {
        of_effects.extend(MAP_BINDINGS);
    }
    if !of_effects.is_empty() {
        layouts.push(layout(device, "foliage effects", &of_effects));
    }
    layouts
}

/// Binding of the limbs of a model, which only the wind moves.
fn limbs(look: &Look) -> Option<(u32, wgpu::ShaderStages, wgpu::BindingType)> {
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    look.effects.wind.map(|_| (LIMBS, wgpu::ShaderStages::VERTEX, texture))
}

/// Array of textures or pages, and its sampler.
const TEXTURE_BINDINGS: [wgpu::BindingType; 2] = [
    wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    },
    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
];

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

/// Creates the layout of a model's impostor, which takes the place of the model's.
pub(super) fn impostor_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let [page, sampler] = TEXTURE_BINDINGS;
    let bindings = [
        (CROWN, vertex | fragment, uniform),
        (IMPOSTOR, vertex | fragment, uniform),
        (COLORS, fragment, page),
        (SURFACES, fragment, page),
        (CLAMPING, fragment, sampler),
    ];
    layout(device, "foliage impostor", &bindings)
}

/// Creates the layout of a model's wood that slides, which takes the place of the model's: vertices
/// read it at random, and with the leaves' buffers there would be too many.
pub(super) fn sliding_layout(device: &wgpu::Device, look: &Look) -> wgpu::BindGroupLayout {
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let storage = buffer_binding(wgpu::BufferBindingType::Storage { read_only: true });
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let [textures, sampler] = TEXTURE_BINDINGS;
    let mut bindings = vec![
        (CROWN, vertex | fragment, uniform),
        (MATERIALS, fragment, storage),
        (TEXTURES, vertex | fragment, textures),
        (SAMPLER, fragment, sampler),
        (PACKING, vertex, uniform),
        (LOOKS, vertex, storage),
        (WOOD, vertex, storage),
        (STEMS, vertex, storage),
    ];
    bindings.extend(limbs(look));
    layout(device, "foliage wood", &bindings)
}

/// Creates the layout of a model's cards of clusters, which takes the place of the model's.
pub(super) fn card_layout(device: &wgpu::Device, look: &Look) -> wgpu::BindGroupLayout {
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let storage = buffer_binding(wgpu::BufferBindingType::Storage { read_only: true });
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let mut bindings = vec![
        (CROWN, vertex | fragment, uniform),
        (EVENTS, vertex, storage),
        (CARDS, vertex | fragment, storage),
        (CARD_TEXELS, fragment, storage),
    ];
    bindings.extend(limbs(look));
    layout(device, "foliage cards", &bindings)
}

/// Creates a layout with only the bindings of the shadow map.
pub(super) fn map_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    layout(device, "shadow map", &MAP_BINDINGS)
}

pub(super) fn buffer_binding(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// Creates a uniform buffer of `bytes` bytes with its own bind group, at binding 0.
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

/// Selects the layouts that the pipeline of a variant binds from `layouts`, the layouts of a
/// renderer.
pub(super) fn bound<'a>(
    layouts: &'a [wgpu::BindGroupLayout],
    look: &Look,
    variant: Variant,
) -> Vec<Option<&'a wgpu::BindGroupLayout>> {
    let count =
        if variant.has_bindings() || look.has_tints() || look.effects.shadow.is_some() { layouts.len() } else { 2 };
    layouts[..count].iter().map(Some).collect()
}

/// Creates the sampler of the textures of models.
pub(super) fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    let repeat = wgpu::AddressMode::Repeat;
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("foliage"),
        address_mode_u: repeat,
        address_mode_v: repeat,
        address_mode_w: repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}
