//! Draw lists of one frame, built on the CPU: a record per plant, runs of leaves, and draws grouped
//! by the shaders that they need.

use super::{
    eye::Eye,
    facts::{Facts, ModelFacts},
    handover,
    instance::{Instance, ModelId, Prepared},
    live::Needed,
    look::{Look, Variant},
    records::{FrameRecord, InstanceRecord, NO_SCALES, RUN_QUADS, Run, Tone, runs},
    sprite::{DEEP_FROM_PX, LEAST_PX},
    tint::{Tint, Tints},
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
    /// Runs of cards of clusters.
    pub cards: Range<u32>,
}

/// Plants of one model that draw as much of its wood.
#[derive(Debug, Clone, PartialEq)]
pub struct WoodDraw {
    /// The model.
    pub model: ModelId,
    /// The shaders that they need.
    pub variant: Variant,
    /// Records of the plants.
    pub instances: Range<u32>,
    /// Wood indices to draw.
    pub corners: Range<u32>,
    /// Whether vertices of the wood slide.
    pub slides: bool,
}

/// Plants of one model whose impostors are drawn alike.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpostorDraw {
    /// The model.
    pub model: ModelId,
    /// The shaders that they need; only the wind counts.
    pub variant: Variant,
    /// Whether the depth of the pictures is followed.
    pub is_deep: bool,
    /// Records of the plants.
    pub instances: Range<u32>,
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
/// Bits of a sorting key below the model.
const MODEL_BIT: u32 = CUT_BITS + 8;

/// What a plant is drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Parts {
    variant: Variant,
    /// Whether leaves are drawn within their outlines.
    is_trimmed: bool,
    /// Whether there are no leaves and no wood, but the impostor alone.
    is_impostor: bool,
    /// Whether the depth of the impostor's pictures is followed.
    is_deep: bool,
    /// Number of the wood's cut.
    cut: u32,
}

/// Key by which plants are sorted: first by model and by what the leaves' and the impostors' draws
/// depend on, then by the number of the wood's cut.
fn key(model: ModelId, parts: Parts) -> u64 {
    let Parts { variant: Variant { wind, contrast, tone, tiles, handover, .. }, is_trimmed, .. } = parts;
    let bits = [is_trimmed, tiles, tone, contrast, wind, handover, parts.is_impostor, parts.is_deep];
    let bits = (CUT_BITS..).zip(bits).fold(0, |bits, (at, bit)| bits | u64::from(bit) << at);
    // The lower half of a model's key is its index among the models that exist.
    (model.data().as_ffi() & u64::from(u32::MAX)) << MODEL_BIT | bits | u64::from(parts.cut)
}

fn parts_of(key: u64) -> Parts {
    let bit = |at: u32| key >> (CUT_BITS + at) & 1 == 1;
    let [tiles, tone, contrast, wind, handover] = [1, 2, 3, 4, 5].map(bit);
    Parts {
        variant: Variant { wind, contrast, tone, tiles, alpha: false, handover },
        is_trimmed: bit(0),
        is_impostor: bit(6),
        is_deep: bit(7),
        cut: (key & ((1 << CUT_BITS) - 1)) as u32,
    }
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
    /// Draws of impostors.
    pub impostors: Vec<ImpostorDraw>,
    /// Parallel to `records`; empty if the effect `contrast` is off.
    pub tones: Vec<Tone>,
    /// Parallel to `records`; empty if the look has neither tints nor a ground with its haze.
    pub tints: Vec<Tint>,
    /// Parallel to `records`; empty if the effect `wind` is off.
    pub sways: Vec<Sway>,
    /// What all plants share.
    pub shared: FrameRecord,
    /// Frames of live impostors that the plants need.
    pub(crate) needed: Needed,
    /// Number of impostors that are smaller than they are drawn.
    faded: u32,
    /// Records and sways of the plants in the previous frame; appended to this frame's at the end.
    before: (Vec<InstanceRecord>, Vec<Sway>),
    /// Records in the order of the instances, and the shares of the motion of limbs.
    unsorted: Vec<InstanceRecord>,
    limb_shares: Vec<[f32; 2]>,
    order: Vec<Listed>,
    /// Room to sort in.
    spare: Vec<Listed>,
    /// Fading runs of the current batch, held until its whole runs are listed.
    fading: Vec<Run>,
    /// Runs of cards of the current batch.
    cards: Vec<Run>,
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
            impostors: Vec::new(),
            tones: Vec::new(),
            tints: Vec::new(),
            sways: Vec::new(),
            needed: Needed::default(),
            faded: 0,
            before: Default::default(),
            unsorted: Vec::new(),
            limb_shares: Vec::new(),
            order: Vec::new(),
            spare: Vec::new(),
            fading: Vec::new(),
            cards: Vec::new(),
        }
    }
}

impl FrameList {
    /// Lists records, runs and batches, model by model.
    pub fn fill(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) -> Prepared {
        self.clear();
        let moments = look.effects.wind.map(|wind| [eye.seconds, eye.seconds_before()].map(|seconds| wind.at(seconds)));
        let tints = look.has_tints().then(|| Tints::new(look, eye.at));
        let mut prepared = Prepared { effects: Counts::of(&look.effects), ..Prepared::default() };
        self.list(look, models, eye, instances);
        sort(&mut self.order, &mut self.spare);
        let mut at = 0;
        while let Some(&first) = self.order.get(at) {
            let is_alike = |next: &&Listed| next.key >> CUT_BITS == first.key >> CUT_BITS;
            let end = at + self.order[at..].iter().take_while(is_alike).count();
            self.batch(look, models, eye, (moments.as_ref(), tints.as_ref()), instances, at..end, &mut prepared);
            at = end;
        }
        prepared.far.impostors -= self.faded;
        prepared.far.faded = self.faded;
        prepared.instances = self.records.len() as u32;
        prepared.skipped = instances.len() as u32 - prepared.instances;
        prepared.draws += (self.wood.len() + self.impostors.len()) as u32;
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
        self.impostors.clear();
        self.tones.clear();
        self.tints.clear();
        self.sways.clear();
        self.needed.clear();
        self.faded = 0;
    }

    /// Computes keys and records of all plants, in the order of `instances`, which are large: they
    /// are read once, from front to back.
    fn list(&mut self, look: &Look, models: &Facts, eye: &Eye, instances: &[Instance]) {
        self.order.clear();
        self.unsorted.clear();
        self.limb_shares.clear();
        for (number, instance) in (0..).zip(instances) {
            let Some(model) = models.get(instance.model) else { continue };
            let Some(place) = eye.place(model, instance) else { continue };
            let moves = look.effects.wind.is_some_and(|wind| {
                let n = (instance.active as usize).min(model.leaves as usize);
                let reach = wind.reach(&model.shape, model.leaf_reaches[n] * instance.leaf_scale);
                f64::from(reach) * place.pixels_per_unit > 0.5
            });
            let shares = look.effects.wind.filter(|_| moves);
            let shares = shares.map(|wind| wind.limb_shares(&model.shape, place.pixels_per_unit));
            self.limb_shares.extend(look.effects.wind.map(|_| shares.unwrap_or_default()));
            let far = look.far.filter(|_| model.impostor.is_some());
            let diameter_px = if far.is_some() { eye.diameter_px(model, instance) } else { f32::INFINITY };
            let share = far.map_or(0.0, |far| far.share_of(diameter_px, instance.seed, instance.far));
            let from_center = || eye.relative_to_impostor(model, instance);
            let share = self.needed.available(share, instance.model, model.live.as_ref(), from_center);
            let is_deep = share > 0.0 && diameter_px >= DEEP_FROM_PX;
            let record = self.unsorted.len() as u32;
            if share >= 1.0 {
                let variant = Variant { wind: moves, ..Variant::default() };
                let parts = Parts { variant, is_impostor: true, is_deep, ..Parts::default() };
                self.order.push(Listed { key: key(instance.model, parts), instance: number, record });
                self.faded += u32::from(diameter_px < LEAST_PX);
                let placed = place.record(model, &Instance { active: 0.0, ..*instance }, look, 0.0);
                let drawn = handover::packed(0, 1.0);
                self.unsorted.push(InstanceRecord { first_partial: instance.seed, drawn, ..placed });
                continue;
            }
            let is_reduced = instance.active < model.leaves as f32;
            let tone = look.tone && model.has_tone && (is_reduced || instance.leaf_scale > 1.0);
            let contrast = look.effects.contrast.is_some() && is_reduced && !(look.tone && model.has_tone);
            let error = f64::from(look.wood_error_px) / place.pixels_per_unit;
            let (cut, wood_error) = model.stems.numbered(error as f32);
            let tiles = model.has_tiles && (is_reduced || instance.leaf_scale > 1.0);
            let mut placed = place.record(model, instance, look, wood_error);
            if share > 0.0 {
                placed.drawn = handover::packed(placed.drawn, share);
            }
            let variant = Variant { wind: moves, contrast, tone, tiles, alpha: false, handover: share > 0.0 };
            let is_trimmed = place.pixels_per_unit >= f64::from(model.trimmed_from);
            let parts = Parts { variant, is_trimmed, is_impostor: false, is_deep, cut };
            self.order.push(Listed { key: key(instance.model, parts), instance: number, record });
            self.unsorted.push(placed);
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one frame's worth of context, used here alone")]
    fn batch(
        &mut self,
        look: &Look,
        models: &Facts,
        eye: &Eye,
        (moments, tints): (Option<&[Moment; 2]>, Option<&Tints>),
        instances: &[Instance],
        range: Range<usize>,
        prepared: &mut Prepared,
    ) {
        let Listed { key, instance, .. } = self.order[range.start];
        let number = instances[instance as usize].model;
        let Parts { variant, is_trimmed, is_impostor, is_deep, .. } = parts_of(key);
        let model = &models[number];
        let (first_run, first_record) = (self.runs.len() as u32, self.records.len() as u32);
        self.fading.clear();
        self.cards.clear();
        let plants = range.len() as u32;
        let of = &mut prepared.far;
        *if is_impostor {
            &mut of.impostors
        } else if variant.handover {
            &mut of.both
        } else {
            &mut of.leaves
        } += plants;
        for i in range {
            let Listed { key, instance, record } = self.order[i];
            let shares = self.limb_shares.get(record as usize).copied().unwrap_or_default();
            let (instance, record) = (&instances[instance as usize], self.unsorted[record as usize]);
            let at = self.records.len() as u32;
            let drawn = if is_impostor || variant.handover { handover::leaves(record.drawn) } else { record.drawn };
            prepared.leaves += u64::from(drawn);
            let end = runs(model.quad_end(drawn));
            let split = first_fading_run(&record, drawn, model, look).min(end);
            self.runs.extend((0..split).map(|run| [at, run]));
            self.fading.extend((split..end).map(|run| [at, run]));
            if !is_impostor && record.first_scale == NO_SCALES {
                model.cards.runs(record.first_partial, drawn, |run| self.cards.push([at, run]));
            }
            prepared.effects.add_drawn(record.first_partial.min(drawn), drawn);
            count_plant(&mut prepared.effects, variant);
            if let Some(effect) = look.effects.contrast {
                let kept = effect.kept(instance.active, model.leaves as usize);
                self.tones.push(Tone { mean: model.mean, kept });
            }
            if let Some(tints) = tints {
                self.tints.push(tints.of(instance, instance.world_from_plant.transform_point3(model.center)));
            }
            if let Some([now, _]) = moments {
                self.sways.push(now.sway(&model.shape, &instance.world_from_plant).with_limbs(shares));
                if model.shape.limbs.is_some() && !is_impostor {
                    prepared.effects.add_limbs(shares);
                }
            }
            if let Some(before) = &eye.before {
                let placed = [instance.before.as_ref(), Some(&instance.world_from_plant)];
                let placed = placed.map(|placed| placed.unwrap_or(&instance.world_from_plant));
                self.before.0.push(before.record(model, placed, &record));
                self.before.1.extend(moments.map(|[_, then]| then.sway(&model.shape, placed[0]).with_limbs(shares)));
            }
            self.records.push(record);
            let corners = if is_impostor { 0..0 } else { model.stems.corners(parts_of(key).cut) };
            if !corners.is_empty() {
                prepared.wood_triangles += corners.len() as u64 / 3;
                let slides = model.stems.slides();
                self.add_wood(WoodDraw { model: number, variant, instances: at..at + 1, corners, slides });
            }
        }
        let whole = first_run..self.runs.len() as u32;
        self.runs.extend_from_slice(&self.fading);
        let fading = whole.end..self.runs.len() as u32;
        self.runs.extend_from_slice(&self.cards);
        let cards = fading.end..self.runs.len() as u32;
        let runs = [!whole.is_empty(), !fading.is_empty(), !cards.is_empty()];
        prepared.draws += runs.into_iter().map(u32::from).sum::<u32>();
        if !is_impostor {
            self.batches.push(Batch { model: number, variant, is_trimmed, whole, fading, cards });
        }
        if is_impostor || variant.handover {
            let instances = first_record..self.records.len() as u32;
            let variant = Variant { wind: variant.wind, ..Variant::default() };
            self.impostors.push(ImpostorDraw { model: number, variant, is_deep, instances });
        }
    }

    /// Adds the wood of the next instance to the previous draw if model, shaders and corners are
    /// the same; otherwise adds a new draw.
    fn add_wood(&mut self, draw: WoodDraw) {
        let what = |draw: &WoodDraw| (draw.model, draw.variant, draw.corners.clone());
        match self.wood.last_mut() {
            Some(last) if what(last) == what(&draw) => last.instances.end = draw.instances.end,
            _ => self.wood.push(draw),
        }
    }
}

/// First run with a leaf that is partly present by alpha; [`u32::MAX`] if there is none.
fn first_fading_run(record: &InstanceRecord, drawn: u32, model: &ModelFacts, look: &Look) -> u32 {
    if !look.fades_by_alpha() || record.first_partial >= drawn {
        return u32::MAX;
    }
    model.quad_end(record.first_partial) / RUN_QUADS
}

/// Counts one plant.
fn count_plant(counts: &mut Counts, variant: Variant) {
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
    fn a_key_tells_what_is_drawn() {
        let variants = Variant::all().filter(|variant| !variant.alpha);
        for (i, variant) in variants.enumerate() {
            let [is_trimmed, is_impostor, is_deep] = [1, 2, 4].map(|bit| i & bit != 0);
            let parts = Parts { variant, is_trimmed, is_impostor, is_deep, cut: 12345 };
            assert_eq!(parts_of(key(ModelId::default(), parts)), parts);
        }
    }
}
