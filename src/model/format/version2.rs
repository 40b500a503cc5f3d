//! The sections of a file of version 2.
//!
//! | tag | content |
//! |---|---|
//! | `ABOU` | name, recipe, largest scale, materials, precision, counts |
//! | `LEAF` | leaf records |
//! | `VERT` | leaf vertices and indices |
//! | `WOOD` | wood |
//! | `TEXT` | textures |
//! | `SHAP` | shapes that leaves share, and these leaves; left out if there are none |
//! | `OUTL` | outlines of cards; left out if there are none, and may be skipped |
//! | `GROW` | how enlarged leaves are drawn; left out if plainly scaled, and may be skipped |
//! | `INTR` | intrinsic cost of the recipe; left out if it is 0, and may be skipped |
//! | `IMPO` | impostor; left out if there is none, and may be skipped |
//! | `SLID` | order in which the wood loses detail; left out if there is none, and may be skipped |
//! | `RIBN` | how wide ribbons of wood are drawn; left out if there are none, and may be skipped |
//! | `CURV` | error curve; left out if none was measured, and may be skipped |
//! | `FILL` | zeros, if the file would else take too much memory for its size; may be skipped |
//!
//! Each is a record whose byte fields are streams: columns of integers, split into byte planes and
//! deflated where that helps. Floats keep their bits: equal models give equal bytes.

use super::{
    super::{Clusters, ErrorCurve, FoliageModel, Growth, Precision, Recipe},
    clusters::PackedClusters,
    fault::{Decoded, MAX_FILE_BYTES, damaged, damaged_in},
    foliage::Foliage,
    impostor::PackedImpostor,
    leaves::Leaves,
    records::{as_bytes, decode, encode},
    shapes::{Shapes, Sources},
    table::{REQUIRED, Section, Tag, join, joined_bytes},
    wood::PackedWood,
    wood_order::PackedWoodOrder,
};
use crate::{
    Error, Result,
    material::{Material, Texture, TextureFormat},
    plant::{MAX_ELEMENTS, MAX_LEAVES, Outline, PlantOf},
    wood::{Boosts, WoodOrder},
};
use serde::{Deserialize, Serialize};
use std::{borrow::Cow, panic::resume_unwind, path::Path, thread};

/// Tags of sections that a file may lack.
const SHAPES: Tag = *b"SHAP";
const OUTLINES: Tag = *b"OUTL";
const GROWTH: Tag = *b"GROW";
const INTRINSIC: Tag = *b"INTR";
const IMPOSTOR: Tag = *b"IMPO";
const WOOD_ORDER: Tag = *b"SLID";
const RIBBONS: Tag = *b"RIBN";
const CURVE: Tag = *b"CURV";
const CLUSTERS: Tag = *b"CLUS";
const FILL: Tag = *b"FILL";
/// Tags in the order in which the sections are written, and what they hold.
pub(super) const SECTIONS: [(Tag, &str); 15] = [
    (*b"ABOU", "about"),
    (*b"LEAF", "leaf_records"),
    (*b"VERT", "leaf_vertices"),
    (*b"WOOD", "wood"),
    (*b"TEXT", "textures"),
    (SHAPES, "shapes"),
    (OUTLINES, "outlines"),
    (GROWTH, "growth"),
    (INTRINSIC, "intrinsic"),
    (IMPOSTOR, "impostor"),
    (WOOD_ORDER, "wood_order"),
    (RIBBONS, "ribbons"),
    (CURVE, "curve"),
    (CLUSTERS, "clusters"),
    (FILL, "fill"),
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

    /// Numbers of vertices and triangles of the wood.
    fn of_wood(&self) -> [usize; 2] {
        [self.wood_vertices as usize, self.wood_indices as usize / 3]
    }

    /// Length of the smallest file that accounts for the memory that reading these elements takes,
    /// `copied` vertices and indices among them in copies of shapes, and `others` bytes. `None` if
    /// that is too much.
    fn least_bytes(&self, copied: Option<[u64; 2]>, others: u64) -> Option<u64> {
        let [in_copies, most] = [copied.unwrap_or_default(), [MAX_ELEMENTS as u64; 2]];
        let all = [self.vertices, self.indices, self.wood_vertices, self.wood_indices];
        let within = self.leaves <= MAX_LEAVES as u64 && all.iter().all(|&count| count <= most[0]);
        if !within || in_copies[0] > self.vertices || in_copies[1] > self.indices {
            return None;
        }
        // A leaf, vertex or index in memory, its columns and their bytes while they are decoded.
        let leaves = (128 + 96 * u64::from(copied.is_some())) * self.leaves;
        let vertices = 80 * (self.vertices - in_copies[0] + self.wood_vertices) + 48 * in_copies[0];
        let indices = 12 * (self.indices - in_copies[1] + self.wood_indices) + 4 * in_copies[1];
        Some((leaves + vertices + indices + others).saturating_sub(MEMORY[0]).div_ceil(MEMORY[1]))
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
    let counts = Counts::of(model);
    let about = About {
        name: model.name.clone(),
        recipe: model.recipe.clone(),
        max_scale: model.max_scale,
        materials: model.materials.clone(),
        precision: model.precision,
        counts,
    };
    let texture = |texture: &'_ Texture| PackedTexture {
        name: texture.name.clone(),
        format: texture.format,
        bytes: Cow::Owned(texture.bytes.clone()),
    };
    let textures: Vec<PackedTexture<'_>> = model.textures.iter().map(texture).collect();
    // Wood takes about as long as the leaves.
    let (leaf_sections, wood) = thread::scope(|scope| {
        let wood = scope.spawn(|| encode(&PackedWood::encode(&model.wood)));
        let leaves = LeafSections::encode(model);
        (leaves, wood.join().unwrap_or_else(|panic| resume_unwind(panic)))
    });
    let LeafSections { leaves, vertices, shapes, copied } = leaf_sections?;
    let impostor = model.impostor.as_ref().map(PackedImpostor::encode);
    let order = model.wood_order.as_ref().map(PackedWoodOrder::encode);
    let has_cards = !model.clusters.cards().is_empty();
    let clusters = has_cards.then(|| PackedClusters::encode(&model.clusters));
    let records = [
        encode(&about)?,
        leaves,
        vertices,
        wood?,
        encode(&textures)?,
        shapes,
        encode_if(!model.outlines.is_empty(), &model.outlines)?,
        encode_if(model.growth != Growth::default(), &model.growth)?,
        encode_if(model.recipe.intrinsic != 0.0, &model.recipe.intrinsic)?,
        impostor.as_ref().map(encode).transpose()?.unwrap_or_default(),
        order.as_ref().map(encode).transpose()?.unwrap_or_default(),
        model.wood_order.as_ref().and_then(|order| order.boosts.as_ref()).map(encode).transpose()?.unwrap_or_default(),
        model.curve.as_ref().map(encode).transpose()?.unwrap_or_default(),
        clusters.as_ref().map(encode).transpose()?.unwrap_or_default(),
        Vec::new(),
    ];
    let is_required =
        |tag| ![OUTLINES, GROWTH, INTRINSIC, IMPOSTOR, WOOD_ORDER, RIBBONS, CURVE, CLUSTERS, FILL].contains(&tag);
    let sections = SECTIONS
        .iter()
        .zip(records)
        .map(|((tag, _), record)| (*tag, if is_required(*tag) { REQUIRED } else { 0 }, record));
    let mut sections: Vec<(Tag, u32, Vec<u8>)> = sections.filter(|(.., record)| !record.is_empty()).collect();
    let others = others_memory(impostor.as_ref(), order.as_ref(), clusters.as_ref(), &counts);
    let missing = counts.least_bytes(copied, others).unwrap_or_default().saturating_sub(joined_bytes(&sections));
    if missing > 0 && missing <= MAX_FILE_BYTES {
        sections.push((FILL, 0, vec![0; missing as usize]));
    }
    join(&model.name, &sections)
}

/// Number of bytes that the leaves of a sound model take in its file.
pub(in crate::model) fn leaf_bytes(model: &FoliageModel) -> Result<usize> {
    let LeafSections { leaves, vertices, shapes, .. } = LeafSections::encode(model)?;
    Ok(leaves.len() + vertices.len() + shapes.len())
}

/// The sections of leaves; that of shapes is empty if there are none.
struct LeafSections {
    leaves: Vec<u8>,
    vertices: Vec<u8>,
    shapes: Vec<u8>,
    /// Numbers of vertices and of indices of copies, if there are any.
    copied: Option<[u64; 2]>,
}

impl LeafSections {
    fn encode(model: &FoliageModel) -> Result<Self> {
        let (sources, copies) = Sources::of(model);
        let shapes = (!copies.is_empty()).then(|| Shapes::encode(model, &sources, &copies));
        Ok(Self {
            leaves: encode(&Leaves::encode(&model.leaves))?,
            vertices: encode(&Foliage::encode(model, &sources))?,
            shapes: shapes.as_ref().map(encode).transpose()?.unwrap_or_default(),
            copied: shapes.as_ref().map(Shapes::copied),
        })
    }
}

/// The record, or nothing if it is not needed.
fn encode_if<T: Serialize>(is_needed: bool, record: &T) -> Result<Vec<u8>> {
    if is_needed { encode(record) } else { Ok(Vec::new()) }
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
    let [about, leaves, foliage, wood, textures, ..] = SECTIONS.map(|(tag, _)| of_tag(tag));
    let shapes = found(SHAPES).map(decode::<Shapes<'_>>).transpose();
    let outlines: Decoded<Vec<Outline>> = found(OUTLINES).map_or_else(|| Ok(Vec::new()), decode);
    let growth = found(GROWTH).map_or_else(|| Ok(Growth::default()), decode);
    let intrinsic = damaged_in(path, "INTR", found(INTRINSIC).map_or(Ok(0.0), decode))?;
    if !(0.0..=1.0).contains(&intrinsic) {
        return Err(damaged(path, format!("section INTR: {intrinsic}")));
    }
    let impostor = damaged_in(path, "IMPO", found(IMPOSTOR).map(decode::<PackedImpostor<'_>>).transpose())?;
    let order = damaged_in(path, "SLID", found(WOOD_ORDER).map(decode::<PackedWoodOrder<'_>>).transpose())?;
    let boosts = damaged_in(path, "RIBN", found(RIBBONS).map(decode::<Boosts>).transpose())?;
    let curve = damaged_in(path, "CURV", found(CURVE).map(decode::<ErrorCurve>).transpose())?;
    let clusters = damaged_in(path, "CLUS", found(CLUSTERS).map(decode::<PackedClusters<'_>>).transpose())?;
    let about: About = damaged_in(path, "ABOU", decode(about?))?;
    let counts = about.counts;
    let shapes = damaged_in(path, "SHAP", shapes)?;
    let copied = shapes.as_ref().map(Shapes::copied);
    let others = others_memory(impostor.as_ref(), order.as_ref(), clusters.as_ref(), &counts);
    if counts.least_bytes(copied, others).is_none_or(|least| least > file.len() as u64) {
        return Err(damaged(path, format!("{counts:?}, {copied:?} in copies, in a file of {} bytes", file.len())));
    }
    let mut leaves = damaged_in(path, "LEAF", decode_leaves(leaves?, counts.leaves as usize))?;
    let sources = shapes.as_ref().map_or_else(|| Ok(Sources::own(leaves.len())), |shapes| shapes.sources(leaves.len()));
    let sources = damaged_in(path, "SHAP", sources)?;
    let of_leaves = [counts.vertices, counts.indices].map(|count| count as usize);
    let copied = copied.unwrap_or_default().map(|count| count as usize);
    let foliage = decode::<Foliage<'_>>(foliage?);
    let foliage = foliage.and_then(|record| record.decode(&mut leaves, &sources, of_leaves, copied));
    let (mut vertices, indices) = damaged_in(path, "VERT", foliage)?;
    let copies = shapes.map_or_else(|| Ok(Vec::new()), |shapes| shapes.decode(&leaves, &sources, &mut vertices));
    let copies = damaged_in(path, "SHAP", copies)?;
    let wood_counts = [counts.wood_vertices as usize, counts.wood_indices as usize];
    let wood = decode::<PackedWood<'_>>(wood?).and_then(|record| record.decode(wood_counts));
    let wood_order = order.map(|packed| packed.decode(counts.of_wood())).transpose();
    let wood_order = damaged_in(path, "SLID", wood_order)?;
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
    Ok(FoliageModel {
        plant,
        recipe: Recipe { intrinsic, ..about.recipe },
        max_scale: about.max_scale,
        precision: about.precision,
        growth: damaged_in(path, "GROW", growth)?,
        copies,
        impostor: damaged_in(path, "IMPO", impostor.map(|packed| packed.decode()).transpose())?,
        wood_order: wood_order.map(|order| WoodOrder { boosts, ..order }),
        curve,
        clusters: match clusters {
            Some(packed) => damaged_in(path, "CLUS", packed.decode())?,
            None => Clusters::default(),
        },
    })
}

/// Memory that reading the impostor, the order of the wood and the cards takes, in bytes.
fn others_memory(
    impostor: Option<&PackedImpostor<'_>>,
    order: Option<&PackedWoodOrder<'_>>,
    clusters: Option<&PackedClusters<'_>>,
    counts: &Counts,
) -> u64 {
    let [vertices, triangles] = [counts.wood_vertices, counts.wood_indices / 3];
    let order = order.map_or(0, |order| order.memory([vertices, triangles]));
    let clusters = clusters.map_or(0, PackedClusters::memory);
    impostor.map_or(0, PackedImpostor::memory).saturating_add(order).saturating_add(clusters)
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
