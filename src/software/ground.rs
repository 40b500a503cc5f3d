//! Ground with heights: twin of `ground_pass.wgsl`, without shadows.

use super::landscape::ground_shown;
use crate::{
    draw::{ground::GroundPages, landscape::Landscape, mips::SrgbTable},
    terrain::GroundMesh,
};
use glam::{Vec2, Vec3};

/// Ground of one picture.
#[derive(Clone, Copy)]
pub(super) struct PlacedGround<'a> {
    pub(super) pages: &'a GroundPages,
    pub(super) mesh: &'a GroundMesh,
    pub(super) landscape: Landscape,
}

impl PlacedGround<'_> {
    /// Linear light that reaches the eye from (u, v), where a pixel is `per_px` of the sides wide
    /// and high.
    pub(super) fn color(&self, uv: Vec2, per_px: [Vec2; 2], from_eye: Vec3, srgb: &SrgbTable) -> Vec3 {
        let plain = self.landscape.ground.map_or(Vec3::ZERO, |ground| ground.color.into());
        let albedo = self.pages.color(uv.to_array(), per_px, plain, srgb);
        let normal = self.pages.normal(uv.to_array(), per_px).normalize_or_zero();
        ground_shown(&self.landscape, albedo, normal, from_eye)
    }
}
