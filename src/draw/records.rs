//! GPU records: their layout, and the constants that shaders share with Rust.
//!
//! Tests compare each `#[repr(C)]` struct and each binding with the WGSL.

mod wood;

pub use wood::{
    HALF_STEPS, LEAST_HALF, LEAST_WIDTH, PackedWood, SlidingWood, StemRecord, WIDTH_STEPS, WoodSlide, WoodVertex,
};

use crate::model::{Framing, Impostor};
use glam::{DVec3, Vec3};

/// What all plants of one frame share, as `surface.wgsl` reads it.
///
/// *Anchor space* is world space with its origin at the frame's anchor, a point in view.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FrameRecord {
    /// Transform from anchor space to clip space.
    pub clip_from_anchor: [[f32; 4]; 4],
    /// The same transform in the previous frame, from that frame's anchor space.
    pub clip_from_anchor_before: [[f32; 4]; 4],
    /// Transform from anchor space to the sun's clip space.
    pub light_from_anchor: [[f32; 4]; 4],
    /// Position of the eye in anchor space.
    pub eye: [f32; 3],
    /// Number of plants. If motion vectors are drawn, as many records follow: those of the previous
    /// frame.
    pub plants: u32,
    /// Jitter of the picture, in clip space.
    pub jitter: [f32; 2],
    /// Half of the picture's width and height in pixels.
    pub half_size_px: [f32; 2],
}

/// One plant instance, as the shaders read it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct InstanceRecord {
    /// Rows of the transform from local space (plant space with its origin at the plant's centre)
    /// to anchor space (see [`FrameRecord`]).
    pub anchor_from_local: [[f32; 4]; 3],
    /// Integer part of the active count.
    pub active_count: u32,
    /// Fractional part of the active count.
    pub fraction: f32,
    /// Number of leaves that are in transition at once.
    pub window: f32,
    /// Factor applied to every leaf's drawn scale.
    pub leaf_scale: f32,
    /// Index of the first of this plant's own drawn scales, or [`NO_SCALES`].
    pub first_scale: u32,
    /// The first leaf that may be only partly present; of a plant that is its impostor alone, the
    /// instance's seed.
    pub first_partial: u32,
    /// Number of leaves to draw. Within the hand-over to the impostor [`LEAF_BITS`] of it, and
    /// above them the impostor's share of the samples, in 1023rds.
    pub drawn: u32,
    /// Error that the wood is drawn at if its vertices slide; otherwise the least width of a drawn
    /// stem (see [`Levels`](super::Levels)). In local space.
    pub wood_error: f32,
}

/// Value of [`InstanceRecord::first_scale`] for a plant without drawn scales of its own; they come
/// from the timeline.
pub const NO_SCALES: u32 = u32::MAX;

/// Number of quads in one run, which is one instance of a leaf draw.
pub const RUN_QUADS: u32 = 64;

/// Number of corners that a trimmed quad is drawn with; outlines of fewer repeat their last one.
pub const TRIMMED_CORNERS: u32 = 8;

/// Bits of the number of a leaf beside that of a quad of it.
pub const LEAF_BITS: u32 = 22;

/// Value of [`PackingRecord::first_color`], [`PackingRecord::first_look`] and
/// [`LookRecord::outline`] if there are none.
pub const NO_EXTRA: u32 = u32::MAX;

/// Bits of a packed normal for a vector without a direction.
pub const NO_NORMAL: u32 = 0x8080;

/// Mip levels between the part of a texture that a surface shows and the coarsest level that it is
/// sampled at: a quarter of its width, since larger texels mix in what lies beside it.
pub const LEVELS_ACROSS: f32 = 2.0;

/// The mean colour and contrast of one plant, as `contrast.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Tone {
    /// Mean shaded colour of the leaves, linear.
    pub mean: [f32; 3],
    /// Fraction of a colour's distance from the mean that is kept.
    pub kept: f32,
}

/// One vertex of a leaf in an [`Upload`](super::Upload).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LeafVertex {
    /// In local space.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Linear colour factor.
    pub color: [f32; 3],
    /// Leaf that the vertex belongs to.
    pub leaf: u32,
}

/// One leaf in an [`Upload`](super::Upload).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LeafRecord {
    /// In local space.
    pub pivot: [f32; 3],
    /// Index into the materials.
    pub material: u32,
    /// First of the leaf's events in the timeline.
    pub first_event: u32,
    /// One past the leaf's last event.
    pub end_event: u32,
    /// Width and height of the part of the texture that the leaf shows, in texture coordinates.
    pub uv_size: [f32; 2],
    /// Lowest texture coordinates of that part.
    pub uv_low: [f32; 2],
    /// Point of that part that stays in place where the enlarged leaf repeats it (see
    /// [`Growth::tiles`](crate::model::Growth::tiles)), as a fraction; -1 if it does not.
    pub anchor: [f32; 2],
    /// Seed by which partial coverage is spread over samples, like a fraction of 2^32.
    pub seed: u32,
}

/// One corner of a leaf's quad, as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedCorner {
    /// Offset from the pivot along x and y, each a signed 16-bit fraction of [`LookRecord::size`].
    pub offset_xy: u32,
    /// Offset along z, and the normal on an octahedron, two signed 8-bit fractions.
    pub offset_z_normal: u32,
    /// Texture coordinates, unsigned 16-bit fractions of [`LookRecord::uv_size`].
    pub uv: u32,
}

/// One leaf, as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackedLeaf {
    /// Pivot along x and y, in steps from [`LookRecord::origin`], 16 bits each.
    pub pivot_xy: u32,
    /// Pivot along z, and the upper half of the seed by which partial coverage is spread.
    pub pivot_z_seed: u32,
    /// First of the leaf's events in the timeline; they end where the next leaf's begin.
    pub first_event: u32,
    /// Square roots of the colour over the look's, 8 bits each, and the number of the look.
    pub color_look: u32,
}

/// What several leaves or vertices of the wood have in common, as `packing.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LookRecord {
    /// Origin of positions, in local space.
    pub origin: [f32; 3],
    /// Index into the materials.
    pub material: u32,
    /// Linear colour factor.
    pub color: [f32; 3],
    /// Unit of offsets from a leaf's pivot; for wood, the width of the stem (see
    /// [`Stems::widths`](super::Stems::widths)) if widths are in looks.
    pub size: f32,
    /// Lowest texture coordinates.
    pub uv_low: [f32; 2],
    /// Range of the texture coordinates.
    pub uv_size: [f32; 2],
    /// Width and height of the part of the texture that a leaf shows, in texture coordinates.
    pub shown: [f32; 2],
    /// Lowest texture coordinates of that part; 0 if `anchor` is -1.
    pub shown_low: [f32; 2],
    /// Point of that part that stays in place where an enlarged leaf repeats it, as a fraction; -1
    /// if it does not.
    pub anchor: [f32; 2],
    /// Extra after [`PackingRecord::first_outline`] for the leaf's first quad, or [`NO_EXTRA`] if
    /// its quads are drawn whole. That extra has the place, after the same one, of the quad's
    /// outlines: an extra of four bits for each mip level, which are the number of a row, or 15 for
    /// none; then the rows. A row has [`TRIMMED_CORNERS`] corners, each with weights of 15 bits for
    /// the quad's second and third corner, or if the next bit is set, for its fourth and third.
    pub outline: u32,
    /// Levels by which outlines must reach farther than the mip levels of the texture array call
    /// for, because the array's layers are not as large as the material's own texture.
    pub farther: f32,
}

/// Impostor of a model, as `impostor_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ImpostorRecord {
    /// Middle of every picture, in local space.
    pub center: [f32; 3],
    /// Half the side of a picture.
    pub half_side: f32,
    /// Radius of the plant's bounding sphere.
    pub radius: f32,
    /// Side of a picture without its margin, in texels.
    pub texels: f32,
    /// Pictures along each side of the lattice.
    pub across: u32,
    /// 1 if the lattice covers the whole sphere, 0 for its upper half.
    pub is_whole_sphere: u32,
}

impl ImpostorRecord {
    /// The record of an impostor; `center` is the origin of local space, in the plant's.
    pub fn new(impostor: &Impostor, center: [f64; 3]) -> Self {
        Self::of(&impostor.framing(), center.into())
    }

    pub(crate) fn of(framing: &Framing, center: DVec3) -> Self {
        Self {
            center: (Vec3::from(framing.center).as_dvec3() - center).as_vec3().to_array(),
            half_side: framing.half_side,
            radius: framing.radius(),
            texels: (framing.frame_px - 2) as f32,
            across: framing.lattice.across,
            is_whole_sphere: framing.lattice.is_whole_sphere.into(),
        }
    }
}

/// A card of a cluster, as `card_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct CardRecord {
    /// Middle, in local space.
    pub center: [f32; 3],
    /// The leaf that stands for the cluster, and the highest bit if another card of it follows.
    pub leaf: u32,
    /// From the middle to those of the right and of the upper side: six signed 16-bit fractions of
    /// `unit`.
    pub half_sides: [u32; 3],
    /// Largest component of those.
    pub unit: f32,
    /// In the upper half the normal on an octahedron, two signed 8-bit fractions; in the lowest
    /// byte, in 255ths, [`ClusterCard::kept`](crate::model::ClusterCard::kept).
    pub normal_kept: u32,
    /// Linear colour.
    pub color: [f32; 3],
    /// Texels along the lower side, and in the second byte along the left one.
    pub size: u32,
    /// First of the card's events in the timeline.
    pub first_event: u32,
    /// Last of them, with which it appears.
    pub last_event: u32,
    /// First word of its picture, of half a byte for each texel.
    pub texels: u32,
    /// Number of the card in its model.
    pub number: u32,
}

/// How a model is packed, as `packing.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PackingRecord {
    /// Step of pivots, in local space.
    pub grid_step: f32,
    /// Step of the wood's positions, in local space.
    pub wood_step: f32,
    /// Number of quads of each leaf; 0 if leaves differ, and the first extras are the leaves of all
    /// quads, of [`LEAF_BITS`], and which of the leaf's quads each is.
    pub quads_per_leaf: u32,
    /// Extra with the colour of the first corner, if colours differ within a leaf: square roots of
    /// the colour over the look's, 10 bits each. Otherwise [`NO_EXTRA`].
    pub first_color: u32,
    /// Extra with the first leaf's look, if there are too many for the leaves' records. Otherwise
    /// [`NO_EXTRA`].
    pub first_look: u32,
    /// 1 if wood has so many looks that the widths of stems are in them, otherwise 0.
    pub widths_in_looks: u32,
    /// First extra of the outlines.
    pub first_outline: u32,
}

/// One event of the timeline as `leaf_pass.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Event {
    /// Leaf that disappears.
    pub leaf: u32,
    /// Drawn scale of the event's owner once that leaf is gone.
    pub scale: f32,
}

/// One material as `surface.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MaterialRecord {
    /// Linear colour factor.
    pub base_color: [f32; 4],
    /// Alpha of the full texture at or above which a texel is opaque; 0 if all texels are.
    pub cutoff: f32,
    /// Layer of the texture array.
    pub layer: u32,
    /// Wrap modes along u and v, as numbered by `wrap_number`.
    pub wrap: [u32; 2],
    /// 1 if the material is two-sided.
    pub is_two_sided: u32,
    /// Padding to a multiple of 16 bytes.
    pub padding: [u32; 3],
}

/// The crown of a model, as `surface.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct CrownRecord {
    /// Centre of the box around all leaves, in local space.
    pub center_local: [f32; 3],
    /// Padding to a multiple of 16 bytes.
    pub padding: f32,
    /// One over half the box's size.
    pub inverse_half_size: [f32; 3],
    /// Tone of enlarged leaves; see [`Growth::tone`](crate::model::Growth::tone).
    pub tone: f32,
    /// Mean shaded colour of the leaves, linear. It depends on the light: an
    /// [`Upload`](super::Upload) leaves it 0, and shaders with [`Variant::tone`](super::Variant)
    /// need it.
    pub mean: [f32; 3],
    /// Padding to a multiple of 16 bytes.
    pub end: f32,
}

/// Uniforms of `landscape_pass.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LandscapeRecord {
    /// See `Rays`.
    pub right: [f32; 3],
    /// Height of the eye above the ground.
    pub eye_height: f32,
    /// See `Rays`.
    pub up: [f32; 3],
    /// Distance at which haze leaves 1/e of the ground's own light.
    pub haze: f32,
    /// See `Rays`.
    pub forward: [f32; 3],
    /// Brightness of the sky.
    pub scale: f32,
    /// Unit vector towards the sun, padded to 16 bytes.
    pub towards_sun: [f32; 4],
    /// Linear colour of the ground, padded.
    pub ground: [f32; 4],
    /// Perez coefficients, each padded.
    pub perez: [[f32; 4]; 5],
    /// Colour of the zenith (CIE xyY), padded.
    pub zenith: [f32; 4],
    /// Transform from world space relative to the eye to the sun's clip space.
    pub light_from_eye: [[f32; 4]; 4],
}

/// Uniforms of `ground_pass.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GroundRecord {
    /// Transform from world space relative to the eye to clip space.
    pub clip_from_eye: [[f32; 4]; 4],
    /// The previous frame's, from the same space.
    pub clip_from_eye_before: [[f32; 4]; 4],
    /// Shift of the picture, in clip space.
    pub jitter: [f32; 2],
    /// 1 if there is a picture of the colours, else 0.
    pub has_colors: u32,
    /// Padding to a multiple of 16 bytes.
    pub padding: u32,
}

/// Uniforms of `landscape_motion.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MotionRays {
    /// See `Rays`.
    pub right: [f32; 3],
    /// Height of the eye above the ground.
    pub eye_height: f32,
    /// See `Rays`; padded to 16 bytes.
    pub up: [f32; 4],
    /// See `Rays`; padded.
    pub forward: [f32; 4],
    /// Transform from world space relative to the eye to the previous frame's clip space.
    pub before_from_eye: [[f32; 4]; 4],
}

/// One instance of a leaf draw: the index of the plant's record, and of the run within the plant.
pub type Run = [u32; 2];

/// Number of runs in a prefix of `quads` quads.
pub fn runs(quads: u32) -> u32 {
    quads.div_ceil(RUN_QUADS)
}

/// Binding numbers. Group 0 holds a model, group 1 a frame, group 2 the effects that have buffers.
pub mod bindings {
    /// Group of a model.
    pub const MODEL: u32 = 0;
    /// Group of a frame.
    pub const FRAME: u32 = 1;
    /// Group of the effects.
    pub const EFFECTS: u32 = 2;

    /// Uniform: the box around all leaves.
    pub const CROWN: u32 = 0;
    /// Storage: one record for each material.
    pub const MATERIALS: u32 = 1;
    /// Texture array of all materials.
    pub const TEXTURES: u32 = 2;
    /// Sampler of the textures.
    pub const SAMPLER: u32 = 3;
    /// Storage: corners of all leaves' quads.
    pub const LEAF_CORNERS: u32 = 4;
    /// Uniform: how the model is packed.
    pub const PACKING: u32 = 5;
    /// Storage: one record for each leaf, and one after the last.
    pub const LEAVES: u32 = 6;
    /// Storage: events of the timeline.
    pub const EVENTS: u32 = 7;
    /// Storage: looks of leaves and wood.
    pub const LOOKS: u32 = 8;
    /// Storage: what only some models need.
    pub const EXTRAS: u32 = 9;
    /// Storage: vertices of wood that slides. Such wood has a group of its own in place of the
    /// model's, with the latter's materials, textures, packing and looks.
    pub const WOOD: u32 = 14;
    /// Storage: stems of wood that slides.
    pub const STEMS: u32 = 15;

    /// Storage: cards of clusters. They have a group of their own in place of the model's, with the
    /// latter's crown and events.
    pub const CARDS: u32 = 17;
    /// Storage: pictures of the cards.
    pub const CARD_TEXELS: u32 = 18;

    /// Texture: limbs of the model, in the wind alone. Wood that slides has it too.
    pub const LIMBS: u32 = 16;

    /// Uniform: the impostor. An impostor has a group of its own in place of the model's.
    pub const IMPOSTOR: u32 = 10;
    /// Texture array of colour and coverage.
    pub const COLORS: u32 = 11;
    /// Texture array of normals and depth.
    pub const SURFACES: u32 = 12;
    /// Sampler of both.
    pub const CLAMPING: u32 = 13;

    /// Uniform: the frame of the ground, which has a group of its own in place of the frame's.
    pub const GROUND: u32 = 0;
    /// Texture of the ground's colours.
    pub const GROUND_COLORS: u32 = 1;
    /// Texture of the ground's slopes.
    pub const GROUND_SLOPES: u32 = 2;
    /// Sampler of both.
    pub const GROUND_SAMPLER: u32 = 3;

    /// Storage: one record for each instance.
    pub const INSTANCES: u32 = 0;
    /// Storage: drawn scales of the plants that keep their own.
    pub const SCALES: u32 = 1;
    /// Uniform: what all plants share.
    pub const SHARED: u32 = 2;

    /// Storage: mean colour and contrast of each instance.
    pub const TONES: u32 = 0;
    /// Storage: sway of each instance.
    pub const SWAYS: u32 = 1;
    /// Depth texture of the shadow map.
    pub const SHADOW_MAP: u32 = 2;
    /// Comparison sampler of the shadow map.
    pub const SHADOW_SAMPLER: u32 = 3;
    /// Storage: [`Tint`](super::super::Tint) of each instance.
    pub const TINTS: u32 = 4;
}
