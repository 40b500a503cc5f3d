//! Camera of one frame list, which computes the record of each instance.
//!
//! Records hold `f32` positions relative to the frame's *anchor*, a point in view that is chosen
//! and subtracted in `f64`, so that plants far from the origin stay precise.

use super::{
    facts::ModelFacts,
    instance::{Frame, Instance},
    look::Look,
    records::{FrameRecord, InstanceRecord, NO_SCALES},
};
use crate::{Camera, bounds::largest_scale, camera::NearScale, model::Transition};
use glam::{DAffine3, DMat4, DVec2, DVec3, Mat4, Vec2, Vec3};

/// Camera of a frame list: the frame's own camera or the sun's.
#[derive(Debug, Clone)]
pub struct Eye {
    /// Position of the eye, from which the leaves are lit and impostors are seen.
    pub(super) at: DVec3,
    camera: Camera,
    /// Half of the picture's width and height.
    half_size_px: Vec2,
    scale: NearScale,
    now: Anchored,
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
        let jittered = frame.jittered();
        Self {
            at: camera.eye,
            camera,
            half_size_px: Vec2::new(camera.aspect() as f32, 1.0) * (0.5 * camera.height_px as f32),
            scale: NearScale::new(&jittered),
            now: Anchored::new(&jittered),
            seconds: frame.seconds,
            jitter,
            before: None,
            light_from_world: None,
        }
    }

    /// Camera of a frame for motion vectors, with the previous frame.
    pub fn of_motion(frame: &Frame) -> Self {
        let now = Self::new(frame);
        let (camera, seconds) = frame.before.unwrap_or((frame.camera, frame.seconds));
        let anchored = Anchored::new(&camera);
        let anchored = if anchored.clip_from_anchor.is_finite() { anchored } else { now.now };
        Self { before: Some(Before { anchored, seconds }), ..now }
    }

    /// The sun's camera, at the time of `frame`.
    pub fn of_sun(frame: &Frame, sun: Camera) -> Self {
        Self::new(&Frame { camera: sun, jitter_px: [0.0; 2], ..*frame })
    }

    /// Depth convention of the camera.
    pub fn depth(&self) -> crate::Depth {
        self.camera.depth
    }

    pub(super) fn seconds_before(&self) -> f64 {
        self.before.as_ref().map_or(self.seconds, |before| before.seconds)
    }

    /// What all plants of the frame share. `plants` is the number of plants drawn.
    pub(super) fn frame_record(&self, plants: u32) -> FrameRecord {
        let before = self.before.as_ref().map_or(&self.now, |before| &before.anchored);
        let light_from_world = self.light_from_world.unwrap_or(DMat4::IDENTITY);
        let light_from_anchor = (light_from_world * DMat4::from_translation(self.now.anchor)).as_mat4();
        FrameRecord {
            clip_from_anchor: self.now.clip_from_anchor.to_cols_array_2d(),
            clip_from_anchor_before: before.clip_from_anchor.to_cols_array_2d(),
            light_from_anchor: light_from_anchor.to_cols_array_2d(),
            eye: (self.at - self.now.anchor).as_vec3().to_array(),
            plants,
            jitter: self.jitter.as_vec2().to_array(),
            half_size_px: self.half_size_px.to_array(),
        }
    }

    /// Diameter in pixels of what a plant's impostor shows; infinite without an impostor.
    pub(super) fn diameter_px(&self, model: &ModelFacts, instance: &Instance) -> f32 {
        let Some((center, radius)) = model.impostor else { return f32::INFINITY };
        let scale = largest_scale(&instance.world_from_plant);
        self.camera.diameter_px(instance.world_from_plant.transform_point3(center), radius * scale)
    }

    /// Position of the eye relative to the middle of a plant's impostor, in the plant's space;
    /// `None` without an impostor or for a transform that cannot be inverted.
    pub(super) fn relative_to_impostor(&self, model: &ModelFacts, instance: &Instance) -> Option<Vec3> {
        let (center, _) = model.impostor?;
        let from_center = instance.world_from_plant.inverse().transform_point3(self.at) - center;
        from_center.is_finite().then(|| from_center.as_vec3())
    }

    /// Where a plant is, and how large it is on screen; `None` if its transform cannot be drawn.
    pub(super) fn place(&self, model: &ModelFacts, instance: &Instance) -> Option<Place> {
        let anchor_from_local = self.now.placed(&instance.world_from_plant, model.center)?;
        let pixels_per_unit = self.pixels_per_unit(model.center, model.reach, &instance.world_from_plant);
        Some(Place { anchor_from_local, pixels_per_unit })
    }

    /// Number of pixels covered by a length of 1, in plant units, where a plant is nearest to the
    /// camera, of which nothing is drawn farther than `reach` from `center`.
    pub(crate) fn pixels_per_unit(&self, center: DVec3, reach: f32, world_from_plant: &DAffine3) -> f64 {
        let scale = largest_scale(world_from_plant);
        scale * self.scale.at(world_from_plant.transform_point3(center), f64::from(reach) * scale)
    }
}

/// Position and size of a plant.
pub(super) struct Place {
    anchor_from_local: [[f32; 4]; 3],
    /// See [`Eye::pixels_per_unit`].
    pub(super) pixels_per_unit: f64,
}

impl Place {
    /// The record of the plant, whose wood is drawn at `wood_error`.
    pub(super) fn record(
        &self,
        model: &ModelFacts,
        instance: &Instance,
        look: &Look,
        wood_error: f32,
    ) -> InstanceRecord {
        let leaves = model.leaves;
        let scales = instance.scales.filter(|scales| scales.leaves == leaves);
        let transition = match (scales, look.effects.fade) {
            (Some(_), _) => Transition::new(f64::from(instance.active.floor()), 1.0, leaves),
            (None, Some(fade)) => fade.transition(f64::from(instance.active), leaves),
            (None, None) => Transition::new(f64::from(instance.active), instance.window, leaves),
        };
        let (active_count, fraction, window) = transition.parts();
        InstanceRecord {
            anchor_from_local: self.anchor_from_local,
            active_count,
            fraction,
            window,
            leaf_scale: instance.leaf_scale,
            first_scale: scales.map_or(NO_SCALES, |scales| scales.first),
            first_partial: transition.first_partial(),
            drawn: transition.drawn(),
            wood_error,
        }
    }
}

/// A camera relative to its anchor: the eye, or the middle of what an orthographic projection
/// shows, since its eye may be far away.
#[derive(Debug, Clone, Copy)]
struct Anchored {
    anchor: DVec3,
    /// Transform to clip space from world space with its origin at the anchor.
    clip_from_anchor: Mat4,
}

impl Anchored {
    fn new(camera: &Camera) -> Self {
        let middle = || camera.clip_from_world.inverse().project_point3(DVec3::new(0.0, 0.0, 0.5));
        let anchor = if camera.is_orthographic() { middle() } else { camera.eye };
        let clip_from_anchor = (camera.clip_from_world * DMat4::from_translation(anchor)).as_mat4();
        Self { anchor, clip_from_anchor }
    }

    /// Rows of a plant's transform from local space, whose origin is the plant's `center`; `None`
    /// if it is not finite or not invertible, or if the camera is not finite.
    fn placed(&self, world_from_plant: &DAffine3, center: DVec3) -> Option<[[f32; 4]; 3]> {
        let from_anchor = world_from_plant.transform_point3(center) - self.anchor;
        let [x, y, z] = world_from_plant.matrix3.to_cols_array_2d();
        let rows = [0, 1, 2].map(|i| [x[i], y[i], z[i], from_anchor[i]].map(|value| value as f32));
        let is_finite = self.clip_from_anchor.is_finite() && rows.as_flattened().iter().all(|value| value.is_finite());
        (is_finite && world_from_plant.matrix3.determinant() != 0.0).then_some(rows)
    }
}

/// The previous frame.
#[derive(Debug, Clone)]
pub(super) struct Before {
    anchored: Anchored,
    seconds: f64,
}

impl Before {
    /// Returns the record `now` with the plant's transform in the previous frame: the first of
    /// `world_from_plant` that can be drawn.
    pub(super) fn record(
        &self,
        model: &ModelFacts,
        world_from_plant: [&DAffine3; 2],
        now: &InstanceRecord,
    ) -> InstanceRecord {
        let mut rows = world_from_plant.into_iter().filter_map(|placed| self.anchored.placed(placed, model.center));
        InstanceRecord { anchor_from_local: rows.next().unwrap_or(now.anchor_from_local), ..*now }
    }
}
