//! Options of the import of trees.

use crate::names::variant;
use clap::Parser;
use foliage_lod::import::{Group, ImportOptions, Up, VertexColors};

/// How a tree file is split into leaves.
#[derive(Parser)]
pub struct Import {
    /// Names of the foliage: materials, meshes, or nodes with all below them. Repeatable, or with
    /// commas; * stands for any letters. By default it is guessed.
    #[arg(long, value_name = "NAME,...")]
    pub leaves: Vec<String>,
    /// How connected pieces are grouped into leaves.
    #[arg(long, value_parser = variant::<Group>(), default_value_t)]
    pub group: Group,
    /// Name of the node or object to take, with all below it, where a file has several plants; '*'
    /// takes everything, also coarser levels of detail, hidden nodes and ground.
    #[arg(long, value_name = "NAME")]
    pub plant: Option<String>,
    /// Use of the vertex colours.
    #[arg(long, value_parser = variant::<VertexColors>(), default_value_t)]
    pub vertex_colors: VertexColors,
    /// Axis of the file that points up.
    #[arg(long, value_parser = variant::<Up>(), default_value_t)]
    pub up: Up,
    /// Alpha from 0 to 1 at or above which cut-out materials are drawn; by default the file's
    /// cutoff or, for blended materials, half of their largest alpha.
    #[arg(long, value_name = "ALPHA")]
    pub alpha_cutoff: Option<f32>,
}

impl Import {
    /// The library's options.
    pub fn options(&self) -> ImportOptions {
        ImportOptions {
            leaves: self.leaves.clone(),
            group: self.group,
            plant: self.plant.clone(),
            vertex_colors: self.vertex_colors,
            up: self.up,
            alpha_cutoff: self.alpha_cutoff,
            max_memory_mb: None,
        }
    }
}
