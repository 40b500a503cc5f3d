//! Pictures: of plants and models on the CPU, and everything that goes through wgpu.
//!
//! [`software`] draws a plant or a model into an [`Image`](image::Image) seen from a [`Camera`](camera::Camera), on any
//! machine. With the feature `render` there is a GPU as well: `device` opens it, `fragment_pass` captures the simplifier's
//! fragments on it.

pub mod camera;
pub mod image;
pub mod landscape_pass;
pub mod light;
mod mips;
pub mod software;

#[cfg(feature = "render")]
pub mod backdrop_pass;
#[cfg(feature = "render")]
mod buffers;
#[cfg(feature = "render")]
pub mod device;
#[cfg(feature = "render")]
mod effect_buffers;
#[cfg(feature = "render")]
pub mod foliage;
#[cfg(all(feature = "render", feature = "simplify"))]
pub mod fragment_pass;
#[cfg(feature = "render")]
pub mod frame_list;
#[cfg(feature = "render")]
pub mod guard;
#[cfg(feature = "render")]
pub mod landscape_motion;
#[cfg(feature = "render")]
mod layer;
#[cfg(feature = "render")]
pub mod leaf_pass;
#[cfg(feature = "render")]
pub mod look;
#[cfg(feature = "render")]
pub mod model_buffers;
#[cfg(feature = "render")]
pub mod offscreen;
#[cfg(feature = "render")]
pub mod shader;
#[cfg(feature = "render")]
mod shadow_pass;
#[cfg(feature = "render")]
mod stems;
#[cfg(feature = "render")]
pub mod surface;
#[cfg(feature = "render")]
mod texture_layers;
#[cfg(feature = "viewer")]
pub mod window;
#[cfg(feature = "render")]
pub mod wood_pass;
