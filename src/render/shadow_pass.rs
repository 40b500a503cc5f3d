//! Shadows of the sun: a map of what its light meets first, drawn before each picture.
//!
//! The map covers what the camera sees as far as the effect says. Plants whose shadow can fall there are drawn into it with
//! a share of their leaves; all others are left out. It moves by whole pixels, so that shadows of still plants stand still.
//!
//! Limits: one map; beyond it there are no shadows, and fine ones are as wide as its pixels.

use super::{
    effect_buffers::ShadowMap,
    foliage::{Frame, Instance},
    frame_list::{Eye, ModelFacts},
    layer::Layer,
    look::Look,
    model_buffers::ModelBuffers,
    surface::{Target, layouts},
};
use crate::{
    Result,
    effects::{Count, Effects, Shadow},
};
use glam::{DMat4, DVec3, DVec4};

/// How far towards the sun something may stand that still casts a shadow, in radii of the map.
const BACK_RADII: f64 = 3.0;

/// The map and what draws it.
pub(super) struct ShadowPass {
    effect: Shadow,
    towards_sun: DVec3,
    map: ShadowMap,
    layer: Layer,
    casters: Vec<Instance>,
}

/// Where the sun's light comes from, and what of the world the map covers.
#[derive(Debug, Clone, Copy)]
pub(super) struct SunView {
    pub(super) clip_from_world: DMat4,
    /// Half the side that is covered, in world units.
    radius: f64,
}

impl SunView {
    /// Covers what `frame` sees as far as `distance`.
    pub(super) fn new(frame: &Frame, towards_sun: DVec3, effect: &Shadow) -> Self {
        let camera = &frame.camera;
        let length = f64::from(effect.distance);
        let forward = (camera.target - camera.eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        let center = camera.eye + forward * (0.5 * length);
        let clip = camera.clip_from_camera();
        let slope = clip.x_axis.x.recip().hypot(clip.y_axis.y.recip());
        let radius = (0.5 * length).hypot(length * slope).min(length);
        let away = -towards_sun.try_normalize().unwrap_or(DVec3::Y);
        let [right, up] = away.any_orthonormal_pair().into();
        // Whole pixels.
        let step = 2.0 * radius / f64::from(effect.resolution);
        let snapped = |axis: DVec3| (axis.dot(center) / step).round() * step;
        let back = away.dot(center) - BACK_RADII * radius;
        let depth = (BACK_RADII + 1.0) * radius;
        let rows = [
            (right / radius).extend(-snapped(right) / radius),
            (up / radius).extend(-snapped(up) / radius),
            (away / depth).extend(-back / depth),
            DVec4::W,
        ];
        Self { clip_from_world: DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(), radius }
    }

    /// Whether the shadow of a sphere can fall on what is covered.
    fn is_reached_by(&self, center: DVec3, radius: f64) -> bool {
        let clip = self.clip_from_world * center.extend(1.0);
        let reach = radius / self.radius;
        let depth_reach = reach / (BACK_RADII + 1.0);
        clip.x.abs() <= 1.0 + reach
            && clip.y.abs() <= 1.0 + reach
            && (-depth_reach..=1.0 + depth_reach).contains(&clip.z)
    }
}

impl ShadowPass {
    /// `picture` is the layouts of the picture's layer, of which models and frames bind the first two.
    pub(super) fn new(device: &wgpu::Device, look: &Look, effect: Shadow, picture: &[wgpu::BindGroupLayout]) -> Self {
        let effects = Effects { wind: look.effects.wind, ..Effects::default() };
        let of_effects = layouts(device, &effects).into_iter().skip(2);
        let layouts = picture[..2].iter().cloned().chain(of_effects).collect();
        let map = ShadowMap::new(device, effect.resolution);
        let towards_sun = look.lighting.towards_sun.as_dvec3();
        let look = Look { effects, ..Look::default() };
        Self {
            effect,
            towards_sun,
            map,
            layer: Layer::new(device, Target::Shadow, look, layouts, None),
            casters: Vec::new(),
        }
    }

    /// The map, for those who look shadows up.
    pub(super) fn map(&self) -> &ShadowMap {
        &self.map
    }

    /// Takes in what casts shadows; tells from where light comes, and how many plants cast.
    ///
    /// # Errors
    /// Those of [`Layer::prepare`].
    pub(super) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        models: &[ModelFacts],
        frame: &Frame,
        plants: &[Instance],
        scales: &wgpu::Buffer,
    ) -> Result<(DMat4, Count)> {
        let sun = SunView::new(frame, self.towards_sun, &self.effect);
        self.casters.clear();
        let mut count = Count::default();
        for plant in plants {
            let Some(model) = models.get(plant.model.0) else { continue };
            let (center, radius) = model.placed(plant);
            let casts = sun.is_reached_by(center, radius);
            count.add(casts);
            if casts {
                let active = (plant.active * self.effect.lod).ceil().min(plant.active);
                self.casters.push(Instance { active, scales: None, window: 1.0, ..*plant });
            }
        }
        let px = f64::from(self.effect.resolution) / (2.0 * sun.radius);
        let eye = Eye::of_sun(frame, sun.clip_from_world, px);
        self.layer.prepare(device, queue, models, &eye, &self.casters, scales)?;
        Ok((sun.clip_from_world, count))
    }

    /// Forgets what casts shadows.
    pub(super) fn clear(&mut self) {
        self.layer.clear();
    }

    /// Forgets what is bound to another buffer of scales.
    pub(super) fn forget_bindings(&mut self) {
        self.layer.forget_bindings();
    }

    /// Draws the map.
    pub(super) fn render(&self, encoder: &mut wgpu::CommandEncoder, models: &[ModelBuffers]) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow map"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: self.map.view(),
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.layer.render(&mut pass, models);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::camera::Camera;

    fn frame(eye: DVec3) -> Frame {
        let target = eye + DVec3::new(0.0, -0.1, -1.0);
        let camera = Camera { eye, target, up: DVec3::Y, fov_y_radians: 0.9, aspect: 1.5, near: 0.1 };
        Frame::new(&camera, 500)
    }

    #[test]
    fn what_is_seen_within_the_distance_is_covered_and_the_map_moves_by_whole_pixels() {
        let effect = Shadow { distance: 50.0, ..Shadow::default() };
        let towards_sun = DVec3::new(0.3, 0.8, 0.2);
        let sun = SunView::new(&frame(DVec3::ZERO), towards_sun, &effect);
        for away in [1.0, 20.0, 49.0] {
            let seen = DVec3::new(0.3, -0.1, -1.0).normalize() * away;
            let clip = sun.clip_from_world * seen.extend(1.0);
            assert!(clip.x.abs() <= 1.0 && clip.y.abs() <= 1.0 && (0.0..=1.0).contains(&clip.z), "{away}: {clip}");
        }
        let moved = SunView::new(&frame(DVec3::new(1.234, 0.0, -5.678)), towards_sun, &effect);
        let point = DVec3::new(3.0, 1.0, -20.0).extend(1.0);
        let pixels = (moved.clip_from_world * point - sun.clip_from_world * point) * f64::from(effect.resolution) / 2.0;
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
        assert!(sun.is_reached_by(seen + DVec3::Z * 200.0, 200.0), "large enough to reach it");
    }
}
