//! Drawing without a graphics API: cameras and instances go in, records and draw lists come out.
//!
//! ```text
//! model ----> Upload (vertices, leaves, timeline events, wood)          once
//! Frame + Look + Instances ----> frame list (records, runs, draws)      each frame
//! Look + Variant ----> WGSL of every pass                               when first needed
//! ```
//!
//! Nothing here depends on wgpu: [`gpu`](crate::gpu) uploads and draws these lists with wgpu,
//! [`software`](crate::software) draws the same instances on the CPU, and engine plug-ins upload
//! the records themselves.

#[cfg_attr(not(feature = "render"), allow(dead_code, reason = "records are for the GPU"))]
pub(crate) mod cards;
pub(crate) mod eye;
pub(crate) mod facts;
pub(crate) mod frame_list;
#[cfg(feature = "software")]
pub(crate) mod ground;
pub(crate) mod handover;
pub(crate) mod instance;
pub(crate) mod landscape;
pub(crate) mod light;
pub(crate) mod limb_texels;
#[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only renderers that keep frames make them"))]
pub(crate) mod live;
pub(crate) mod look;
#[cfg(feature = "textures")]
#[cfg_attr(not(feature = "software"), allow(dead_code, reason = "drawers on the CPU sample them"))]
pub(crate) mod mips;
#[cfg(feature = "render")]
pub(crate) mod packed;
#[cfg(feature = "textures")]
pub(crate) mod pages;
pub(crate) mod quads;
pub(crate) mod seed;
pub(crate) mod shader;
pub(crate) mod sprite;
pub(crate) mod stems;
pub(crate) mod sun;
pub(crate) mod tint;
mod trimmed;
pub(crate) mod upload;
pub(crate) mod wood;

pub mod records;
pub mod shaders;

pub use eye::Eye;
pub use facts::{Facts, ModelFacts};
pub use frame_list::{Batch, FrameList, ImpostorDraw, WoodDraw};
pub use instance::{FarCounts, Frame, GroundCounts, Instance, LiveCounts, ModelId, Prepared, ScalesId};
pub use landscape::{Ground, Landscape, Rays};
pub use light::Lighting;
pub use limb_texels::limb_texels;
pub use look::{Coloring, Look, Variant};
#[cfg(feature = "textures")]
pub use mips::mip_levels;
#[cfg(feature = "render")]
pub use packed::gpu_bytes;
#[cfg(feature = "textures")]
pub use pages::{PageLevel, impostor_levels};
pub use shader::ShaderSource;
pub use stems::{DrawnStems, Levels, Stems};
pub use sun::SunView;
pub use tint::Tint;
pub use upload::{MaterialLeaves, Upload};
