//! Export: plants and models as files for other programs.
//!
//! The format is binary glTF 2.0 (`.glb`): of a plant, grown or imported, with [`write_glb`]; of a
//! model, in a form that every viewer shows as the full tree and that keeps its continuous level of
//! detail, with [`write_continuous`]. [Levels](Level) of a model are plants, and the last of them
//! may be [cards](far_cards) with its picture, in files of their own ([`write_level`]) or in one
//! ([`write_lods`]). A [`page`] draws a continuous glTF in any browser.

mod buffer;
mod cards;
mod clusters;
mod continuous;
mod coverage;
mod document;
mod glb;
mod levels;
mod page;
mod plain;
mod textures;
mod tiled;
mod writer;

pub use cards::{FAR_PX, far_cards};
pub use continuous::write_continuous;
pub use glb::write_glb;
pub use levels::Level;
pub use page::{READER, page};
pub use plain::{write_level, write_lods};
pub use textures::{TEXTURE_SIDES, resized};
pub use writer::GlbOptions;
