//! Writes models as continuous glTF: one GLB that every viewer shows as the full tree, with what a
//! reader needs to draw any prefix of the leaves in vertex attributes.
//!
//! `docs/CONTINUOUS_GLTF.md` describes the format. Attributes survive what files named in `extras`
//! do not: gltf-transform, also where it reorders vertices, and Blender.

use super::writer::{GlbOptions, Writer, corners};
use crate::{
    FoliageModel, Result,
    continuous::VERSION,
    model::{ErrorCurve, Leaf},
};
use serde_json::{Value, json};

/// Most corners of the error curve, without the last one. Measured curves have some twenty, those
/// that are summed up from the leaves' errors up to one a leaf.
const CURVE_CORNERS: usize = 256;

/// Encodes a valid model as a continuous glTF. Equal models give equal bytes. Growth is carried by
/// scale: tiles and tone are left out, and colour factors above 1 are 1.
///
/// # Errors
/// [`TooLarge`](crate::Error::TooLarge) above 4 GiB; [`Unreadable`](crate::Error::Unreadable) for a
/// damaged WebP texture; [`InvalidOption`](crate::Error::InvalidOption) for a scale beyond 1e-12 to
/// 1e12, or one that leaves nothing of the plant's size, or more, than `f32` holds.
pub fn write_continuous(model: &FoliageModel, options: &GlbOptions) -> Result<Vec<u8>> {
    let pivots = model.leaves.iter().map(|leaf| leaf.pivot);
    let mut writer = Writer::new(&model.materials, &model.textures, corners(&model.plant).chain(pivots), options)?;
    let mut primitives: Vec<Value> =
        (0..model.materials.len() as u32).filter_map(|material| writer.leaves(model, material)).collect();
    primitives.extend(writer.wood(&model.wood, |material| material));
    let sphere = model.sphere();
    let about = json!({
        "version": VERSION,
        "leaves": model.leaves.len(),
        "maxScale": model.max_scale,
        "center": sphere.center,
        "radius": sphere.radius,
        "curve": curve(&ErrorCurve::of(model)),
    });
    writer.node(json!({ "name": model.name, "extras": { "foliageLod": about } }), primitives);
    writer.finish()
}

/// The curve in flat arrays: Blender drops nested ones. Some of the corners of a convex curve are
/// one too.
fn curve(curve: &ErrorCurve) -> Value {
    let step = curve.corners.len().div_ceil(CURVE_CORNERS).max(1);
    let last = curve.corners.len().saturating_sub(1);
    let kept = curve.corners.iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last);
    let (leaves, errors): (Vec<u32>, Vec<f32>) = kept.map(|(_, corner)| (corner.leaves, corner.error_px)).unzip();
    json!({ "sizePx": curve.size_px, "sizePower": curve.size_power, "leaves": leaves, "errorsPx": errors })
}

impl Writer<'_> {
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
        attributes["_PIVOT"] = self.points(pivots).into();
        let indices = self.document.buffer.indices(&indices, vertices.len());
        Some(json!({ "attributes": attributes, "indices": indices, "material": self.document.material(material) }))
    }
}
