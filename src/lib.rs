//! Continuous level of detail for trees, leaf by leaf.
//!
//! ```text
//! offline    file ----import---> Plant ---simplify---> FoliageModel ---> .vds
//!            species --grow----->
//! run time   .vds, or .glb by `continuous` ---> FoliageModel
//!            FoliageModel ---extract---> active count n, drawn scales
//!            camera, look, instances ---draw---> records, draw lists ---gpu | software---> picture
//!            many plants ---scene---> those in the frustum, each with its n
//! ```
//!
//! A **plant** is foliage cut into leaves, and wood. A **leaf** is the unit that is pruned: one
//! connected piece of foliage. A **view** is one of the offline cameras that judge which leaf can
//! go; its **fragments** are the leaves at its pixels. **Pruning** a leaf removes it for good,
//! offline, and enlarges its **target**. The **model** holds the leaves in drawing order, the last
//! one pruned first, so that any **prefix** of `n` leaves, the **active count**, is a good tree. At
//! run time **collapse** (`n -> n - 1`) and **split** (`n -> n + 1`) swap scales; a **timeline**
//! gives a leaf's scale at any `n` without state.
//!
//! Units are the plant's own (glTF: metres), radians, pixels and seconds. Coordinates are
//! right-handed with +Y up.
//!
//! Anything beyond a limit is refused by name before memory is allocated for it:
//! `plant::MAX_LEAVES` and `plant::MAX_ELEMENTS` of a plant, `material::MAX_TEXTURE_SIDE` and the
//! memory that a texture's bytes account for (`Texture::decode`), `model::MAX_FILE_BYTES`,
//! `simplify::MAX_RESOLUTION`, `grow::MAX_GROWN_LEAVES`, `scene::MAX_PLANTS`,
//! `software::MAX_IMAGE_SIDE`, and the available memory, or `max_memory_mb` of `ImportOptions` and
//! `SimplifyOptions`.
//!
//! ```
//! # #[cfg(feature = "simplify")] {
//! use foliage_lod::{Swap, grow::{GrowOptions, Species, grow}};
//! use foliage_lod::simplify::{CpuFragments, Quiet, SimplifyOptions, simplify};
//!
//! let species = Species::embedded("betula-populifolia")?;
//! let birch = grow(&species, &GrowOptions { leaves: Some(200), ..Default::default() })?;
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
mod camera;
mod crown;
#[cfg(feature = "software")]
mod edge;
mod error;
pub mod file;
mod frustum;
mod hash;
pub mod leaf;
pub mod material;
#[cfg(feature = "simplify")]
mod memory;
pub mod plant;
#[cfg(any(feature = "simplify", feature = "scene"))]
mod random;
#[cfg(feature = "textures")]
mod srgb;
pub mod wood;

#[cfg(feature = "continuous")]
pub mod continuous;
#[cfg(feature = "simplify")]
pub mod export;
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

#[cfg(any(feature = "scene", feature = "textures"))]
pub mod terrain;

#[cfg(feature = "scene")]
pub mod scene;

pub mod draw;
#[cfg(feature = "render")]
pub mod gpu;
#[cfg(feature = "software")]
pub mod software;

#[cfg(feature = "measure")]
pub mod measure;

// Only documentation, of nearly all that is above.
#[cfg(feature = "measure")]
#[allow(rustdoc::private_intra_doc_links)]
pub mod numerics;

#[doc(hidden)]
pub mod internals;

pub use camera::{Camera, Depth, LookAt};
pub use draw::{Frame, Instance, Look};
pub use error::{Error, Result};
pub use extract::{Blend, LodPolicy, Swap};
pub use frustum::Frustum;
pub use glam;
#[cfg(feature = "render")]
pub use gpu::FoliageRenderer;
pub use model::{FoliageModel, Timeline};
pub use plant::Plant;
#[cfg(feature = "scene")]
pub use scene::Grove;

/// The code in the README compiles.
#[cfg(all(doctest, feature = "render", feature = "simplify"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
