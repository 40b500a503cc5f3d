//! The crown: the ellipsoid that the box around all leaves encloses, in whose middle less light arrives.

/// Share of the light left in the middle of a crown.
pub(crate) const INNERMOST: f32 = 0.35;
/// Where, between the crown's middle (0) and its outside (1), light begins to rise.
pub(crate) const INNERMOST_RADIUS: f32 = 0.15;

/// Share of the light that arrives at `radius`: 0 in the crown's middle, 1 on its outside.
pub(crate) fn openness(radius: f32) -> f32 {
    INNERMOST + (1.0 - INNERMOST) * smoothstep(INNERMOST_RADIUS, 1.0, radius)
}

/// Rises smoothly from 0 at `from` to 1 at `to`.
pub(crate) fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
