//! Pictures: of plants and models on the CPU, and everything that goes through wgpu.
//!
//! [`software`] draws a plant or a model into an [`Image`](image::Image) seen from a [`Camera`](camera::Camera), on any
//! machine.

pub mod camera;
pub mod image;
pub mod software;
