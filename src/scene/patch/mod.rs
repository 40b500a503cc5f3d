//! Foliage patches: landscapes of plants from a few numbers and maps, made where the camera is.
//!
//! ```text
//! PatchEntry + maps + HeightMap -> Patch --tile--> PatchPlants   (any part, in any order)
//!                        eye, Patch -> Tiles       (those within reach, some each frame)
//! ```
//!
//! Over the ground lie grids of cells, one for each spacing, with a point in each cell. A random
//! number of the cell decides what grows there: kinds have shares of it as large as their density
//! and their map say. Larger kinds keep smaller ones away. After D. McNabb, *Foliage Patch* (Intel,
//! 2013), and J. van Muijden, *GPU-Based Procedural Placement in Horizon Zero Dawn* (GDC 2017).
//! Where the sample draws its numbers from one stream, and later kinds erase earlier ones, here
//! every number is a hash of the cell and of what it is for.
//!
//! Limits: maps and ground are held in memory whole; placing is on the CPU alone.

mod blue_noise;
mod entry;
mod field;
mod fol;
mod hash;
mod kind;
mod layer;
mod order;
mod thin;
mod tiles;

pub use crate::terrain::{HeightMap, Map};
pub use entry::{MAX_KINDS, PatchEntry};
pub use field::{Patch, PatchPlant, Scratch, TileKey};
pub use fol::{FOOT, FolFile, FolGround, FolPlant};
pub use kind::{Placing, PlantKind, REACH, Spacing};
pub use order::{CellOrder, Sweep};
pub use thin::{MOST_GROWTH, Seen};
pub use tiles::{MOST_TILES, Tile, TileCounts, TileOptions, Tiles};
