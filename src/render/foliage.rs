//! Draws any number of plants of a few models into the caller's render pass.
//!
//! ```text
//! new(device, queue, target, look)  add_model(model)        once
//! prepare(frame, instances)                                 each frame: uploads 144 bytes a plant and 8 a run of its leaves
//! render(pass)                                              each frame: two or three draws a model and look
//! ```
//!
//! Every instance has its own active count, with a fraction, and no state: the drawn scales come from the model's timeline
//! in the vertex shader. A plant that keeps its drawn scales itself ([`Swap`]) can hand them over
//! instead ([`FoliageRenderer::add_scales`]).
//!
//! Pipelines are compiled for the combinations of effects that a frame needs, when it first needs them; buffers of effects
//! exist only where the [`Look`] calls for them. [`Prepared::effects`] tells for how much each was simulated.
//!
//! The device must offer vertex shaders that read storage buffers (`DownlevelFlags::VERTEX_STORAGE`).
//!
//! Limits: plants are not sorted, blended materials count as masked; under uneven scaling the light is a little off.

use super::{
    buffers::{buffer, grow},
    camera::Camera,
    effect_buffers::EffectBuffers,
    frame_list::{FrameList, ModelFacts},
    leaf_pass::{self, Run},
    look::{Look, Variant},
    model_buffers::ModelBuffers,
    software::mean_leaf_color,
    stems::Stems,
    surface::{Coloring, InstanceRecord, RUN_INDICES, TargetFormat, layouts},
    wood_pass,
};
use crate::{Error, Result, effects::Counts, extract::Swap, model::FoliageModel};
use glam::DAffine3;
use std::{collections::HashMap, ops::Range};

/// A model that was added to a renderer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelId(pub(super) usize);

/// Room for the drawn scales of one plant on a renderer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScalesId {
    pub(super) first: u32,
    pub(super) leaves: u32,
}

/// From where and when a frame is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The camera.
    pub camera: Camera,
    /// Rows of the picture: what moves by less than half of one is not simulated.
    pub height_px: u32,
    /// Time of what moves.
    pub seconds: f64,
}

impl Frame {
    /// The frame at time 0.
    pub fn new(camera: &Camera, height_px: u32) -> Self {
        Self { camera: *camera, height_px, seconds: 0.0 }
    }

    /// The same at another time.
    pub fn at(self, seconds: f64) -> Self {
        Self { seconds, ..self }
    }
}

impl From<&Camera> for Frame {
    /// A picture of 1080 rows at time 0: enough where nothing moves.
    fn from(camera: &Camera) -> Self {
        Self::new(camera, 1080)
    }
}

/// One plant to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Which model.
    pub model: ModelId,
    /// Where it stands. A transform that is not finite or not invertible hides the plant.
    pub world_from_plant: DAffine3,
    /// Active count with its fraction. Clamped to what the model has; NaN draws the wood alone.
    pub active: f32,
    /// How many leaves at the end of the prefix come and go at once (see [`Transition`](crate::model::Transition)); less
    /// than 1 counts as 1. The effect `fade` takes its place.
    pub window: f32,
    /// Factor on the drawn scale of every leaf: 1, but for stochastic pruning.
    pub leaf_scale: f32,
    /// The plant's own drawn scales; `None` takes them from the timeline. They belong to whole counts: fraction and window
    /// are ignored with them.
    pub scales: Option<ScalesId>,
}

impl Instance {
    /// A plant with `active` of its leaves, none of them on its way.
    pub fn new(model: ModelId, world_from_plant: DAffine3, active: f32) -> Self {
        Self { model, world_from_plant, active, window: 1.0, leaf_scale: 1.0, scales: None }
    }
}

/// What a frame draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Prepared {
    /// Plants.
    pub instances: u32,
    /// Plants that are not drawn because their transform cannot be.
    pub skipped: u32,
    /// Leaves of all plants, those that are still growing included.
    pub leaves: u64,
    /// Triangles of all plants' wood. Stems too thin to be seen are left out (see [`Look::thinnest_px`]).
    pub wood_triangles: u64,
    /// Draw calls.
    pub draws: u32,
    /// For how much each effect that is on was simulated.
    pub effects: Counts,
}

/// Draws plants.
pub struct FoliageRenderer {
    look: Look,
    leaves: HashMap<Variant, wgpu::RenderPipeline>,
    wood: HashMap<Variant, wgpu::RenderPipeline>,
    target: TargetFormat,
    layouts: Vec<wgpu::BindGroupLayout>,
    sampler: wgpu::Sampler,
    models: Vec<ModelBuffers>,
    facts: Vec<ModelFacts>,
    scales: wgpu::Buffer,
    scales_used: u32,
    instances: wgpu::Buffer,
    runs: wgpu::Buffer,
    bindings: Option<wgpu::BindGroup>,
    effects: Option<EffectBuffers>,
    list: FrameList,
}

impl FoliageRenderer {
    /// Draws plants as they are into one kind of target.
    pub fn new(device: &wgpu::Device, target: TargetFormat) -> Self {
        Self::with_look(device, target, Look::default())
    }

    /// Draws plants with effects, or lit in another way.
    pub fn with_look(device: &wgpu::Device, target: TargetFormat, look: Look) -> Self {
        use wgpu::BufferUsages as Usage;
        let layouts = layouts(device, &look.effects);
        let storage = Usage::STORAGE | Usage::COPY_DST;
        Self {
            effects: layouts.get(2).map(|layout| EffectBuffers::new(device, layout, &look.effects)),
            look,
            leaves: HashMap::new(),
            wood: HashMap::new(),
            target,
            layouts,
            sampler: sampler(device),
            models: Vec::new(),
            facts: Vec::new(),
            scales: buffer(device, "foliage scales", storage | Usage::COPY_SRC, size_of::<f32>() as u64),
            scales_used: 0,
            instances: buffer(device, "foliage instances", storage, size_of::<InstanceRecord>() as u64),
            runs: buffer(device, "foliage runs", Usage::VERTEX | Usage::COPY_DST, size_of::<Run>() as u64),
            bindings: None,
            list: FrameList::default(),
        }
    }

    /// Colours leaves in another way from the next [`prepare`](Self::prepare) on, which compiles the passes anew.
    pub fn set_coloring(&mut self, coloring: Coloring) {
        self.look.coloring = coloring;
        self.leaves.clear();
    }

    /// What plants look like.
    pub fn look(&self) -> &Look {
        &self.look
    }

    /// Variants for which pipelines exist: of the leaves' pass, and of the wood's.
    pub fn compiled(&self) -> [Vec<Variant>; 2] {
        [&self.leaves, &self.wood].map(|pipelines| {
            let mut variants: Vec<_> = pipelines.keys().copied().collect();
            variants.sort_unstable();
            variants
        })
    }

    /// Labels of the buffers that exist for effects.
    pub fn effect_buffers(&self) -> Vec<&'static str> {
        self.effects.as_ref().map_or_else(Vec::new, EffectBuffers::labels)
    }

    /// Uploads a model.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for one that breaks an invariant, [`Error::TooLarge`] for one beyond the device's limits,
    /// [`Error::Unreadable`] for a damaged texture.
    pub fn add_model(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, model: &FoliageModel) -> Result<ModelId> {
        model.validate()?;
        let mean = match self.look.effects.contrast {
            Some(_) => mean_leaf_color(model, &self.look.lighting())?,
            None => [0.0; 3],
        };
        let stems = Stems::new(model);
        self.models.push(ModelBuffers::new(device, queue, &self.layouts[0], &self.sampler, model, &stems)?);
        self.facts.push(ModelFacts::new(model, &stems, mean));
        Ok(ModelId(self.models.len() - 1))
    }

    /// Makes room for the drawn scales of one plant; upload them before they are drawn.
    ///
    /// # Errors
    /// [`Error::TooLarge`] when all plants' scales together outgrow the device's storage buffers.
    pub fn add_scales(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, swap: &Swap) -> Result<ScalesId> {
        let id = ScalesId { first: self.scales_used, leaves: swap.leaves() };
        let bytes = 4 * (u64::from(id.first) + u64::from(id.leaves));
        let limit = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        if bytes > limit {
            let fix = "leave scales to the timeline".into();
            return Err(Error::TooLarge { what: "bytes of drawn scales".into(), value: bytes, limit, fix });
        }
        let old = self.scales.clone();
        if grow(device, &mut self.scales, bytes) {
            let mut encoder = device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&old, 0, &self.scales, 0, 4 * u64::from(id.first));
            queue.submit([encoder.finish()]);
            self.bindings = None;
        }
        self.scales_used += id.leaves;
        self.upload_scales(queue, id, swap, std::slice::from_ref(&(0..id.leaves)));
        Ok(id)
    }

    /// Uploads the scales in `changed`, as [`Swap::set_active`] reports them.
    pub fn upload_scales(&self, queue: &wgpu::Queue, id: ScalesId, swap: &Swap, changed: &[Range<u32>]) {
        for range in changed {
            if let Some(scales) = swap.scales().get(range.start as usize..range.end.min(id.leaves) as usize) {
                let offset = 4 * u64::from(id.first + range.start);
                queue.write_buffer(&self.scales, offset, bytemuck::cast_slice(scales));
            }
        }
    }

    /// Takes in what the next [`render`](Self::render) draws. Allocates nothing once the lists have grown.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more plants than the device's buffers hold; then nothing is drawn.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: impl Into<Frame>,
        instances: &[Instance],
    ) -> Result<Prepared> {
        let prepared = self.list.fill(&self.look, &self.facts, &frame.into(), instances);
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
            let entries = [(0, &self.instances), (1, &self.scales)]
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
            self.bindings = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("foliage frame"),
                layout: &self.layouts[1],
                entries: &entries,
            }));
        }
        Ok(prepared)
    }

    /// Draws what was prepared. The pass must have the formats and samples of the renderer's target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(bindings) = &self.bindings else { return };
        pass.set_bind_group(1, bindings, &[]);
        if let Some(effects) = &self.effects {
            pass.set_bind_group(2, effects.bindings(), &[]);
        }
        for draw in &self.list.wood {
            let model = &self.models[draw.model];
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
                pass.set_bind_group(0, &self.models[batch.model].bindings, &[]);
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

    fn check_room(&mut self, device: &wgpu::Device) -> Result<()> {
        let limits = device.limits();
        let uses = [
            ("bytes of instances", size_of_val(&self.list.records[..]), limits.max_storage_buffer_binding_size),
            ("bytes of runs of leaves", size_of_val(&self.list.runs[..]), limits.max_buffer_size),
        ];
        for (what, value, limit) in uses {
            if value as u64 > limit.min(limits.max_buffer_size) {
                self.list.clear();
                let fix = "draw fewer plants or fewer leaves".into();
                return Err(Error::TooLarge { what: what.into(), value: value as u64, limit, fix });
            }
        }
        Ok(())
    }
}

fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    let repeat = wgpu::AddressMode::Repeat;
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("foliage"),
        address_mode_u: repeat,
        address_mode_v: repeat,
        address_mode_w: repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

/// Wood is neither toned nor faded.
fn of_wood(variant: Variant) -> Variant {
    Variant { wind: variant.wind, ..Variant::default() }
}
