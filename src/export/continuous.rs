//! Writes models as continuous glTF: one GLB that every viewer shows as the full tree, with what a
//! reader needs to draw any prefix of the leaves in vertex attributes.
//!
//! `docs/CONTINUOUS_GLTF.md` describes the format. Attributes survive what files named in `extras`
//! do not: gltf-transform, also where it reorders vertices, and Blender.

use super::{
    document::{Document, push},
    glb::{compacted, unit},
};
use crate::{
    Error, FoliageModel, Plant, Result,
    bounds::Aabb,
    error::check_range,
    leaf::Vertex,
    model::Leaf,
    plant::{PlantOf, Wood, WoodPart},
};
use glam::{DQuat, DVec3, Vec3};
use serde_json::{Value, json};

/// Version of the format.
const VERSION: u32 = 1;
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

/// Encodes a valid model as a continuous glTF. Equal models give equal bytes. Growth is carried by
/// scale: tiles and tone are left out, and colour factors above 1 are 1.
///
/// # Errors
/// [`TooLarge`](crate::Error::TooLarge) above 4 GiB; [`Unreadable`](crate::Error::Unreadable) for a
/// damaged WebP texture; [`InvalidOption`](crate::Error::InvalidOption) for a scale beyond 1e-12 to
/// 1e12, or one that leaves nothing of the plant's size, or more, than `f32` holds.
pub fn write_continuous(model: &FoliageModel, options: &GlbOptions) -> Result<Vec<u8>> {
    let pivots = model.leaves.iter().map(|leaf| leaf.pivot);
    let mut writer = Writer::new(&model.plant, pivots, options)?;
    let mut primitives: Vec<Value> =
        (0..model.materials.len() as u32).filter_map(|material| writer.leaves(model, material)).collect();
    primitives.extend(writer.wood(&model.wood));
    let sphere = model.sphere();
    let about = json!({
        "version": VERSION,
        "leaves": model.leaves.len(),
        "maxScale": model.max_scale,
        "center": sphere.center,
        "radius": sphere.radius,
    });
    writer.finish(json!({ "name": model.name, "extras": { "foliageLod": about } }), primitives, options)
}

/// Encodes a valid plant as a GLB of one mesh, such as one of the [levels](super::Level) of a
/// model. Leaves keep their order within each material.
///
/// # Errors
/// Those of [`write_continuous`].
pub fn write_level(plant: &Plant, options: &GlbOptions) -> Result<Vec<u8>> {
    let mut writer = Writer::new(plant, std::iter::empty(), options)?;
    let leaves = |material: u32| {
        let leaves = plant.leaves.iter().filter(|leaf| leaf.material == material);
        leaves.flat_map(|leaf| &plant.indices[leaf.index_range()]).copied().collect::<Vec<u32>>()
    };
    let of_leaves = (0..plant.materials.len() as u32).map(|material| (material, leaves(material)));
    let mut primitives: Vec<Value> = of_leaves
        .filter(|(_, indices)| !indices.is_empty())
        .map(|(material, indices)| writer.primitive(&plant.vertices, &indices, material))
        .collect();
    primitives.extend(writer.wood(&plant.wood));
    writer.finish(json!({ "name": plant.name }), primitives, options)
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

struct Writer<'a> {
    document: Document<'a>,
    grid: Grid,
    exact: bool,
}

impl<'a> Writer<'a> {
    fn new<L>(plant: &'a PlantOf<L>, pivots: impl Iterator<Item = [f32; 3]>, options: &GlbOptions) -> Result<Self> {
        check_range("scale", options.scale, 1e-12..=1e12)?;
        let vertices = plant.vertices.iter().chain(&plant.wood.vertices).map(|vertex| vertex.position);
        let grid = Grid::of(vertices.chain(pivots));
        let size = grid.low.abs().max_element().max(grid.side) * options.scale;
        if !((grid.side * options.scale) as f32).is_normal() || !(size as f32).is_finite() {
            let allowed = format!("one that keeps the plant, {:e} across, within the range of f32", grid.side);
            return Err(Error::invalid("scale", options.scale, allowed));
        }
        Ok(Self { document: Document::new(plant), grid, exact: options.exact })
    }

    /// The file, with one node.
    fn finish(self, mut node: Value, primitives: Vec<Value>, options: &GlbOptions) -> Result<Vec<u8>> {
        let Self { mut document, grid, exact } = self;
        if !primitives.is_empty() {
            let mesh = json!({ "name": node["name"], "primitives": primitives });
            node["mesh"] = json!(push(&mut document.json["meshes"], mesh));
        }
        let turn = if options.z_up { DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2) } else { DQuat::IDENTITY };
        let (low, unit) = if exact { (DVec3::ZERO, 1.0) } else { (grid.low, grid.side) };
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
        if !exact {
            document.json["extensionsUsed"] = json!([QUANTIZATION]);
            document.json["extensionsRequired"] = json!([QUANTIZATION]);
        }
        document.json["nodes"] = json!([node]);
        document.json["scene"] = json!(0);
        document.json["scenes"] = json!([{ "nodes": [0] }]);
        document.finish()
    }

    /// The leaves of a material in drawing order; `None` without any.
    fn leaves(&mut self, model: &FoliageModel, material: u32) -> Option<Value> {
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
        let count = |leaf: &Leaf| (leaf.vertices[1] - leaf.vertices[0]) as usize;
        let each = |value: &dyn Fn(u32, &Leaf) -> f32| -> Vec<[f32; 1]> {
            leaves().flat_map(|(number, leaf)| std::iter::repeat_n([value(number, leaf)], count(leaf))).collect()
        };
        let target = |leaf: &Leaf| leaf.target().map_or(-1.0, |target| target as f32);
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

    fn wood(&mut self, wood: &Wood) -> Vec<Value> {
        let parts = wood.parts.iter().filter(|part| part.indices[0] < part.indices[1]);
        let indices = |part: &WoodPart| &wood.indices[part.indices[0] as usize..part.indices[1] as usize];
        parts.map(|part| self.primitive(&wood.vertices, indices(part), part.material)).collect()
    }

    /// A primitive of the triangles `indices`, with only the vertices that they use.
    fn primitive(&mut self, vertices: &[Vertex], indices: &[u32], material: u32) -> Value {
        let (vertices, indices) = compacted(vertices, indices);
        let attributes = self.attributes(&vertices, material);
        let indices = self.document.buffer.indices(&indices, vertices.len());
        json!({ "attributes": attributes, "indices": indices, "material": self.document.material(material) })
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
            // glTF allows no more than 1.
            let colors = vertices.iter().map(|vertex| vertex.color.map(|part| part.clamp(0.0, 1.0)));
            attributes["COLOR_0"] = match self.exact {
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
