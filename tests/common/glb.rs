//! Small glTF files built in memory: a row of cards, as JSON and a buffer that a test can change
//! before encoding them.

#![allow(dead_code)] // Each test binary uses only some of it.

use serde_json::{Value, json};

/// A glTF file as JSON and a buffer.
#[derive(Clone)]
pub struct Gltf {
    /// The JSON part.
    pub json: Value,
    /// Buffer 0.
    pub buffer: Vec<u8>,
}

/// `count` unit cards in a row along x, 3 apart, facing +z. Accessor 0 holds positions, 1 texture
/// coordinates and 2 indices (unsigned short). There is one node, one mesh and one masked material
/// named "leaf".
pub fn cards(count: u16) -> Gltf {
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut buffer = Vec::new();
    for i in 0..count {
        for [x, y] in corners {
            [x + 3.0 * f32::from(i), y, 0.0].iter().for_each(|value| buffer.extend(value.to_le_bytes()));
        }
    }
    for [u, v] in (0..count).flat_map(|_| corners) {
        [u, v].iter().for_each(|value| buffer.extend(value.to_le_bytes()));
    }
    for index in (0..count).flat_map(|i| [0, 1, 2, 0, 2, 3].map(|corner| i * 4 + corner)) {
        buffer.extend(index.to_le_bytes());
    }
    let count = usize::from(count);
    let [positions, uvs, indices] = [count * 48, count * 32, count * 12];
    let json = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "crown" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "name": "leaf", "alphaMode": "MASK", "doubleSided": true }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": count * 4 },
            { "bufferView": 1, "componentType": 5126, "type": "VEC2", "count": count * 4 },
            { "bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": count * 6 }
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions },
            { "buffer": 0, "byteOffset": positions, "byteLength": uvs },
            { "buffer": 0, "byteOffset": positions + uvs, "byteLength": indices }
        ],
        "buffers": [{ "byteLength": positions + uvs + indices }]
    });
    Gltf { json, buffer }
}

impl Gltf {
    /// Splits a valid binary glTF file into its parts.
    pub fn of(bytes: &[u8]) -> Self {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let (json, buffer) = bytes[20..].split_at(length);
        Self { json: serde_json::from_slice(json).unwrap(), buffer: buffer[8..].to_vec() }
    }

    /// Appends `bytes` to the buffer, with a view and `accessor`; returns the accessor's index.
    pub fn push(&mut self, bytes: &[u8], mut accessor: Value) -> usize {
        let view = json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        self.buffer.extend_from_slice(bytes);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        accessor["bufferView"] = json!(views.len() - 1);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    /// Encodes the file as binary glTF.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut buffer = self.buffer.clone();
        buffer.resize(buffer.len().next_multiple_of(4), 0);
        let mut file = b"glTF".to_vec();
        file.extend(2u32.to_le_bytes());
        file.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", json), (b"BIN\0", buffer)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}
