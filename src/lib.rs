//! Continuous level of detail for trees, leaf by leaf.
//!
//! ```text
//! offline    file ----import---> Plant ---simplify---> FoliageModel ---> .vds
//!            species --grow----->
//! run time   .vds ---> FoliageModel ---extract---> active count n, drawn scales ---render---> leaves 0..n
//!                      many plants -----scene----> those in view, each with its n
//! ```
//!
//! A **plant** is foliage cut into leaves, and wood. A **leaf** is the unit that is pruned: one connected piece of foliage.
//! A **view** is one of the offscreen cameras that judge which leaf can go; its **fragments** are the leaves at its pixels.
//! To **prune** a leaf removes it for good, offline, and enlarges its **target**. The **model** holds the leaves in drawing
//! order, the last pruned first, so that any **prefix** of `n` leaves, the **active count**, is a good tree. At run time
//! **collapse** (`n -> n - 1`) and **split** (`n -> n + 1`) swap scales; a **timeline** tells a leaf's scale at any `n`
//! without state.
//!
//! Units are the plant's own (glTF: metres), radians, pixels and seconds; right-handed, +Y up.
//!
//! What is beyond a limit is refused by name before anything is allocated for it: `plant::MAX_LEAVES` and
//! `plant::MAX_ELEMENTS` of a plant, `material::MAX_TEXTURE_SIDE` and the memory that a texture's bytes account for
//! (`Texture::decode`), `model::format::MAX_FILE_BYTES`, `simplify::views::MAX_RESOLUTION`, `grow::MAX_GROWN_LEAVES`,
//! `scene::file::MAX_PLANTS`, `render::image::MAX_IMAGE_SIDE`, and the memory that there is, or `max_memory_mb` of
//! `ImportOptions` and `SimplifyOptions`.
//!
//! ```
//! # #[cfg(feature = "simplify")] {
//! use foliage_lod::{extract::Swap, grow::{GrowOptions, Species, grow}};
//! use foliage_lod::simplify::{Quiet, SimplifyOptions, raster::CpuFragments, simplify};
//!
//! let birch = grow(&Species::embedded("betula-populifolia")?, &GrowOptions { leaves: Some(200), ..Default::default() })?;
//! let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
//! let model = simplify(&birch, &options, &mut CpuFragments::new(), &mut Quiet)?.model;
//!
//! let mut swap = Swap::new(&model);
//! swap.set_active(60);
//! assert!(swap.scales()[..60].iter().any(|&scale| scale > 1.0));
//! # }
//! # Ok::<(), foliage_lod::Error>(())
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod bounds;
#[cfg(any(feature = "simplify", feature = "render"))]
mod crown;
mod error;
pub mod file;
pub mod leaf;
pub mod material;
#[cfg(feature = "simplify")]
mod memory;
pub mod plant;
#[cfg(any(feature = "simplify", feature = "scene"))]
mod random;
#[cfg(any(feature = "simplify", feature = "render"))]
mod srgb;

#[cfg(feature = "simplify")]
pub mod grow;
#[cfg(feature = "simplify")]
pub mod import;
pub mod model;

pub mod extract;
#[cfg(feature = "simplify")]
pub mod simplify;
pub mod stochastic;

pub mod effects;

#[cfg(feature = "scene")]
pub mod scene;

#[cfg(any(feature = "simplify", feature = "render"))]
pub mod render;

#[cfg(feature = "report")]
pub mod report;

// Only documentation, of nearly all that is above.
#[cfg(feature = "report")]
pub mod numerics;

pub use error::{Error, Result};
pub use plant::Plant;

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
