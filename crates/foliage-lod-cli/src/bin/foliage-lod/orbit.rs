//! The orbit of a window's camera: drag to turn, scroll to zoom.

use glam::DVec3;

/// Rotation per pixel of drag, in radians.
const TURN_PER_PX: f64 = 0.006;
/// Factor applied to the distance for each line of scrolling.
const SCROLL_FACTOR: f64 = 0.88;
/// Maximum elevation above and below the horizon, in radians: short of the poles.
const STEEPEST: f64 = 1.5;

/// Position of the eye relative to the target, after a drag by `right` and `down` pixels.
pub fn dragged(from_target: DVec3, [right, down]: [f32; 2]) -> DVec3 {
    let distance = from_target.length();
    let azimuth = from_target.x.atan2(from_target.z) - f64::from(right) * TURN_PER_PX;
    let elevation = (from_target.y / distance).asin() + f64::from(down) * TURN_PER_PX;
    let elevation = elevation.clamp(-STEEPEST, STEEPEST);
    DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos()) * distance
}

/// Factor applied to the distance after scrolling by `lines`; below 1 for scrolling away from the
/// user.
pub fn zoom(lines: f32) -> f64 {
    SCROLL_FACTOR.powf(f64::from(lines))
}
