//! Where crowns and their parts are on the small picture.

use super::{Crown, Parts};
use crate::Camera;
use glam::DVec3;

/// Diameter in pixels of the small picture from which on a plant is drawn by its parts.
const PARTS_PX: f32 = 24.0;
/// Diameters in pixels of the small picture over which what shows begins to count.
pub(super) const SEEN_PX: [f32; 2] = [2.0, 4.0];

/// A crown on the small picture, or a part of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Distances of its middle and of its nearest part from the eye.
    pub(super) distance: f32,
    pub(super) front: f32,
    /// Index into the plants.
    pub(super) plant: u32,
    pub(super) middle: [f32; 2],
    pub(super) half: [f32; 2],
    pub(super) opacity: f32,
}

/// How crowns are seen on the small picture.
pub(super) struct Seen<'a> {
    camera: &'a Camera,
    size: [f32; 2],
    /// Pixels over a unit of length, at a clip-space w of 1.
    scale: f64,
    /// Squares of cosine and sine of the camera's pitch.
    pitch: [f64; 2],
}

impl<'a> Seen<'a> {
    pub(super) fn new(camera: &'a Camera, size: [u32; 2]) -> Self {
        let row = camera.clip_from_world.row(3).truncate();
        // An orthographic camera looks along its depth.
        let forwards = if camera.is_orthographic() { camera.clip_from_world.row(2).truncate() } else { row };
        let down = forwards.normalize_or_zero().y;
        let scale = camera.pixels_per_unit() * f64::from(size[1]) / f64::from(camera.height_px);
        Self { camera, size: size.map(|side| side as f32), scale, pitch: [1.0 - down * down, down * down] }
    }

    /// Appends the disc of a crown, or those of its parts. Returns its diameter in pixels, or
    /// `None` if it is too small to count or behind the eye.
    pub(super) fn discs(&self, crown: &Crown<'_>, plant: u32, discs: &mut Vec<Disc>) -> Option<f32> {
        let whole = self.disc(crown.center, crown.half, crown.opacity, plant);
        let diameter = whole.map_or(f32::INFINITY, |disc| 2.0 * disc.half[0].max(disc.half[1]));
        let Parts { parts, center, radius, turn: [cos, sin] } = crown.parts;
        if diameter <= SEEN_PX[0] || (whole.is_none() && parts.is_empty()) {
            return None;
        }
        if parts.is_empty() || diameter < PARTS_PX {
            discs.extend(whole);
            return Some(diameter);
        }
        let before = discs.len();
        let [cos, sin] = [cos, sin].map(f64::from);
        discs.extend(parts.iter().filter_map(|part| {
            let [x, y, z] = part.center.map(f64::from);
            let at = DVec3::new(cos * x + sin * z, y, cos * z - sin * x);
            self.disc(center + at * radius, part.half.map(|half| f64::from(half) * radius), part.opacity, plant)
        }));
        (discs.len() > before).then_some(diameter)
    }

    /// The disc of an ellipsoid; `None` if it is around the eye or behind it.
    fn disc(&self, center: DVec3, [wide, high]: [f64; 2], opacity: f32, plant: u32) -> Option<Disc> {
        let clip = self.camera.clip_from_world * center.extend(1.0);
        let distance = center.distance(self.camera.eye);
        let front = distance - wide.max(high);
        let is_around = !self.camera.is_orthographic() && front <= 0.0;
        if clip.w <= 0.0 || is_around || !clip.is_finite() {
            return None;
        }
        let scale = self.scale / clip.w;
        let high = (high * high * self.pitch[0] + wide * wide * self.pitch[1]).sqrt();
        let half = [(wide * scale) as f32, (high * scale) as f32];
        let is_seen = half[0].is_finite() && half[1].is_finite();
        let x = (0.5 + 0.5 * (clip.x / clip.w) as f32) * self.size[0];
        let y = (0.5 + 0.5 * (clip.y / clip.w) as f32) * self.size[1];
        let opacity = if opacity.is_nan() { 0.0 } else { opacity.clamp(0.0, 1.0) };
        let [distance, front] = [distance, front].map(|distance| distance as f32);
        is_seen.then_some(Disc { distance, front, plant, middle: [x, y], half, opacity })
    }
}
