//! Reads continuous glTF: a GLB that every viewer shows as the full tree, and that holds a model's
//! leaves in drawing order.
//!
//! ```text
//! bytes --file--> JSON, binary --place----> primitives, each with its transform
//!                              --arrays---> attributes --leaves--> leaves in drawing order
//!                              --surfaces-> materials and textures
//!                                           = FoliageModel
//! ```
//!
//! `docs/CONTINUOUS_GLTF.md` describes the format. The reader takes files as `foliage-lod export`
//! writes them, and those that a tool has rewritten since: nodes under nodes, attributes of other
//! component types, triangles in another order. Memory is bounded by the length of the file.
//!
//! Limits: what the format leaves out is not in the model: tiles, tone, outlines, the order of the
//! wood and the impostor. Meshes that a tool has compressed, data outside of the file and mirrored
//! nodes are refused.

mod arrays;
mod file;
mod leaves;
mod place;
mod surfaces;

use crate::{
    Error, FoliageModel, Result,
    leaf::Vertex,
    material::Material,
    model::{CurveCorner, ErrorCurve, MAX_FILE_BYTES},
    plant::{MAX_ELEMENTS, MAX_LEAVES, PlantOf, Wood, WoodPart},
};
use arrays::Arrays;
use file::{About, Curve, File, Primitive};
use leaves::Part;
use place::Place;

/// Version of the format.
pub const VERSION: u32 = 1;

/// Diameter in pixels that a curve is guessed for, the area of its disc, and number of its steps.
const GUESSED_PX: f32 = 64.0;
const DISC_PX: f32 = 0.25 * std::f32::consts::PI * GUESSED_PX * GUESSED_PX;
const GUESSED_STEPS: u32 = 32;

/// How a file is mended that is damaged or was rewritten by a tool.
const AGAIN: &str = "export it again: `foliage-lod export MODEL.vds -o TREE.glb`";

/// Whether these are the bytes of a binary glTF, continuous or not.
pub fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(file::MAGIC)
}

/// Reads a model from the bytes of a continuous glTF, in the space of its scene.
///
/// Numbers are those of the file: of one that was written with `GlbOptions::exact`, bit for bit
/// those of the model. Errors of single leaves are 0; the [curve](FoliageModel::curve) has them in
/// total. O(file).
///
/// # Errors
/// [`Unreadable`](Error::Unreadable) if the file is damaged, or no continuous glTF;
/// [`Unsupported`](Error::Unsupported) for a newer version of the format, compressed meshes and
/// other extensions; [`TooLarge`](Error::TooLarge) above [`MAX_FILE_BYTES`] or the limits of a
/// plant; [`InvalidModel`](Error::InvalidModel). The path in the error is `model`.
pub fn read(bytes: &[u8]) -> Result<FoliageModel> {
    limit("the length of the file in bytes", bytes.len() as u64, MAX_FILE_BYTES)?;
    let file = File::new(bytes)?;
    let (name, about) = about(&file)?;
    let mut arrays = Arrays::new(&file);
    let (mut parts, mut wood) = (Vec::new(), Wood::default());
    for (primitive, place) in place::primitives(&file)? {
        let material = material(primitive, &file)?;
        let vertices = vertices(&mut arrays, primitive, &place)?;
        let indices = arrays.indices(primitive.indices, vertices.len())?;
        match primitive.attributes.contains_key("_LEAF") {
            true => parts.push(Part::new(&mut arrays, primitive, &place, material, vertices, indices)?),
            false => add_wood(&mut wood, material, vertices, &indices)?,
        }
    }
    let (mut materials, textures) = surfaces::surfaces(&file)?;
    if materials.is_empty() {
        materials.push(Material::default());
    }
    let plant = PlantOf { name, wood, materials, textures, ..PlantOf::default() };
    let mut model =
        FoliageModel { plant, curve: Some(curve(about.curve.as_ref(), about.leaves)?), ..FoliageModel::default() };
    leaves::add(&mut model, &parts, about.leaves)?;
    model.validate()?;
    Ok(model)
}

fn damaged(reason: impl Into<String>) -> Error {
    Error::unreadable("model", reason, AGAIN)
}

fn unsupported(feature: impl Into<String>, fix: &str) -> Error {
    Error::Unsupported { path: "model".into(), feature: feature.into(), fix: fix.into() }
}

fn limit(what: &str, value: u64, limit: u64) -> Result<()> {
    if value <= limit {
        return Ok(());
    }
    Err(Error::TooLarge { what: what.into(), value, limit, fix: "cut the plant into smaller ones".into() })
}

/// The name of the plant, and what its node tells.
fn about<'a>(file: &'a File<'_>) -> Result<(String, &'a About)> {
    let mut told = file.json.nodes.iter().filter_map(|node| Some((node, node.extras.as_ref()?.foliage_lod.as_ref()?)));
    let Some((node, about)) = told.next() else {
        let fix = "write one from a model: `foliage-lod export MODEL.vds -o TREE.glb`";
        return Err(Error::unreadable("model", "is no continuous glTF: no node has `extras.foliageLod`", fix));
    };
    if told.next().is_some() {
        return Err(Error::unreadable("model", "holds several plants", "put each into a file of its own"));
    }
    if about.version != VERSION {
        let feature = format!("version {} of continuous glTF", about.version);
        return Err(unsupported(feature, "take a newer foliage-lod, or export the model with this one"));
    }
    limit("the number of leaves", about.leaves as u64, MAX_LEAVES as u64)?;
    Ok((node.name.clone(), about))
}

/// The error curve of the file. Where a tool has dropped it, the error is guessed to fall from that
/// of a disc to none with the square of the missing share of the leaves.
fn curve(told: Option<&Curve>, leaves: usize) -> Result<ErrorCurve> {
    let Some(Curve { size_px, size_power, leaves, errors_px }) = told else {
        let at = |step: u32| (leaves as u64 * u64::from(step) / u64::from(GUESSED_STEPS)) as u32;
        let missing = |n: u32| 1.0 - n as f32 / leaves as f32;
        let mut counts: Vec<u32> = (0..=GUESSED_STEPS).map(at).collect();
        counts.dedup();
        let points = counts.into_iter().map(|n| (n, DISC_PX * missing(n) * missing(n)));
        return Ok(ErrorCurve::hull(GUESSED_PX, 2.0, points));
    };
    if leaves.len() != errors_px.len() {
        return Err(damaged("the error curve has more counts than errors, or fewer"));
    }
    let corners = leaves.iter().zip(errors_px).map(|(&leaves, &error_px)| CurveCorner { leaves, error_px });
    Ok(ErrorCurve { size_px: *size_px, size_power: *size_power, corners: corners.collect() })
}

/// The material of a primitive, of those in the file; the first one stands in where there is none.
fn material(primitive: &Primitive, file: &File<'_>) -> Result<u32> {
    match primitive.material {
        None if file.json.materials.is_empty() => Ok(0),
        Some(material) if material < file.json.materials.len() => Ok(material as u32),
        None => Err(damaged("a primitive has no material")),
        Some(material) => Err(damaged(format!("there is no material {material}"))),
    }
}

/// The vertices of a primitive, in the space of the scene.
fn vertices(arrays: &mut Arrays<'_>, primitive: &Primitive, place: &Place) -> Result<Vec<Vertex>> {
    let positions = arrays.vectors::<3>(primitive, "POSITION")?.ok_or_else(|| damaged("a primitive lacks POSITION"))?;
    let mut vertices: Vec<Vertex> = positions
        .iter()
        .map(|&position| Vertex {
            position: place.point(position),
            normal: [0.0, 1.0, 0.0],
            uv: [0.0; 2],
            color: [1.0; 4],
        })
        .collect();
    let count = vertices.len();
    let of_all = |name: &str, found: usize| match found == count {
        true => Ok(()),
        false => Err(damaged(format!("{name} has {found} values for {count} vertices"))),
    };
    if let Some(normals) = arrays.vectors::<3>(primitive, "NORMAL")? {
        of_all("NORMAL", normals.len())?;
        vertices.iter_mut().zip(&normals).for_each(|(vertex, &normal)| vertex.normal = place.normal(normal));
    }
    if let Some(uvs) = arrays.vectors::<2>(primitive, "TEXCOORD_0")? {
        of_all("TEXCOORD_0", uvs.len())?;
        vertices.iter_mut().zip(&uvs).for_each(|(vertex, &uv)| vertex.uv = uv);
    }
    if let Some(colors) = arrays.colors(primitive)? {
        of_all("COLOR_0", colors.len())?;
        vertices.iter_mut().zip(&colors).for_each(|(vertex, &color)| vertex.color = color);
    }
    Ok(vertices)
}

fn add_wood(wood: &mut Wood, material: u32, vertices: Vec<Vertex>, indices: &[u32]) -> Result<()> {
    let most = MAX_ELEMENTS as u64;
    limit("the number of vertices of the wood", (wood.vertices.len() + vertices.len()) as u64, most)?;
    limit("the number of indices of the wood", (wood.indices.len() + indices.len()) as u64, most)?;
    let [from, first] = [wood.indices.len() as u32, wood.vertices.len() as u32];
    wood.indices.extend(indices.iter().map(|index| first + index));
    wood.vertices.extend(vertices);
    wood.parts.push(WoodPart { indices: [from, wood.indices.len() as u32], material });
    Ok(())
}
