//! Export: plants and models as files for other programs.
//!
//! The format is binary glTF 2.0 (`.glb`): of a plant, grown or imported, with [`write_glb`]; of a
//! model, in a form that every viewer shows as the full tree and that keeps its continuous level of
//! detail, with [`write_continuous`]. [Levels](Level) of a model are plants, and a [`page`] draws a
//! continuous glTF in any browser.

mod buffer;
mod continuous;
mod document;
mod glb;
mod levels;
mod page;

pub use continuous::{GlbOptions, write_continuous, write_level};
pub use glb::write_glb;
pub use levels::Level;
pub use page::{READER, page};
