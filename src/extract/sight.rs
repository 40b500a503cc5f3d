//! How a plant is seen in a frame: what policies of the level of detail go by.

use crate::Camera;
use glam::DVec3;

/// Vertical field of view assumed for distances that are given without one: 60 degrees.
pub const REFERENCE_FOV_Y: f32 = std::f32::consts::FRAC_PI_3;

/// Least LOD inside the bounding sphere. Leaves that no view from outside sees are pruned first, so
/// below about half of the leaves the crown is hollow, seen from within.
const LEAST_LOD_INSIDE: f32 = 0.5;
/// Distance in radii within which the least LOD begins to rise.
const LEAST_LOD_FROM: f32 = 1.5;

/// How a plant is seen in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Distance from the camera to the centre of the plant's bounding sphere, in the plant's units
    /// times the instance's scale.
    pub distance: f32,
    /// Radius of the bounding sphere, in the same unit.
    pub radius: f32,
    /// Vertical field of view in radians, between 0 and pi.
    pub fov_y: f32,
    /// Image height in pixels.
    pub height_px: f32,
}

impl Sight {
    /// Describes how a camera sees a sphere, in world units. For an orthographic projection, the
    /// distance is the one at which a perspective camera of [`REFERENCE_FOV_Y`] would see the
    /// sphere at the same size.
    pub fn new(camera: &Camera, center: DVec3, radius: f64) -> Self {
        SeenBy::new(camera).sight(center, radius)
    }

    /// Distance in radii of the bounding sphere; 0 if the distance or radius is NaN, or if the
    /// plant is a point at the camera.
    pub fn distance_in_radii(&self) -> f32 {
        let radii = self.distance / self.radius;
        if radii.is_nan() { 0.0 } else { radii.max(0.0) }
    }

    /// The least LOD at which the plant may be drawn when seen like this, whatever the policy: 0.5
    /// within the bounding sphere, 0 from 1.5 radii on, and between them a smooth rise, so that
    /// nothing changes at once when the eye enters the sphere. Rising outside of it, the bound
    /// holds all the way through the sphere, and at distances where few plants are.
    ///
    /// An orthographic camera counts as being where a perspective one would see the plant as large.
    pub fn least_lod(&self) -> f32 {
        let inwards = unit((LEAST_LOD_FROM - self.distance_in_radii()) / (LEAST_LOD_FROM - 1.0));
        LEAST_LOD_INSIDE * inwards * inwards * (3.0 - 2.0 * inwards)
    }

    /// Radius of the bounding sphere's outline, relative to half the image height. Infinite inside
    /// the sphere.
    pub(super) fn outline(&self) -> f32 {
        outline(self.distance_in_radii(), self.fov_y)
    }

    /// Radius of the bounding sphere's outline in pixels. Infinite inside the sphere.
    pub fn radius_px(&self) -> f32 {
        self.outline() * 0.5 * self.height_px
    }
}

/// How a camera sees any number of spheres: what does not depend on the sphere is computed once.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeenBy {
    eye: DVec3,
    fov_y: f32,
    height_px: u32,
    /// Number of pixels covered by a length of 1; set for an orthographic projection.
    pixels_per_unit: Option<f64>,
}

impl SeenBy {
    pub(crate) fn new(camera: &Camera) -> Self {
        let pixels_per_unit = camera.is_orthographic().then(|| camera.pixels_per_unit());
        let fov_y = if pixels_per_unit.is_some() { REFERENCE_FOV_Y } else { camera.fov_y() as f32 };
        Self { eye: camera.eye, fov_y, height_px: camera.height_px, pixels_per_unit }
    }

    /// See [`Sight::new`].
    pub(crate) fn sight(&self, center: DVec3, radius: f64) -> Sight {
        let distance = match self.pixels_per_unit {
            None => center.distance(self.eye) as f32,
            Some(pixels_per_unit) => {
                let outline = 2.0 * radius * pixels_per_unit / f64::from(self.height_px);
                let across = 1.0 / (outline * f64::from(0.5 * REFERENCE_FOV_Y).tan());
                (radius * across.hypot(1.0)) as f32
            }
        };
        Sight { distance, radius: radius as f32, fov_y: self.fov_y, height_px: self.height_px as f32 }
    }
}

/// Radius of a unit sphere's outline at `distance`, relative to half the image height; infinite
/// inside the sphere.
pub(super) fn outline(distance: f32, fov_y: f32) -> f32 {
    if distance > 1.0 { 1.0 / ((distance * distance - 1.0).sqrt() * (0.5 * fov_y).tan()) } else { f32::INFINITY }
}

/// Clamps to `0..=1`; NaN becomes 0.
pub(super) fn unit(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_lod_rises_without_a_jump_and_without_a_kink_at_the_sphere() {
        let least = |radii: f32| {
            let sight = Sight { distance: 2.0 * radii, radius: 2.0, fov_y: 1.0, height_px: 1080.0 };
            sight.least_lod()
        };
        assert_eq!([0.0, 1.0, 1.25, 1.5, 9.0].map(least), [0.5, 0.5, 0.25, 0.0, 0.0]);
        let steps: Vec<f32> = (0..=2000).map(|step| least(0.001 * step as f32)).collect();
        let largest = steps.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f32::max);
        assert!(steps.windows(2).all(|pair| pair[0] >= pair[1]) && largest < 0.002, "{largest}");
        assert!(least(1.0) - least(1.001) < 1e-5 && least(1.499) - least(1.5) < 1e-5);
    }
}
