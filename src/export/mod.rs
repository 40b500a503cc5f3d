//! Export: plants and models as files for other programs.
//!
//! The only format is binary glTF 2.0 (`.glb`): of a plant, grown or imported, with
//! [`write_glb`]; of a model, in a form that every viewer shows as the full tree and that keeps its
//! continuous level of detail, with [`write_continuous`]; and [levels](Level) of a model, which are
//! plants.

mod buffer;
mod continuous;
mod document;
mod glb;
mod levels;

pub use continuous::{Continuous, write_continuous};
pub use glb::write_glb;
pub use levels::Level;
