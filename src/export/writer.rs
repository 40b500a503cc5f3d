//! Meshes of plants in a GLB, quantised or exact.

use super::{
    document::{Document, push},
    glb::{compacted, unit},
};
use crate::{
    Error, Result,
    bounds::Aabb,
    error::check_range,
    leaf::Vertex,
    material::{Material, Texture},
    plant::{PlantOf, Wood, WoodPart},
};
use glam::{DQuat, DVec3, Vec3};
use serde_json::{Value, json};

/// Extension of quantised attributes.
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// How a model or a level of it is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlbOptions {
    /// Whether all numbers are `f32`. Otherwise positions and pivots are 1/65,535 of the box around
    /// the plant, normals 1/127, texture coordinates within their picture 1/65,535, and colours
    /// 1/255.
    pub exact: bool,
    /// Whether the file's vertical axis is Z, for programs that do not turn glTF, whose own is Y.
    pub z_up: bool,
    /// Factor of all lengths: 1e-12 to 1e12.
    pub scale: f64,
}

impl Default for GlbOptions {
    fn default() -> Self {
        Self { exact: false, z_up: false, scale: 1.0 }
    }
}

/// The cube whose 65,535 steps along each axis positions and pivots are rounded to.
struct Grid {
    low: DVec3,
    side: f64,
}

impl Grid {
    fn of(points: impl Iterator<Item = [f32; 3]>) -> Self {
        let all = Aabb::of_points(points);
        let low = Vec3::from(all.min).as_dvec3();
        let side = (Vec3::from(all.max).as_dvec3() - low).max_element();
        if side > 0.0 && side.is_finite() { Self { low, side } } else { Self { low: DVec3::ZERO, side: 1.0 } }
    }

    fn steps(&self, point: [f32; 3]) -> [u16; 3] {
        let steps = (Vec3::from(point).as_dvec3() - self.low) / self.side * f64::from(u16::MAX);
        steps.round().to_array().map(|step| step as u16)
    }
}

/// Positions of all vertices of a plant.
pub(super) fn corners<L>(plant: &PlantOf<L>) -> impl Iterator<Item = [f32; 3]> {
    plant.vertices.iter().chain(&plant.wood.vertices).map(|vertex| vertex.position)
}

/// A file under construction.
pub(super) struct Writer<'a> {
    pub(super) document: Document<'a>,
    grid: Grid,
    options: GlbOptions,
}

impl<'a> Writer<'a> {
    /// A file of meshes with these materials, all of whose positions and pivots are among `points`.
    pub(super) fn new(
        materials: &'a [Material],
        textures: &'a [Texture],
        points: impl Iterator<Item = [f32; 3]>,
        options: &GlbOptions,
    ) -> Result<Self> {
        check_range("scale", options.scale, 1e-12..=1e12)?;
        let grid = Grid::of(points);
        let size = grid.low.abs().max_element().max(grid.side) * options.scale;
        if !((grid.side * options.scale) as f32).is_normal() || !(size as f32).is_finite() {
            let allowed = format!("one that keeps the plant, {:e} across, within the range of f32", grid.side);
            return Err(Error::invalid("scale", options.scale, allowed));
        }
        Ok(Self { document: Document::new(materials, textures), grid, options: *options })
    }

    /// Adds a node with a mesh of these primitives, if there are any.
    pub(super) fn node(&mut self, mut node: Value, primitives: Vec<Value>) {
        let Self { document, grid, options: GlbOptions { exact, z_up, scale } } = self;
        if !primitives.is_empty() {
            let mesh = json!({ "name": node["name"], "primitives": primitives });
            node["mesh"] = json!(push(&mut document.json["meshes"], mesh));
        }
        let turn = if *z_up { DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2) } else { DQuat::IDENTITY };
        let (low, unit) = if *exact { (DVec3::ZERO, 1.0) } else { (grid.low, grid.side) };
        let at = turn * (low * *scale);
        if at != DVec3::ZERO {
            node["translation"] = json!(at.as_vec3().to_array());
        }
        if *z_up {
            node["rotation"] = json!(turn.as_quat().to_array());
        }
        if unit * *scale != 1.0 {
            node["scale"] = json!(vec![(unit * *scale) as f32; 3]);
        }
        push(&mut document.json["nodes"], node);
    }

    /// The file, with the first node in its scene.
    pub(super) fn finish(mut self) -> Result<Vec<u8>> {
        if !self.options.exact {
            push(&mut self.document.json["extensionsUsed"], json!(QUANTIZATION));
            push(&mut self.document.json["extensionsRequired"], json!(QUANTIZATION));
        }
        self.document.json["scene"] = json!(0);
        self.document.json["scenes"] = json!([{ "nodes": [0] }]);
        self.document.finish()
    }

    /// The attribute of points that are no positions.
    pub(super) fn points(&mut self, points: impl Iterator<Item = [f32; 3]> + Clone) -> usize {
        match self.options.exact {
            true => self.document.buffer.floats("VEC3", points),
            false => self.document.buffer.shorts("VEC3", points.map(|point| self.grid.steps(point)), false),
        }
    }

    /// A primitive of the triangles `indices`, with only the vertices that they use.
    pub(super) fn primitive(&mut self, vertices: &[Vertex], indices: &[u32], material: u32) -> Value {
        let (vertices, indices) = compacted(vertices, indices);
        let attributes = self.attributes(&vertices, material);
        let indices = self.document.buffer.indices(&indices, vertices.len());
        json!({ "attributes": attributes, "indices": indices, "material": self.document.material(material) })
    }

    /// Primitives of wood; `material` has the number in the file of each material.
    pub(super) fn wood(&mut self, wood: &Wood, material: impl Fn(u32) -> u32) -> Vec<Value> {
        let parts = wood.parts.iter().filter(|part| part.indices[0] < part.indices[1]);
        let indices = |part: &WoodPart| &wood.indices[part.indices[0] as usize..part.indices[1] as usize];
        parts.map(|part| self.primitive(&wood.vertices, indices(part), material(part.material))).collect()
    }

    /// Attributes of vertices of a material, without those that say nothing.
    pub(super) fn attributes(&mut self, vertices: &[Vertex], material: u32) -> Value {
        let is_textured = self.document.is_textured(material);
        let exact = self.options.exact;
        let grid = &self.grid;
        let buffer = &mut self.document.buffer;
        let positions = vertices.iter().map(|vertex| vertex.position);
        let normals = vertices.iter().map(|vertex| unit(vertex.normal));
        let mut attributes = match exact {
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
            let is_small = !exact && are_fractions(uvs.clone());
            attributes["TEXCOORD_0"] = match is_small {
                true => buffer.shorts("VEC2", uvs.map(|uv| uv.map(|part| (part * 65535.0).round() as u16)), false),
                false => buffer.floats("VEC2", uvs),
            }
            .into();
        }
        if vertices.iter().any(|vertex| vertex.color != [1.0; 4]) {
            // glTF allows no more than 1.
            let colors = vertices.iter().map(|vertex| vertex.color.map(|part| part.clamp(0.0, 1.0)));
            attributes["COLOR_0"] = match exact {
                false => buffer.bytes("VEC4", colors.map(|color| color.map(|part| (part * 255.0).round() as u8))),
                true => buffer.floats("VEC4", colors),
            }
            .into();
        }
        attributes
    }
}

fn are_fractions<const N: usize>(mut vectors: impl Iterator<Item = [f32; N]>) -> bool {
    vectors.all(|vector| vector.iter().all(|part| (0.0..=1.0).contains(part)))
}
