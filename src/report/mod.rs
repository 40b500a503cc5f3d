//! Measurements of the whole: what is drawn, how long it takes, as tables, plots and pages.
//!
//! ```text
//! Plant -> Study (full pictures, held-out views) -> Method at each level -> Row ---> page (HTML), CSV, JSON
//!       -> offline::measure (preset, resolution, views, criterion) -> OfflineRow -->
//! ```

pub mod dolly;
pub mod frames;
pub mod held_out;
pub mod method;
pub mod metrics;
pub mod offline;
pub mod page;
pub mod paper;
#[cfg(feature = "peers")]
pub mod peers;
mod plot;
pub mod scene_costs;
pub mod study;
pub mod target;

pub use method::Method;
pub use study::{Study, StudyOptions};
