//! Writes models as continuous glTF: one GLB that every viewer shows as the full tree, with what a
//! reader needs to draw any prefix of the leaves in vertex attributes.
//!
//! `docs/CONTINUOUS_GLTF.md` describes the format. Attributes survive what files named in `extras` do
//! not: gltf-transform, also where it reorders vertices, and Blender.

use super::{
    document::{Document, push},
    glb::{compacted, unit},
};
use crate::{FoliageModel, Result, bounds::Aabb, leaf::Vertex};
use glam::{DQuat, DVec3, Vec3};
use serde_json::{Value, json};

/// Version of the format.
const VERSION: u32 = 1;
/// Extension of quantised attributes.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// How a model is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Continuous {
    /// Whether all numbers are `f32`. Otherwise positions and pivots are 1/65,535 of the box around
    /// the plant, normals 1/127, texture coordinates within their picture 1/65,535, and colours up to
    /// 1 1/255.
    pub exact: bool,
    /// Whether the file's vertical axis is Z, for programs that do not turn glTF, whose own is Y.
    pub z_up: bool,
    /// Factor of all lengths; above 0.
    pub scale: f64,
}

impl Default for Continuous {
    fn default() -> Self {
        Self { exact: false, z_up: false, scale: 1.0 }
    }
}

/// Encodes a valid model as a continuous glTF. Equal models give equal bytes. Growth is carried by
/// scale: tiles and tone are left out.
///
/// # Errors
/// [`TooLarge`](crate::Error::TooLarge) above 4 GiB; [`Unreadable`](crate::Error::Unreadable) for a
/// damaged WebP texture; [`InvalidOption`](crate::Error::InvalidOption) for a scale that is not above
/// 0 and finite.
pub fn write_continuous(model: &FoliageModel, options: &Continuous) -> Result<Vec<u8>> {
    crate::error::check_range("scale", options.scale, f64::MIN_POSITIVE..=1e12)?;
    let mut writer =
        Writer { document: Document::new(&model.plant), model, grid: Grid::of(model), exact: options.exact };
    let mut primitives: Vec<Value> =
        (0..model.materials.len() as u32).filter_map(|material| writer.leaves(material)).collect();
    primitives.extend(writer.wood());
    let Writer { mut document, grid, .. } = writer;
    let sphere = model.sphere();
    let about = json!({
        "version": VERSION,
        "leaves": model.leaves.len(),
        "maxScale": model.max_scale,
        "center": sphere.center,
        "radius": sphere.radius,
    });
    let mut node = json!({ "name": model.name, "extras": { "foliageLod": about } });
    if !primitives.is_empty() {
        node["mesh"] =
            json!(push(&mut document.json["meshes"], json!({ "name": model.name, "primitives": primitives })));
    }
    let turn = if options.z_up { DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2) } else { DQuat::IDENTITY };
    let (low, unit) = if options.exact { (DVec3::ZERO, 1.0) } else { (grid.low, grid.side) };
    let at = turn * (low * options.scale);
    if at != DVec3::ZERO {
        node["translation"] = json!(at.as_vec3().to_array());
    }
    if options.z_up {
        node["rotation"] = json!(turn.as_quat().to_array());
    }
    if unit * options.scale != 1.0 {
        node["scale"] = json!(vec![(unit * options.scale) as f32; 3]);
    }
    if !options.exact {
        document.json["extensionsUsed"] = json!([QUANTIZATION]);
        document.json["extensionsRequired"] = json!([QUANTIZATION]);
    }
    document.json["nodes"] = json!([node]);
    document.json["scene"] = json!(0);
    document.json["scenes"] = json!([{ "nodes": [0] }]);
    document.finish()
}

/// The cube whose 65,535 steps along each axis positions and pivots are rounded to.
struct Grid {
    low: DVec3,
    side: f64,
}

impl Grid {
    fn of(model: &FoliageModel) -> Self {
        let vertices = model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
        let all = Aabb::of_points(vertices.chain(model.leaves.iter().map(|leaf| leaf.pivot)));
        let low = Vec3::from(all.min).as_dvec3();
        let side = (Vec3::from(all.max).as_dvec3() - low).max_element();
        if side > 0.0 && side.is_finite() { Self { low, side } } else { Self { low: DVec3::ZERO, side: 1.0 } }
    }

    fn steps(&self, point: [f32; 3]) -> [u16; 3] {
        let steps = (Vec3::from(point).as_dvec3() - self.low) / self.side * f64::from(u16::MAX);
        steps.round().to_array().map(|step| step as u16)
    }
}

struct Writer<'a> {
    document: Document<'a>,
    model: &'a FoliageModel,
    grid: Grid,
    exact: bool,
}

impl Writer<'_> {
    /// The leaves of a material in drawing order; `None` without any.
    fn leaves(&mut self, material: u32) -> Option<Value> {
        let model = self.model;
        let leaves = || (0..).zip(&model.leaves).filter(|(_, leaf)| leaf.material == material);
        let mut vertices = Vec::new();
        let mut indices = Vec::new();
        for (_, leaf) in leaves() {
            let first = vertices.len() as u32;
            let own = &model.indices[leaf.geometry().index_range()];
            indices.extend(own.iter().map(|index| index - leaf.vertices[0] + first));
            vertices.extend_from_slice(&model.vertices[leaf.geometry().vertex_range()]);
        }
        if indices.is_empty() {
            return None;
        }
        let mut attributes = self.attributes(&vertices, material);
        // Of each vertex, what its leaf has.
        let count = |leaf: &crate::model::Leaf| (leaf.vertices[1] - leaf.vertices[0]) as usize;
        let each = |value: &dyn Fn(u32, &crate::model::Leaf) -> f32| -> Vec<[f32; 1]> {
            leaves().flat_map(|(number, leaf)| std::iter::repeat_n([value(number, leaf)], count(leaf))).collect()
        };
        let target = |leaf: &crate::model::Leaf| leaf.target().map_or(-1.0, |target| target as f32);
        let numbers = [
            ("_LEAF", each(&|number, _| number as f32)),
            ("_TARGET", each(&|_, leaf| target(leaf))),
            ("_SCALE", each(&|_, leaf| leaf.scale)),
        ];
        let buffer = &mut self.document.buffer;
        for (name, values) in numbers {
            attributes[name] = buffer.floats("SCALAR", values.into_iter()).into();
        }
        let pivots = leaves().flat_map(|(_, leaf)| std::iter::repeat_n(leaf.pivot, count(leaf)));
        attributes["_PIVOT"] = match self.exact {
            true => buffer.floats("VEC3", pivots),
            false => buffer.shorts("VEC3", pivots.map(|pivot| self.grid.steps(pivot)), false),
        }
        .into();
        let indices = self.document.buffer.indices(&indices, vertices.len());
        Some(json!({ "attributes": attributes, "indices": indices, "material": self.document.material(material) }))
    }

    fn wood(&mut self) -> Vec<Value> {
        let model = self.model;
        let wood = &model.wood;
        let parts = wood.parts.iter().filter(|part| part.indices[0] < part.indices[1]);
        let part = |part: &crate::plant::WoodPart| {
            let range = part.indices[0] as usize..part.indices[1] as usize;
            let (vertices, indices) = compacted(&wood.vertices, &wood.indices[range]);
            let attributes = self.attributes(&vertices, part.material);
            let indices = self.document.buffer.indices(&indices, vertices.len());
            json!({ "attributes": attributes, "indices": indices, "material": self.document.material(part.material) })
        };
        parts.map(part).collect()
    }

    fn attributes(&mut self, vertices: &[Vertex], material: u32) -> Value {
        let is_textured = self.document.is_textured(material);
        let grid = &self.grid;
        let buffer = &mut self.document.buffer;
        let positions = vertices.iter().map(|vertex| vertex.position);
        let normals = vertices.iter().map(|vertex| unit(vertex.normal));
        let mut attributes = match self.exact {
            true => json!({ "POSITION": buffer.positions(positions), "NORMAL": buffer.floats("VEC3", normals) }),
            false => {
                let normals = normals.map(|normal| normal.map(|part| (part * 127.0).round() as i8));
                json!({
                    "POSITION": buffer.shorts("VEC3", positions.map(|position| grid.steps(position)), true),
                    "NORMAL": buffer.signed_bytes("VEC3", normals),
                })
            }
        };
        if is_textured {
            let uvs = vertices.iter().map(|vertex| vertex.uv);
            let is_small = !self.exact && are_fractions(uvs.clone());
            attributes["TEXCOORD_0"] = match is_small {
                true => buffer.shorts("VEC2", uvs.map(|uv| uv.map(|part| (part * 65535.0).round() as u16)), false),
                false => buffer.floats("VEC2", uvs),
            }
            .into();
        }
        if vertices.iter().any(|vertex| vertex.color != [1.0; 4]) {
            let colors = vertices.iter().map(|vertex| vertex.color);
            let is_small = !self.exact && are_fractions(colors.clone());
            attributes["COLOR_0"] = match is_small {
                true => buffer.bytes("VEC4", colors.map(|color| color.map(|part| (part * 255.0).round() as u8))),
                false => buffer.floats("VEC4", colors),
            }
            .into();
        }
        attributes
    }
}

fn are_fractions<const N: usize>(mut vectors: impl Iterator<Item = [f32; N]>) -> bool {
    vectors.all(|vector| vector.iter().all(|part| (0.0..=1.0).contains(part)))
}
