//! Import: a glTF or OBJ file becomes a [`Plant`], its foliage cut into leaves.
//!
//! ```text
//! bytes -> gltf | obj -> Source (meshes, their places, materials)
//!       -> pieces -> foliage -> crossed -> Plant
//! ```
//!
//! A *piece* is a set of triangles connected over shared edges once vertices at exactly equal
//! positions are welded. `foliage` decides which pieces are leaves, `crossed` merges cards that
//! cross at one centre into one leaf, `pivot` finds where a leaf is attached, `assemble` writes the
//! plant in its canonical form. Nothing in a file is trusted before it is checked: counts against
//! the bytes that back them, indices against their arrays, the node graph against cycles.

mod accessor;
mod assemble;
mod budget;
mod buffers;
mod container;
mod crossed;
mod draco;
mod extensions;
mod fault;
mod foliage;
mod gltf;
mod instancing;
mod materials;
mod meshopt;
mod nodes;
mod obj;
mod pieces;
mod pivot;
mod source;
mod textures;
mod topology;
mod transform;
mod uri;

use crate::{Error, Plant, Result};
use budget::Budget;
use fault::Fault;
use source::Source;
use std::{fmt, path::Path};
use strum::{Display, EnumMessage, EnumString, IntoStaticStr, VariantArray};

/// Maximum size of a file, or of one that it refers to: 4 GiB, glTF's own limit for a binary.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Options that control how a file is cut into leaves.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportOptions {
    /// Name of the material, node or mesh that is foliage. `None` (default) guesses from alpha mode
    /// and shape.
    pub leaves: Option<String>,
    /// Which pieces form one leaf.
    pub group: Group,
    /// Memory limit in megabytes. Memory use is estimated from the number of triangles before they
    /// are written; a file above the limit is refused. `None` (default) uses the available memory,
    /// or no limit where that is unknown.
    pub max_memory_mb: Option<u64>,
}

/// Which pieces form one leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Group {
    /// Cards that cross at one centre, within 5 % of their size, are one leaf.
    #[default]
    Crossed,
    /// Every connected piece is a leaf of its own.
    Piece,
}

/// Classification of a part of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Foliage: its pieces are leaves, except pieces that are not shaped like one.
    Leaf,
    /// Wood: drawn, never pruned.
    Wood,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Leaf => "leaf",
            Self::Wood => "wood",
        })
    }
}

/// One part of the file, a mesh with one material, and its classification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Name of the node, or of the mesh where the node has none; may be empty.
    pub name: String,
    /// Name of the material; may be empty.
    pub material: String,
    /// Number of triangles, including instances.
    pub triangles: usize,
    /// Number of connected pieces, including instances.
    pub pieces: usize,
    /// Whether it is foliage or wood.
    pub verdict: Verdict,
    /// The reason, in a few words with the numbers that decided.
    pub reason: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, material, triangles, pieces, verdict, reason } = self;
        write!(f, "{verdict}: {name:?}, material {material:?}, {triangles} triangles in {pieces} pieces: {reason}")
    }
}

/// The imported plant, and how its file was interpreted.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The plant. Each leaf is in the canonical form of [`Plant::canonicalize`]; leaves are in the
    /// order in which their first triangles appear in the file.
    pub plant: Plant,
    /// Position of the plant's origin in the file: zero, unless the plant is so far from the file's
    /// origin (about 170 of its radii) that single precision would round its leaves. In that case
    /// it is the middle of the plant and has been subtracted from every position.
    pub origin: [f64; 3],
    /// Classification of each part, and the reason for it.
    pub findings: Vec<Finding>,
    /// Anything ignored that does not affect the cut into leaves, such as a missing texture: one
    /// line each.
    pub warnings: Vec<String>,
}

/// Reads `path`: glTF (`.gltf`), binary glTF (`.glb`) or OBJ (`.obj`). The content decides the
/// format, then the extension.
///
/// # Errors
/// [`Io`](Error::Io), [`Unreadable`](Error::Unreadable), [`Unsupported`](Error::Unsupported) or
/// [`TooLarge`](Error::TooLarge) for the file; [`InvalidOption`](Error::InvalidOption) if nothing
/// in it has the name `leaves`; [`NoLeaves`](Error::NoLeaves) if it contains no separable leaves.
pub fn load(path: &Path, options: &ImportOptions) -> Result<Imported> {
    require_leaves(inspect(path, options)?, path)
}

/// As [`load`], but a plant without leaves is not an error: the findings give the reason.
///
/// # Errors
/// As [`load`], except `NoLeaves`.
pub fn inspect(path: &Path, options: &ImportOptions) -> Result<Imported> {
    let bytes = uri::read_file(path).map_err(|fault| fault.at(path))?;
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let is_gltf = container::is_gltf(&bytes) || !is_obj;
    finish(
        |budget| if is_gltf { gltf::read(&bytes, path, budget) } else { obj::read(&bytes, path, budget) },
        path,
        options,
    )
}

/// Reads glTF or binary glTF from memory. `path` names it in messages; files it refers to are
/// looked up in the folder of `path`.
///
/// # Errors
/// As [`load`].
pub fn load_gltf_bytes(bytes: &[u8], path: &Path, options: &ImportOptions) -> Result<Imported> {
    require_leaves(finish(|budget| gltf::read(bytes, path, budget), path, options)?, path)
}

/// Reads OBJ from memory. `path` names it in messages; materials and textures are looked up in the
/// folder of `path`.
///
/// # Errors
/// As [`load`].
pub fn load_obj_bytes(bytes: &[u8], path: &Path, options: &ImportOptions) -> Result<Imported> {
    require_leaves(finish(|budget| obj::read(bytes, path, budget), path, options)?, path)
}

fn finish(
    read: impl FnOnce(&Budget) -> std::result::Result<Source, Fault>,
    path: &Path,
    options: &ImportOptions,
) -> Result<Imported> {
    let budget = Budget::new(options);
    let imported = read(&budget).and_then(|source| assemble::plant(source, options));
    let imported = imported.map_err(|fault| fault.at(path))?;
    imported.plant.validate()?;
    Ok(imported)
}

fn require_leaves(imported: Imported, path: &Path) -> Result<Imported> {
    if !imported.plant.leaves.is_empty() {
        return Ok(imported);
    }
    let reason = match imported.findings.iter().max_by_key(|finding| finding.pieces) {
        Some(finding) => format!(
            "the most likely part is {:?} with material {:?}: {}",
            finding.name, finding.material, finding.reason
        ),
        None => "the file has no triangles".to_owned(),
    };
    let fix = "model leaves as separate small pieces or name the foliage's material or node in `leaves`".to_owned();
    Err(Error::NoLeaves { name: path.display().to_string(), reason, fix })
}
