//! Layer: pipelines, buffers and draw lists for one kind of target: the picture, the shadow map or
//! the motion vectors.

use super::{
    bindings::{card_layout, impostor_layout, sliding_layout},
    buffers::{buffer, filled, grow},
    effect_buffers::EffectBuffers,
    model_buffers::{ModelBuffers, WoodVertices},
    pipeline::Target,
    plant_pass::{self, Part},
    shadow_map::ShadowMap,
};
use crate::{
    Depth, Error, Result,
    draw::{
        eye::Eye,
        facts::Facts,
        frame_list::{FrameList, ImpostorDraw, WoodDraw},
        instance::{Instance, ModelId, Prepared},
        live::Needed,
        look::{Look, Variant},
        quads::{RUN_INDICES, TRIMMED_RUN_INDICES, run_indices},
        records::{FrameRecord, InstanceRecord, Run, bindings},
    },
};
use slotmap::SecondaryMap;
use std::collections::HashMap;

/// GPU buffers of all models of a renderer.
pub(super) type Buffers = SecondaryMap<ModelId, ModelBuffers>;

/// Key of a pipeline.
type Key = (Part, Depth, Variant);

/// Pipelines, buffers and draw lists of one kind of target.
pub(super) struct Layer {
    pub(super) look: Look,
    pub(super) target: Target,
    layouts: Vec<wgpu::BindGroupLayout>,
    /// The same with the impostor's layout in place of the model's, if the look hands plants over.
    impostor_layouts: Vec<wgpu::BindGroupLayout>,
    /// The same with the layout of wood that slides.
    sliding_layouts: Vec<wgpu::BindGroupLayout>,
    /// The same with that of cards of clusters.
    card_layouts: Vec<wgpu::BindGroupLayout>,
    pipelines: HashMap<Key, wgpu::RenderPipeline>,
    instances: wgpu::Buffer,
    shared: wgpu::Buffer,
    runs: wgpu::Buffer,
    /// Indices of a run's quads, and of its trimmed cards.
    pattern: wgpu::Buffer,
    bindings: Option<wgpu::BindGroup>,
    pub(super) effects: Option<EffectBuffers>,
    list: FrameList,
    /// Depth convention of the prepared frame.
    pub(super) depth: Depth,
}

impl Layer {
    /// Creates a layer without pipelines. `layouts` come from
    /// [`layouts`](super::bindings::layouts).
    pub(super) fn new(
        device: &wgpu::Device,
        target: Target,
        look: Look,
        layouts: Vec<wgpu::BindGroupLayout>,
        map: Option<&ShadowMap>,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let storage = Usage::STORAGE | Usage::COPY_DST;
        Self {
            effects: layouts.get(2).map(|layout| EffectBuffers::new(device, layout, &look, map)),
            impostor_layouts: match look.far {
                Some(_) => std::iter::once(impostor_layout(device)).chain(layouts[1..].iter().cloned()).collect(),
                None => Vec::new(),
            },
            sliding_layouts: std::iter::once(sliding_layout(device, &look))
                .chain(layouts[1..].iter().cloned())
                .collect(),
            card_layouts: std::iter::once(card_layout(device, &look)).chain(layouts[1..].iter().cloned()).collect(),
            look,
            target,
            layouts,
            pipelines: HashMap::new(),
            instances: buffer(device, "foliage instances", storage, size_of::<InstanceRecord>() as u64),
            shared: buffer(device, "foliage frame", Usage::UNIFORM | Usage::COPY_DST, size_of::<FrameRecord>() as u64),
            runs: buffer(device, "foliage runs", Usage::VERTEX | Usage::COPY_DST, size_of::<Run>() as u64),
            pattern: filled(device, "run of quads", Usage::INDEX, bytemuck::cast_slice(&run_indices())),
            bindings: None,
            list: FrameList::default(),
            depth: Depth::default(),
        }
    }

    /// Drops the pipelines that depend on the colouring.
    pub(super) fn forget_colored(&mut self) {
        self.pipelines.retain(|(part, ..), _| matches!(part, Part::Wood { .. }));
    }

    /// Drops the bind group, because the scale buffer was replaced.
    pub(super) fn forget_bindings(&mut self) {
        self.bindings = None;
    }

    /// Frames of live impostors that the plants of the prepared frame need.
    pub(super) fn needed(&self) -> &Needed {
        &self.list.needed
    }

    /// Empties the draw lists.
    pub(super) fn clear(&mut self) {
        self.list.clear();
    }

    /// Variants of `part` that have pipelines, sorted.
    pub(super) fn compiled(&self, part: Part) -> Vec<Variant> {
        let of_part = self.pipelines.keys().filter(|(of, ..)| *of == part);
        let mut variants: Vec<_> = of_part.map(|&(.., variant)| variant).collect();
        variants.sort_unstable();
        variants.dedup();
        variants
    }

    /// Variants of wood that have pipelines, sorted.
    pub(super) fn compiled_wood(&self) -> Vec<Variant> {
        let mut variants = [false, true].map(|slides| self.compiled(Part::Wood { slides })).concat();
        variants.sort_unstable();
        variants.dedup();
        variants
    }

    /// Builds and uploads the draw lists of [`render`](Self::render), and compiles missing
    /// pipelines.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if the plants exceed the device's buffer limits; the caller must then
    /// [`clear`](Self::clear) the lists.
    pub(super) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        models: &Facts,
        eye: &Eye,
        instances: &[Instance],
        scales: &wgpu::Buffer,
    ) -> Result<Prepared> {
        let prepared = self.list.fill(&self.look, models, eye, instances);
        self.check_room(device)?;
        self.depth = eye.depth();
        self.compile(device);
        let list = &self.list;
        let mut is_rebound = grow(device, &mut self.instances, size_of_val(&list.records[..]) as u64);
        grow(device, &mut self.runs, size_of_val(&list.runs[..]) as u64);
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&list.records));
        queue.write_buffer(&self.shared, 0, bytemuck::bytes_of(&list.shared));
        queue.write_buffer(&self.runs, 0, bytemuck::cast_slice(&list.runs));
        if let (Some(effects), Some(layout)) = (&mut self.effects, self.layouts.get(2)) {
            effects.upload(device, queue, layout, list);
        }
        is_rebound |= self.bindings.is_none();
        if is_rebound {
            let buffers =
                [(bindings::INSTANCES, &self.instances), (bindings::SCALES, scales), (bindings::SHARED, &self.shared)];
            let entries =
                buffers.map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
            self.bindings = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("foliage frame"),
                layout: &self.layouts[1],
                entries: &entries,
            }));
        }
        Ok(prepared)
    }

    /// Draws the prepared frame.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>, models: &Buffers) {
        let Some(frame) = &self.bindings else { return };
        pass.set_bind_group(bindings::FRAME, frame, &[]);
        if let Some(effects) = &self.effects {
            pass.set_bind_group(bindings::EFFECTS, effects.bindings(), &[]);
        }
        for draw in &self.list.wood {
            let Some(model) = models.get(draw.model) else { continue };
            let pipeline = self.pipelines.get(&(part_of_wood(draw), self.depth, of_wood(draw.variant)));
            let Some((wood, pipeline)) = model.wood.as_ref().zip(pipeline) else { continue };
            pass.set_pipeline(pipeline);
            match &wood.vertices {
                WoodVertices::Still(vertices) => {
                    pass.set_bind_group(bindings::MODEL, &model.bindings, &[]);
                    pass.set_vertex_buffer(0, vertices.slice(..));
                }
                WoodVertices::Sliding(own) => pass.set_bind_group(bindings::MODEL, own, &[]),
            }
            pass.set_index_buffer(wood.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(draw.corners.clone(), 0, draw.instances.clone());
        }
        for draw in &self.list.impostors {
            let impostor = models.get(draw.model).and_then(|model| model.impostor.as_ref());
            let pipeline = self.pipelines.get(&(of_impostor(draw), self.depth, draw.variant));
            let Some((impostor, pipeline)) = impostor.zip(pipeline) else { continue };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(bindings::MODEL, &impostor.bindings, &[]);
            pass.set_index_buffer(self.pattern.slice(..), wgpu::IndexFormat::Uint16);
            pass.draw_indexed(0..SPRITE_INDICES, 0, draw.instances.clone());
        }
        for batch in &self.list.batches {
            let fading = Variant { alpha: true, ..batch.variant };
            for (variant, runs) in [(batch.variant, &batch.whole), (fading, &batch.fading)] {
                let pipeline = self.pipelines.get(&(Part::Leaves, self.depth, variant)).filter(|_| !runs.is_empty());
                let Some((pipeline, model)) = pipeline.zip(models.get(batch.model)) else { continue };
                pass.set_pipeline(pipeline);
                pass.set_bind_group(bindings::MODEL, &model.bindings, &[]);
                pass.set_vertex_buffer(0, self.runs.slice(..));
                pass.set_index_buffer(self.pattern.slice(..), wgpu::IndexFormat::Uint16);
                let indices = match batch.is_trimmed {
                    true => RUN_INDICES..RUN_INDICES + TRIMMED_RUN_INDICES,
                    false => 0..RUN_INDICES,
                };
                pass.draw_indexed(indices, 0, runs.clone());
            }
            let pipeline = self.pipelines.get(&(Part::Cards, self.depth, of_cards(batch.variant)));
            let cards = models.get(batch.model).and_then(|model| model.cards.as_ref());
            if let Some((pipeline, cards)) = pipeline.zip(cards).filter(|_| !batch.cards.is_empty()) {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(bindings::MODEL, cards, &[]);
                pass.set_vertex_buffer(0, self.runs.slice(..));
                pass.set_index_buffer(self.pattern.slice(..), wgpu::IndexFormat::Uint16);
                pass.draw_indexed(0..RUN_INDICES, 0, batch.cards.clone());
            }
        }
    }

    /// Compiles the pipelines that the frame needs and that do not exist yet.
    fn compile(&mut self, device: &wgpu::Device) {
        let Self {
            layouts, impostor_layouts, sliding_layouts, card_layouts, target, look, list, pipelines, depth, ..
        } = self;
        let leaves = list.batches.iter().flat_map(|batch| {
            let fading = Variant { alpha: true, ..batch.variant };
            [(batch.variant, &batch.whole), (fading, &batch.fading)]
        });
        let leaves = leaves.filter(|(_, runs)| !runs.is_empty()).map(|(variant, _)| (Part::Leaves, *depth, variant));
        let wood = list.wood.iter().map(|draw| (part_of_wood(draw), *depth, of_wood(draw.variant)));
        let impostors = list.impostors.iter().map(|draw| (of_impostor(draw), *depth, draw.variant));
        let cards = list.batches.iter().filter(|batch| !batch.cards.is_empty());
        let cards = cards.map(|batch| (Part::Cards, *depth, of_cards(batch.variant)));
        for key @ (part, depth, variant) in leaves.chain(wood).chain(impostors).chain(cards) {
            let layouts: &[_] = match part {
                Part::Impostor { .. } => impostor_layouts,
                Part::Wood { slides: true } => sliding_layouts,
                Part::Cards => card_layouts,
                Part::Wood { slides: false } | Part::Leaves => layouts,
            };
            let pipeline = || plant_pass::pipeline(device, layouts, *target, part, look, variant, depth);
            pipelines.entry(key).or_insert_with(pipeline);
        }
    }

    fn check_room(&self, device: &wgpu::Device) -> Result<()> {
        let limits = device.limits();
        let uses = [
            ("size in bytes of instances", size_of_val(&self.list.records[..]), limits.max_storage_buffer_binding_size),
            ("size in bytes of leaf runs", size_of_val(&self.list.runs[..]), limits.max_buffer_size),
        ];
        for (what, value, limit) in uses {
            if value as u64 > limit.min(limits.max_buffer_size) {
                let fix = "draw fewer plants or fewer leaves".into();
                return Err(Error::TooLarge { what: what.into(), value: value as u64, limit, fix });
            }
        }
        Ok(())
    }
}

/// Variant of the wood: only the wind and the hand-over apply to it.
fn of_wood(variant: Variant) -> Variant {
    Variant { wind: variant.wind, handover: variant.handover, ..Variant::default() }
}

/// Variant of cards of clusters: they repeat nothing, and appear by themselves.
fn of_cards(variant: Variant) -> Variant {
    Variant { tiles: false, alpha: false, ..variant }
}

/// Indices of a sprite: those of the first quad of a run.
const SPRITE_INDICES: u32 = 6;

fn part_of_wood(draw: &WoodDraw) -> Part {
    Part::Wood { slides: draw.slides }
}

fn of_impostor(draw: &ImpostorDraw) -> Part {
    Part::Impostor { is_deep: draw.is_deep }
}
