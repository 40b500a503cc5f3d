//! Outlines and veins of single leaves.
//!
//! A leaf's coordinates: x across, y along, foot of the blade at (0, 0), tip at (0, 1).

use super::{mixed, shaded, smooth};
use crate::grow::frame::sin_cos;
use glam::Vec2;
use std::f32::consts::TAU;

/// Lobes on each side of an oak leaf.
const OAK_LOBES: f32 = 4.6;
/// Teeth on each side of a birch leaf.
const BIRCH_TEETH: f32 = 11.0;
/// Side veins on each side of a birch leaf.
const BIRCH_VEINS: f32 = 7.0;
/// Side veins on each side of a pecan leaflet.
const PECAN_VEINS: f32 = 12.0;
/// How much lighter veins are than the blade.
const VEIN_LIGHT: f32 = 1.32;

/// Colour of an oak leaf (Quercus robur: obovate, four to five round lobes a side) at `p`, `None` outside of it.
pub(super) fn oak(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let across = p.x.abs();
    // Lobes point forwards: their axes rise with the distance from the midrib.
    let y = p.y - 0.42 * across;
    if !(0.0..1.0).contains(&p.y) || y < 0.0 {
        return None;
    }
    let phase = OAK_LOBES * y * (1.12 - 0.12 * y) - 0.42;
    let wave = 0.5 + 0.5 * sin_cos(TAU * phase + 0.25 * TAU).0;
    let outline = 0.5 * libm::powf((y * (1.0 - y)).max(0.0), 0.62) * (0.42 + 1.05 * y);
    let half_width = outline * (0.56 + 0.44 * libm::powf(wave, 0.7)) + 0.004;
    let round_tip = p.y < 0.985;
    if across > half_width || !round_tip {
        return None;
    }
    let vein = vein(across, 0.017 * (1.0 - 0.8 * p.y), wave_vein(phase, 0.10 - 0.12 * across));
    Some(finished(color, vein, p.x, across / half_width))
}

/// Colour of a pecan leaflet (lance-shaped, curved, finely toothed) at `p`.
pub(super) fn pecan(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let y = p.y;
    if !(0.0..1.0).contains(&y) {
        return None;
    }
    // The broad part lies below the middle, the tip is drawn out.
    let outline = 0.62 * libm::powf(y, 0.62) * libm::powf(1.0 - y, 1.05);
    let across = p.x.abs();
    let teeth = 1.0 - 0.05 * (18.0 * y).fract();
    if across > outline * teeth {
        return None;
    }
    let phase = PECAN_VEINS * (y - 0.45 * across);
    let vein = vein(across, 0.022 * (1.0 - y), wave_vein(phase, 0.09));
    Some(finished(color, vein, p.x, across / outline.max(1e-3)))
}

/// Colour of a gray birch leaf (triangular, flat foot, long point, double teeth) at `p`.
pub(super) fn birch(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let y = p.y;
    if !(0.0..1.0).contains(&y) {
        return None;
    }
    let foot = smooth(-0.02, 0.16, y);
    let taper = libm::powf(1.0 - y, 1.35) + 0.05 * (1.0 - y);
    let outline = 0.44 * foot * taper;
    let across = p.x.abs();
    let tooth = (BIRCH_TEETH * y).fract();
    let small_tooth = (3.0 * BIRCH_TEETH * y).fract();
    if across > outline * (1.06 - 0.16 * tooth - 0.05 * small_tooth) {
        return None;
    }
    let phase = BIRCH_VEINS * (y - 0.55 * across);
    let vein = vein(across, 0.02 * (1.0 - y), wave_vein(phase, 0.08));
    Some(finished(color, vein, p.x, across / outline.max(1e-3)))
}

/// 1 on the midrib or a side vein, 0 between.
fn vein(across: f32, midrib: f32, side_vein: f32) -> f32 {
    (1.0 - smooth(0.5 * midrib, midrib.max(1e-4), across)).max(0.7 * side_vein)
}

/// 1 where `phase` is a whole number, falling off over `width`.
fn wave_vein(phase: f32, width: f32) -> f32 {
    let distance = (phase - phase.round()).abs();
    1.0 - smooth(0.3 * width, width.max(1e-3), distance)
}

/// Blade and veins, one half lit, the rim a little darker.
fn finished(color: [f32; 3], vein: f32, x: f32, rim: f32) -> [f32; 3] {
    let half = if x < 0.0 { 0.92 } else { 1.05 };
    let blade = shaded(color, half * (1.04 - 0.14 * rim * rim));
    mixed(blade, shaded(mixed(color, [0.75, 0.8, 0.45], 0.25), VEIN_LIGHT), 0.6 * vein)
}
