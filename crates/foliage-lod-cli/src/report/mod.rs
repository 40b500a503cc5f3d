//! Measurements of quality, time and memory, as tables, plots and pages.
//!
//! ```text
//! Plant -> Study (full pictures) -> Method at each level -> Row --------> HTML page, CSV, JSON
//!       -> offline::measure (preset, resolution, criterion) -> OfflineRow ->
//! ```

mod budget_section;
pub mod dolly;
pub mod far;
pub mod frames;
mod impostor_section;
pub mod impostors;
mod markup;
pub mod method;
pub mod offline;
pub mod page;
pub mod paper;
#[cfg(feature = "peers")]
pub mod peers;
mod plot;
pub mod rows;
pub mod scene_costs;
pub mod study;
pub mod wood;
mod wood_section;

pub use budget_section::BudgetRow;
pub use method::{Method, Toned};
pub use study::{Study, StudyOptions};
