//! Import: a glTF or OBJ file becomes a [`Plant`], its foliage cut into leaves.
//!
//! ```text
//! bytes -> gltf | obj -> Source (meshes, their places, materials)
//!       -> pieces -> foliage -> crossed -> Plant
//! ```
//!
//! A *piece* is a set of triangles connected over shared edges once vertices at exactly equal
//! positions are welded. `foliage` decides which pieces are leaves, `cards` separates cards that
//! were joined at their edges, `crossed` merges cards that cross at one centre into one leaf,
//! `pivot` finds where a leaf is attached, `assemble` writes the plant in its canonical form.
//! Nothing in a file is trusted before it is checked: counts against the bytes that back them,
//! indices against their arrays, the node graph against cycles.

mod accessor;
mod alpha_cut;
mod alpha_range;
mod assemble;
mod attributes;
mod budget;
mod buffers;
mod cards;
mod colors;
mod container;
mod crossed;
mod draco;
mod extensions;
mod fault;
mod foliage;
mod foreign;
mod gltf;
mod graph;
mod ground;
mod instancing;
mod ktx2;
mod left_out;
mod marks;
mod materials;
mod meshopt;
mod morph;
mod mtl;
mod mtl_surfaces;
mod named;
mod nodes;
mod obj;
mod obj_lines;
mod objects;
mod opacity;
mod opacity_map;
mod pieces;
mod pivot;
mod plants;
mod roles;
mod skin;
mod source;
mod text;
mod textures;
mod topology;
mod transform;
mod up;
mod uri;
mod warning;

use crate::{Error, Plant, Result, error::check_range};
use budget::Budget;
pub use colors::VertexColors;
use fault::Fault;
use source::Source;
use std::{fmt, path::Path};
use strum::{Display, EnumMessage, EnumString, IntoStaticStr, VariantArray};
pub use up::Up;
pub use warning::{Warning, WarningKind};

/// Maximum size of a file, or of one that it refers to: 4 GiB, glTF's own limit for a binary.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Options that control how a file is cut into leaves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImportOptions {
    /// Names of the materials, meshes or nodes, with all below them, that are foliage; `*` in a
    /// name stands for any letters. Empty (default) guesses from alpha mode and shape.
    pub leaves: Vec<String>,
    /// Which pieces form one leaf.
    pub group: Group,
    /// Name of the node or object to take, with all below it. `None` (default) takes the whole
    /// scene without coarser levels of detail, billboards, collision shapes and ground; `*` takes
    /// the whole scene, these and hidden nodes included.
    pub plant: Option<String>,
    /// Use of the vertex colours.
    pub vertex_colors: VertexColors,
    /// The axis of the file that points up.
    pub up: Up,
    /// Alpha, from 0 to 1, at or above which texels of materials that are cut out by alpha are
    /// covered. `None` (default) uses the file's cutoff or, for blended materials, half of the
    /// largest alpha that they reach.
    pub alpha_cutoff: Option<f32>,
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
    /// Anything ignored or changed that does not stop the import, such as a missing texture.
    pub warnings: Vec<Warning>,
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
        &bytes,
        |budget| if is_gltf { gltf::read(&bytes, path, options, budget) } else { obj(&bytes, path, options, budget) },
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
    require_leaves(finish(bytes, |budget| gltf::read(bytes, path, options, budget), path, options)?, path)
}

/// Reads OBJ from memory. `path` names it in messages; materials and textures are looked up in the
/// folder of `path`.
///
/// # Errors
/// As [`load`].
pub fn load_obj_bytes(bytes: &[u8], path: &Path, options: &ImportOptions) -> Result<Imported> {
    require_leaves(finish(bytes, |budget| obj(bytes, path, options, budget), path, options)?, path)
}

fn finish(
    bytes: &[u8],
    read: impl FnOnce(&Budget) -> std::result::Result<Source, Fault>,
    path: &Path,
    options: &ImportOptions,
) -> Result<Imported> {
    options.alpha_cutoff.map_or(Ok(()), |cutoff| check_range("alpha_cutoff", cutoff, 0.0..=1.0))?;
    let budget = Budget::new(options);
    let imported = foreign::check(bytes).and_then(|()| read(&budget)).and_then(|source| {
        let mut source = prepared(source, options);
        alpha_cut::settle(&mut source, options.alpha_cutoff);
        assemble::plant(source, options)
    });
    let imported = imported.map_err(|fault| fault.at(path))?;
    imported.plant.validate()?;
    Ok(imported)
}

fn obj(bytes: &[u8], path: &Path, options: &ImportOptions, budget: &Budget) -> std::result::Result<Source, Fault> {
    let mut source = obj::read(bytes, path, budget)?;
    objects::select(&mut source, options.plant.as_deref())?;
    Ok(source)
}

/// Turns the plant upright and settles its ground and its vertex colours.
fn prepared(mut source: Source, options: &ImportOptions) -> Source {
    let up = up::turn(&mut source, options.up);
    let chosen = options.plant.is_some();
    let ground = if chosen { None } else { ground::leave_out(&mut source, &options.leaves) };
    let colors = colors::settle(&mut source, options.vertex_colors);
    source.warnings.extend([up, ground, colors].into_iter().flatten());
    source
}

fn require_leaves(imported: Imported, path: &Path) -> Result<Imported> {
    if !imported.plant.leaves.is_empty() {
        return Ok(imported);
    }
    let is_invisible = |warning: &&Warning| warning.kind == WarningKind::Invisible;
    if let Some(Warning { message, fix, .. }) = imported.warnings.iter().find(is_invisible) {
        let name = path.display().to_string();
        return Err(Error::NoLeaves { name, reason: message.clone(), fix: fix.clone() });
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
