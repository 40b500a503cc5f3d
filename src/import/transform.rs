//! Transforms composed of translation, rotation and scale.

use glam::{DAffine3, DMat3, DQuat, DVec3};

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

/// The matrix that turns normals where `linear` turns positions: the cofactors, which do as the
/// inverse transpose does and also exist for flat scales.
pub(super) fn normal_matrix(linear: &DMat3) -> DMat3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if linear.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}
