//! Numbers of corners in a few bits each.

use super::super::records::{LEAST_WIDTH, LookRecord, NO_NORMAL, TRIMMED_CORNERS, WIDTH_STEPS};
use crate::plant::Outline;
use glam::{Vec2, Vec3};

/// A width in steps as 15 bits of its logarithm, and its sign; the largest for an infinite one.
pub(super) fn width_bits(steps: f32) -> u32 {
    let code = ((steps.abs().log2() - LEAST_WIDTH) * WIDTH_STEPS).round().clamp(0.0, f32::from(i16::MAX));
    code as u32 | u32::from(steps.is_sign_negative()) << 15
}

/// Square roots of a colour over the largest one, with `bits` bits each.
pub(super) fn color_bits(color: [f32; 3], largest: Vec3, bits: u32) -> u32 {
    let steps = ((1 << bits) - 1) as f32;
    let root = |axis: usize| ((color[axis].max(0.0) / largest[axis]).sqrt() * steps).round() as u32;
    root(0) | root(1) << bits | root(2) << (2 * bits)
}

/// Corners of an outline; the last one is repeated.
pub(super) fn outline_bits(outline: &Outline, look: &LookRecord) -> [u32; TRIMMED_CORNERS as usize] {
    let corners = &outline.corners;
    std::array::from_fn(|i| corners.get(i).or(corners.last()).map_or(0, |&uv| uv_bits(uv, look)))
}

pub(super) fn uv_bits(uv: [f32; 2], look: &LookRecord) -> u32 {
    let [u, v] = [0, 1].map(|axis| {
        let share = (uv[axis] - look.uv_low[axis]) / look.uv_size[axis];
        (share * f32::from(u16::MAX)).round() as u16
    });
    u32::from(u) | u32::from(v) << 16
}

/// A direction folded onto an octahedron, with 8 bits each for x and y: of the roundings, the one
/// nearest to it. After Z. H. Cigolle, S. Donow, D. Evangelakos, M. Mara, M. McGuire and Q. Meyer,
/// *A Survey of Efficient Representations for Independent Unit Vectors* (2014).
pub(super) fn normal_bits(normal: [f32; 3]) -> u32 {
    let normal = Vec3::from(normal).normalize_or_zero();
    if normal == Vec3::ZERO {
        return NO_NORMAL;
    }
    let on_plane = normal.truncate() / normal.abs().element_sum();
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let folded = Vec2::new((1.0 - on_plane.y.abs()) * sign(normal.x), (1.0 - on_plane.x.abs()) * sign(normal.y));
    let steps = if normal.z < 0.0 { folded } else { on_plane } * f32::from(i8::MAX);
    let roundings = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|up| (steps.floor() + up).min(Vec2::splat(127.0)));
    let of = |steps: &Vec2| unfolded(*steps / f32::from(i8::MAX)).dot(normal);
    let best = roundings.into_iter().max_by(|a, b| of(a).total_cmp(&of(b))).unwrap_or_default();
    u32::from(best.x as i8 as u8) | u32::from(best.y as i8 as u8) << 8
}

/// Direction of a point on the octahedron; twin of `normal_of` in `packing.wgsl`.
pub(super) fn unfolded(at: Vec2) -> Vec3 {
    let z = 1.0 - at.x.abs() - at.y.abs();
    let back = (-z).max(0.0);
    let folded = |x: f32| if x < 0.0 { x + back } else { x - back };
    Vec3::new(folded(at.x), folded(at.y), z).normalize_or_zero()
}
