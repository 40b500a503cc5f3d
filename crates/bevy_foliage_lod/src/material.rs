//! The material of foliage: Bevy's own, whose vertices follow the model's timeline and the wind.

use bevy::{
    asset::{Asset, Handle, uuid_handle},
    image::Image,
    math::Vec3,
    mesh::{Mesh, MeshVertexAttribute, MeshVertexBufferLayoutRef, VertexAttributeDescriptor, VertexFormat},
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline, StandardMaterial},
    reflect::TypePath,
    render::{
        render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
        storage::ShaderBuffer,
    },
    shader::{Shader, ShaderDefVal, ShaderRef},
};
use foliage_lod::draw::shaders::engine_parts;

/// A [`StandardMaterial`] for the leaves or the wood of plants.
pub type FoliageMaterial = ExtendedMaterial<StandardMaterial, FoliageExtension>;

/// Vertex attribute of leaves: the number of the leaf.
pub const ATTRIBUTE_LEAF: MeshVertexAttribute =
    MeshVertexAttribute::new("Foliage_Leaf", 0x666f_6c69_6c65_6166, VertexFormat::Uint32);
/// Vertex attribute of wood: the number of the stem.
pub const ATTRIBUTE_STEM: MeshVertexAttribute =
    MeshVertexAttribute::new("Foliage_Stem", 0x666f_6c69_7374_656d, VertexFormat::Uint32);

/// The shader of all passes.
pub(crate) const SHADER: Handle<Shader> = uuid_handle!("5f3c8a5e-31a5-4a52-9f6d-0c1b8c6f7d21");

/// The shader, assembled from the library's functions and the plug-in's own.
pub(crate) fn shader() -> Shader {
    let source = format!("{}\n{}", include_str!("foliage.wesl"), engine_parts());
    Shader::from_wesl(source, "embedded://bevy_foliage_lod/foliage.wesl")
}

/// What a plant's materials need beyond [`StandardMaterial`]. Built by
/// [`FoliageAsset`](crate::FoliageAsset).
#[derive(Asset, AsBindGroup, TypePath, Debug, Clone)]
pub struct FoliageExtension {
    /// Pivot, texture rectangle and first event of each leaf.
    #[storage(100, read_only, visibility(vertex))]
    pub(crate) leaves: Handle<ShaderBuffer>,
    /// Events of the timeline.
    #[storage(101, read_only, visibility(vertex))]
    pub(crate) events: Handle<ShaderBuffer>,
    /// Counts of all plants, by mesh tag.
    #[storage(102, read_only, visibility(vertex))]
    pub(crate) plants: Handle<ShaderBuffer>,
    /// The wind's motion of all plants: two records a plant, this frame's and the last one's.
    #[storage(103, read_only, visibility(vertex))]
    pub(crate) sways: Handle<ShaderBuffer>,
    /// The limbs that the wind moves.
    #[texture(104, sample_type = "u_int", visibility(vertex))]
    pub(crate) limbs: Handle<Image>,
    /// The crown.
    #[uniform(105, visibility(vertex, fragment))]
    pub(crate) crown: Crown,
}

/// The crown of a model, as the shader reads it.
#[derive(ShaderType, Debug, Clone, Copy)]
pub(crate) struct Crown {
    /// Middle of the box around all leaves, in local space.
    pub(crate) center: Vec3,
    /// Exponent of the tone of enlarged leaves.
    pub(crate) tone: f32,
    /// Reciprocals of half of the box's sides.
    pub(crate) inverse_half_size: Vec3,
    /// Alpha of the full texture from which on a texel is opaque; 0 if all are.
    pub(crate) cutoff: f32,
    /// Mean colour of the leaves, linear.
    pub(crate) mean: Vec3,
}

impl MaterialExtension for FoliageExtension {
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
        let is_leaf = layout.0.contains(ATTRIBUTE_LEAF);
        // Bevy takes equal keys and vertex layouts for equal pipelines, whatever they are for.
        let part = if is_leaf { ATTRIBUTE_LEAF.at_shader_location(4) } else { ATTRIBUTE_STEM.at_shader_location(5) };
        // One layout for all passes, whose own differ.
        let attributes = [
            Mesh::ATTRIBUTE_POSITION.at_shader_location(0),
            Mesh::ATTRIBUTE_NORMAL.at_shader_location(1),
            Mesh::ATTRIBUTE_UV_0.at_shader_location(2),
            Mesh::ATTRIBUTE_COLOR.at_shader_location(3),
            part,
        ];
        lay_out(descriptor, layout, &attributes, is_leaf.then_some("FOLIAGE_LEAVES"))
    }
}

/// Sets the vertex attributes of a pipeline and what its shaders know: the number of samples, and
/// one definition more.
pub(crate) fn lay_out(
    descriptor: &mut RenderPipelineDescriptor,
    layout: &MeshVertexBufferLayoutRef,
    attributes: &[VertexAttributeDescriptor],
    definition: Option<&'static str>,
) -> Result<(), SpecializedMeshPipelineError> {
    descriptor.vertex.buffers = vec![layout.0.get_layout(attributes)?];
    let samples = descriptor.multisample.count;
    let fragment = descriptor.fragment.as_mut().map(|fragment| &mut fragment.shader_defs);
    for defs in [Some(&mut descriptor.vertex.shader_defs), fragment].into_iter().flatten() {
        defs.push(ShaderDefVal::UInt("FOLIAGE_SAMPLES".into(), samples));
        defs.extend(definition.map(ShaderDefVal::from));
    }
    Ok(())
}
