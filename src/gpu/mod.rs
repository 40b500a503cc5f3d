//! The wgpu backend: draws plants and captures the simplifier's fragments, on the caller's device
//! or on one opened here.
//!
//! [`FoliageRenderer`] draws into the caller's render passes, [`Offscreen`] into memory. No other
//! module uses wgpu.

mod backdrop_pass;
mod bindings;
mod buffers;
#[cfg(feature = "simplify")]
pub(crate) mod capture;
mod device;
mod diagnostics;
mod effect_buffers;
mod frame_thread;
mod ground_pass;
mod guard;
mod impostor_buffers;
mod landscape_motion;
mod landscape_pass;
mod layer;
mod live;
mod model_buffers;
mod offscreen;
mod pipeline;
mod plant_pass;
mod renderer;
mod shadow_map;
mod shadow_pass;
mod texture_layers;
mod timer;

pub use backdrop_pass::Backdrop;
#[cfg(feature = "simplify")]
pub use capture::GpuFragments;
pub use device::{GpuDevice, GpuOptions, one_line};
pub use diagnostics::Diagnostics;
pub use guard::{guarded, is_guarding};
pub use offscreen::{MOTION, Offscreen, TARGET, texture};
pub use pipeline::TargetFormat;
pub use renderer::FoliageRenderer;
pub use timer::FrameTimer;
