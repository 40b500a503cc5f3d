//! Many plants on screen: which of them are seen, and how many leaves each of them draws.
//!
//! A [`Grove`] holds where plants stand; each frame it is asked by a [`Viewer`] and answers with the instances in view and
//! their active counts. What draws them needs nothing else: models and their timelines never change.

pub mod camera;
mod check;
pub mod file;
pub mod grove;
pub mod lod;
pub mod scatter;
pub mod viewer;

pub use file::SceneFile;
pub use grove::{Active, Grove, Kind, Placement};
pub use viewer::Viewer;
