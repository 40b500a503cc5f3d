//! Outlines and veins of single leaves.
//!
//! In leaf coordinates, x is across and y along the leaf; the foot of the blade is at (0, 0) and
//! the tip at (0, 1).

use super::{mixed, shaded, smooth};
use crate::grow::frame::sin_cos;
use glam::Vec2;
use std::f32::consts::TAU;

/// Number of lobes on each side of an oak leaf.
const OAK_LOBES: f32 = 4.0;
/// Number of teeth on each side of a birch leaf.
const BIRCH_TEETH: f32 = 11.0;
/// Number of veins on each side of a birch leaf.
const BIRCH_VEINS: f32 = 7.0;
/// Number of veins on each side of a pecan leaflet.
const PECAN_VEINS: f32 = 12.0;
/// Number of teeth on each side of a fern's leaflet.
const FERN_TEETH: f32 = 5.0;
/// Brightness of veins relative to the blade.
const VEIN_LIGHT: f32 = 1.32;

/// Colour of an oak leaf at `p`, `None` outside it (Quercus robur: broadest above the middle, four
/// to five rounded lobes on each side).
pub(super) fn oak(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let across = p.x.abs();
    if !(0.0..1.0).contains(&p.y) || across > 0.4 {
        return None;
    }
    // Lobes point forwards, less so at the rounded tip.
    let y = p.y - 0.40 * across * (1.0 - p.y * p.y);
    let outline = (y * (1.0 - y)).max(0.0).sqrt() * (0.24 + 0.60 * y);
    let phase = OAK_LOBES * (y - 1.0);
    let wave = 0.5 + 0.5 * sin_cos(TAU * (phase + 0.25)).0;
    let half_width = outline * (0.58 + 0.42 * wave.sqrt()) + 0.004;
    if across > half_width {
        return None;
    }
    let vein = vein(across, 0.020 * (1.0 - 0.8 * p.y), wave_vein(phase, 0.10 - 0.15 * across));
    Some(finished(color, vein, p.x, across / half_width))
}

/// Colour of a pecan leaflet at `p`, `None` outside it (lance-shaped, finely toothed, with a long
/// tip).
pub(super) fn pecan(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let (across, y) = (p.x.abs(), p.y);
    if !(0.0..1.0).contains(&y) || across > 0.2 {
        return None;
    }
    let outline = 0.40 * (y * (1.0 - y)).sqrt() * (1.18 - 0.75 * y);
    let teeth = 1.0 - 0.06 * (20.0 * y).fract();
    if across > outline * teeth {
        return None;
    }
    let vein = vein(across, 0.022 * (1.0 - y), wave_vein(PECAN_VEINS * (y - 0.6 * across), 0.09));
    Some(finished(color, vein, p.x, across / outline.max(1e-3)))
}

/// Colour of a gray birch leaf at `p`, `None` outside it (triangular, with a nearly flat foot with
/// round corners, a long point and double teeth).
pub(super) fn birch(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let across = p.x.abs();
    if !(0.0..1.0).contains(&p.y) || across > 0.46 {
        return None;
    }
    // The foot rises a little towards its corners.
    let y = p.y - 0.10 * across;
    let above = (1.0 - y).clamp(0.0, 1.0);
    let corner = (1.0 - (1.0 - y / 0.17).max(0.0) * (1.0 - y / 0.17).max(0.0)).max(0.0).sqrt();
    let outline = corner * above * (0.10 + 0.46 * above.sqrt() * (0.75 + 0.25 * above));
    let teeth = 1.05 - 0.15 * (BIRCH_TEETH * y).rem_euclid(1.0) - 0.05 * (3.0 * BIRCH_TEETH * y).rem_euclid(1.0);
    if y < 0.0 || across > outline * teeth {
        return None;
    }
    let vein = vein(across, 0.02 * above, wave_vein(BIRCH_VEINS * (p.y - 0.55 * across), 0.08));
    Some(finished(color, vein, p.x, across / outline.max(1e-3)))
}

/// Colour of a fern's leaflet at `p`, `None` outside it (blunt, with shallow round teeth).
pub(super) fn fern(p: Vec2, color: [f32; 3]) -> Option<[f32; 3]> {
    let (across, y) = (p.x.abs(), p.y);
    if !(0.0..1.0).contains(&y) || across > 0.3 {
        return None;
    }
    let outline = 0.27 * (1.0 - y * y * y).max(0.0).sqrt();
    let wave = 0.5 + 0.5 * sin_cos(TAU * FERN_TEETH * y).1;
    let half_width = outline * (0.82 + 0.18 * wave);
    if across > half_width {
        return None;
    }
    Some(finished(color, vein(across, 0.05 * (1.0 - y), 0.0), p.x, across / half_width.max(1e-3)))
}

/// 1 on the midrib, up to 0.7 on a side vein, 0 between.
fn vein(across: f32, midrib: f32, side_vein: f32) -> f32 {
    (1.0 - smooth(0.5 * midrib, midrib.max(1e-4), across)).max(0.7 * side_vein)
}

/// 1 where `phase` is an integer, falling to 0 over `width`.
fn wave_vein(phase: f32, width: f32) -> f32 {
    let distance = (phase - phase.round()).abs();
    1.0 - smooth(0.3 * width, width.max(1e-3), distance)
}

/// Combines blade and veins; one half is brighter, and the rim is slightly darker.
fn finished(color: [f32; 3], vein: f32, x: f32, rim: f32) -> [f32; 3] {
    let half = if x < 0.0 { 0.92 } else { 1.05 };
    let blade = shaded(color, half * (1.04 - 0.14 * rim * rim));
    mixed(blade, shaded(mixed(color, [0.75, 0.8, 0.45], 0.25), VEIN_LIGHT), 0.6 * vein)
}
