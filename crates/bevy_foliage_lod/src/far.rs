//! Impostors of far plants, of models that have one.

use crate::{
    asset::Store,
    material::lay_out,
    plants::{PLANTS, SWAYS},
};
use bevy::{
    asset::{Asset, Handle, RenderAssetUsages, uuid_handle},
    image::{Image, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    math::Vec3,
    mesh::{Indices, Mesh, MeshVertexBufferLayoutRef, PrimitiveTopology},
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline, StandardMaterial},
    prelude::AlphaMode,
    reflect::TypePath,
    render::{
        render_resource::{
            AsBindGroup, Extent3d, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError,
            TextureDataOrder, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension,
        },
        storage::ShaderBuffer,
    },
    shader::{Shader, ShaderRef},
};
use foliage_lod::{
    draw::{PageLevel, impostor_levels, records::ImpostorRecord, shaders::impostor_parts},
    model::Impostor,
};

/// A [`StandardMaterial`] for the impostor of a model.
pub type FarMaterial = ExtendedMaterial<StandardMaterial, FarExtension>;

/// The shader of all passes.
pub(crate) const SHADER: Handle<Shader> = uuid_handle!("d6a4b7f0-6a86-4f43-9e1c-7c2f80b5a3d9");

/// The shader, assembled from the library's functions and the plug-in's own.
pub(crate) fn shader() -> Shader {
    let source = format!("{}\n{}", include_str!("far.wesl"), impostor_parts());
    Shader::from_wesl(source, "embedded://bevy_foliage_lod/far.wesl")
}

/// What the material of an impostor needs beyond [`StandardMaterial`].
#[derive(Asset, AsBindGroup, TypePath, Debug, Clone)]
pub struct FarExtension {
    #[uniform(100, visibility(vertex, fragment))]
    record: Record,
    #[storage(101, read_only, visibility(vertex))]
    plants: Handle<ShaderBuffer>,
    /// Colour and coverage.
    #[texture(102, dimension = "2d_array")]
    #[sampler(104)]
    colors: Handle<Image>,
    /// Mean normal and depth.
    #[texture(103, dimension = "2d_array")]
    surfaces: Handle<Image>,
    /// The wind's motion of all plants, as for leaves.
    #[storage(105, read_only, visibility(vertex, fragment))]
    sways: Handle<ShaderBuffer>,
}

/// An [`ImpostorRecord`].
#[derive(ShaderType, Debug, Clone, Copy)]
struct Record {
    center: Vec3,
    half_side: f32,
    radius: f32,
    texels: f32,
    across: u32,
    is_whole_sphere: u32,
}

/// The mesh and the material of a model's impostor.
pub(crate) fn far_parts(
    impostor: &Impostor,
    center: [f64; 3],
    store: &mut impl Store,
) -> (Handle<Mesh>, Handle<FarMaterial>) {
    let levels = impostor_levels(impostor);
    let record = ImpostorRecord::new(impostor, center);
    let frames = impostor.lattice.frames();
    let page = |format: TextureFormat, of: fn(&PageLevel) -> &Vec<u8>| {
        let side = levels.first().map_or(1, |level| level.side);
        let size = Extent3d { width: side, height: side, depth_or_array_layers: frames };
        let mut image = Image::new_uninit(size, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
        image.data = Some(levels.iter().flat_map(of).copied().collect());
        image.data_order = TextureDataOrder::MipMajor;
        image.texture_descriptor.mip_level_count = levels.len() as u32;
        let dimension = Some(TextureViewDimension::D2Array);
        image.texture_view_descriptor = Some(TextureViewDescriptor { dimension, ..Default::default() });
        image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
            mag_filter: ImageFilterMode::Linear,
            min_filter: ImageFilterMode::Linear,
            mipmap_filter: ImageFilterMode::Linear,
            ..ImageSamplerDescriptor::default()
        });
        image
    };
    let extension = FarExtension {
        record: Record {
            center: record.center.into(),
            half_side: record.half_side,
            radius: record.radius,
            texels: record.texels,
            across: record.across,
            is_whole_sphere: record.is_whole_sphere,
        },
        plants: PLANTS,
        colors: store.put("FarColors".into(), page(TextureFormat::Rgba8UnormSrgb, |level| &level.color)),
        surfaces: store.put("FarSurfaces".into(), page(TextureFormat::Rgba8Unorm, |level| &level.surface)),
        sways: SWAYS,
    };
    let base = StandardMaterial {
        alpha_mode: AlphaMode::Mask(0.5),
        double_sided: true,
        cull_mode: None,
        perceptual_roughness: 0.85,
        reflectance: 0.2,
        ..StandardMaterial::default()
    };
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_indices(Indices::U32(vec![0, 1, 2, 0, 2, 3]))
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.to_vec())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 4])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0_f32; 2]; 4]);
    (store.put("Far".into(), mesh), store.put("FarMaterial".into(), FarMaterial { base, extension }))
}

impl MaterialExtension for FarExtension {
    fn vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn prepass_fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn deferred_vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn deferred_fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn specialize(
        _pipeline: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        layout: &MeshVertexBufferLayoutRef,
        _key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let attributes = [
            Mesh::ATTRIBUTE_POSITION.at_shader_location(0),
            Mesh::ATTRIBUTE_NORMAL.at_shader_location(1),
            Mesh::ATTRIBUTE_UV_0.at_shader_location(2),
        ];
        // Only shadow maps of the sun are drawn so.
        let is_of_sun = descriptor.primitive.unclipped_depth;
        lay_out(descriptor, layout, &attributes, is_of_sun.then_some("FOLIAGE_SUN"))
    }
}
