//! What a renderer has created.

use crate::draw::look::Variant;

/// Pipelines and buffers that a renderer has created.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Diagnostics {
    /// Number of loaded models.
    pub models: usize,
    /// Total size in bytes of the models' buffers: of leaves with their timelines, and of wood.
    /// What both need, such as materials and looks, counts as leaves; textures are not counted.
    pub model_bytes: [u64; 2],
    /// Total size in bytes of the limbs of the models, which the wind moves; 0 without wind.
    pub limb_bytes: u64,
    /// Total size in bytes of the models' impostors; 0 unless the look hands plants over.
    pub impostor_bytes: u64,
    /// Number of frames that live impostors have.
    pub live_frames: u32,
    /// Number of pipelines that draw impostors.
    pub impostor_pipelines: usize,
    /// Variants of the leaf pass that have pipelines.
    pub leaf_variants: Vec<Variant>,
    /// Variants of the wood pass that have pipelines.
    pub wood_variants: Vec<Variant>,
    /// Names of the passes other than leaves and wood.
    pub passes: Vec<&'static str>,
    /// Labels of the effect buffers and textures.
    pub effect_buffers: Vec<&'static str>,
    /// Total size in bytes of the effect buffers and textures.
    pub effect_bytes: u64,
    /// Number of drawn scales that plants keep, and the capacity of their buffer in scales.
    pub scales: [u32; 2],
}
