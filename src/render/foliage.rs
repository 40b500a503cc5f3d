//! Draws any number of plants of a few models into the caller's render pass.
//!
//! ```text
//! new(device, queue, target, look)  add_model(model)        once
//! prepare(frame, instances)                                 each frame: uploads 144 bytes a plant and 8 a run of its leaves
//! render_before(encoder)                                    each frame with shadows: the shadow map
//! render(pass)                                              each frame: a few draws a model
//! render_motion(pass)                                       each frame with motion vectors: as many again
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
    frame_list::{Eye, ModelFacts},
    landscape_motion::LandscapeMotion,
    landscape_pass::LandscapePass,
    layer::Layer,
    look::{Look, Variant},
    model_buffers::ModelBuffers,
    shadow_pass::ShadowPass,
    software::mean_leaf_color,
    stems::Stems,
    surface::{Coloring, Target, TargetFormat, layouts, map_layout},
};
use crate::{
    Error, Result,
    effects::{Counts, Effects},
    extract::Swap,
    model::FoliageModel,
};
use glam::{DAffine3, DMat4};
use std::ops::Range;

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
    /// How far plants are shifted to the right and down, in pixels: for antialiasing over several frames. What lies behind
    /// them is not shifted.
    pub jitter_px: [f64; 2],
    /// Camera and time of the frame before, from which motion vectors are told; `None` where there is none.
    pub before: Option<(Camera, f64)>,
}

impl Frame {
    /// The frame at time 0.
    pub fn new(camera: &Camera, height_px: u32) -> Self {
        Self { camera: *camera, height_px, seconds: 0.0, jitter_px: [0.0; 2], before: None }
    }

    /// The same at another time.
    pub fn at(self, seconds: f64) -> Self {
        Self { seconds, ..self }
    }

    /// The same as the one that follows `before`.
    pub fn after(self, before: &Self) -> Self {
        Self { before: Some((before.camera, before.seconds)), ..self }
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
    /// Where it stood in the frame before, for motion vectors; `None` for a plant that stays in its place.
    pub before: Option<DAffine3>,
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
        Self { model, world_from_plant, before: None, active, window: 1.0, leaf_scale: 1.0, scales: None }
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
    picture: Layer,
    shadow: Option<ShadowPass>,
    landscape: Option<LandscapePass>,
    motion: Option<Layer>,
    landscape_motion: Option<LandscapeMotion>,
    model_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    models: Vec<ModelBuffers>,
    facts: Vec<ModelFacts>,
    scales: wgpu::Buffer,
    scales_used: u32,
}

impl FoliageRenderer {
    /// Draws plants as they are into one kind of target.
    pub fn new(device: &wgpu::Device, target: TargetFormat) -> Self {
        Self::with_look(device, target, Look::default())
    }

    /// Draws plants with effects, or lit in another way. Where the look has a sky or a ground, they take the place of what
    /// lies behind the plants.
    pub fn with_look(device: &wgpu::Device, target: TargetFormat, look: Look) -> Self {
        let layouts = layouts(device, &look.effects);
        let shadow = look.effects.shadow.map(|effect| ShadowPass::new(device, &look, effect, &layouts));
        let map = shadow.as_ref().map(ShadowPass::map);
        let map_layout = map.map(|_| map_layout(device));
        let scales = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        Self {
            landscape: look.landscape().map(|_| LandscapePass::new(device, target, &look, map_layout.as_ref())),
            model_layout: layouts[0].clone(),
            picture: Layer::new(device, Target::Picture(target), look, layouts, map),
            shadow,
            motion: None,
            landscape_motion: None,
            sampler: sampler(device),
            models: Vec::new(),
            facts: Vec::new(),
            scales: buffer(device, "foliage scales", scales, size_of::<f32>() as u64),
            scales_used: 0,
        }
    }

    /// Also draws motion vectors ([`render_motion`](Self::render_motion)), into targets of this kind: colour of two numbers
    /// a pixel (`Rg16Float`, `Rg32Float`), one sample.
    pub fn with_motion(mut self, device: &wgpu::Device, target: TargetFormat) -> Self {
        let Look { effects, thinnest_px, .. } = self.picture.look;
        let effects = Effects { wind: effects.wind, fade: effects.fade, ..Effects::default() };
        let look = Look { effects, thinnest_px, ..Look::default() };
        self.landscape_motion =
            self.picture.look.landscape().map(|landscape| LandscapeMotion::new(device, target, &landscape));
        self.motion = Some(Layer::new(device, Target::Motion(target), look, layouts(device, &effects), None));
        self
    }

    /// Colours leaves in another way from the next [`prepare`](Self::prepare) on, which compiles the passes anew.
    pub fn set_coloring(&mut self, coloring: Coloring) {
        self.picture.look.coloring = coloring;
        self.picture.forget_leaves();
    }

    /// What plants look like.
    pub fn look(&self) -> &Look {
        &self.picture.look
    }

    /// Variants for which pipelines of the picture exist: of the leaves' pass, and of the wood's.
    pub fn compiled(&self) -> [Vec<Variant>; 2] {
        self.picture.compiled()
    }

    /// Names of the passes besides leaves and wood.
    pub fn passes(&self) -> Vec<&'static str> {
        let shadow = self.shadow.iter().map(|_| "shadow map");
        let motion = self.motion.iter().map(|_| "motion vectors");
        shadow.chain(self.landscape.iter().map(|_| "landscape")).chain(motion).collect()
    }

    /// Labels of the buffers and textures that exist for effects.
    pub fn effect_buffers(&self) -> Vec<&'static str> {
        self.picture.effects.as_ref().map_or_else(Vec::new, EffectBuffers::labels)
    }

    /// Bytes of the buffers and textures that exist for effects.
    pub fn effect_bytes(&self) -> u64 {
        self.picture.effects.as_ref().map_or(0, EffectBuffers::bytes)
    }

    /// Uploads a model.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for one that breaks an invariant, [`Error::TooLarge`] for one beyond the device's limits,
    /// [`Error::Unreadable`] for a damaged texture.
    pub fn add_model(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, model: &FoliageModel) -> Result<ModelId> {
        model.validate()?;
        let look = self.look();
        let mean = match look.effects.contrast {
            Some(_) => mean_leaf_color(model, &look.lighting())?,
            None => [0.0; 3],
        };
        let stems = Stems::new(model);
        self.models.push(ModelBuffers::new(device, queue, &self.model_layout, &self.sampler, model, &stems)?);
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
            self.picture.forget_bindings();
            self.motion.iter_mut().for_each(Layer::forget_bindings);
            self.shadow.iter_mut().for_each(ShadowPass::forget_bindings);
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

    /// Takes in what the next [`render`](Self::render) draws. Allocates nothing once the lists have grown. What is drawn
    /// casts the shadows.
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
        self.prepare_with_casters(device, queue, frame, instances, instances)
    }

    /// As [`prepare`](Self::prepare), with plants that cast shadows whether they are drawn or not: those of the whole scene.
    ///
    /// # Errors
    /// Those of [`prepare`](Self::prepare).
    pub fn prepare_with_casters(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: impl Into<Frame>,
        instances: &[Instance],
        casters: &[Instance],
    ) -> Result<Prepared> {
        let listed = self.list(device, queue, &frame.into(), instances, casters);
        if listed.is_err() {
            self.picture.clear();
            self.motion.iter_mut().for_each(Layer::clear);
            self.shadow.iter_mut().for_each(ShadowPass::clear);
        }
        listed
    }

    fn list(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        instances: &[Instance],
        casters: &[Instance],
    ) -> Result<Prepared> {
        let mut eye = Eye::new(frame);
        let mut shadow = None;
        if let Some(pass) = &mut self.shadow {
            let (light_from_world, count) = pass.prepare(device, queue, &self.facts, frame, casters, &self.scales)?;
            eye.light_from_world = Some(light_from_world);
            shadow = Some(count);
        }
        if let (Some(pass), Some(landscape)) = (&self.landscape, self.picture.look.landscape()) {
            let to_eye = DMat4::from_translation(frame.camera.eye);
            let light_from_eye = eye.light_from_world.map_or(DMat4::IDENTITY, |light| light * to_eye);
            pass.upload(queue, &landscape, frame, light_from_eye.as_mat4());
        }
        if let (Some(pass), Some(landscape)) = (&self.landscape_motion, self.picture.look.landscape()) {
            pass.upload(queue, &landscape, frame);
        }
        if let Some(layer) = &mut self.motion {
            layer.prepare(device, queue, &self.facts, &Eye::of_motion(frame), instances, &self.scales)?;
        }
        let mut prepared = self.picture.prepare(device, queue, &self.facts, &eye, instances, &self.scales)?;
        prepared.effects.shadow = shadow;
        Ok(prepared)
    }

    /// Draws what the picture's passes need: the shadow map. Before the pass that [`render`](Self::render) draws into.
    pub fn render_before(&self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(shadow) = &self.shadow {
            shadow.render(encoder, &self.models);
        }
    }

    /// Draws what was prepared. The pass must have the formats and samples of the renderer's target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(landscape) = &self.landscape {
            if let Some(effects) = self.picture.effects.as_ref().filter(|_| self.shadow.is_some()) {
                pass.set_bind_group(2, effects.map_bindings(), &[]);
            }
            landscape.render(pass);
        }
        self.picture.render(pass, &self.models);
    }

    /// Draws motion vectors of what was prepared, where the renderer was made with them
    /// ([`with_motion`](Self::with_motion)): how far what a pixel shows has moved since the frame before, as a share of the
    /// picture's width and height, to the right and down; the shift of [`Frame::jitter_px`] is no motion. Clear to 0,
    /// depth as for the picture. A leaf that grows does not move. Sky and ground are told where the renderer draws them.
    pub fn render_motion(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(landscape) = &self.landscape_motion {
            landscape.render(pass);
        }
        if let Some(layer) = &self.motion {
            layer.render(pass, &self.models);
        }
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
