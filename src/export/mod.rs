//! Export: any [`Plant`](crate::Plant), grown or imported, as a file for other programs.
//!
//! The only format is binary glTF 2.0 (`.glb`).

mod glb;
mod page;

pub use glb::write_glb;
pub use page::{READER, page};
