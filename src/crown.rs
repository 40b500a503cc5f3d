//! Ambient occlusion of the crown, the ellipsoid inscribed in the bounding box of all leaves: less
//! light reaches its interior.

use crate::bounds::Aabb;
use glam::Vec3;

/// Fraction of the light that reaches the centre of a crown.
pub(crate) const INNERMOST: f32 = 0.35;
/// Radius, from the crown's centre (0) to its surface (1), up to which the light stays at its
/// minimum.
pub(crate) const INNERMOST_RADIUS: f32 = 0.15;

/// Fraction of the light that arrives at `radius`, which is 0 at the crown's centre and 1 on its
/// surface.
#[cfg(feature = "software")]
pub(crate) fn openness(radius: f32) -> f32 {
    INNERMOST + (1.0 - INNERMOST) * smoothstep(INNERMOST_RADIUS, 1.0, radius)
}

/// Rises smoothly from 0 at `from` to 1 at `to`.
pub(crate) fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// One over half a box's size, along each axis; 0 for an empty box, and for one that is infinitely
/// thin.
pub(crate) fn inverse_half_size(crown: &Aabb) -> Vec3 {
    let half_size = (crown.size() * 0.5).max(Vec3::splat(f32::MIN_POSITIVE));
    let inverse = half_size.recip();
    if inverse.is_finite() && !crown.is_empty() { inverse } else { Vec3::ZERO }
}
