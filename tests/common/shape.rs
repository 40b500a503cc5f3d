//! glTF files of any triangles, built in memory card by card.

#![allow(dead_code)] // Each test binary uses only some of it.

use super::glb::Gltf;
use glam::{Quat, Vec2, Vec3};
use serde_json::{Value, json};

/// Gives material 0 a texture.
pub fn textured(mut file: Gltf, png: &[u8]) -> Gltf {
    file.push(png, json!({}));
    file.json["accessors"].as_array_mut().unwrap().pop();
    let view = file.json["bufferViews"].as_array().unwrap().len() - 1;
    file.json["buffers"][0]["byteLength"] = json!(file.buffer.len());
    file.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    file
}

/// Triangles in memory.
#[derive(Default, Clone)]
pub struct Shape {
    pub positions: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub indices: Vec<u32>,
}

/// Texture coordinates of a card that shows the whole texture.
pub const WHOLE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

impl Shape {
    pub fn with_card_at(mut self, corners: [[f32; 3]; 4], uvs: [[f32; 2]; 4]) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(Vec3::from));
        self.uvs.extend(uvs.map(Vec2::from));
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        self
    }

    pub fn with_card(self, corners: [[f32; 3]; 4]) -> Self {
        self.with_card_at(corners, WHOLE)
    }

    pub fn with(mut self, other: &Shape, by: Vec3) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|position| *position + by));
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|index| first + index));
        self
    }

    /// Six copies in a row.
    pub fn six(&self) -> Self {
        (0..6).fold(Self::default(), |all, i| all.with(self, Vec3::X * 9.0 * i as f32))
    }

    /// A box without top and bottom; each side has the whole texture.
    pub fn tube() -> Self {
        let ring = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        (0..4).fold(Self::default(), |tube, i| {
            let [[x, z], [to_x, to_z]] = [ring[i], ring[(i + 1) % 4]];
            tube.with_card([[x, 0.0, z], [to_x, 0.0, to_z], [to_x, 5.0, to_z], [x, 5.0, z]])
        })
    }

    /// A sphere of squashed faces around `center`.
    pub fn ball(center: Vec3, radius: f32) -> Self {
        let at = |ring: u32, step: u32| {
            let [tilt, turn] = [ring as f32 * 0.125, step as f32 * 0.125].map(|turns| turns * std::f32::consts::PI);
            let [tilt, turn] = [tilt, 2.0 * turn];
            (center + radius * Vec3::new(tilt.sin() * turn.cos(), tilt.cos(), tilt.sin() * turn.sin())).to_array()
        };
        let quad = |(i, j): (u32, u32)| [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        // The last step is the first again, to the bit.
        let quads = (0..8).flat_map(|i| (0..8).map(move |j| (i, j)));
        let mut ball = quads.map(quad).fold(Self::default(), Self::with_card);
        for position in &mut ball.positions {
            *position = (*position * 4096.0).round() / 4096.0;
        }
        ball
    }

    /// Adds the shape to `file` as a node of its own with a material of its own, named alike.
    pub fn push(&self, file: &mut Gltf, material: Value) {
        let floats = |values: Vec<f32>| values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
        let positions = floats(self.positions.iter().flat_map(|position| position.to_array()).collect());
        let uvs = floats(self.uvs.iter().flat_map(|uv| uv.to_array()).collect());
        let indices: Vec<u8> = self.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let accessor = |kind: &str, component: u32, count: usize| json!({ "type": kind, "componentType": component, "count": count });
        let position = file.push(&positions, accessor("VEC3", 5126, self.positions.len()));
        let uv = file.push(&uvs, accessor("VEC2", 5126, self.uvs.len()));
        let index = file.push(&indices, accessor("SCALAR", 5125, self.indices.len()));
        let add = |list: &mut Value, item: Value| {
            list.as_array_mut().unwrap().push(item);
            list.as_array().unwrap().len() - 1
        };
        let node = json!({ "name": material["name"] });
        let material = add(&mut file.json["materials"], material);
        let attributes = json!({ "POSITION": position, "TEXCOORD_0": uv });
        let primitive = json!({ "attributes": attributes, "indices": index, "material": material });
        let mesh = add(&mut file.json["meshes"], json!({ "primitives": [primitive] }));
        let node = add(&mut file.json["nodes"], node);
        file.json["nodes"][node]["mesh"] = json!(mesh);
        add(&mut file.json["scenes"][0]["nodes"], json!(node));
        file.json["buffers"][0]["byteLength"] = json!(file.buffer.len());
    }

    /// A file of this shape alone, cut out by alpha.
    pub fn cut_out(&self, png: Option<&[u8]>) -> Gltf {
        let mut file = Gltf { json: empty(), buffer: Vec::new() };
        self.push(&mut file, json!({ "name": "leaf", "alphaMode": "MASK", "doubleSided": true }));
        match png {
            Some(png) => textured(file, png),
            None => file,
        }
    }
}

pub fn empty() -> Value {
    let nothing = || json!([]);
    json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [] }], "nodes": nothing(), "meshes": nothing(),
        "materials": nothing(), "accessors": nothing(), "bufferViews": nothing(), "buffers": [{ "byteLength": 0 }]
    })
}

/// Cards around a vertical axis that they share, all facing the same way around.
pub fn fan(count: u16) -> Shape {
    (0..count).fold(Shape::default(), |fan, i| {
        let out = Quat::from_rotation_y(std::f32::consts::TAU * f32::from(i) / f32::from(count)) * Vec3::X * 2.0;
        fan.with_card([[0.0; 3], out.to_array(), (out + Vec3::Y).to_array(), [0.0, 1.0, 0.0]])
    })
}

/// Cards in a row, each folded back on the one before; `uvs` are those of card i.
pub fn folds(count: u16, uvs: impl Fn(f32) -> [[f32; 2]; 4]) -> Shape {
    let x = |i: u16| f32::from(i % 2);
    (0..count).fold(Shape::default(), |folds, i| {
        let [from, to] = [[x(i), 0.0, f32::from(i) * 0.1], [x(i + 1), 0.0, f32::from(i + 1) * 0.1]];
        let up = |[x, y, z]: [f32; 3]| [x, y + 1.0, z];
        folds.with_card_at([from, to, up(to), up(from)], uvs(f32::from(i)))
    })
}
