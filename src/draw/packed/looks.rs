//! Looks: what many vertices have in common.

use super::super::records::{LeafRecord, LookRecord, NO_EXTRA, WoodVertex};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Range of texture coordinates that one look of the wood covers.
const WOOD_UV: f32 = 4.0;

/// Table of looks without repetitions.
#[derive(Default)]
pub(super) struct Looks {
    pub(super) rows: Vec<LookRecord>,
    numbers: HashMap<[u8; size_of::<LookRecord>()], u32>,
}

impl Looks {
    pub(super) fn number(&mut self, look: LookRecord) -> u32 {
        *self.numbers.entry(bytemuck::cast(look)).or_insert_with(|| {
            self.rows.push(look);
            self.rows.len() as u32 - 1
        })
    }
}

/// The look of a leaf whose corners have the texture coordinates `uvs`.
pub(super) fn look(
    origin: Vec3,
    material: u32,
    color: Vec3,
    size: f32,
    uvs: impl Iterator<Item = Vec2> + Clone,
    leaf: &LeafRecord,
) -> LookRecord {
    let low = uvs.clone().reduce(Vec2::min).unwrap_or_default().floor();
    let high = uvs.reduce(Vec2::max).unwrap_or_default();
    LookRecord {
        origin: origin.to_array(),
        material,
        color: color.to_array(),
        size,
        uv_low: low.to_array(),
        uv_size: (high - low).to_array().map(|size| unit_of_length(size.max(1.0))),
        shown: leaf.uv_size,
        shown_low: if leaf.anchor[0] < 0.0 { [0.0; 2] } else { leaf.uv_low },
        anchor: leaf.anchor,
        outline: NO_EXTRA,
        farther: 0.0,
    }
}

/// The smallest power of two that is at least `length`.
pub(super) fn unit_of_length(length: f32) -> f32 {
    let exponent = length.max(f32::MIN_POSITIVE).log2().ceil();
    let unit = exponent.exp2();
    if unit < length { (exponent + 1.0).exp2() } else { unit }.min(f32::MAX)
}

/// The look of a vertex of the wood, without the stem's width.
pub(super) fn wood_look(origin: Vec3, vertex: &WoodVertex) -> LookRecord {
    LookRecord {
        origin: origin.to_array(),
        material: vertex.material,
        color: vertex.color,
        size: 0.0,
        uv_low: ((Vec2::from(vertex.uv) / WOOD_UV).floor() * WOOD_UV).to_array(),
        uv_size: [WOOD_UV; 2],
        shown: [1.0; 2],
        shown_low: [0.0; 2],
        anchor: [-1.0; 2],
        outline: NO_EXTRA,
        farther: 0.0,
    }
}
