//! Transforms composed of translation, rotation and scale.

use glam::{DAffine3, DQuat, DVec3};

/// Quaternion of a node or an instance without a rotation.
pub(super) const NO_ROTATION: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Scales, then rotates by the quaternion (x, y, z, w), then translates. The quaternion is
/// normalised; one of length zero does not rotate.
pub(super) fn affine(translation: [f32; 3], rotation: [f32; 4], scale: [f32; 3]) -> DAffine3 {
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let quaternion = DQuat::from_array(rotation.map(f64::from));
    let quaternion = if quaternion.length_squared() > 0.0 { quaternion.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(vector(scale), quaternion, vector(translation))
}
