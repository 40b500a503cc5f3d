//! What one frame draws, listed on the CPU: a record for each plant, runs of leaves, and draws grouped by what they need.

use super::{
    camera::Camera,
    foliage::{Frame, Instance, Prepared},
    leaf_pass::{self, Run},
    look::{Look, Variant},
    stems::{Levels, Stems},
    surface::{InstanceRecord, NO_SCALES},
};
use crate::{
    bounds::Aabb,
    effects::{
        Counts,
        wind::{Moment, Shape, Sway},
    },
    model::{FoliageModel, Leaf, Transition},
};
use glam::{DAffine3, DMat4, DVec2, DVec3, DVec4, Vec3};
use std::ops::Range;

/// What listing a frame needs to know of a model.
pub(super) struct ModelFacts {
    /// Origin of local space, in the plant's.
    pub(super) center: DVec3,
    /// One past the last index of each leaf.
    pub(super) index_ends: Vec<u32>,
    stems: Levels,
    /// Farthest that anything is drawn from the centre, before the wind.
    pub(super) reach: f32,
    /// Entry n: farthest that a corner is drawn from its leaf's pivot at active count n or more.
    leaf_reaches: Vec<f32>,
    /// In local space.
    pub(super) shape: Shape,
    /// Mean shaded colour of the leaves, linear, where contrast is called for.
    pub(super) mean: [f32; 3],
}

impl ModelFacts {
    pub(super) fn new(model: &FoliageModel, stems: &Stems, mean: [f32; 3]) -> Self {
        let sphere = model.sphere();
        let reach = model.enlarged_sphere();
        let wood = model.wood.vertices.iter();
        let corners = || model.vertices.iter().chain(wood.clone()).map(|vertex| vertex.position);
        let local = |position: [f32; 3]| (Vec3::from(position).as_dvec3() - sphere.center()).as_vec3().to_array();
        let extents: Vec<f32> = model.leaves.iter().map(|leaf| extent(model, leaf)).collect();
        let mut most = extents.iter().copied().fold(0.0, f32::max);
        let mut leaf_reaches = vec![most; model.leaves.len() + 1];
        for (n, leaf) in model.leaves.iter().enumerate().rev() {
            most = leaf.target().map_or(most, |target| most.max(extents[target] * leaf.scale));
            leaf_reaches[n] = most;
        }
        Self {
            center: sphere.center(),
            index_ends: model.leaves.iter().map(|leaf| leaf.indices[1]).collect(),
            stems: stems.levels.clone(),
            reach: (reach.radius + reach.center().distance(sphere.center())) as f32,
            leaf_reaches,
            shape: Shape::new(&Aabb::of_points(corners().map(local))),
            mean,
        }
    }
}

impl ModelFacts {
    /// Middle and radius of everything that is drawn of a plant, in the world.
    pub(super) fn placed(&self, plant: &Instance) -> (DVec3, f64) {
        let to_world = plant.world_from_plant;
        let scale = (0..3).map(|i| to_world.matrix3.col(i).length()).fold(0.0, f64::max);
        (to_world.transform_point3(self.center), f64::from(self.reach) * scale * f64::from(plant.leaf_scale.max(1.0)))
    }
}

/// Farthest that a corner of the unscaled leaf lies from its pivot.
fn extent(model: &FoliageModel, leaf: &Leaf) -> f32 {
    let pivot = Vec3::from(leaf.pivot);
    let corners = model.vertices[leaf.geometry().vertex_range()].iter();
    corners.map(|corner| pivot.distance(corner.position.into())).fold(0.0, f32::max)
}

/// The mean colour and contrast of one plant, as `contrast.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Tone {
    /// Mean shaded colour of the leaves, linear.
    pub mean: [f32; 3],
    /// Share of a colour's distance from it that stays.
    pub kept: f32,
}

/// Plants of one model that need the same shaders.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Batch {
    pub(super) model: usize,
    pub(super) variant: Variant,
    /// Runs whose leaves are all there.
    pub(super) whole: Range<u32>,
    /// Runs with leaves that fade by alpha.
    pub(super) fading: Range<u32>,
}

/// Plants of one model with equally many of its stems.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WoodDraw {
    pub(super) model: usize,
    pub(super) variant: Variant,
    pub(super) instances: Range<u32>,
    pub(super) corners: u32,
}

/// A plant in drawing order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    model: usize,
    variant: Variant,
    /// Corners of its wood.
    corners: u32,
    /// Number of the instance.
    instance: usize,
}

/// The lists of one frame; kept between frames, so that a frame allocates nothing once they have grown.
#[derive(Default)]
pub(super) struct FrameList {
    pub(super) records: Vec<InstanceRecord>,
    pub(super) runs: Vec<Run>,
    pub(super) batches: Vec<Batch>,
    pub(super) wood: Vec<WoodDraw>,
    /// Parallel to `records`; empty where the effect is off.
    pub(super) tones: Vec<Tone>,
    pub(super) sways: Vec<Sway>,
    /// From local space to the light's clip space.
    pub(super) lights: Vec<[[f32; 4]; 4]>,
    /// Where plants were in the frame before: records and sways, listed behind those of this frame in the end.
    before: (Vec<InstanceRecord>, Vec<Sway>),
    order: Vec<Place>,
    /// Runs that fade, until the batch's whole runs are listed.
    fading: Vec<Run>,
}

impl FrameList {
    /// Lists records, runs and batches, model by model.
    pub(super) fn fill(&mut self, look: &Look, models: &[ModelFacts], eye: &Eye, instances: &[Instance]) -> Prepared {
        self.clear();
        let moments = look.effects.wind.map(|wind| [eye.seconds, eye.seconds_before()].map(|seconds| wind.at(seconds)));
        let mut prepared = Prepared { effects: Counts::of(&look.effects), ..Prepared::default() };
        self.sort(look, models, eye, instances);
        let mut at = 0;
        while let Some(&Place { model, variant, .. }) = self.order.get(at) {
            let is_alike = |next: &&Place| (next.model, next.variant) == (model, variant);
            let end = at + self.order[at..].iter().take_while(is_alike).count();
            self.batch(look, models, eye, moments.as_ref(), instances, at..end, &mut prepared);
            at = end;
        }
        prepared.instances = self.records.len() as u32;
        if eye.before.is_some() {
            (prepared.instances..).zip(&mut self.records).for_each(|(before, record)| record.before = before);
        }
        prepared.draws += self.wood.len() as u32;
        self.records.append(&mut self.before.0);
        self.sways.append(&mut self.before.1);
        prepared
    }

    /// Forgets what is to be drawn.
    pub(super) fn clear(&mut self) {
        self.records.clear();
        self.runs.clear();
        self.batches.clear();
        self.wood.clear();
        self.tones.clear();
        self.sways.clear();
        self.lights.clear();
    }

    /// Puts plants that need the same shaders beside each other.
    fn sort(&mut self, look: &Look, models: &[ModelFacts], eye: &Eye, instances: &[Instance]) {
        self.order.clear();
        let known = instances.iter().enumerate().filter(|(_, instance)| instance.model.0 < models.len());
        self.order.extend(known.map(|(i, instance)| {
            let model = &models[instance.model.0];
            let px = eye.pixels_per_unit(model, instance);
            let moves = look.effects.wind.is_some_and(|wind| {
                let n = (instance.active as usize).min(model.index_ends.len());
                let reach = wind.reach(&model.shape, model.leaf_reaches[n] * instance.leaf_scale);
                f64::from(reach) * px > 0.5
            });
            let is_reduced = instance.active < model.index_ends.len() as f32;
            let contrast = look.effects.contrast.is_some() && is_reduced;
            let variant = Variant { wind: moves, contrast, alpha: false };
            let corners = model.stems.at_least((f64::from(look.thinnest_px) / px) as f32);
            Place { model: instance.model.0, variant, corners, instance: i }
        }));
        self.order.sort_unstable();
    }

    #[expect(clippy::too_many_arguments, reason = "one frame's worth of context, used here alone")]
    fn batch(
        &mut self,
        look: &Look,
        models: &[ModelFacts],
        eye: &Eye,
        moments: Option<&[Moment; 2]>,
        instances: &[Instance],
        range: Range<usize>,
        prepared: &mut Prepared,
    ) {
        let Place { model: number, variant, .. } = self.order[range.start];
        let model = &models[number];
        let first_run = self.runs.len() as u32;
        self.fading.clear();
        for i in range {
            let place = self.order[i];
            let instance = &instances[place.instance];
            let Some(record) = eye.record(model, instance, look) else {
                prepared.skipped += 1;
                continue;
            };
            prepared.leaves += u64::from(record.drawn);
            let at = self.records.len() as u32;
            let split = first_fading_run(&record, model, look);
            self.runs.extend((0..split).map(|run| [at, run]));
            self.fading.extend((split..leaf_pass::runs(record.index_end)).map(|run| [at, run]));
            count(&mut prepared.effects, &record, variant);
            if let Some(effect) = look.effects.contrast {
                let kept = effect.kept(instance.active, model.index_ends.len());
                self.tones.push(Tone { mean: model.mean, kept });
            }
            if let Some([now, _]) = moments {
                self.sways.push(now.sway(&model.shape, &instance.world_from_plant));
            }
            if let Some(before) = &eye.before {
                let world_from_plant = instance.before.unwrap_or(instance.world_from_plant);
                self.before.0.push(before.record(model, &world_from_plant, &record));
                self.before.1.extend(moments.map(|[_, then]| then.sway(&model.shape, &world_from_plant)));
            }
            if let Some(light_from_world) = eye.light_from_world {
                let world_from_local = instance.world_from_plant * DAffine3::from_translation(model.center);
                self.lights.push((light_from_world * world_from_local).as_mat4().to_cols_array_2d());
            }
            self.records.push(record);
            if place.corners > 0 {
                prepared.wood_triangles += u64::from(place.corners / 3);
                self.add_wood(&place, at);
            }
        }
        let whole = first_run..self.runs.len() as u32;
        self.runs.extend_from_slice(&self.fading);
        let fading = whole.end..self.runs.len() as u32;
        let runs = [!whole.is_empty(), !fading.is_empty()];
        prepared.draws += runs.into_iter().map(u32::from).sum::<u32>();
        self.batches.push(Batch { model: number, variant, whole, fading });
    }

    /// Draws the wood of instance `at` with that of the plant before it where they have as many stems.
    fn add_wood(&mut self, place: &Place, at: u32) {
        let &Place { model, variant, corners, .. } = place;
        match self.wood.last_mut() {
            Some(last) if (last.model, last.variant, last.corners) == (model, variant, corners) => {
                last.instances.end = at + 1;
            }
            _ => self.wood.push(WoodDraw { model, variant, instances: at..at + 1, corners }),
        }
    }
}

/// The first run with a leaf that is there in part by alpha; one past the last where none is.
fn first_fading_run(record: &InstanceRecord, model: &ModelFacts, look: &Look) -> u32 {
    let end = leaf_pass::runs(record.index_end);
    if !look.fades_by_alpha() || record.first_partial >= record.drawn {
        return end;
    }
    let first_index = record.first_partial.checked_sub(1).map_or(0, |last| model.index_ends[last as usize]);
    (first_index / super::surface::RUN_INDICES).min(end)
}

fn count(counts: &mut Counts, record: &InstanceRecord, variant: Variant) {
    counts.add_drawn(record.first_partial, record.drawn);
    let plants = [
        (&mut counts.contrast, variant.contrast),
        (&mut counts.wind, variant.wind),
        (&mut counts.crown_normals, true),
        (&mut counts.translucency, true),
    ];
    for (count, is_simulated) in plants {
        if let Some(count) = count {
            count.add(is_simulated);
        }
    }
}

/// The frame before.
struct Before {
    clip_from_world: DMat4,
    seconds: f64,
}

impl Before {
    /// `now` with the place that the plant had; with the one it has where that cannot be drawn.
    fn record(&self, model: &ModelFacts, world_from_plant: &DAffine3, now: &InstanceRecord) -> InstanceRecord {
        let world_from_local = *world_from_plant * DAffine3::from_translation(model.center);
        let clip_from_local = (self.clip_from_world * world_from_local).as_mat4();
        if !clip_from_local.is_finite() {
            return *now;
        }
        InstanceRecord { clip_from_local: clip_from_local.to_cols_array_2d(), ..*now }
    }
}

/// Who looks at a list: the camera of a frame, or the sun.
pub(super) struct Eye {
    at: DVec3,
    clip_from_world: DMat4,
    /// Pixels that a length of 1 takes: at a distance of 1, or at any for the sun.
    pixels: f64,
    is_sun: bool,
    near: f64,
    seconds: f64,
    /// How far the picture is shifted, in clip space.
    jitter: DVec2,
    /// The frame before, where motion vectors are drawn.
    before: Option<Before>,
    /// To the clip space of the sun, where shadows are looked up.
    pub(super) light_from_world: Option<DMat4>,
}

impl Eye {
    pub(super) fn new(frame: &Frame) -> Self {
        let Camera { eye, near, .. } = frame.camera;
        let clip_from_camera = frame.camera.clip_from_camera();
        let [right, down] = frame.jitter_px;
        let jitter = DVec2::new(right / frame.camera.aspect, -down) * (2.0 / f64::from(frame.height_px));
        let shift = DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::Z, jitter.extend(0.0).extend(1.0));
        // An unshifted picture keeps every bit.
        let clip_from_world = frame.camera.clip_from_world();
        let shifted = if jitter == DVec2::ZERO { clip_from_world } else { shift * clip_from_world };
        Self {
            at: eye,
            clip_from_world: shifted,
            pixels: 0.5 * f64::from(frame.height_px) * clip_from_camera.y_axis.y,
            is_sun: false,
            near,
            seconds: frame.seconds,
            jitter,
            before: None,
            light_from_world: None,
        }
    }

    /// The same with the frame before.
    pub(super) fn of_motion(frame: &Frame) -> Self {
        let (camera, seconds) = frame.before.unwrap_or((frame.camera, frame.seconds));
        let before = Before { clip_from_world: camera.clip_from_world(), seconds };
        Self { before: Some(before), ..Self::new(frame) }
    }

    fn seconds_before(&self) -> f64 {
        self.before.as_ref().map_or(self.seconds, |before| before.seconds)
    }

    /// The sun's view of a frame, `pixels` of its map to a unit of length.
    pub(super) fn of_sun(frame: &Frame, clip_from_world: DMat4, pixels: f64) -> Self {
        Self { clip_from_world, pixels, is_sun: true, ..Self::new(frame) }
    }

    /// Pixels that a length of 1, in plant units, takes where the plant is nearest to the eye.
    fn pixels_per_unit(&self, model: &ModelFacts, instance: &Instance) -> f64 {
        let to_world = instance.world_from_plant;
        let scale = (0..3).map(|i| to_world.matrix3.col(i).length()).fold(0.0, f64::max);
        if self.is_sun {
            return scale * self.pixels;
        }
        let middle = self.clip_from_world * to_world.transform_point3(model.center).extend(1.0);
        let nearest = (middle.w - f64::from(model.reach) * scale).max(self.near);
        scale * self.pixels / nearest
    }

    /// What the shaders are told of one plant; `None` where its transform cannot be drawn. Composed in `f64`, so that plants
    /// far from the origin stay sharp.
    fn record(&self, model: &ModelFacts, instance: &Instance, look: &Look) -> Option<InstanceRecord> {
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
        })
    }
}
