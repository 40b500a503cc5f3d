//! Numbers of corners in a few bits each.

use super::super::records::{HALF_STEPS, LEAST_HALF, LEAST_WIDTH, LookRecord, NO_NORMAL, WIDTH_STEPS};
use crate::model::octahedral;
use glam::Vec3;

/// A width in steps as 15 bits of its logarithm, and its sign; the largest for an infinite one.
pub(super) fn width_bits(steps: f32) -> u32 {
    let code = ((steps.abs().log2() - LEAST_WIDTH) * WIDTH_STEPS).round().clamp(0.0, f32::from(i16::MAX));
    code as u32 | u32::from(steps.is_sign_negative()) << 15
}

/// Half of a ribbon's width over its stem's as 8 bits of its logarithm, above 0.
pub(super) fn half_bits(share: f32) -> u32 {
    ((share.log2() - LEAST_HALF) * HALF_STEPS).round().clamp(1.0, 255.0) as u32
}

/// Square roots of a colour over the largest one, with `bits` bits each.
pub(super) fn color_bits(color: [f32; 3], largest: Vec3, bits: u32) -> u32 {
    let steps = ((1 << bits) - 1) as f32;
    let root = |axis: usize| ((color[axis].max(0.0) / largest[axis]).sqrt() * steps).round() as u32;
    root(0) | root(1) << bits | root(2) << (2 * bits)
}

pub(super) fn uv_bits(uv: [f32; 2], look: &LookRecord) -> u32 {
    let [u, v] = [0, 1].map(|axis| {
        let share = (uv[axis] - look.uv_low[axis]) / look.uv_size[axis];
        (share * f32::from(u16::MAX)).round() as u16
    });
    u32::from(u) | u32::from(v) << 16
}

/// A direction folded onto an octahedron, with 8 bits each for x and y; `normal_of` in
/// `packing.wgsl` reads it.
pub(super) fn normal_bits(normal: [f32; 3]) -> u32 {
    if Vec3::from(normal).normalize_or_zero() == Vec3::ZERO {
        return NO_NORMAL;
    }
    let [x, y] = octahedral::encode(normal, 8).map(|code| u32::from(code as i8 as u8));
    x | y << 8
}
