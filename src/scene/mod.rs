//! Many plants on screen: frustum culling and an active count for each plant in view.
//!
//! A [`Grove`] holds the placements of plants. Each frame, [`Grove::select`] takes a
//! [`Camera`](crate::Camera) and returns the instances in view with their active counts. A renderer
//! needs nothing else per frame: models and their timelines never change.
//!
//! [`patch`] places plants over whole landscapes, where the camera is.

pub mod budget;
mod camera;
mod check;
mod cost;
mod file;
mod footing;
mod ground;
mod grove;
mod lod;
pub mod patch;
mod portions;
mod scatter;
mod shared;
pub mod visibility;

pub use camera::{CameraEntry, Orbit, Station};
pub use file::{MAX_PLANTS, ModelSource, PlantEntry, Planted, SceneFile, Sun};
pub use footing::Footing;
pub use ground::GroundEntry;
pub use grove::{Active, Grove, Kind, Placement};
pub use lod::{Lod, Policy};
pub use portions::{Amount, BudgetEntry, Portions};
pub use scatter::{Scatter, Spot};
pub use shared::SharedBudget;
