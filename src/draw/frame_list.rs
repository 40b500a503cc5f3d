//! Draw lists of one frame, built on the CPU: a record per plant, runs of leaves, and draws grouped
//! by the shaders that they need.

use super::{
    eye::Eye,
    facts::{Facts, ModelFacts},
    instance::{Instance, ModelId, Prepared},
    look::{Look, Variant},
    records::{InstanceRecord, RUN_INDICES, Run, Tone, runs},
};
use crate::effects::{
    Counts,
    wind::{Moment, Sway},
};
use glam::DAffine3;
use std::ops::Range;

/// Plants of one model that need the same shaders.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// The model.
    pub model: ModelId,
    /// The shaders that they need.
    pub variant: Variant,
    /// Runs whose leaves are all fully present.
    pub whole: Range<u32>,
    /// Runs with leaves that fade by alpha.
    pub fading: Range<u32>,
}

/// Plants of one model that draw the same number of its stems.
#[derive(Debug, Clone, PartialEq)]
pub struct WoodDraw {
    /// The model.
    pub model: ModelId,
    /// The shaders that they need.
    pub variant: Variant,
    /// Records of the plants.
    pub instances: Range<u32>,
    /// Number of wood indices to draw.
    pub corners: u32,
}

/// A plant in drawing order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    model: ModelId,
    variant: Variant,
    /// Number of wood indices to draw.
    corners: u32,
    /// Index of the instance.
    instance: usize,
}

/// Draw lists of one frame. They are reused, so that a frame allocates nothing once they have
/// grown.
#[derive(Debug, Clone, Default)]
pub struct FrameList {
    /// One record per plant, model by model. With motion vectors, the records of the previous frame
    /// follow.
    pub records: Vec<InstanceRecord>,
    /// Runs of all batches.
    pub runs: Vec<Run>,
    /// Draws of leaves.
    pub batches: Vec<Batch>,
    /// Draws of wood.
    pub wood: Vec<WoodDraw>,
    /// Parallel to `records`; empty if the effect `contrast` is off.
    pub tones: Vec<Tone>,
    /// Parallel to `records`; empty if the effect `wind` is off.
    pub sways: Vec<Sway>,
    /// Transforms from local space to the sun's clip space, parallel to `records`; empty if the
    /// effect `shadow` is off.
    pub lights: Vec<[[f32; 4]; 4]>,
    /// Records and sways of the plants in the previous frame; appended to this frame's at the end.
    before: (Vec<InstanceRecord>, Vec<Sway>),
    order: Vec<Place>,
    /// Fading runs of the current batch, held until its whole runs are listed.
    fading: Vec<Run>,
}

impl FrameList {
    /// Lists records, runs and batches, model by model.
    pub fn fill(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) -> Prepared {
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
        prepared.skipped = instances.len() as u32 - prepared.instances;
        if eye.before.is_some() {
            (prepared.instances..).zip(&mut self.records).for_each(|(before, record)| record.before = before);
        }
        prepared.draws += self.wood.len() as u32;
        self.records.append(&mut self.before.0);
        self.sways.append(&mut self.before.1);
        prepared
    }

    /// Empties all lists.
    pub fn clear(&mut self) {
        self.records.clear();
        self.runs.clear();
        self.batches.clear();
        self.wood.clear();
        self.tones.clear();
        self.sways.clear();
        self.lights.clear();
    }

    /// Sorts the plants so that plants with the same shaders are adjacent.
    fn sort(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) {
        self.order.clear();
        let known = instances.iter().enumerate();
        self.order.extend(known.filter_map(|(i, instance)| {
            let model = models.get(instance.model)?;
            let px = eye.pixels_per_unit(model, instance);
            let moves = look.effects.wind.is_some_and(|wind| {
                let n = (instance.active as usize).min(model.index_ends.len());
                let reach = wind.reach(&model.shape, model.leaf_reaches[n] * instance.leaf_scale);
                f64::from(reach) * px > 0.5
            });
            let is_reduced = instance.active < model.index_ends.len() as f32;
            let contrast = look.effects.contrast.is_some() && is_reduced;
            let variant = Variant { wind: moves, contrast, alpha: false };
            let corners = model.stems.drawn(eye.stem_width(model, instance, look)).corners;
            Some(Place { model: instance.model, variant, corners, instance: i })
        }));
        self.order.sort_unstable();
    }

    #[expect(clippy::too_many_arguments, reason = "one frame's worth of context, used here alone")]
    fn batch(
        &mut self,
        look: &Look,
        models: &Facts,
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
            let Some(record) = eye.record(model, instance, look) else { continue };
            prepared.leaves += u64::from(record.drawn);
            let at = self.records.len() as u32;
            let split = first_fading_run(&record, model, look);
            self.runs.extend((0..split).map(|run| [at, run]));
            self.fading.extend((split..runs(record.index_end)).map(|run| [at, run]));
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

    /// Adds the wood of instance `at` to the previous draw if model, shaders and number of stems
    /// are the same; otherwise adds a new draw.
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

/// First run with a leaf that is partly present by alpha; one past the last run if there is none.
fn first_fading_run(record: &InstanceRecord, model: &ModelFacts, look: &Look) -> u32 {
    let end = runs(record.index_end);
    if !look.fades_by_alpha() || record.first_partial >= record.drawn {
        return end;
    }
    let first_index = record.first_partial.checked_sub(1).map_or(0, |last| model.index_ends[last as usize]);
    (first_index / RUN_INDICES).min(end)
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
