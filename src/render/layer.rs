//! Draws a list of plants into one kind of target: pipelines, buffers and lists of the picture, or of the shadow map.

use super::{
    buffers::{buffer, grow},
    effect_buffers::{EffectBuffers, ShadowMap},
    foliage::{Instance, Prepared},
    frame_list::{Eye, FrameList, ModelFacts},
    leaf_pass::{self, Run},
    look::{Look, Variant},
    model_buffers::ModelBuffers,
    surface::{InstanceRecord, RUN_INDICES, Target},
    wood_pass,
};
use crate::{Error, Result};
use std::collections::HashMap;

/// One kind of target with what draws into it.
pub(super) struct Layer {
    pub(super) look: Look,
    target: Target,
    layouts: Vec<wgpu::BindGroupLayout>,
    leaves: HashMap<Variant, wgpu::RenderPipeline>,
    wood: HashMap<Variant, wgpu::RenderPipeline>,
    instances: wgpu::Buffer,
    runs: wgpu::Buffer,
    bindings: Option<wgpu::BindGroup>,
    pub(super) effects: Option<EffectBuffers>,
    list: FrameList,
}

impl Layer {
    /// Compiles nothing yet. `layouts` are those of [`layouts`](super::surface::layouts).
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
            effects: layouts.get(2).map(|layout| EffectBuffers::new(device, layout, &look.effects, map)),
            look,
            target,
            layouts,
            leaves: HashMap::new(),
            wood: HashMap::new(),
            instances: buffer(device, "foliage instances", storage, size_of::<InstanceRecord>() as u64),
            runs: buffer(device, "foliage runs", Usage::VERTEX | Usage::COPY_DST, size_of::<Run>() as u64),
            bindings: None,
            list: FrameList::default(),
        }
    }

    /// Forgets the pipelines of leaves.
    pub(super) fn forget_leaves(&mut self) {
        self.leaves.clear();
    }

    /// Forgets what is bound to another buffer of scales.
    pub(super) fn forget_bindings(&mut self) {
        self.bindings = None;
    }

    /// Forgets what is to be drawn.
    pub(super) fn clear(&mut self) {
        self.list.clear();
    }

    /// Variants for which pipelines exist: of the leaves, and of the wood.
    pub(super) fn compiled(&self) -> [Vec<Variant>; 2] {
        [&self.leaves, &self.wood].map(|pipelines| {
            let mut variants: Vec<_> = pipelines.keys().copied().collect();
            variants.sort_unstable();
            variants
        })
    }

    /// Takes in what [`render`](Self::render) draws.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more plants than the device's buffers hold; then the lists are to be cleared.
    pub(super) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        models: &[ModelFacts],
        eye: &Eye,
        instances: &[Instance],
        scales: &wgpu::Buffer,
    ) -> Result<Prepared> {
        let prepared = self.list.fill(&self.look, models, eye, instances);
        self.check_room(device)?;
        self.compile(device);
        let list = &self.list;
        let mut is_rebound = grow(device, &mut self.instances, size_of_val(&list.records[..]) as u64);
        grow(device, &mut self.runs, size_of_val(&list.runs[..]) as u64);
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&list.records));
        queue.write_buffer(&self.runs, 0, bytemuck::cast_slice(&list.runs));
        if let (Some(effects), Some(layout)) = (&mut self.effects, self.layouts.get(2)) {
            effects.upload(device, queue, layout, list);
        }
        is_rebound |= self.bindings.is_none();
        if is_rebound {
            let entries = [(0, &self.instances), (1, scales)]
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
            self.bindings = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("foliage frame"),
                layout: &self.layouts[1],
                entries: &entries,
            }));
        }
        Ok(prepared)
    }

    /// Draws what was prepared.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>, models: &[ModelBuffers]) {
        let Some(bindings) = &self.bindings else { return };
        pass.set_bind_group(1, bindings, &[]);
        if let Some(effects) = &self.effects {
            pass.set_bind_group(2, effects.bindings(), &[]);
        }
        for draw in &self.list.wood {
            let model = &models[draw.model];
            let Some((wood, pipeline)) = model.wood.as_ref().zip(self.wood.get(&of_wood(draw.variant))) else {
                continue;
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &model.bindings, &[]);
            pass.set_vertex_buffer(0, wood.vertices.slice(..));
            pass.set_index_buffer(wood.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..draw.corners, 0, draw.instances.clone());
        }
        for batch in &self.list.batches {
            let fading = Variant { alpha: true, ..batch.variant };
            for (variant, runs) in [(batch.variant, &batch.whole), (fading, &batch.fading)] {
                let Some(pipeline) = self.leaves.get(&variant).filter(|_| !runs.is_empty()) else { continue };
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &models[batch.model].bindings, &[]);
                pass.set_vertex_buffer(0, self.runs.slice(..));
                pass.draw(0..RUN_INDICES, runs.clone());
            }
        }
    }

    /// Compiles what the frame needs and is not there yet.
    fn compile(&mut self, device: &wgpu::Device) {
        let Self { layouts, target, look, list, leaves, wood, .. } = self;
        for batch in &list.batches {
            let variants = [(batch.variant, &batch.whole), (Variant { alpha: true, ..batch.variant }, &batch.fading)];
            for (variant, _) in variants.into_iter().filter(|(_, runs)| !runs.is_empty()) {
                let pipeline = || leaf_pass::pipeline(device, layouts, *target, look, variant);
                leaves.entry(variant).or_insert_with(pipeline);
            }
        }
        for variant in list.wood.iter().map(|draw| of_wood(draw.variant)) {
            wood.entry(variant).or_insert_with(|| wood_pass::pipeline(device, layouts, *target, look, variant));
        }
    }

    fn check_room(&self, device: &wgpu::Device) -> Result<()> {
        let limits = device.limits();
        let uses = [
            ("bytes of instances", size_of_val(&self.list.records[..]), limits.max_storage_buffer_binding_size),
            ("bytes of runs of leaves", size_of_val(&self.list.runs[..]), limits.max_buffer_size),
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

/// Wood is neither toned nor faded.
fn of_wood(variant: Variant) -> Variant {
    Variant { wind: variant.wind, ..Variant::default() }
}
