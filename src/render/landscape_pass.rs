//! Sky and ground behind everything: where a [`Look`](super::look::Look) calls for them, in place of the plain backdrop.
//!
//! Every pixel takes the colour along its ray: the ground where that meets it, hazier the farther away, else the sky.
//!
//! Limits: the ground is level and lies behind all plants; an eye below it sees no ground.

use super::{
    camera::Camera,
    light::{FLOOR, HORIZON, Lighting, ZENITH},
};
use crate::{crown::smoothstep, effects::sky::Daylight};
use glam::{DVec3, Vec3};

/// A level ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Linear colour.
    pub color: [f32; 3],
    /// World height.
    pub height: f64,
    /// Distance at which a third of the ground's own light arrives, in world units, above 0.
    pub haze: f64,
}

/// What lies behind all plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landscape {
    pub(super) daylight: Option<Daylight>,
    pub(super) ground: Option<Ground>,
    pub(super) lighting: Lighting,
}

/// The rays of a camera: that of a pixel is `forward + right * x + up * y`, with x and y from -1 to 1.
pub(super) struct Rays {
    pub(super) right: Vec3,
    pub(super) up: Vec3,
    pub(super) forward: Vec3,
}

impl Rays {
    pub(super) fn new(camera: &Camera) -> Self {
        let world_from_camera = camera.camera_from_world().inverse();
        let clip_from_camera = camera.clip_from_camera();
        let axis = |axis: DVec3| world_from_camera.transform_vector3(axis);
        Self {
            right: (axis(DVec3::X) / clip_from_camera.x_axis.x).as_vec3(),
            up: (axis(DVec3::Y) / clip_from_camera.y_axis.y).as_vec3(),
            forward: axis(DVec3::NEG_Z).as_vec3(),
        }
    }

    pub(super) fn through(&self, x: f32, y: f32) -> Vec3 {
        self.forward + self.right * x + self.up * y
    }
}

impl Landscape {
    /// Linear colour along `ray` for an eye at world height `eye_height`. Without shadows.
    pub(super) fn color(&self, eye_height: f64, ray: Vec3) -> Vec3 {
        let ray = ray.normalize_or(Vec3::Y);
        let Some((ground, over)) = self.ground.map(|ground| (ground, (eye_height - ground.height) as f32)) else {
            return self.sky(ray);
        };
        if ray.y >= 0.0 || over <= 0.0 {
            return self.sky(ray);
        }
        let away = over / -ray.y;
        let cosine = self.lighting.towards_sun.normalize_or_zero().y.max(0.0);
        let lit = self.lighting.sun * cosine + self.lighting.sky;
        let haze = 1.0 - (-away / ground.haze as f32).exp();
        (Vec3::from(ground.color) * lit).lerp(self.sky(Vec3::new(ray.x, 0.0, ray.z)), haze)
    }

    fn sky(&self, ray: Vec3) -> Vec3 {
        match self.daylight {
            Some(daylight) => daylight.shown(ray),
            None if ray.y < 0.0 => HORIZON.lerp(FLOOR, smoothstep(0.0, 0.4, -ray.y)),
            None => HORIZON.lerp(ZENITH, smoothstep(0.0, 0.7, ray.y)),
        }
    }
}

#[cfg(feature = "render")]
pub(super) use gpu::LandscapePass;
#[cfg(feature = "render")]
pub use gpu::{LandscapeRecord, wgsl};

#[cfg(feature = "render")]
mod gpu {
    use super::{Landscape, Rays};
    use crate::{
        effects::sky::{LOWEST, RGB_FROM_XYZ, SHOWN},
        render::{
            foliage::Frame,
            light,
            look::{Look, shadow_constants},
            shader::ShaderSource,
            surface::{PassDescription, TargetFormat, uniform},
        },
    };
    use glam::{Mat4, Vec3};

    /// What `landscape_pass.wgsl` reads.
    #[repr(C)]
    #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
    pub struct LandscapeRecord {
        /// See `Rays`.
        pub right: [f32; 3],
        /// Of the eye over the ground.
        pub eye_height: f32,
        /// See `Rays`.
        pub up: [f32; 3],
        /// Distance at which a third of the ground's own light arrives.
        pub haze: f32,
        /// See `Rays`.
        pub forward: [f32; 3],
        /// Brightness of the sky.
        pub scale: f32,
        /// Unit vector towards the sun, with what fills it up to 16 bytes.
        pub towards_sun: [f32; 4],
        /// Linear colour of the ground, filled up.
        pub ground: [f32; 4],
        /// Perez' coefficients, each filled up.
        pub perez: [[f32; 4]; 5],
        /// Colour straight above, filled up.
        pub zenith: [f32; 4],
        /// From the eye to the light's clip space.
        pub light_from_eye: [[f32; 4]; 4],
    }

    /// The pass's shader for a look.
    pub fn wgsl(look: &Look) -> String {
        let shadow: [&str; 2] = match look.effects.shadow {
            Some(_) => [
                include_str!("../../shaders/shadow.wgsl"),
                "fn ground_sunlit(from_eye: vec3<f32>) -> f32 {\n    \
                 return shadow_share((landscape.light_from_eye * vec4(from_eye, 1.0)).xyz);\n}\n",
            ],
            None => ["", "fn ground_sunlit(from_eye: vec3<f32>) -> f32 { return 1.0; }\n"],
        };
        let [x, y, z] = [RGB_FROM_XYZ.x_axis, RGB_FROM_XYZ.y_axis, RGB_FROM_XYZ.z_axis]
            .map(|axis| format!("vec3({:?}f, {:?}f, {:?}f)", axis.x, axis.y, axis.z));
        shadow_constants(light::constants(ShaderSource::new(), &look.lighting()), look)
            .constant_bool("HAS_SKY", look.effects.sky.is_some())
            .constant_bool("HAS_GROUND", look.ground.is_some())
            .constant_f32("LOWEST", LOWEST)
            .with_part(&format!("const RGB_FROM_XYZ: mat3x3<f32> = mat3x3({x}, {y}, {z});\n"))
            .with_part(include_str!("../../shaders/light.wgsl"))
            .with_part(shadow[0])
            .with_part(shadow[1])
            .with_body(include_str!("../../shaders/landscape_pass.wgsl"))
    }

    /// The pipeline and what it reads.
    pub(in crate::render) struct LandscapePass {
        pipeline: wgpu::RenderPipeline,
        record: wgpu::Buffer,
        bindings: wgpu::BindGroup,
    }

    impl LandscapePass {
        /// `shadow` lays out the shadow map's bindings where there is one.
        pub(in crate::render) fn new(
            device: &wgpu::Device,
            target: TargetFormat,
            look: &Look,
            shadow: Option<&wgpu::BindGroupLayout>,
        ) -> Self {
            let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
            let (own, record, bindings) = uniform(device, "landscape", stages, size_of::<LandscapeRecord>());
            let pipeline = PassDescription {
                name: "landscape_pass",
                wgsl: wgsl(look),
                entry_points: ["landscape_corner", "landscape_color"],
                layouts: match shadow {
                    Some(shadow) => vec![Some(&own), None, Some(shadow)],
                    None => vec![Some(&own)],
                },
                vertex_buffers: &[],
                surface: None,
            };
            Self { pipeline: pipeline.pipeline(device, target), record, bindings }
        }

        pub(in crate::render) fn upload(
            &self,
            queue: &wgpu::Queue,
            landscape: &Landscape,
            frame: &Frame,
            light_from_eye: Mat4,
        ) {
            let rays = Rays::new(&frame.camera);
            let ground = landscape.ground;
            let dome = landscape.daylight.map(|daylight| daylight.dome);
            let padded = |v: Vec3| v.extend(0.0).to_array();
            let towards_sun = dome.map_or(landscape.lighting.towards_sun.normalize_or_zero(), |dome| dome.towards_sun);
            let record = LandscapeRecord {
                right: rays.right.to_array(),
                eye_height: ground.map_or(0.0, |ground| (frame.camera.eye.y - ground.height) as f32),
                up: rays.up.to_array(),
                haze: ground.map_or(1.0, |ground| ground.haze as f32),
                forward: rays.forward.to_array(),
                scale: landscape.daylight.map_or(0.0, |daylight| daylight.scale * daylight.exposure * SHOWN),
                towards_sun: padded(towards_sun),
                ground: padded(ground.map_or(Vec3::ZERO, |ground| ground.color.into())),
                perez: dome.map_or([[0.0; 4]; 5], |dome| dome.perez.map(padded)),
                zenith: padded(dome.map_or(Vec3::ZERO, |dome| dome.zenith)),
                light_from_eye: light_from_eye.to_cols_array_2d(),
            };
            queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
        }

        /// Covers the whole target. Bindings of a shadow map are set by the caller.
        pub(in crate::render) fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Sky;

    #[test]
    fn rays_go_where_the_camera_looks_and_the_ground_fades_into_the_horizon() {
        let camera = Camera {
            eye: DVec3::new(3.0, 2.0, 1.0),
            target: DVec3::new(3.0, 2.0, -9.0),
            up: DVec3::Y,
            fov_y_radians: std::f64::consts::FRAC_PI_2,
            aspect: 2.0,
            near: 0.1,
        };
        let rays = Rays::new(&camera);
        assert!((rays.through(0.0, 0.0) - Vec3::NEG_Z).length() < 1e-6);
        assert!((rays.through(1.0, 1.0) - Vec3::new(2.0, 1.0, -1.0)).length() < 1e-6);
        let lighting = Lighting::default();
        for daylight in [None, Some(Sky::default().under(lighting.towards_sun))] {
            let ground = Some(Ground { color: [0.2, 0.3, 0.1], height: 0.0, haze: 50.0 });
            let landscape = Landscape { daylight, ground, lighting };
            let color = |y: f32| landscape.color(2.0, Vec3::new(0.0, y, -1.0));
            assert!((color(-1e-5) - color(1e-5)).length() < 0.02, "{} {}", color(-1e-5), color(1e-5));
            let below = color(-10.0);
            assert!(below.y > below.x && below.x > below.z, "the ground's own colour: {below}");
            assert_eq!(
                landscape.color(-1.0, Vec3::NEG_Y),
                Landscape { ground: None, ..landscape }.color(-1.0, Vec3::NEG_Y)
            );
        }
    }
}
