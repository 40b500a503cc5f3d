//! Camera of one frame list, which computes the record of each instance.

use super::{
    facts::ModelFacts,
    instance::{Frame, Instance},
    look::Look,
    records::{InstanceRecord, NO_SCALES},
};
use crate::{Camera, bounds::largest_scale, model::Transition};
use glam::{DAffine3, DMat4, DVec2, DVec3};

/// Camera of a frame list: the frame's own camera or the sun's.
#[derive(Debug, Clone)]
pub struct Eye {
    /// Position of the frame's eye, from which the leaves are lit.
    at: DVec3,
    camera: Camera,
    /// The camera's matrix, shifted by the jitter.
    clip_from_world: DMat4,
    pub(super) seconds: f64,
    /// Jitter of the picture, in clip space.
    jitter: DVec2,
    /// The previous frame; set if motion vectors are drawn.
    pub(super) before: Option<Before>,
    /// Transform to the sun's clip space; set if shadows are looked up.
    pub light_from_world: Option<DMat4>,
}

impl Eye {
    /// Camera of a frame.
    pub fn new(frame: &Frame) -> Self {
        let camera = frame.camera;
        let is_still = frame.jitter_px == [0.0; 2];
        let jitter = if is_still { DVec2::ZERO } else { frame.jitter() };
        let clip_from_world = frame.jittered().clip_from_world;
        Self {
            at: camera.eye,
            camera,
            clip_from_world,
            seconds: frame.seconds,
            jitter,
            before: None,
            light_from_world: None,
        }
    }

    /// Camera of a frame for motion vectors, with the previous frame.
    pub fn of_motion(frame: &Frame) -> Self {
        let (camera, seconds) = frame.before.unwrap_or((frame.camera, frame.seconds));
        let before = Before { clip_from_world: camera.clip_from_world, seconds };
        Self { before: Some(before), ..Self::new(frame) }
    }

    /// The sun's camera, at the time of `frame`.
    pub fn of_sun(frame: &Frame, sun: Camera) -> Self {
        Self { at: frame.camera.eye, ..Self::new(&Frame { camera: sun, jitter_px: [0.0; 2], ..*frame }) }
    }

    /// Depth convention of the camera.
    pub fn depth(&self) -> crate::Depth {
        self.camera.depth
    }

    pub(super) fn seconds_before(&self) -> f64 {
        self.before.as_ref().map_or(self.seconds, |before| before.seconds)
    }

    /// Number of pixels covered by a length of 1, in plant units, where the plant is nearest to the
    /// camera.
    pub(super) fn pixels_per_unit(&self, model: &ModelFacts, instance: &Instance) -> f64 {
        let scale = largest_scale(&instance.world_from_plant);
        let center = instance.world_from_plant.transform_point3(model.center);
        let w = self.clip_from_world.row(3).dot(center.extend(1.0));
        let nearest = (w - f64::from(model.reach) * scale * self.camera.w_slope()).max(self.camera.near_w());
        scale * self.camera.pixels_per_unit() / nearest
    }

    /// Width of the thinnest stem that is drawn whole, in local space.
    pub(super) fn stem_width(&self, model: &ModelFacts, instance: &Instance, look: &Look) -> f32 {
        (f64::from(look.thinnest_px) / self.pixels_per_unit(model, instance)) as f32
    }

    /// Computes the record of one plant, or `None` if its transform cannot be drawn. Matrices are
    /// composed in `f64`, so that plants far from the origin stay precise.
    pub(super) fn record(&self, model: &ModelFacts, instance: &Instance, look: &Look) -> Option<InstanceRecord> {
        let world_from_local = instance.world_from_plant * DAffine3::from_translation(model.center);
        let local_from_world = world_from_local.inverse();
        let clip_from_local = (self.clip_from_world * world_from_local).as_mat4();
        let eye_local = local_from_world.transform_point3(self.at).as_vec3();
        if !(clip_from_local.is_finite() && eye_local.is_finite()) {
            return None;
        }
        let turned =
            |direction: DVec3| local_from_world.transform_vector3(direction).normalize_or_zero().as_vec3().to_array();
        let leaves = model.index_ends.len() as u32;
        let scales = instance.scales.filter(|scales| scales.leaves == leaves);
        let transition = match (scales, look.effects.fade) {
            (Some(_), _) => Transition::new(f64::from(instance.active.floor()), 1.0, leaves),
            (None, Some(fade)) => fade.transition(f64::from(instance.active), leaves),
            (None, None) => Transition::new(f64::from(instance.active), instance.window, leaves),
        };
        let (active_count, fraction, window) = transition.parts();
        let drawn = transition.drawn();
        Some(InstanceRecord {
            clip_from_local: clip_from_local.to_cols_array_2d(),
            eye_local: eye_local.to_array(),
            fraction,
            sun_local: turned(look.lighting.towards_sun.as_dvec3()),
            active_count,
            up_local: turned(DVec3::Y),
            index_end: drawn.checked_sub(1).map_or(0, |last| model.index_ends[last as usize]),
            first_partial: transition.first_partial(),
            window,
            drawn,
            first_scale: scales.map_or(NO_SCALES, |scales| scales.first),
            leaf_scale: instance.leaf_scale,
            before: 0,
            jitter: self.jitter.as_vec2().to_array(),
            stem_width: model.stems.drawn(self.stem_width(model, instance, look)).width,
            padding: [0.0; 3],
        })
    }
}

/// The previous frame.
#[derive(Debug, Clone)]
pub(super) struct Before {
    clip_from_world: DMat4,
    seconds: f64,
}

impl Before {
    /// Returns `now` with the plant's transform in the previous frame, or `now` itself if that
    /// transform cannot be drawn.
    pub(super) fn record(
        &self,
        model: &ModelFacts,
        world_from_plant: &DAffine3,
        now: &InstanceRecord,
    ) -> InstanceRecord {
        let world_from_local = *world_from_plant * DAffine3::from_translation(model.center);
        let clip_from_local = (self.clip_from_world * world_from_local).as_mat4();
        if !clip_from_local.is_finite() {
            return *now;
        }
        InstanceRecord { clip_from_local: clip_from_local.to_cols_array_2d(), ..*now }
    }
}
