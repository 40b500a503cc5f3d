//! Where a picture is taken from.

use crate::bounds::Sphere;
use glam::{
    DMat4, DVec3,
    dcamera::rh::{proj, view},
};

/// Nearest distance drawn, in radii of the framed sphere: a camera may stand inside a crown.
const NEAR_RADII: f64 = 1e-3;
/// Narrowest and widest vertical field of view, in degrees, that a camera is taken with.
const FOV_RANGE_DEG: [f64; 2] = [0.1, 175.0];

/// A perspective camera, right-handed, in the plant's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub eye: DVec3,
    /// What it looks at.
    pub target: DVec3,
    /// Roughly upwards; need not be perpendicular to the line of sight.
    pub up: DVec3,
    /// Vertical field of view in radians; brought into 0.1 to 175 degrees where it is used.
    pub fov_y_radians: f64,
    /// Width over height.
    pub aspect: f64,
    /// Distance of the near plane, above 0. There is no far plane.
    pub near: f64,
}

impl Camera {
    /// Looks at a sphere from `direction` (from the sphere towards the eye), square picture, +Y up.
    ///
    /// At `distance_factor` 1 the sphere just fits into the picture; 2 is twice as far. A zero or non-finite direction
    /// counts as +Z, a sphere without radius as one of radius 1.
    pub fn framing(sphere: &Sphere, direction: DVec3, fov_y_radians: f64, distance_factor: f64) -> Self {
        let towards_eye = direction.try_normalize().unwrap_or(DVec3::Z);
        let radius = if sphere.radius > 0.0 { sphere.radius } else { 1.0 };
        let distance = radius / (clamped_fov(fov_y_radians) * 0.5).sin() * distance_factor;
        Self {
            eye: sphere.center() + towards_eye * distance,
            target: sphere.center(),
            up: up_for(towards_eye),
            fov_y_radians,
            aspect: 1.0,
            near: radius * NEAR_RADII,
        }
    }

    /// The same camera for a picture of another shape; the vertical field of view stays.
    pub fn with_aspect(self, aspect: f64) -> Self {
        Self { aspect, ..self }
    }

    /// Camera space: the eye at the origin, looking along -Z, +Y up.
    pub fn camera_from_world(&self) -> DMat4 {
        let forward = (self.target - self.eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        let sideways = forward.cross(self.up).length_squared() > 0.0;
        let up = if sideways { self.up } else { up_for(-forward) };
        view::look_to_mat4(self.eye, forward, up)
    }

    /// Clip space as wgpu has it, with reversed depth: z/w is 1 at the near plane and falls to 0 at infinity.
    pub fn clip_from_camera(&self) -> DMat4 {
        proj::directx::perspective_infinite_reverse(clamped_fov(self.fov_y_radians), self.aspect, self.near)
    }

    /// What culling and levels of detail need of this camera, for a picture of `height_px` rows.
    #[cfg(feature = "scene")]
    pub fn viewer(&self, height_px: f32) -> crate::scene::Viewer {
        crate::scene::Viewer {
            eye: self.eye,
            clip_from_world: self.clip_from_world(),
            fov_y: clamped_fov(self.fov_y_radians) as f32,
            height_px,
        }
    }

    /// Both steps in one; the w of a point is its depth along the line of sight.
    pub fn clip_from_world(&self) -> DMat4 {
        self.clip_from_camera() * self.camera_from_world()
    }
}

fn clamped_fov(fov_y_radians: f64) -> f64 {
    let [narrowest, widest] = FOV_RANGE_DEG.map(f64::to_radians);
    if fov_y_radians.is_nan() { narrowest } else { fov_y_radians.clamp(narrowest, widest) }
}

/// +Y, or -Z where the line of sight is nearly vertical.
fn up_for(towards_eye: DVec3) -> DVec3 {
    if towards_eye.y.abs() > 0.999 { DVec3::NEG_Z } else { DVec3::Y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec4;

    const SPHERE: Sphere = Sphere { center: [1e5, 2.0, -3.0], radius: 7.0 };

    #[test]
    fn a_framed_sphere_just_fits_from_every_side() {
        for direction in [DVec3::X, DVec3::Y, DVec3::NEG_Y, DVec3::new(1.0, 0.3, -2.0)] {
            let camera = Camera::framing(&SPHERE, direction, 0.7, 1.0);
            let center = camera.camera_from_world().transform_point3(SPHERE.center());
            assert!(center.truncate().length() < 1e-6 && center.z < 0.0, "{center}");
            let tangent_angle = (SPHERE.radius / -center.z).asin();
            assert!((tangent_angle - 0.35).abs() < 1e-9, "{tangent_angle}");
        }
    }

    #[test]
    fn reversed_depth_is_one_at_the_near_plane_and_w_is_the_distance() {
        let camera = Camera::framing(&SPHERE, DVec3::Z, 0.7, 2.0);
        let at_near: DVec4 = camera.clip_from_camera() * DVec4::new(0.0, 0.0, -camera.near, 1.0);
        assert!((at_near.z / at_near.w - 1.0).abs() < 1e-12 && (at_near.w - camera.near).abs() < 1e-12);
    }

    #[test]
    fn hostile_numbers_still_give_a_finite_camera() {
        let sphere = Sphere { center: [0.0; 3], radius: 0.0 };
        for (direction, fov) in [(DVec3::ZERO, 0.0), (DVec3::splat(f64::NAN), f64::NAN), (DVec3::Y, 99.0)] {
            let camera = Camera::framing(&sphere, direction, fov, 1.0);
            assert!(camera.clip_from_world().is_finite(), "{camera:?}");
        }
    }
}
