//! Offline simplification: finds the order in which a plant's leaves are pruned, and which leaf
//! grows to compensate for each.
//!
//! ```text
//! Plant -> views (4 to 20 cameras) -> fragments (CPU or wgpu) -> layers (sorted per pixel)
//!       -> prune: choose a leaf (criterion) -> enlarge a target (compensation)
//!              -> update layers, areas and criterion -> repeat -> FoliageModel
//! ```

pub(crate) mod appearance;
pub(crate) mod areas;
mod canvas;
pub(crate) mod capture;
pub(crate) mod change;
mod crew;
pub(crate) mod criterion;
mod depth;
mod drift;
pub(crate) mod enlarge;
pub(crate) mod footprint;
pub(crate) mod fragments;
mod growth;
pub(crate) mod information;
pub(crate) mod intrinsic;
mod judge;
pub(crate) mod layers;
pub(crate) mod masks;
pub(crate) mod memory;
pub(crate) mod neighbours;
pub(crate) mod occlusion;
pub(crate) mod options;
pub(crate) mod order;
pub(crate) mod outline;
pub(crate) mod pairs;
mod pixels;
pub(crate) mod price;
pub(crate) mod prune;
mod ranking;
pub(crate) mod raster;
mod recipe;
pub(crate) mod scene;
pub(crate) mod shapes;
mod terms;
pub(crate) mod tournament;
pub(crate) mod views;
pub(crate) mod vmi;

pub use fragments::{AlphaMask, AlphaTest, Coverage, FragmentSource, ViewTriangles};
pub use memory::{available_bytes, estimated_bytes};
pub use options::{Compensate, Criterion, GrowBy, MAX_SCALE_LIMIT, SimplifyOptions};
pub use raster::CpuFragments;
pub use recipe::{Observer, Quiet, Seconds, Simplified, order, rasterise_all, simplify};
pub use views::{MAX_RESOLUTION, VIEW_COUNTS, View, ViewSet};
