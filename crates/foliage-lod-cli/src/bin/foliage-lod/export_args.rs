//! The command line of `foliage-lod export`.

use crate::{
    import_args::Import,
    names::{Preset, Raster, Switch, share},
};
use clap::Parser;
use foliage_lod::{
    export::{GlbOptions, TEXTURE_SIDES},
    measure::Target,
};
use std::{path::PathBuf, str::FromStr};

/// `foliage-lod export`.
#[derive(Parser)]
pub struct Export {
    /// The model (.vds); or a tree to simplify first: .glb, .gltf, .obj, or the name of an embedded
    /// species such as english-oak.
    pub input: PathBuf,
    /// File to write: a glTF that every viewer shows as the full tree, and that keeps the
    /// continuous level of detail for readers of docs/CONTINUOUS_GLTF.md; or a page (.html) that
    /// draws it in a browser, without a network.
    #[arg(short, long, value_name = "OUT.glb|OUT.html")]
    pub output: PathBuf,
    /// Write a plain glTF for each of these levels instead, fine to coarse, OUT_LOD0.glb and so on,
    /// and OUT_lods.json with their numbers. A level is a share of the leaves, or the fewest leaves
    /// that meet a bound: ssim=0.95@256 is a structural similarity of at least 0.95 at 256 pixels;
    /// rmse and xor are upper bounds.
    #[arg(long, value_name = "SHARE|MEASURE=BOUND@PIXELS,...", value_delimiter = ',')]
    pub levels: Vec<LevelOf>,
    /// Add a last level for plants far away: crossed cards with a picture of the model's impostor,
    /// or of one made for it. On by default.
    #[arg(long, value_enum, requires = "levels", value_name = "on|off")]
    pub far_cards: Option<Switch>,
    /// Write all levels into OUT.glb: only the first in the scene, the others by the extension
    /// MSFT_lod.
    #[arg(long, requires = "levels")]
    pub msft_lod: bool,
    /// Halve textures until no side is longer than so many texels.
    #[arg(long, value_name = "TEXELS|asis", default_value = "asis", value_parser = textures)]
    pub textures: Textures,
    /// Keep every bit instead of 16 bits a coordinate.
    #[arg(long)]
    pub exact: bool,
    /// Turn the tree so that Z points up in programs that do not turn glTF, whose up is Y.
    #[arg(long)]
    pub z_up: bool,
    /// Factor of all lengths.
    #[arg(long, default_value_t = 1.0)]
    pub scale: f64,
    /// Preset that a tree is simplified with; balanced by default.
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    #[command(flatten)]
    pub import: Import,
    /// Processor that captures the fragments of a tree; auto uses a hardware GPU if there is one.
    #[arg(long, value_enum, default_value_t = Raster::Auto)]
    pub raster: Raster,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// What a level is given by.
#[derive(Clone, Copy)]
pub enum LevelOf {
    /// Share of the leaves.
    Share(f64),
    /// Bound that it meets.
    Target(Target),
}

impl FromStr for LevelOf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.contains('=') {
            true => text.parse().map(Self::Target).map_err(|error: foliage_lod::Error| error.to_string()),
            false => share(text).map(Self::Share),
        }
    }
}

impl Export {
    /// The library's options.
    pub fn options(&self) -> GlbOptions {
        GlbOptions { exact: self.exact, z_up: self.z_up, scale: self.scale }
    }

    /// Whether a last level of crossed cards is written.
    pub fn has_cards(&self) -> bool {
        !self.levels.is_empty() && self.far_cards != Some(Switch::Off)
    }
}

/// Longest side of textures; `None` to leave them as they are.
#[derive(Clone, Copy)]
pub struct Textures(pub Option<u32>);

fn textures(text: &str) -> Result<Textures, String> {
    if text == "asis" {
        return Ok(Textures(None));
    }
    let side = text.parse().ok().filter(|side| TEXTURE_SIDES.contains(side));
    let refused = || format!("asis, or {} to {} texels", TEXTURE_SIDES.start(), TEXTURE_SIDES.end());
    side.map(|side| Textures(Some(side))).ok_or_else(refused)
}
