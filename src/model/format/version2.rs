//! The sections of a file of version 2.
//!
//! | tag | content |
//! |---|---|
//! | `ABOU` | name, recipe, largest scale, materials, precision, counts |
//! | `LEAF` | leaf records |
//! | `VERT` | leaf vertices and indices |
//! | `WOOD` | wood |
//! | `TEXT` | textures |
//! | `OUTL` | outlines of cards; left out if there are none, and may be skipped |
//!
//! Each is a record whose byte fields are streams: columns of integers, split into byte planes and
//! deflated where that helps. Floats keep their bits: equal models give equal bytes.

use super::{
    super::{FoliageModel, Precision, Recipe},
    fault::{Decoded, damaged, damaged_in},
    foliage::Foliage,
    ints::Packing,
    leaves::Leaves,
    records::{as_bytes, decode, encode},
    table::{REQUIRED, Section, Tag, join},
    wood::PackedWood,
};
use crate::{
    Error, Result,
    material::{Material, Texture, TextureFormat},
    plant::{MAX_ELEMENTS, MAX_LEAVES, Outline, PlantOf},
};
use serde::{Deserialize, Serialize};
use std::{borrow::Cow, panic::resume_unwind, path::Path, thread};

/// Tag of the only section that a file may lack and a reader may skip.
const OUTLINES: Tag = *b"OUTL";
/// Tags in the order in which the sections are written, and what they hold.
pub(super) const SECTIONS: [(Tag, &str); 6] = [
    (*b"ABOU", "about"),
    (*b"LEAF", "leaf_records"),
    (*b"VERT", "leaf_vertices"),
    (*b"WOOD", "wood"),
    (*b"TEXT", "textures"),
    (OUTLINES, "outlines"),
];

/// Memory that a file may take when it is read: so many bytes, and so many per byte of the file.
const MEMORY: [u64; 2] = [8_000_000, 48];

#[derive(Serialize, Deserialize)]
struct About {
    name: String,
    recipe: Recipe,
    max_scale: f32,
    materials: Vec<Material>,
    precision: Precision,
    counts: Counts,
}

/// Numbers of elements, which bound everything that is allocated.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Counts {
    leaves: u64,
    vertices: u64,
    indices: u64,
    wood_vertices: u64,
    wood_indices: u64,
}

impl Counts {
    fn of(model: &FoliageModel) -> Self {
        Self {
            leaves: model.leaves.len() as u64,
            vertices: model.vertices.len() as u64,
            indices: model.indices.len() as u64,
            wood_vertices: model.wood.vertices.len() as u64,
            wood_indices: model.wood.indices.len() as u64,
        }
    }

    /// Whether a file of `length` bytes accounts for the memory that these counts take.
    fn fit(&self, length: u64) -> bool {
        let most = MAX_ELEMENTS as u64;
        let [vertices, indices] = [[self.vertices, self.wood_vertices], [self.indices, self.wood_indices]];
        let within = self.leaves <= MAX_LEAVES as u64 && vertices.iter().chain(&indices).all(|&count| count <= most);
        // A leaf, vertex or index in memory, its columns and their bytes while they are decoded.
        let bytes = || 128 * self.leaves + 80 * vertices.iter().sum::<u64>() + 12 * indices.iter().sum::<u64>();
        within && bytes() <= MEMORY[0] + MEMORY[1] * length
    }
}

#[derive(Serialize, Deserialize)]
struct PackedTexture<'a> {
    name: String,
    format: TextureFormat,
    #[serde(borrow, serialize_with = "as_bytes")]
    bytes: Cow<'a, [u8]>,
}

/// Encodes a sound model.
pub(super) fn encode_model(model: &FoliageModel) -> Result<Vec<u8>> {
    let packed = encode_by(model, Packing::Tight)?;
    match Counts::of(model).fit(packed.len() as u64) {
        true => Ok(packed),
        false => encode_by(model, Packing::Loose),
    }
}

fn encode_by(model: &FoliageModel, packing: Packing) -> Result<Vec<u8>> {
    let about = About {
        name: model.name.clone(),
        recipe: model.recipe.clone(),
        max_scale: model.max_scale,
        materials: model.materials.clone(),
        precision: model.precision,
        counts: Counts::of(model),
    };
    let texture = |texture: &'_ Texture| PackedTexture {
        name: texture.name.clone(),
        format: texture.format,
        bytes: Cow::Owned(texture.bytes.clone()),
    };
    let textures: Vec<PackedTexture<'_>> = model.textures.iter().map(texture).collect();
    // Wood takes about as long as everything else.
    let [leaves, foliage, wood] = thread::scope(|scope| {
        let wood = scope.spawn(|| encode(&PackedWood::encode(&model.wood, packing)));
        let leaves = encode(&Leaves::encode(&model.leaves, packing));
        let foliage = encode(&Foliage::encode(&model.leaves, &model.vertices, &model.indices, packing));
        [leaves, foliage, wood.join().unwrap_or_else(|panic| resume_unwind(panic))]
    });
    let records = [encode(&about)?, leaves?, foliage?, wood?, encode(&textures)?, encode(&model.outlines)?];
    let sections = SECTIONS.iter().zip(records).map(|((tag, _), record)| match *tag {
        OUTLINES => (*tag, 0, record),
        _ => (*tag, REQUIRED, record),
    });
    let sections: Vec<_> = sections.filter(|(tag, ..)| *tag != OUTLINES || !model.outlines.is_empty()).collect();
    join(&model.name, &sections)
}

/// Decodes the sections of a file that are known.
///
/// # Errors
/// [`Error::Unsupported`] for an unknown section that is required.
pub(super) fn decode_model(path: &Path, sections: &[Section], file: &[u8]) -> Result<FoliageModel> {
    let unknown = sections.iter().find(|section| !is_known(section) && section.flags & REQUIRED != 0);
    if let Some(section) = unknown {
        let feature = format!("section {} of the model", section.name());
        let fix = "read it with a newer version of this program".into();
        return Err(Error::Unsupported { path: path.into(), feature, fix });
    }
    let checked: Vec<&[u8]> = sections.iter().map(|section| section.bytes(path, file)).collect::<Result<_>>()?;
    let found = |tag: Tag| sections.iter().position(|section| section.tag == tag).map(|index| checked[index]);
    let of_tag = |tag: Tag| found(tag).ok_or_else(|| damaged(path, format!("no section {}", tag.escape_ascii())));
    let [about, leaves, foliage, wood, textures, _] = SECTIONS.map(|(tag, _)| of_tag(tag));
    let outlines: Decoded<Vec<Outline>> = found(OUTLINES).map_or_else(|| Ok(Vec::new()), decode);
    let about: About = damaged_in(path, "ABOU", decode(about?))?;
    let counts = about.counts;
    if !counts.fit(file.len() as u64) {
        return Err(damaged(path, format!("{counts:?} in a file of {} bytes", file.len())));
    }
    let [vertices, indices] = [counts.vertices as usize, counts.indices as usize];
    let mut leaves = damaged_in(path, "LEAF", decode_leaves(leaves?, counts.leaves as usize))?;
    let foliage = decode::<Foliage<'_>>(foliage?).and_then(|record| record.decode(&mut leaves, [vertices, indices]));
    let (vertices, indices) = damaged_in(path, "VERT", foliage)?;
    let wood_counts = [counts.wood_vertices as usize, counts.wood_indices as usize];
    let wood = decode::<PackedWood<'_>>(wood?).and_then(|record| record.decode(wood_counts));
    let plant = PlantOf {
        name: about.name,
        vertices,
        indices,
        leaves,
        wood: damaged_in(path, "WOOD", wood)?,
        materials: about.materials,
        textures: damaged_in(path, "TEXT", decode_textures(textures?))?,
        outlines: damaged_in(path, "OUTL", outlines)?,
    };
    let Precision { position, normal_rad, uv, color } = about.precision;
    if ![position, normal_rad, uv, color].iter().all(|step| step.is_finite() && *step >= 0.0) {
        return Err(damaged(path, format!("section ABOU: {:?}", about.precision)));
    }
    Ok(FoliageModel { plant, recipe: about.recipe, max_scale: about.max_scale, precision: about.precision })
}

/// Whether this version reads the section.
pub(super) fn is_known(section: &Section) -> bool {
    SECTIONS.iter().any(|(tag, _)| *tag == section.tag)
}

fn decode_leaves(bytes: &[u8], count: usize) -> Decoded<Vec<super::super::Leaf>> {
    decode::<Leaves<'_>>(bytes)?.decode(count)
}

fn decode_textures(bytes: &[u8]) -> Decoded<Vec<Texture>> {
    let packed: Vec<PackedTexture<'_>> = decode(bytes)?;
    let texture = |PackedTexture { name, format, bytes }| Texture { name, format, bytes: Vec::from(bytes) };
    Ok(packed.into_iter().map(texture).collect())
}
