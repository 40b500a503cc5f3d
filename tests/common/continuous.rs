//! Continuous glTF of a model, written the slow way, from the description of the format.

use super::glb::Gltf;
use foliage_lod::{FoliageModel, leaf::Vertex, material::AlphaMode};
use serde_json::{Value, json};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// Buffer, views and accessors under construction.
#[derive(Default)]
struct Data {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Data {
    fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length }));
        self.views.len() - 1
    }

    fn floats(&mut self, values: &[f32], size: usize) -> usize {
        let view = self.view(values.iter().flat_map(|value| value.to_le_bytes()));
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][size - 1];
        let count = values.len() / size;
        self.accessors.push(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": shape }));
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let view = self.view(indices.iter().flat_map(|index| index.to_le_bytes()));
        let count = indices.len();
        self.accessors
            .push(json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" }));
        self.accessors.len() - 1
    }

    fn attributes(&mut self, vertices: &[Vertex]) -> Value {
        let flat = |get: &dyn Fn(&Vertex) -> Vec<f32>| vertices.iter().flat_map(get).collect::<Vec<f32>>();
        let positions = flat(&|vertex| vertex.position.to_vec());
        let position = self.floats(&positions, 3);
        let end = |of: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
            (0..3).map(|axis| positions.iter().skip(axis).step_by(3).copied().fold(start, of)).collect()
        };
        self.accessors[position]["min"] = json!(end(f32::min, f32::MAX));
        self.accessors[position]["max"] = json!(end(f32::max, f32::MIN));
        json!({
            "POSITION": position,
            "NORMAL": self.floats(&flat(&|vertex| vertex.normal.to_vec()), 3),
            "TEXCOORD_0": self.floats(&flat(&|vertex| vertex.uv.to_vec()), 2),
            "COLOR_0": self.floats(&flat(&|vertex| vertex.color.map(|c| c.min(1.0)).to_vec()), 4),
        })
    }
}

/// The bytes of a GLB.
pub fn glb(model: &FoliageModel) -> Vec<u8> {
    let mut data = Data::default();
    let mut primitives = Vec::new();
    for material in 0..model.materials.len() as u32 {
        let (mut vertices, mut indices, mut numbers) = (Vec::new(), Vec::new(), [const { Vec::new() }; 4]);
        for (number, leaf) in model.leaves.iter().enumerate().filter(|(_, leaf)| leaf.material == material) {
            let geometry = leaf.geometry();
            let first = vertices.len() as u32;
            indices.extend(model.indices[geometry.index_range()].iter().map(|index| index - leaf.vertices[0] + first));
            for vertex in &model.vertices[geometry.vertex_range()] {
                vertices.push(*vertex);
                numbers[0].push(number as f32);
                numbers[1].push(leaf.target().map_or(-1.0, |target| target as f32));
                numbers[2].push(leaf.scale);
                numbers[3].extend(leaf.pivot);
            }
        }
        if !indices.is_empty() {
            let mut attributes = data.attributes(&vertices);
            for ((name, values), size) in
                ["_LEAF", "_TARGET", "_SCALE", "_PIVOT"].iter().zip(&numbers).zip([1, 1, 1, 3])
            {
                attributes[*name] = data.floats(values, size).into();
            }
            let indices = data.indices(&indices);
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material }));
        }
    }
    for part in &model.wood.parts {
        let attributes = data.attributes(&model.wood.vertices);
        let indices = data.indices(&model.wood.indices[part.indices[0] as usize..part.indices[1] as usize]);
        primitives.push(json!({ "attributes": attributes, "indices": indices, "material": part.material }));
    }
    let sphere = model.sphere();
    let about = json!({
        "version": 1, "leaves": model.leaves.len(), "maxScale": model.max_scale, "radius": sphere.radius,
        "center": sphere.center,
    });
    let mut json = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": model.name, "extras": { "foliageLod": about } }],
        "meshes": [{ "name": model.name, "primitives": primitives }], "materials": materials(model),
    });
    if !model.textures.is_empty() {
        let views: Vec<usize> = model.textures.iter().map(|texture| data.view(texture.bytes.iter().copied())).collect();
        let image = |view: &usize| json!({ "bufferView": view, "mimeType": "image/png" });
        json["images"] = views.iter().map(image).collect();
        json["textures"] = (0..views.len()).map(|source| json!({ "source": source })).collect();
    }
    json["buffers"] = json!([{ "byteLength": data.bytes.len() }]);
    json["bufferViews"] = data.views.into();
    json["accessors"] = data.accessors.into();
    Gltf { json, buffer: data.bytes }.glb()
}

fn materials(model: &FoliageModel) -> Value {
    let materials = model.materials.iter().map(|material| {
        let mut pbr = json!({ "metallicFactor": 0.0, "baseColorFactor": material.base_color });
        if let Some(texture) = material.texture {
            pbr["baseColorTexture"] = json!({ "index": texture });
        }
        let mut json = json!({ "name": material.name, "pbrMetallicRoughness": pbr, "doubleSided": true });
        if material.alpha_mode != AlphaMode::Opaque {
            json["alphaMode"] = json!("MASK");
            json["alphaCutoff"] = json!(material.alpha_cutoff);
        }
        json
    });
    materials.collect()
}
