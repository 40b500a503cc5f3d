//! Draws any number of plants of a few models into the caller's render pass.
//!
//! ```text
//! new(device, queue, target)        add_model(model)        once
//! prepare(camera, instances)                                each frame: uploads 128 bytes a plant and 8 a run of its leaves
//! render(pass)                                              each frame: two draws a model, however many plants there are
//! ```
//!
//! Every instance has its own active count, with a fraction, and no state: the drawn scales come from the model's timeline
//! in the vertex shader. A plant that keeps its drawn scales itself ([`Swap`]) can hand them over
//! instead ([`FoliageRenderer::add_scales`]).
//!
//! The device must offer vertex shaders that read storage buffers (`DownlevelFlags::VERTEX_STORAGE`).
//!
//! Limits: plants are not sorted, blended materials count as masked; under uneven scaling the light is a little off.

use super::{
    buffers::{buffer, grow},
    camera::Camera,
    leaf_pass::{self, Run},
    light::TOWARDS_SUN,
    model_buffers::ModelBuffers,
    surface::{Coloring, InstanceRecord, NO_SCALES, RUN_INDICES, TargetFormat, layouts},
    wood_pass,
};
use crate::{
    Error, Result,
    extract::Swap,
    model::{FoliageModel, Transition},
};
use glam::{DAffine3, DMat4, DVec3};
use std::ops::Range;

/// A model that was added to a renderer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelId(usize);

/// Room for the drawn scales of one plant on a renderer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScalesId {
    first: u32,
    leaves: u32,
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
    /// How many leaves at the end of the prefix come and go at once (see [`Transition`]); less than 1 counts as 1.
    pub window: f32,
    /// The plant's own drawn scales; `None` takes them from the timeline. They belong to whole counts: fraction and window
    /// are ignored with them.
    pub scales: Option<ScalesId>,
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
    /// Draw calls.
    pub draws: u32,
}

/// All plants of one model in one frame.
#[derive(Debug, Clone, PartialEq)]
struct Batch {
    model: usize,
    instances: Range<u32>,
    runs: Range<u32>,
}

/// Draws plants.
pub struct FoliageRenderer {
    leaves: wgpu::RenderPipeline,
    wood: wgpu::RenderPipeline,
    target: TargetFormat,
    layouts: [wgpu::BindGroupLayout; 2],
    sampler: wgpu::Sampler,
    models: Vec<ModelBuffers>,
    scales: wgpu::Buffer,
    scales_used: u32,
    instances: wgpu::Buffer,
    runs: wgpu::Buffer,
    bindings: Option<wgpu::BindGroup>,
    records: Vec<InstanceRecord>,
    run_list: Vec<Run>,
    batches: Vec<Batch>,
}

impl FoliageRenderer {
    /// Compiles the passes for one kind of target.
    pub fn new(device: &wgpu::Device, target: TargetFormat) -> Self {
        use wgpu::BufferUsages as Usage;
        let layouts = layouts(device);
        let storage = Usage::STORAGE | Usage::COPY_DST;
        Self {
            leaves: leaf_pass::pipeline(device, &layouts, target, Coloring::Picture),
            wood: wood_pass::pipeline(device, &layouts, target),
            target,
            layouts,
            sampler: sampler(device),
            models: Vec::new(),
            scales: buffer(device, "foliage scales", storage | Usage::COPY_SRC, size_of::<f32>() as u64),
            scales_used: 0,
            instances: buffer(device, "foliage instances", storage, size_of::<InstanceRecord>() as u64),
            runs: buffer(device, "foliage runs", Usage::VERTEX | Usage::COPY_DST, size_of::<Run>() as u64),
            bindings: None,
            records: Vec::new(),
            run_list: Vec::new(),
            batches: Vec::new(),
        }
    }

    /// Compiles the leaves' pass anew for another look.
    pub fn set_coloring(&mut self, device: &wgpu::Device, coloring: Coloring) {
        self.leaves = leaf_pass::pipeline(device, &self.layouts, self.target, coloring);
    }

    /// Uploads a model.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for one that breaks an invariant, [`Error::TooLarge`] for one beyond the device's limits,
    /// [`Error::Unreadable`] for a damaged texture.
    pub fn add_model(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, model: &FoliageModel) -> Result<ModelId> {
        model.validate()?;
        self.models.push(ModelBuffers::new(device, queue, &self.layouts[0], &self.sampler, model)?);
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
        camera: &Camera,
        instances: &[Instance],
    ) -> Result<Prepared> {
        let prepared = self.list(camera, instances);
        self.check_room(device)?;
        let mut is_rebound = grow(device, &mut self.instances, size_of_val(&self.records[..]) as u64);
        grow(device, &mut self.runs, size_of_val(&self.run_list[..]) as u64);
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.records));
        queue.write_buffer(&self.runs, 0, bytemuck::cast_slice(&self.run_list));
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

    /// Draws what was prepared: two draws a model. The pass must have the formats and samples of the renderer's target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(bindings) = &self.bindings else { return };
        pass.set_bind_group(1, bindings, &[]);
        pass.set_pipeline(&self.wood);
        for batch in &self.batches {
            let model = &self.models[batch.model];
            if let Some(wood) = &model.wood {
                pass.set_bind_group(0, &model.bindings, &[]);
                pass.set_vertex_buffer(0, wood.vertices.slice(..));
                pass.set_index_buffer(wood.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..wood.count, 0, batch.instances.clone());
            }
        }
        pass.set_pipeline(&self.leaves);
        for batch in self.batches.iter().filter(|batch| !batch.runs.is_empty()) {
            pass.set_bind_group(0, &self.models[batch.model].bindings, &[]);
            pass.set_vertex_buffer(0, self.runs.slice(..));
            pass.draw(0..RUN_INDICES, batch.runs.clone());
        }
    }

    /// Lists records, runs and batches, model by model.
    fn list(&mut self, camera: &Camera, instances: &[Instance]) -> Prepared {
        self.records.clear();
        self.run_list.clear();
        self.batches.clear();
        let mut prepared = Prepared::default();
        let clip_from_world = camera.clip_from_world();
        for (number, model) in self.models.iter().enumerate() {
            let [first_record, first_run] = [self.records.len() as u32, self.run_list.len() as u32];
            for instance in instances.iter().filter(|instance| instance.model.0 == number) {
                let Some(record) = record(model, instance, &clip_from_world, camera.eye) else {
                    prepared.skipped += 1;
                    continue;
                };
                prepared.leaves += u64::from(record.drawn);
                let at = self.records.len() as u32;
                self.run_list.extend((0..leaf_pass::runs(record.index_end)).map(|run| [at, run]));
                self.records.push(record);
            }
            let batch = Batch {
                model: number,
                instances: first_record..self.records.len() as u32,
                runs: first_run..self.run_list.len() as u32,
            };
            if !batch.instances.is_empty() {
                prepared.draws += u32::from(model.wood.is_some()) + u32::from(!batch.runs.is_empty());
                self.batches.push(batch);
            }
        }
        prepared.instances = self.records.len() as u32;
        prepared
    }

    fn check_room(&mut self, device: &wgpu::Device) -> Result<()> {
        let limits = device.limits();
        let uses = [
            ("bytes of instances", size_of_val(&self.records[..]), limits.max_storage_buffer_binding_size),
            ("bytes of runs of leaves", size_of_val(&self.run_list[..]), limits.max_buffer_size),
        ];
        for (what, value, limit) in uses {
            if value as u64 > limit.min(limits.max_buffer_size) {
                self.batches.clear();
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

/// What the shaders are told of one plant; `None` where its transform cannot be drawn. Composed in `f64`, so that plants far
/// from the origin stay sharp.
fn record(model: &ModelBuffers, instance: &Instance, clip_from_world: &DMat4, eye: DVec3) -> Option<InstanceRecord> {
    let world_from_local = instance.world_from_plant * DAffine3::from_translation(model.center);
    let local_from_world = world_from_local.inverse();
    let clip_from_local = (*clip_from_world * world_from_local).as_mat4();
    let eye_local = local_from_world.transform_point3(eye).as_vec3();
    if !(clip_from_local.is_finite() && eye_local.is_finite()) {
        return None;
    }
    let turned =
        |direction: DVec3| local_from_world.transform_vector3(direction).normalize_or_zero().as_vec3().to_array();
    let leaves = model.index_ends.len() as u32;
    let scales = instance.scales.filter(|scales| scales.leaves == leaves);
    let (active, window) =
        if scales.is_some() { (instance.active.floor(), 1.0) } else { (instance.active, instance.window) };
    let transition = Transition::new(f64::from(active), window, leaves);
    let (active_count, fraction, window) = transition.parts();
    let drawn = transition.drawn();
    Some(InstanceRecord {
        clip_from_local: clip_from_local.to_cols_array_2d(),
        eye_local: eye_local.to_array(),
        fraction,
        sun_local: turned(TOWARDS_SUN.as_dvec3()),
        active_count,
        up_local: turned(DVec3::Y),
        index_end: drawn.checked_sub(1).map_or(0, |last| model.index_ends[last as usize]),
        first_partial: transition.first_partial(),
        window,
        drawn,
        first_scale: scales.map_or(NO_SCALES, |scales| scales.first),
    })
}
