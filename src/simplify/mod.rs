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
pub(crate) mod cards;
pub(crate) mod change;
pub(crate) mod clusters;
mod crew;
pub(crate) mod criterion;
mod curve;
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
mod progress;
pub(crate) mod prune;
mod ranking;
pub(crate) mod raster;
mod recipe;
pub(crate) mod scene;
pub(crate) mod shapes;
mod terms;
pub(crate) mod tournament;
mod trial;
pub(crate) mod views;
pub(crate) mod vmi;
mod work;

pub use curve::{CurveOptions, curve_steps, error_curve};
pub use fragments::{AlphaMask, AlphaTest, Coverage, FragmentSource, ViewTriangles};
pub use memory::{available_bytes, estimated_bytes};
pub use options::{Compensate, Criterion, GrowBy, MAX_SCALE_LIMIT, SimplifyOptions};
pub use progress::{Observer, Quiet, Seconds};
pub use raster::CpuFragments;
pub use recipe::{Simplified, order, rasterise_all, simplify};
pub use trial::{Trial, Tried};
pub use views::{MAX_RESOLUTION, VIEW_COUNTS, View, ViewSet};
