//! Writes plants as GLB (binary glTF 2.0), following the Khronos specification.
//!
//! There is one buffer; one bufferView per array, each starting at a multiple of 4 bytes; and one
//! mesh and node for the wood and one for the leaves, with one primitive per material. Redundant
//! data is omitted: colours if all are white, texture coordinates if the material has no texture,
//! and unused materials and textures.

mod buffer;

use crate::{
    Error, Plant, Result,
    leaf::Vertex,
    material::{AlphaMode, Material, Wrap},
};
use buffer::Buffer;
use serde_json::{Value, json};

/// First word of a GLB file: "glTF".
const MAGIC: u32 = 0x4654_6C67;
/// Container version.
const VERSION: u32 = 2;
/// Chunk types "JSON" and "BIN\0".
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;
/// Sampler filters: linear; linear between linear mipmaps.
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// Encodes `plant` as a GLB. Leaves keep their order; pivots are not part of the format.
///
/// # Errors
/// [`InvalidPlant`](Error::InvalidPlant); [`TooLarge`](Error::TooLarge) above 4 GiB;
/// [`Unreadable`](Error::Unreadable) for a damaged WebP texture. WebP textures are converted to
/// PNG; other textures are copied unchanged.
pub fn write_glb(plant: &Plant) -> Result<Vec<u8>> {
    plant.validate()?;
    let mut document = Document::new(plant);
    document.add_wood();
    document.add_leaves();
    document.add_textures()?;
    document.add_scene();
    let Document { buffer, json, .. } = document;
    let (json, bin) = buffer.into_parts(json);
    container(&json, bin)
}

/// Writes the header and the two chunks; JSON is padded with spaces, binary data with zeros.
fn container(json: &Value, mut bin: Vec<u8>) -> Result<Vec<u8>> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + if bin.is_empty() { 0 } else { 8 + bin.len() };
    let total = u32::try_from(length).map_err(|_| Error::TooLarge {
        what: "the size of the GLB in bytes".into(),
        value: length as u64,
        limit: u64::from(u32::MAX),
        fix: "use fewer leaves or smaller textures".into(),
    })?;
    let mut bytes = Vec::with_capacity(length);
    let word = |bytes: &mut Vec<u8>, value: u32| bytes.extend(value.to_le_bytes());
    for value in [MAGIC, VERSION, total, text.len() as u32, JSON_CHUNK] {
        word(&mut bytes, value);
    }
    bytes.extend(text);
    if bin.is_empty() {
        return Ok(bytes);
    }
    word(&mut bytes, bin.len() as u32);
    word(&mut bytes, BIN_CHUNK);
    bytes.extend(bin);
    Ok(bytes)
}

/// The JSON under construction.
struct Document<'a> {
    plant: &'a Plant,
    buffer: Buffer,
    json: Value,
    /// Index of the glTF material of each plant material, once it is written.
    materials: Vec<Option<usize>>,
    /// Plant texture and wrap modes of each glTF texture, in order of first use.
    textures: Vec<(u32, [Wrap; 2])>,
}

impl<'a> Document<'a> {
    fn new(plant: &'a Plant) -> Self {
        let generator = concat!("foliage-lod ", env!("CARGO_PKG_VERSION"));
        let json = json!({
            "asset": { "version": "2.0", "generator": generator },
        });
        let materials = vec![None; plant.materials.len()];
        Self { plant, buffer: Buffer::default(), json, materials, textures: Vec::new() }
    }

    fn add_wood(&mut self) {
        let wood = &self.plant.wood;
        let parts = wood.parts.iter().filter(|part| part.indices[0] < part.indices[1]);
        let primitives = parts
            .map(|part| {
                let range = part.indices[0] as usize..part.indices[1] as usize;
                self.primitive(&wood.vertices, &wood.indices[range], part.material)
            })
            .collect();
        self.add_mesh("wood", primitives);
    }

    fn add_leaves(&mut self) {
        let plant = self.plant;
        let primitives = (0..plant.materials.len() as u32)
            .filter_map(|material| {
                let leaves = plant.leaves.iter().filter(|leaf| leaf.material == material);
                let indices: Vec<u32> = leaves.flat_map(|leaf| plant.indices[leaf.index_range()].to_vec()).collect();
                (!indices.is_empty()).then(|| self.primitive(&plant.vertices, &indices, material))
            })
            .collect();
        self.add_mesh("leaves", primitives);
    }

    fn add_mesh(&mut self, name: &str, primitives: Vec<Value>) {
        if primitives.is_empty() {
            return;
        }
        let mesh = push(&mut self.json["meshes"], json!({ "name": name, "primitives": primitives }));
        push(&mut self.json["nodes"], json!({ "name": name, "mesh": mesh }));
    }

    /// A primitive of the triangles `indices`, with only the vertices that they use.
    fn primitive(&mut self, vertices: &[Vertex], indices: &[u32], material: u32) -> Value {
        let (vertices, indices) = compacted(vertices, indices);
        let mut attributes = json!({
            "POSITION": self.buffer.positions(vertices.iter().map(|vertex| vertex.position)),
            "NORMAL": self.buffer.floats("VEC3", vertices.iter().map(|vertex| unit(vertex.normal))),
        });
        if self.plant.materials[material as usize].texture.is_some() {
            attributes["TEXCOORD_0"] = self.buffer.floats("VEC2", vertices.iter().map(|vertex| vertex.uv)).into();
        }
        if vertices.iter().any(|vertex| vertex.color != [1.0; 4]) {
            attributes["COLOR_0"] = self.buffer.floats("VEC4", vertices.iter().map(|vertex| vertex.color)).into();
        }
        let indices = self.buffer.indices(&indices, vertices.len());
        json!({ "attributes": attributes, "indices": indices, "material": self.material(material) })
    }

    /// The glTF index of a plant material, which is written on first use.
    fn material(&mut self, index: u32) -> usize {
        if let Some(known) = self.materials[index as usize] {
            return known;
        }
        let material = &self.plant.materials[index as usize];
        let mut pbr = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.9 });
        if material.base_color != [1.0; 4] {
            pbr["baseColorFactor"] = json!(material.base_color);
        }
        if let Some(texture) = material.texture {
            pbr["baseColorTexture"] = json!({ "index": self.texture(texture, material.wrap) });
        }
        let written = push(&mut self.json["materials"], material_json(material, pbr));
        self.materials[index as usize] = Some(written);
        written
    }

    fn texture(&mut self, texture: u32, wrap: [Wrap; 2]) -> usize {
        let known = self.textures.iter().position(|&used| used == (texture, wrap));
        known.unwrap_or_else(|| {
            self.textures.push((texture, wrap));
            self.textures.len() - 1
        })
    }

    /// Adds one scene with all nodes; glTF does not allow an empty scene.
    fn add_scene(&mut self) {
        let nodes = self.json["nodes"].as_array().map_or(0, Vec::len);
        if nodes > 0 {
            self.json["scene"] = json!(0);
            self.json["scenes"] = json!([{ "nodes": (0..nodes).collect::<Vec<_>>() }]);
        }
    }

    /// Writes the images, samplers and textures in use.
    fn add_textures(&mut self) -> Result<()> {
        let (mut images, mut samplers): (Vec<u32>, Vec<[Wrap; 2]>) = (Vec::new(), Vec::new());
        for (texture, wrap) in std::mem::take(&mut self.textures) {
            let source = position_or_push(&mut images, texture);
            let sampler = position_or_push(&mut samplers, wrap);
            push(&mut self.json["textures"], json!({ "source": source, "sampler": sampler }));
        }
        for image in images {
            let json = self.buffer.image(&self.plant.textures[image as usize])?;
            push(&mut self.json["images"], json);
        }
        for [u, v] in samplers {
            let sampler = json!({
                "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": wrap_code(u), "wrapT": wrap_code(v),
            });
            push(&mut self.json["samplers"], sampler);
        }
        Ok(())
    }
}

fn material_json(material: &Material, pbr: Value) -> Value {
    let mut json = json!({ "pbrMetallicRoughness": pbr });
    if !material.name.is_empty() {
        json["name"] = json!(material.name);
    }
    match material.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask => {
            json["alphaMode"] = json!("MASK");
            json["alphaCutoff"] = json!(material.alpha_cutoff);
        }
        AlphaMode::Blend => json["alphaMode"] = json!("BLEND"),
    }
    if material.double_sided {
        json["doubleSided"] = json!(true);
    }
    json
}

/// glTF constant of a wrap mode.
fn wrap_code(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    }
}

/// The vertices in use, in index order, and `indices` renumbered to match.
fn compacted(vertices: &[Vertex], indices: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
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
fn unit(normal: [f32; 3]) -> [f32; 3] {
    glam::Vec3::from(normal).normalize_or(glam::Vec3::Y).to_array()
}

/// Appends to a JSON array, which is created if missing; returns the index of the item.
fn push(array: &mut Value, item: Value) -> usize {
    if array.is_null() {
        *array = json!([]);
    }
    array.as_array_mut().map_or(0, |items| {
        items.push(item);
        items.len() - 1
    })
}

fn position_or_push<T: PartialEq>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}
