//! Writes plants as GLB (binary glTF 2.0): one mesh and node for the wood and one for the leaves,
//! with one primitive per material. Redundant data is omitted: colours if all are white, and
//! texture coordinates if the material has no texture.

use super::document::{Document, push};
use crate::{Plant, Result, leaf::Vertex};
use serde_json::{Value, json};

/// Encodes `plant` as a GLB. Leaves keep their order; pivots are not part of the format.
///
/// # Errors
/// [`InvalidPlant`](crate::Error::InvalidPlant); [`TooLarge`](crate::Error::TooLarge) above 4 GiB;
/// [`Unreadable`](crate::Error::Unreadable) for a damaged WebP texture. WebP textures are converted
/// to PNG; other textures are copied unchanged.
pub fn write_glb(plant: &Plant) -> Result<Vec<u8>> {
    plant.validate()?;
    let mut document = Document::new(&plant.materials, &plant.textures);
    add_wood(&mut document, plant);
    add_leaves(&mut document, plant);
    add_scene(&mut document);
    document.finish()
}

fn add_wood(document: &mut Document<'_>, plant: &Plant) {
    let wood = &plant.wood;
    let parts = wood.parts.iter().filter(|part| part.indices[0] < part.indices[1]);
    let primitives = parts.map(|part| {
        let range = part.indices[0] as usize..part.indices[1] as usize;
        primitive(document, &wood.vertices, &wood.indices[range], part.material)
    });
    let primitives = primitives.collect();
    add_mesh(document, "wood", primitives);
}

fn add_leaves(document: &mut Document<'_>, plant: &Plant) {
    let primitives = (0..plant.materials.len() as u32).filter_map(|material| {
        let leaves = plant.leaves.iter().filter(|leaf| leaf.material == material);
        let indices: Vec<u32> = leaves.flat_map(|leaf| plant.indices[leaf.index_range()].to_vec()).collect();
        (!indices.is_empty()).then(|| primitive(document, &plant.vertices, &indices, material))
    });
    let primitives = primitives.collect();
    add_mesh(document, "leaves", primitives);
}

fn add_mesh(document: &mut Document<'_>, name: &str, primitives: Vec<Value>) {
    if primitives.is_empty() {
        return;
    }
    let mesh = push(&mut document.json["meshes"], json!({ "name": name, "primitives": primitives }));
    push(&mut document.json["nodes"], json!({ "name": name, "mesh": mesh }));
}

/// A primitive of the triangles `indices`, with only the vertices that they use.
fn primitive(document: &mut Document<'_>, vertices: &[Vertex], indices: &[u32], material: u32) -> Value {
    let (vertices, indices) = compacted(vertices, indices);
    let is_textured = document.is_textured(material);
    let buffer = &mut document.buffer;
    let mut attributes = json!({
        "POSITION": buffer.positions(vertices.iter().map(|vertex| vertex.position)),
        "NORMAL": buffer.floats("VEC3", vertices.iter().map(|vertex| unit(vertex.normal))),
    });
    if is_textured {
        attributes["TEXCOORD_0"] = buffer.floats("VEC2", vertices.iter().map(|vertex| vertex.uv)).into();
    }
    if vertices.iter().any(|vertex| vertex.color != [1.0; 4]) {
        attributes["COLOR_0"] = buffer.floats("VEC4", vertices.iter().map(|vertex| vertex.color)).into();
    }
    let indices = buffer.indices(&indices, vertices.len());
    json!({ "attributes": attributes, "indices": indices, "material": document.material(material) })
}

/// Adds one scene with all nodes; glTF does not allow an empty scene.
fn add_scene(document: &mut Document<'_>) {
    let nodes = document.json["nodes"].as_array().map_or(0, Vec::len);
    if nodes > 0 {
        document.json["scene"] = json!(0);
        document.json["scenes"] = json!([{ "nodes": (0..nodes).collect::<Vec<_>>() }]);
    }
}

/// The vertices in use, in index order, and `indices` renumbered to match.
pub(super) fn compacted(vertices: &[Vertex], indices: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
    let mut used = vec![false; vertices.len()];
    indices.iter().for_each(|&index| used[index as usize] = true);
    let mut new_index = vec![0; vertices.len()];
    let mut kept = Vec::new();
    for (old, vertex) in vertices.iter().enumerate().filter(|(old, _)| used[*old]) {
        new_index[old] = kept.len() as u32;
        kept.push(*vertex);
    }
    (kept, indices.iter().map(|&index| new_index[index as usize]).collect())
}

/// `normal` at unit length, as glTF requires; +Y for a zero vector.
pub(super) fn unit(normal: [f32; 3]) -> [f32; 3] {
    glam::Vec3::from(normal).normalize_or(glam::Vec3::Y).to_array()
}
