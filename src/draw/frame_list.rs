//! Draw lists of one frame, built on the CPU: a record per plant, runs of leaves, and draws grouped
//! by the shaders that they need.

use super::{
    eye::Eye,
    facts::{Facts, ModelFacts},
    instance::{Instance, ModelId, Prepared},
    look::{Look, Variant},
    records::{FrameRecord, InstanceRecord, RUN_QUADS, Run, Tone, runs},
};
use crate::effects::{
    Counts,
    wind::{Moment, Sway},
};
use bytemuck::Zeroable;
use slotmap::Key;
use std::ops::Range;

/// Plants of one model that need the same shaders.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// The model.
    pub model: ModelId,
    /// The shaders that they need.
    pub variant: Variant,
    /// Whether their leaves are drawn within their outlines.
    pub is_trimmed: bool,
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

/// A plant to draw, with its position in the drawing order.
#[derive(Debug, Clone, Copy)]
struct Listed {
    /// See [`key`].
    key: u64,
    /// Index of the instance.
    instance: u32,
    /// Index of its record in `unsorted`.
    record: u32,
}

/// Bits of a sorting key below the model, the variant and the trimming.
const CUT_BITS: u32 = 27;

/// Key by which plants are sorted: first by model, variant and trimming, which the leaves' draws
/// depend on, then by the number of the wood's cut.
fn key(model: ModelId, variant: Variant, is_trimmed: bool, cut: u32) -> u64 {
    // The lower half of a model's key is its index among the models that exist.
    let model = model.data().as_ffi() << 32;
    let bits = [variant.tiles, variant.tone, variant.contrast, variant.wind];
    let variant = (0..).zip(bits).fold(0, |bits, (at, bit)| bits | u64::from(bit) << at);
    model | variant << (CUT_BITS + 1) | u64::from(is_trimmed) << CUT_BITS | u64::from(cut)
}

fn variant_of(key: u64) -> Variant {
    let [tiles, tone, contrast, wind] = [1, 2, 3, 4].map(|bit| key >> (CUT_BITS + bit) & 1 == 1);
    Variant { wind, contrast, tone, tiles, alpha: false }
}

fn is_trimmed(key: u64) -> bool {
    key >> CUT_BITS & 1 == 1
}

fn cut_of(key: u64) -> u32 {
    (key & ((1 << CUT_BITS) - 1)) as u32
}

/// Sorts plants by key, keeping the order of those with the same key: byte by byte, leaving out the
/// bytes that all have in common.
fn sort(plants: &mut Vec<Listed>, spare: &mut Vec<Listed>) {
    let first = plants.first().map_or(0, |plant| plant.key);
    let differing = plants.iter().fold(0, |bits, plant| bits | (plant.key ^ first));
    for shift in (0..u64::BITS).step_by(8).filter(|shift| differing >> shift & 255 != 0) {
        let digit = |plant: &Listed| (plant.key >> shift & 255) as usize;
        let mut starts = [0; 257];
        plants.iter().for_each(|plant| starts[digit(plant) + 1] += 1);
        (0..256).for_each(|i| starts[i + 1] += starts[i]);
        spare.clone_from(plants);
        for plant in &*spare {
            plants[starts[digit(plant)]] = *plant;
            starts[digit(plant)] += 1;
        }
    }
}

/// Draw lists of one frame. They are reused, so that a frame allocates nothing once they have
/// grown.
#[derive(Debug, Clone)]
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
    /// What all plants share.
    pub shared: FrameRecord,
    /// Records and sways of the plants in the previous frame; appended to this frame's at the end.
    before: (Vec<InstanceRecord>, Vec<Sway>),
    /// Records in the order of the instances.
    unsorted: Vec<InstanceRecord>,
    order: Vec<Listed>,
    /// Room to sort in.
    spare: Vec<Listed>,
    /// Fading runs of the current batch, held until its whole runs are listed.
    fading: Vec<Run>,
}

impl Default for FrameList {
    /// Empty lists.
    fn default() -> Self {
        Self {
            records: Vec::new(),
            shared: FrameRecord::zeroed(),
            runs: Vec::new(),
            batches: Vec::new(),
            wood: Vec::new(),
            tones: Vec::new(),
            sways: Vec::new(),
            before: Default::default(),
            unsorted: Vec::new(),
            order: Vec::new(),
            spare: Vec::new(),
            fading: Vec::new(),
        }
    }
}

impl FrameList {
    /// Lists records, runs and batches, model by model.
    pub fn fill(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) -> Prepared {
        self.clear();
        let moments = look.effects.wind.map(|wind| [eye.seconds, eye.seconds_before()].map(|seconds| wind.at(seconds)));
        let mut prepared = Prepared { effects: Counts::of(&look.effects), ..Prepared::default() };
        self.list(look, models, eye, instances);
        sort(&mut self.order, &mut self.spare);
        let mut at = 0;
        while let Some(&first) = self.order.get(at) {
            let is_alike = |next: &&Listed| next.key >> CUT_BITS == first.key >> CUT_BITS;
            let end = at + self.order[at..].iter().take_while(is_alike).count();
            self.batch(look, models, eye, moments.as_ref(), instances, at..end, &mut prepared);
            at = end;
        }
        prepared.instances = self.records.len() as u32;
        prepared.skipped = instances.len() as u32 - prepared.instances;
        prepared.draws += self.wood.len() as u32;
        self.shared = eye.frame_record(prepared.instances);
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
    }

    /// Computes keys and records of all plants, in the order of `instances`, which are large: they
    /// are read once, from front to back.
    fn list(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) {
        self.order.clear();
        self.unsorted.clear();
        for (number, instance) in (0..).zip(instances) {
            let Some(model) = models.get(instance.model) else { continue };
            let Some(place) = eye.place(model, instance) else { continue };
            let moves = look.effects.wind.is_some_and(|wind| {
                let n = (instance.active as usize).min(model.leaves as usize);
                let reach = wind.reach(&model.shape, model.leaf_reaches[n] * instance.leaf_scale);
                f64::from(reach) * place.pixels_per_unit > 0.5
            });
            let is_reduced = instance.active < model.leaves as f32;
            let tone = look.tone && model.has_tone && (is_reduced || instance.leaf_scale > 1.0);
            let contrast = look.effects.contrast.is_some() && is_reduced && !(look.tone && model.has_tone);
            let (cut, stem_width) = model.stems.numbered((f64::from(look.thinnest_px) / place.pixels_per_unit) as f32);
            let tiles = model.has_tiles && (is_reduced || instance.leaf_scale > 1.0);
            let variant = Variant { wind: moves, contrast, tone, tiles, alpha: false };
            let record = self.unsorted.len() as u32;
            let is_trimmed = place.pixels_per_unit >= f64::from(model.trimmed_from);
            let key = key(instance.model, variant, is_trimmed, cut);
            self.order.push(Listed { key, instance: number, record });
            self.unsorted.push(place.record(model, instance, look, stem_width));
        }
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
        let Listed { key, instance, .. } = self.order[range.start];
        let number = instances[instance as usize].model;
        let variant = variant_of(key);
        let model = &models[number];
        let first_run = self.runs.len() as u32;
        self.fading.clear();
        for i in range {
            let Listed { key, instance, record } = self.order[i];
            let (instance, record) = (&instances[instance as usize], self.unsorted[record as usize]);
            prepared.leaves += u64::from(record.drawn);
            let at = self.records.len() as u32;
            let end = runs(model.quad_end(record.drawn));
            let split = first_fading_run(&record, model, look).min(end);
            self.runs.extend((0..split).map(|run| [at, run]));
            self.fading.extend((split..end).map(|run| [at, run]));
            count(&mut prepared.effects, &record, variant);
            if let Some(effect) = look.effects.contrast {
                let kept = effect.kept(instance.active, model.leaves as usize);
                self.tones.push(Tone { mean: model.mean, kept });
            }
            if let Some([now, _]) = moments {
                self.sways.push(now.sway(&model.shape, &instance.world_from_plant));
            }
            if let Some(before) = &eye.before {
                let placed = [instance.before.as_ref(), Some(&instance.world_from_plant)];
                let placed = placed.map(|placed| placed.unwrap_or(&instance.world_from_plant));
                self.before.0.push(before.record(model, placed, &record));
                self.before.1.extend(moments.map(|[_, then]| then.sway(&model.shape, placed[0])));
            }
            self.records.push(record);
            let corners = model.stems.corners(cut_of(key));
            if corners > 0 {
                prepared.wood_triangles += u64::from(corners / 3);
                self.add_wood(number, variant, corners, at);
            }
        }
        let whole = first_run..self.runs.len() as u32;
        self.runs.extend_from_slice(&self.fading);
        let fading = whole.end..self.runs.len() as u32;
        let runs = [!whole.is_empty(), !fading.is_empty()];
        prepared.draws += runs.into_iter().map(u32::from).sum::<u32>();
        self.batches.push(Batch { model: number, variant, is_trimmed: is_trimmed(key), whole, fading });
    }

    /// Adds the wood of instance `at` to the previous draw if model, shaders and number of stems
    /// are the same; otherwise adds a new draw.
    fn add_wood(&mut self, model: ModelId, variant: Variant, corners: u32, at: u32) {
        match self.wood.last_mut() {
            Some(last) if (last.model, last.variant, last.corners) == (model, variant, corners) => {
                last.instances.end = at + 1;
            }
            _ => self.wood.push(WoodDraw { model, variant, instances: at..at + 1, corners }),
        }
    }
}

/// First run with a leaf that is partly present by alpha; [`u32::MAX`] if there is none.
fn first_fading_run(record: &InstanceRecord, model: &ModelFacts, look: &Look) -> u32 {
    if !look.fades_by_alpha() || record.first_partial >= record.drawn {
        return u32::MAX;
    }
    model.quad_end(record.first_partial) / RUN_QUADS
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plants_are_sorted_by_key_and_those_with_the_same_key_stay_in_order() {
        for keys in [1, 2, 7, 300, 70_000] {
            let key = |i: u32| u64::from(i.wrapping_mul(2_654_435_761) % keys) * 0x1_0040_0001;
            let mut plants: Vec<Listed> =
                (0..5000).map(|i| Listed { key: key(i), instance: i, record: i / 2 }).collect();
            let mut expected: Vec<_> = plants.iter().map(|plant| (plant.key, plant.instance)).collect();
            expected.sort_unstable();
            sort(&mut plants, &mut Vec::new());
            assert!(plants.iter().map(|plant| (plant.key, plant.instance)).eq(expected), "{keys} keys");
        }
        sort(&mut Vec::new(), &mut Vec::new());
    }

    #[test]
    fn a_key_tells_the_variant_the_trimming_and_the_cut() {
        for (variant, trimmed) in Variant::all().filter(|variant| !variant.alpha).zip([true, false].into_iter().cycle())
        {
            let key = key(ModelId::default(), variant, trimmed, 12345);
            assert_eq!((variant_of(key), is_trimmed(key), cut_of(key)), (variant, trimmed, 12345));
        }
    }
}
