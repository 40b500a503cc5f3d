//! Offline: puts a plant's leaves in the order in which they may be lost.
//!
//! ```text
//! Plant -> views (20 cameras) -> fragments (CPU or wgpu) -> layers (per pixel, sorted)
//!       -> prune: choose (criterion) -> enlarge (nearest) -> update layers, areas, criterion -> ... -> FoliageModel
//! ```

pub mod appearance;
pub mod areas;
pub mod capture;
pub mod criterion;
mod drift;
pub mod enlarge;
pub mod footprint;
pub mod fragments;
pub mod information;
pub mod layers;
pub mod masks;
pub mod memory;
pub mod neighbours;
pub mod occlusion;
pub mod options;
pub mod pairs;
pub mod price;
pub mod prune;
pub mod raster;
mod recipe;
pub mod shapes;
pub mod tournament;
pub mod views;
pub mod vmi;

pub use options::{Compensate, SimplifyOptions};
pub use recipe::{Observer, Quiet, Seconds, Simplified, order, rasterise_all, simplify};
