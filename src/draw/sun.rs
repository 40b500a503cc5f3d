//! The sun's camera: the part of the world that a shadow map covers.

use super::instance::Frame;
use crate::{Camera, Depth, effects::Shadow, frustum::Frustum};
use glam::{DMat4, DVec3, DVec4};

/// Distance towards the sun, in radii of the map, up to which casters are drawn. With the sun at 20
/// degrees, a tree as tall as the map's radius casts a shadow of that length.
const BACK_RADII: f64 = 3.0;
/// Depth of the map along the light, in radii of the map: the casters' side plus the map's own
/// radius.
pub(crate) const DEPTH_RADII: f64 = BACK_RADII + 1.0;

/// The sun's camera, and the radius of the map.
#[derive(Debug, Clone, Copy)]
pub struct SunView {
    /// Orthographic, with standard depth.
    pub camera: Camera,
    /// Half the side of the covered square, in world units.
    radius: f64,
    /// Unit vector from the sun.
    away: DVec3,
    /// What the picture's camera sees, relative to `seen_from`.
    seen: Frustum,
    seen_from: DVec3,
}

impl SunView {
    /// Covers everything that `frame` sees up to the effect's distance, measured from the eye or,
    /// for an orthographic camera, from the near plane. The map moves by whole texels, so that the
    /// shadows of static plants do not shimmer.
    pub fn new(frame: &Frame, towards_sun: DVec3, effect: &Shadow) -> Self {
        let length = f64::from(effect.distance);
        let (center, radius) = covered(&frame.camera, length);
        let away = -towards_sun.try_normalize().unwrap_or(DVec3::Y);
        let [right, up] = away.any_orthonormal_pair().into();
        let step = 2.0 * radius / f64::from(effect.resolution);
        let snapped = |axis: DVec3| (axis.dot(center) / step).round() * step;
        let back = away.dot(center) - BACK_RADII * radius;
        let depth = DEPTH_RADII * radius;
        let rows = [
            (right / radius).extend(-snapped(right) / radius),
            (up / radius).extend(-snapped(up) / radius),
            (away / depth).extend(-back / depth),
            DVec4::W,
        ];
        let camera = Camera {
            clip_from_world: DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(),
            eye: center - away * (BACK_RADII * radius),
            height_px: effect.resolution,
            depth: Depth::Standard,
        };
        let seen = Frustum::new(&frame.camera, center);
        Self { camera, radius, away, seen, seen_from: center }
    }

    /// Whether the shadow of a sphere can fall on the map, and within it on what the picture shows.
    pub fn is_reached_by(&self, center: DVec3, radius: f64) -> bool {
        let clip = self.camera.clip_from_world * center.extend(1.0);
        let reach = radius / self.radius;
        let depth_reach = reach / DEPTH_RADII;
        clip.x.abs() <= 1.0 + reach
            && clip.y.abs() <= 1.0 + reach
            && (-depth_reach..=1.0 + depth_reach).contains(&clip.z)
            && self.seen.meets_swept_sphere(center - self.seen_from, radius, self.shadow_of(clip.z))
    }

    /// From a caster at the depth `z` of the map to where its shadow leaves the map.
    fn shadow_of(&self, z: f64) -> DVec3 {
        self.away * ((1.0 - z).max(0.0) * DEPTH_RADII * self.radius)
    }
}

/// Centre and radius of a sphere around the part of a frustum within `length`.
fn covered(camera: &Camera, length: f64) -> (DVec3, f64) {
    let sides = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
    if let Some([forward, right, up]) = camera.rays() {
        let forward = forward.try_normalize().map_or((DVec3::NEG_Z, 1.0), |unit| (unit, forward.length()));
        let center = camera.eye + forward.0 * (0.5 * length);
        let corner = |[x, y]: [f64; 2]| {
            let across = (right * x + up * y) * (length / forward.1);
            (0.5 * length).hypot(across.length())
        };
        return (center, sides.map(corner).into_iter().fold(0.0, f64::max).min(length));
    }
    let world_from_clip = camera.clip_from_world.inverse();
    let at = |x: f64, y: f64, z: f64| world_from_clip.project_point3(DVec3::new(x, y, z));
    let [near, far] = match camera.depth {
        Depth::Reversed => [1.0, 0.0],
        Depth::Standard => [0.0, 1.0],
    };
    let start = at(0.0, 0.0, near);
    let forward = (at(0.0, 0.0, far) - start).normalize_or(DVec3::NEG_Z);
    let across = sides.map(|[x, y]| at(x, y, near).distance(start)).into_iter().fold(0.0, f64::max);
    (start + forward * (0.5 * length), (0.5 * length).hypot(across))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LookAt;

    fn frame(eye: DVec3) -> Frame {
        let target = eye + DVec3::new(0.0, -0.1, -1.0);
        let camera = LookAt { eye, target, up: DVec3::Y, fov_y_radians: 0.9, aspect: 1.5, near: 0.1 };
        camera.camera(500).into()
    }

    #[test]
    fn what_is_seen_within_the_distance_is_covered_and_the_map_moves_by_whole_pixels() {
        let effect = Shadow { distance: 50.0, ..Shadow::default() };
        let towards_sun = DVec3::new(0.3, 0.8, 0.2);
        let sun = SunView::new(&frame(DVec3::ZERO), towards_sun, &effect);
        for away in [1.0, 20.0, 49.0] {
            let seen = DVec3::new(0.3, -0.1, -1.0).normalize() * away;
            let clip = sun.camera.clip_from_world * seen.extend(1.0);
            assert!(clip.x.abs() <= 1.0 && clip.y.abs() <= 1.0 && (0.0..=1.0).contains(&clip.z), "{away}: {clip}");
        }
        let moved = SunView::new(&frame(DVec3::new(1.234, 0.0, -5.678)), towards_sun, &effect);
        let point = DVec3::new(3.0, 1.0, -20.0).extend(1.0);
        let pixels = (moved.camera.clip_from_world * point - sun.camera.clip_from_world * point)
            * f64::from(effect.resolution)
            / 2.0;
        assert!((pixels.x - pixels.x.round()).abs() < 1e-6 && (pixels.y - pixels.y.round()).abs() < 1e-6, "{pixels}");
    }

    #[test]
    fn plants_towards_the_sun_cast_and_those_beyond_do_not() {
        let effect = Shadow { distance: 50.0, ..Shadow::default() };
        let towards_sun = DVec3::new(1.0, 1.0, 0.0).normalize();
        let sun = SunView::new(&frame(DVec3::ZERO), towards_sun, &effect);
        let seen = DVec3::new(0.0, -2.0, -25.0);
        assert!(sun.is_reached_by(seen, 1.0) && sun.is_reached_by(seen + towards_sun * 100.0, 1.0));
        assert!(!sun.is_reached_by(seen - towards_sun * 100.0, 1.0), "behind what is seen");
        assert!(!sun.is_reached_by(seen + DVec3::Z * 200.0, 1.0), "beside it");
        let behind_the_eye = DVec3::new(0.0, 0.0, 10.0);
        assert!(!sun.is_reached_by(behind_the_eye, 1.0), "its shadow is out of the picture");
        assert!(sun.is_reached_by(behind_the_eye, 15.0), "large enough to be seen itself");
        assert!(sun.is_reached_by(seen + DVec3::Z * 200.0, 200.0), "large enough to reach it");
    }

    /// A point that the picture shows is reached by whatever stands between it and the sun.
    #[test]
    fn nothing_that_shades_a_seen_point_is_left_out() {
        let effect = Shadow { distance: 50.0, ..Shadow::default() };
        for towards_sun in [DVec3::new(1.0, 0.3, 0.0), DVec3::new(0.1, 0.2, -1.0), DVec3::new(0.0, 0.4, 1.0), DVec3::Y]
        {
            let towards_sun = towards_sun.normalize();
            let view = frame(DVec3::new(300.0, 2.0, -70.0));
            let sun = SunView::new(&view, towards_sun, &effect);
            for i in 0..1000_u32 {
                let unit = |salt: u32| f64::from((i * 7 + salt).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
                let clip = DVec3::new(2.0 * unit(1) - 1.0, 2.0 * unit(2) - 1.0, 0.1 / (1.0 + 45.0 * unit(3)));
                let seen = view.camera.clip_from_world.inverse().project_point3(clip);
                let caster = seen + towards_sun * (60.0 * unit(4));
                assert!(sun.is_reached_by(caster, 0.01), "{caster} shades {seen}");
            }
        }
    }
}
