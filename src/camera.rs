//! Cameras: from the caller's own matrix, or built from an eye and a target ([`LookAt`]).

use crate::{Error, Result, bounds::Sphere};
use glam::{
    DMat3, DMat4, DVec3, DVec4,
    dcamera::rh::{proj, view},
};

/// Distance of the near plane, in radii of the framed sphere; small, because a camera may be inside
/// a crown.
const NEAR_RADII: f64 = 1e-3;
/// Distance of a sphere's centre, in diameters, within which it is too near for one picture of it.
const NEAR_DIAMETERS: f64 = 1.0;
/// Range to which a vertical field of view is clamped, in degrees.
const FOV_RANGE_DEG: [f64; 2] = [0.1, 175.0];

/// Depth convention of a projection. Clip space is that of wgpu, Direct3D and Metal: z/w runs from
/// 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Depth {
    /// 1 at the near plane, falling to 0 at the far plane or at infinity: the greater depth wins.
    #[default]
    Reversed,
    /// 0 at the near plane, rising to 1 at the far plane: the lesser depth wins.
    Standard,
}

impl Depth {
    /// Value to which a depth buffer is cleared.
    pub fn clear_value(self) -> f32 {
        match self {
            Self::Reversed => 0.0,
            Self::Standard => 1.0,
        }
    }
}

/// Camera of one frame, in world units; right-handed or left-handed, perspective or orthographic.
///
/// Any projection works: off-centre (for one eye of a headset, for instance), with or without near
/// and far planes. Pixels are square.
///
/// ```
/// use foliage_lod::{Camera, Depth, glam::{DMat4, DVec3, dcamera::rh::{proj, view}}};
///
/// let eye = DVec3::new(0.0, 2.0, 30.0);
/// let clip_from_camera = proj::directx::perspective(1.0, 16.0 / 9.0, 0.1, 1000.0);
/// let camera = Camera {
///     clip_from_world: clip_from_camera * view::look_at_mat4(eye, DVec3::ZERO, DVec3::Y),
///     eye,
///     height_px: 1080,
///     depth: Depth::Standard,
/// };
/// assert!(camera.check().is_ok());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Projection times view matrix: x to the right, y up, z as `depth` defines. A point's w is its
    /// distance along the line of sight, or 1 under an orthographic projection.
    pub clip_from_world: DMat4,
    /// Position of the eye. For an orthographic projection, a point far back along the line of
    /// sight: leaves are lit as seen from there.
    pub eye: DVec3,
    /// Height of the picture in pixels; levels of detail depend on it.
    pub height_px: u32,
    /// Depth convention of the matrix.
    pub depth: Depth,
}

/// Numbers of a camera from which sizes on screen follow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NearScale {
    pixels_per_unit: f64,
    w_slope: f64,
    near_w: f64,
    w_row: DVec4,
}

impl NearScale {
    pub(crate) fn new(camera: &Camera) -> Self {
        Self {
            pixels_per_unit: camera.pixels_per_unit(),
            w_slope: camera.w_slope(),
            near_w: camera.near_w(),
            w_row: camera.row(3),
        }
    }

    /// Number of pixels covered by a length of 1 where a sphere is nearest to the camera.
    pub(crate) fn at(&self, center: DVec3, radius: f64) -> f64 {
        let w = self.w_row.dot(center.extend(1.0));
        self.pixels_per_unit / (w - radius * self.w_slope).max(self.near_w)
    }
}

impl Camera {
    /// Checks that `depth` is the convention of the matrix. A non-finite matrix passes: nothing is
    /// drawn with it.
    ///
    /// An orthographic projection is not checked.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a perspective projection with the other convention.
    pub fn check(&self) -> Result<()> {
        let [_, offset] = self.depth_by_w();
        let (is_wrong, other) = match self.depth {
            Depth::Reversed => (offset < 0.0, Depth::Standard),
            Depth::Standard => (offset > 0.0, Depth::Reversed),
        };
        if is_wrong && !self.is_orthographic() {
            let allowed = format!("{other:?}, the convention of the matrix");
            return Err(Error::invalid("camera.depth", format!("{:?}", self.depth), allowed));
        }
        Ok(())
    }

    /// Whether w is the same for all points.
    pub fn is_orthographic(&self) -> bool {
        self.row(3).truncate() == DVec3::ZERO
    }

    /// Vertical field of view in radians; 0 for an orthographic projection. For an off-centre
    /// projection, the angle that the picture would have if it were centred.
    pub fn fov_y(&self) -> f64 {
        2.0 * (self.w_slope() / self.across(1).length()).atan()
    }

    /// Width of the picture over its height.
    pub fn aspect(&self) -> f64 {
        self.across(1).length() / self.across(0).length()
    }

    /// Number of pixels covered by a length of 1 across the line of sight where w is 1.
    pub(crate) fn pixels_per_unit(&self) -> f64 {
        0.5 * f64::from(self.height_px) * self.across(1).length()
    }

    /// Diameter in pixels of a sphere, across the line of sight at its centre. Infinite for a
    /// centre that is not before the eye, and within [`NEAR_DIAMETERS`] of a perspective camera: a
    /// flat picture of it cannot stand for it there.
    pub(crate) fn diameter_px(&self, center: DVec3, radius: f64) -> f32 {
        let w = self.row(3).dot(center.extend(1.0));
        let is_near = !self.is_orthographic() && center.distance(self.eye) < NEAR_DIAMETERS * 2.0 * radius;
        let is_seen = w > 0.0 && !is_near;
        if is_seen { (2.0 * radius * self.pixels_per_unit() / w) as f32 } else { f32::INFINITY }
    }

    /// Change of w per unit of length along the line of sight: 1 for an ordinary perspective, 0 for
    /// an orthographic projection.
    pub(crate) fn w_slope(&self) -> f64 {
        self.row(3).truncate().length()
    }

    /// The w of the near plane; 0 under an orthographic projection.
    pub(crate) fn near_w(&self) -> f64 {
        let [slope, offset] = self.depth_by_w();
        match self.depth {
            _ if self.is_orthographic() => 0.0,
            Depth::Reversed => offset / (1.0 - slope),
            Depth::Standard => -offset / slope,
        }
    }

    /// Signed distances of a clip-space point from the near and the far plane; both are
    /// non-negative between the planes.
    #[cfg(feature = "software")]
    pub(crate) fn between_planes(depth: Depth, clip: DVec4) -> [f64; 2] {
        match depth {
            Depth::Reversed => [clip.w - clip.z, clip.z],
            Depth::Standard => [clip.z, clip.w - clip.z],
        }
    }

    /// World-space ray through the picture's centre, and its change to the right edge and to the
    /// upper edge, all scaled to w = 1. `None` for an orthographic projection.
    pub(crate) fn rays(&self) -> Option<[DVec3; 3]> {
        let rows = [0, 1, 3].map(|row| self.row(row).truncate());
        let world_from_ray = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose().inverse();
        (!self.is_orthographic()).then_some([world_from_ray.z_axis, world_from_ray.x_axis, world_from_ray.y_axis])
    }

    fn row(&self, row: usize) -> DVec4 {
        self.clip_from_world.row(row)
    }

    /// Component of a row of the matrix across the line of sight, in clip-space units per unit of
    /// length.
    fn across(&self, row: usize) -> DVec3 {
        let (row, forward) = (self.row(row).truncate(), self.row(3).truncate());
        row - row.dot(forward) * forward / forward.length_squared().max(f64::MIN_POSITIVE)
    }

    /// Slope and offset of clip-space z as a linear function of w, along the line of sight through
    /// the eye.
    fn depth_by_w(&self) -> [f64; 2] {
        let (z, w) = (self.row(2), self.row(3));
        let slope = z.truncate().dot(w.truncate()) / w.truncate().length_squared().max(f64::MIN_POSITIVE);
        [slope, z.w - slope * w.w + (z.truncate() - slope * w.truncate()).dot(self.eye)]
    }
}

/// Description of a perspective camera that looks from one point at another: right-handed, reversed
/// depth, no far plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookAt {
    /// Position of the eye.
    pub eye: DVec3,
    /// Point in the middle of the picture.
    pub target: DVec3,
    /// Up direction; need not be perpendicular to the line of sight.
    pub up: DVec3,
    /// Vertical field of view in radians; clamped to between 0.1 and 175 degrees when it is used.
    pub fov_y_radians: f64,
    /// Aspect ratio: width over height.
    pub aspect: f64,
    /// Distance of the near plane, above 0.
    pub near: f64,
}

impl LookAt {
    /// Returns the camera for a picture of `height_px` rows.
    pub fn camera(&self, height_px: u32) -> Camera {
        Camera { clip_from_world: self.clip_from_world(), eye: self.eye, height_px, depth: Depth::Reversed }
    }

    /// Frames a sphere seen from `direction` (pointing from the sphere towards the eye), for a
    /// square picture with +Y up.
    ///
    /// At `distance_factor` 1 the sphere just fits into the picture; 2 is twice as far away. A zero
    /// or non-finite direction is replaced by +Z, a radius that is not above 0 by 1.
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

    /// Returns the same camera for a picture with another aspect ratio; the vertical field of view
    /// is unchanged.
    pub fn with_aspect(self, aspect: f64) -> Self {
        Self { aspect, ..self }
    }

    /// View matrix. In camera space the eye is at the origin and looks along -Z, with +Y up.
    pub fn camera_from_world(&self) -> DMat4 {
        let forward = (self.target - self.eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        let sideways = forward.cross(self.up).length_squared() > 0.0;
        let up = if sideways { self.up } else { up_for(-forward) };
        view::look_to_mat4(self.eye, forward, up)
    }

    /// Projection matrix, in wgpu's clip space with reversed depth: z/w is 1 at the near plane and
    /// falls to 0 at infinity.
    pub fn clip_from_camera(&self) -> DMat4 {
        proj::directx::perspective_infinite_reverse(clamped_fov(self.fov_y_radians), self.aspect, self.near)
    }

    /// Projection times view matrix; a point's w is its depth along the line of sight.
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
            let camera = LookAt::framing(&SPHERE, direction, 0.7, 1.0);
            let center = camera.camera_from_world().transform_point3(SPHERE.center());
            assert!(center.truncate().length() < 1e-6 && center.z < 0.0, "{center}");
            let tangent_angle = (SPHERE.radius / -center.z).asin();
            assert!((tangent_angle - 0.35).abs() < 1e-9, "{tangent_angle}");
        }
    }

    #[test]
    fn reversed_depth_is_one_at_the_near_plane_and_w_is_the_distance() {
        let camera = LookAt::framing(&SPHERE, DVec3::Z, 0.7, 2.0);
        let at_near: DVec4 = camera.clip_from_camera() * DVec4::new(0.0, 0.0, -camera.near, 1.0);
        assert!((at_near.z / at_near.w - 1.0).abs() < 1e-12 && (at_near.w - camera.near).abs() < 1e-12);
    }

    #[test]
    fn hostile_numbers_still_give_a_finite_camera() {
        let sphere = Sphere { center: [0.0; 3], radius: 0.0 };
        for (direction, fov) in [(DVec3::ZERO, 0.0), (DVec3::splat(f64::NAN), f64::NAN), (DVec3::Y, 99.0)] {
            let camera = LookAt::framing(&sphere, direction, fov, 1.0);
            assert!(camera.clip_from_world().is_finite(), "{camera:?}");
        }
    }
}
