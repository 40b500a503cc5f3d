//! Pictures of plants and models, drawn on the CPU: no adapter, no driver, the same bytes for any
//! number of threads.
//!
//! A [`SoftwareRenderer`] takes the input of the GPU renderer: a [`Camera`](crate::Camera), a
//! [`Look`](crate::Look) and instances. It is built on a [`Painter`], which draws any number of
//! [`DrawList`]s (parts of leaves and wood, each leaf with its linear scale about its pivot) with
//! one set of materials; [`draw_plant`] and [`draw_model`] are shortcuts. Each pixel has sixteen
//! samples, with an alpha test at each, and textures have mip levels that preserve their coverage.
//!
//! Cost: grows with the number of covered samples; 20,000 masked leaves at 512 x 512 took 2 s on
//! two busy cores in a development build.

mod alpha_test;
mod bake;
mod bake_options;
mod baker;
mod correction;
mod fragments;
mod frame_pages;
mod ground;
mod image;
mod landscape;
mod light;
mod list;
mod live;
mod options;
mod painter;
mod project;
mod renderer;
mod riders;
mod samples;
mod sprite;
mod tile;
mod toning;
mod wood;

pub use bake::bake;
pub use bake_options::BakeOptions;
#[cfg(feature = "render")]
pub(crate) use baker::framing;
pub use fragments::leaf_fragments;
pub use image::{Image, MAX_IMAGE_SIDE};
pub use list::{DrawList, Drawn, Part, Placed};
#[cfg(feature = "render")]
pub(crate) use live::FrameMaker;
pub use live::LiveImpostors;
pub use options::{Background, DrawOptions};
pub use painter::{Painter, draw_model, draw_plant, mean_color, mean_leaf_color, model_toning};
pub use renderer::{Drawing, SoftwareRenderer};
pub use toning::Toning;
