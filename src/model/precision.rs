//! How exact the numbers of a model are.

use serde::{Deserialize, Serialize};

/// How far the numbers of a model may be from those of the plant that was simplified; 0 if they are
/// exact.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Precision {
    /// Coordinates of vertices and pivots, in the plant's units.
    pub position: f32,
    /// Normals, in radians.
    pub normal_rad: f32,
    /// Texture coordinates.
    pub uv: f32,
    /// Linear colour factors; their alpha is always exact.
    pub color: f32,
}

impl Precision {
    /// Nothing was rounded.
    pub const EXACT: Self = Self { position: 0.0, normal_rad: 0.0, uv: 0.0, color: 0.0 };
}
