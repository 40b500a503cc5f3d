//! Colour of the sky and the ground along a ray: twin of `landscape_pass.wgsl`, without shadows.

use crate::draw::landscape::{Landscape, Rays};
use glam::Vec3;

/// Ray through the picture at (x, y): x to the right and y up, each from -1 to 1.
pub(super) fn ray_through(rays: &Rays, x: f32, y: f32) -> Vec3 {
    rays.forward + rays.right * x + rays.up * y
}

/// Linear colour along `ray` for an eye at world height `eye_height`.
pub(super) fn color(landscape: &Landscape, eye_height: f64, ray: Vec3) -> Vec3 {
    let ray = ray.normalize_or(Vec3::Y);
    let Some((ground, over)) = landscape.ground.map(|ground| (ground, (eye_height - ground.height) as f32)) else {
        return landscape.sky(ray);
    };
    if ray.y >= 0.0 || over <= 0.0 {
        return landscape.sky(ray);
    }
    ground_shown(landscape, ground.color.into(), Vec3::Y, ray * (over / -ray.y))
}

/// Light that reaches the eye from ground of some colour, linear.
pub(super) fn ground_shown(landscape: &Landscape, albedo: Vec3, normal: Vec3, from_eye: Vec3) -> Vec3 {
    let haze = landscape.ground.map_or(0.0, |ground| 1.0 - (-from_eye.length() / ground.haze as f32).exp());
    landscape.lighting.on_ground(albedo, normal).lerp(landscape.sky(Vec3::new(from_eye.x, 0.0, from_eye.z)), haze)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        LookAt,
        draw::{Ground, Lighting},
        effects::Sky,
    };
    use glam::DVec3;

    #[test]
    fn rays_go_where_the_camera_looks_and_the_ground_fades_into_the_horizon() {
        let camera = LookAt {
            eye: DVec3::new(3.0, 2.0, 1.0),
            target: DVec3::new(3.0, 2.0, -9.0),
            up: DVec3::Y,
            fov_y_radians: std::f64::consts::FRAC_PI_2,
            aspect: 2.0,
            near: 0.1,
        };
        let rays = Rays::new(&camera.camera(100)).unwrap();
        assert!((ray_through(&rays, 0.0, 0.0) - Vec3::NEG_Z).length() < 1e-6);
        assert!((ray_through(&rays, 1.0, 1.0) - Vec3::new(2.0, 1.0, -1.0)).length() < 1e-6);
        let lighting = Lighting::default();
        for daylight in [None, Some(Sky::default().under(lighting.towards_sun))] {
            let ground = Some(Ground { color: [0.2, 0.3, 0.1], height: 0.0, haze: 50.0 });
            let landscape = Landscape { daylight, ground, lighting };
            let color = |y: f32| super::color(&landscape, 2.0, Vec3::new(0.0, y, -1.0));
            assert!((color(-1e-5) - color(1e-5)).length() < 0.02, "{} {}", color(-1e-5), color(1e-5));
            let below = color(-10.0);
            assert!(below.y > below.x && below.x > below.z, "the ground's own colour: {below}");
            assert_eq!(
                super::color(&landscape, -1.0, Vec3::NEG_Y),
                super::color(&Landscape { ground: None, ..landscape }, -1.0, Vec3::NEG_Y)
            );
        }
    }
}
