//! Draws any number of instances of a few models into the caller's render pass.
//!
//! ```text
//! new(device, target, look)    add_model(model)   once
//! prepare(frame, instances)    each frame: uploads 80 bytes per instance, 8 bytes per leaf run
//! render_before(encoder)       each frame with shadows: the shadow map
//! render(pass)                 each frame: a few draw calls per model
//! render_motion(pass)          each frame with motion vectors: as many draw calls again
//! ```
//!
//! Every instance has its own active count, with a fraction, and no state: the vertex shader reads
//! the drawn scales from the model's timeline. A plant that keeps its drawn scales itself
//! ([`Swap`]) can upload them instead ([`FoliageRenderer::add_scales`]).
//!
//! A pipeline is compiled when a frame first needs its combination of effects. Effect buffers exist
//! only for the effects that the [`Look`] enables. [`Prepared::effects`] counts how often each
//! effect was simulated.
//!
//! Limits: plants are not sorted by depth; blended materials are drawn as masked; lighting is
//! slightly wrong under non-uniform scaling.

use super::{
    bindings::{card_layout, impostor_layout, layouts, map_layout, sampler, sliding_layout},
    buffers::{buffer, grow},
    device::check_device,
    diagnostics::Diagnostics,
    effect_buffers::EffectBuffers,
    ground_pass::GroundPass,
    impostor_buffers::{ImpostorBuffers, check_layers},
    landscape_motion::LandscapeMotion,
    landscape_pass::LandscapePass,
    layer::{Buffers, Layer},
    live::{self, Live},
    model_buffers::ModelBuffers,
    pipeline::{Target, TargetFormat},
    plant_pass::Part,
    shadow_pass::ShadowPass,
};
use crate::{
    Depth, Error, Result,
    draw::{
        cards::PackedCards,
        eye::Eye,
        facts::{Facts, ModelFacts},
        instance::{Frame, Instance, LiveCounts, ModelId, Prepared, ScalesId},
        limb_texels::limb_texels,
        live::Needed,
        look::{Coloring, Look},
        packed::Packed,
        pages::Pages,
        records::bindings,
        upload::Upload,
        wood::limbs_of,
    },
    effects::Effects,
    error::check_range,
    extract::Swap,
    model::FoliageModel,
    software::{LiveImpostors, mean_leaf_color},
    terrain::Terrain,
};
use glam::DMat4;
use range_alloc::RangeAllocator;
use std::{ops::Range, sync::Arc};

/// Draws instances of foliage models with wgpu, into the caller's render passes.
///
/// One renderer draws into one kind of target with one [`Look`], on the device that it was created
/// with.
pub struct FoliageRenderer {
    picture: Layer,
    shadow: Option<ShadowPass>,
    landscape: Option<LandscapePass>,
    motion: Option<Layer>,
    landscape_motion: Option<LandscapeMotion>,
    /// Present if there is ground with heights.
    ground: Option<GroundPass>,
    /// Of a model, of wood that slides, and of cards of clusters.
    model_layouts: [wgpu::BindGroupLayout; 3],
    /// Present if the look hands plants over to impostors.
    impostor_layout: Option<wgpu::BindGroupLayout>,
    /// Present if impostors are made while plants are drawn.
    live: Option<Live>,
    sampler: wgpu::Sampler,
    facts: Facts,
    models: Buffers,
    scales: wgpu::Buffer,
    /// Free and used ranges of `scales`, in leaves (4 bytes each).
    ranges: RangeAllocator<u32>,
}

impl FoliageRenderer {
    /// Creates a renderer for one kind of target. A look with a sky or a ground covers the whole
    /// target; without them, draw your own backdrop first.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device allows fewer than 8 storage buffers per shader stage (as WebGL2
    /// does) or fewer than 3 bind groups; [`Error::InvalidOption`] if `target.samples` is not 1 to
    /// 16, `look` has a value outside its range or the shadow map is larger than the device's
    /// largest texture.
    pub fn new(device: &wgpu::Device, target: TargetFormat, look: Look) -> Result<Self> {
        check_device(device, target.samples)?;
        look.check()?;
        let layouts = layouts(device, &look);
        let widest = device.limits().max_texture_dimension_2d;
        if let Some(shadow) = look.effects.shadow {
            check_range("effects.shadow.resolution", shadow.resolution, 0..=widest)?;
        }
        let shadow = look.effects.shadow.map(|effect| ShadowPass::new(device, &look, effect, &layouts));
        let map = shadow.as_ref().map(ShadowPass::map);
        let map_layout = map.map(|_| map_layout(device));
        let scales = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        Ok(Self {
            landscape: look.landscape().map(|_| LandscapePass::new(device, target, &look, map_layout.as_ref())),
            model_layouts: [layouts[0].clone(), sliding_layout(device, &look), card_layout(device, &look)],
            impostor_layout: look.far.map(|_| impostor_layout(device)),
            live: None,
            picture: Layer::new(device, Target::Picture(target), look, layouts, map),
            shadow,
            motion: None,
            landscape_motion: None,
            ground: None,
            sampler: sampler(device),
            facts: Facts::default(),
            models: Buffers::default(),
            scales: buffer(device, "foliage scales", scales, size_of::<f32>() as u64),
            ranges: RangeAllocator::new(0..0),
        })
    }

    /// Enables motion vectors ([`render_motion`](Self::render_motion)) into targets of this kind: a
    /// two-channel colour format (`Rg16Float`, `Rg32Float`) and one sample per pixel.
    pub fn with_motion(mut self, device: &wgpu::Device, target: TargetFormat) -> Self {
        let Look { effects, wood_error_px, far, .. } = self.picture.look;
        let effects = Effects { wind: effects.wind, fade: effects.fade, ..Effects::default() };
        let look = Look { effects, wood_error_px, far, tone: false, ..Look::default() };
        self.landscape_motion =
            self.picture.look.landscape().map(|landscape| LandscapeMotion::new(device, target, &landscape));
        self.motion = Some(Layer::new(device, Target::Motion(target), look, layouts(device, &look), None));
        self
    }

    /// Makes impostors for the models without one that are added from now on, if the look hands
    /// plants over: a thread makes the frames of a model when plants first need them, and a plant
    /// keeps its leaves until those that it needs are there. [`Prepared::live`] counts them. Each
    /// such model is copied, and its frames are as large as those of a baked impostor.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a size out of its range.
    pub fn with_live_impostors(mut self, live: LiveImpostors) -> Result<Self> {
        self.live = self.picture.look.far.map(|_| Live::new(live)).transpose()?;
        Ok(self)
    }

    /// Draws ground with heights from now on, which casts and receives shadows; `None` draws only
    /// what the look says.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if the look has no ground; [`Error::TooLarge`] for pictures that
    /// exceed the device's limits.
    pub fn set_terrain(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        terrain: Option<Arc<Terrain>>,
    ) -> Result<()> {
        self.look().check_terrain(terrain.is_some())?;
        self.ground = terrain.map(|terrain| GroundPass::new(device, queue, terrain)).transpose()?;
        Ok(())
    }

    /// Changes the colouring of leaves. The next [`prepare`](Self::prepare) recompiles the leaf
    /// pipelines.
    pub fn set_coloring(&mut self, coloring: Coloring) {
        self.picture.look.coloring = coloring;
        self.picture.forget_colored();
    }

    /// Appearance of the plants.
    pub fn look(&self) -> &Look {
        &self.picture.look
    }

    /// Value to which the depth buffer must be cleared for the prepared frame; 0 before the first
    /// one.
    pub fn depth_clear_value(&self) -> f32 {
        self.picture.depth.clear_value()
    }

    /// Lists the pipelines and buffers created so far.
    pub fn diagnostics(&self) -> Diagnostics {
        let shadow = self.shadow.iter().map(|_| "shadow map");
        let motion = self.motion.iter().map(|_| "motion vectors");
        let ground = self.ground.iter().map(|_| "ground");
        let effects = self.picture.effects.as_ref();
        let bounds = self.ranges.initial_range();
        Diagnostics {
            models: self.models.len(),
            model_bytes: self
                .models
                .values()
                .map(ModelBuffers::bytes)
                .fold([0; 2], |sum, of| [0, 1].map(|i| sum[i] + of[i])),
            limb_bytes: self.models.values().map(|model| model.limb_bytes).sum(),
            impostor_bytes: self.models.values().map(ModelBuffers::impostor_bytes).sum(),
            live_frames: self.live_frames()[0],
            impostor_pipelines: [true, false]
                .map(|is_deep| self.picture.compiled(Part::Impostor { is_deep }).len())
                .into_iter()
                .sum(),
            leaf_variants: self.picture.compiled(Part::Leaves),
            wood_variants: self.picture.compiled_wood(),
            passes: shadow.chain(self.landscape.iter().map(|_| "landscape")).chain(ground).chain(motion).collect(),
            effect_buffers: effects.map_or_else(Vec::new, EffectBuffers::labels),
            effect_bytes: effects.map_or(0, EffectBuffers::bytes),
            scales: [self.ranges.allocated_ranges().map(|range| range.len() as u32).sum(), bounds.len() as u32],
        }
    }

    /// Uploads a model.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] if the model violates an invariant, [`Error::TooLarge`] if it
    /// exceeds the device's limits, [`Error::Unreadable`] for a damaged texture.
    pub fn add_model(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, model: &FoliageModel) -> Result<ModelId> {
        model.validate()?;
        let look = self.look();
        let mean = if look.tones(&model.growth) { mean_leaf_color(model, &look.lighting())? } else { [0.0; 3] };
        let mut upload = Upload::sliding(model);
        upload.crown.mean = mean;
        upload.hide_behind_cards(model);
        let limbs = limbs_of(model, look, model.sphere().center());
        let facts = ModelFacts::new(model, &upload, mean).with_limbs(limbs.as_ref());
        let limbs = look.effects.wind.map(|_| limb_texels(limbs.as_ref()));
        let packed = Packed { limbs, cards: PackedCards::new(model), ..Packed::new(upload) };
        let mut buffers = ModelBuffers::new(device, queue, &self.model_layouts, &self.sampler, model, &packed)?;
        if let (Some(layout), Some(impostor)) = (&self.impostor_layout, &model.impostor) {
            let (framing, center) = (impostor.framing(), model.sphere().center());
            check_layers(device, &framing)?;
            let created = ImpostorBuffers::new(device, layout, &framing, &packed.crown, center);
            created.write(queue, 0, &Pages::new(impostor));
            buffers.impostor = Some(created);
        }
        let live = self.live.as_mut().filter(|_| model.impostor.is_none());
        let framing = live.as_ref().map_or(Ok(None), |live| live.framing(device, model))?;
        let id = self.facts.insert(match &framing {
            Some(framing) => facts.with_live(framing),
            None => facts,
        });
        if let Some((live, framing)) = live.zip(framing) {
            live.insert(id, model, framing, packed.crown);
        }
        self.models.insert(id, buffers);
        Ok(id)
    }

    /// Removes a model; its buffers and textures are freed once the GPU has drawn the submitted
    /// frames. Instances of it are skipped from now on. Returns false if this renderer does not
    /// have the model.
    pub fn remove_model(&mut self, id: ModelId) -> bool {
        self.models.remove(id);
        self.live.iter_mut().for_each(|live| live.remove(id));
        self.facts.remove(id).is_some()
    }

    /// Allocates a range for the drawn scales of one plant and uploads them.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if the scales of all plants together exceed the device's storage buffer
    /// limit.
    pub fn add_scales(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, swap: &Swap) -> Result<ScalesId> {
        let leaves = swap.leaves().max(1);
        let range = match self.ranges.allocate_range(leaves) {
            Ok(range) => range,
            Err(_) => {
                self.grow_scales(device, queue, leaves)?;
                let what = "number of drawn scales".to_owned();
                self.ranges
                    .allocate_range(leaves)
                    .map_err(|_| scales_too_large(what, leaves.into(), u32::MAX.into()))?
            }
        };
        let id = ScalesId { first: range.start, leaves: swap.leaves() };
        self.upload_scales(queue, id, swap, std::slice::from_ref(&(0..id.leaves)));
        Ok(id)
    }

    /// Grows the buffer by at least `more` scales. Existing scales are copied.
    fn grow_scales(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, more: u32) -> Result<()> {
        let room = self.ranges.initial_range().end;
        let bytes = 4 * (u64::from(room) + u64::from(more));
        let limit = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        if bytes > limit {
            return Err(scales_too_large("size in bytes of drawn scales".into(), bytes, limit));
        }
        let old = self.scales.clone();
        if grow(device, &mut self.scales, bytes) {
            let mut encoder = device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&old, 0, &self.scales, 0, 4 * u64::from(room));
            queue.submit([encoder.finish()]);
            self.picture.forget_bindings();
            self.motion.iter_mut().for_each(Layer::forget_bindings);
            self.shadow.iter_mut().for_each(ShadowPass::forget_bindings);
        }
        self.ranges.grow_to((self.scales.size() / 4).min(u64::from(u32::MAX)) as u32);
        Ok(())
    }

    /// Frees the range of a plant's drawn scales for reuse by other plants. Do not draw with `id`
    /// afterwards.
    pub fn remove_scales(&mut self, id: ScalesId) {
        let range = id.first..id.first + id.leaves.max(1);
        if self.ranges.allocated_ranges().any(|used| used.start <= range.start && range.end <= used.end) {
            self.ranges.free_range(range);
        }
    }

    /// Uploads the scales of the leaf ranges in `changed`, as returned by [`Swap::set_active`].
    pub fn upload_scales(&self, queue: &wgpu::Queue, id: ScalesId, swap: &Swap, changed: &[Range<u32>]) {
        for range in changed {
            if let Some(scales) = swap.scales().get(range.start as usize..range.end.min(id.leaves) as usize) {
                let offset = 4 * u64::from(id.first + range.start);
                queue.write_buffer(&self.scales, offset, bytemuck::cast_slice(scales));
            }
        }
    }

    /// Builds the draw lists and uploads the instances that the next [`render`](Self::render)
    /// draws; the same instances cast shadows. Allocates no memory once the lists have grown. A
    /// [`Camera`](crate::Camera) alone is a frame at time 0.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if the plants exceed the device's buffer limits;
    /// [`Error::InvalidOption`] if the camera's depth convention differs from that of its matrix,
    /// or if the camera is orthographic and the look has a sky or a ground. After an error,
    /// [`render`](Self::render) draws no plants.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: impl Into<Frame>,
        instances: &[Instance],
    ) -> Result<Prepared> {
        self.prepare_with_casters(device, queue, frame, instances, instances)
    }

    /// Same as [`prepare`](Self::prepare), but `casters` cast the shadows: all plants of the scene,
    /// including plants outside the view frustum.
    ///
    /// # Errors
    /// Same as [`prepare`](Self::prepare).
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
        frame.camera.check()?;
        let made = self.with_live(device, queue, |live, _, to| live.upload(to))?;
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
            pass.upload(queue, &landscape, frame, light_from_eye.as_mat4())?;
        }
        if let (Some(pass), Some(landscape)) = (&self.landscape_motion, self.picture.look.landscape()) {
            pass.upload(queue, &landscape, frame)?;
        }
        if let Some(layer) = &mut self.motion {
            layer.prepare(device, queue, &self.facts, &Eye::of_motion(frame), instances, &self.scales)?;
        }
        let mut prepared = self.picture.prepare(device, queue, &self.facts, &eye, instances, &self.scales)?;
        if let (Some(ground), Some(landscape)) = (&mut self.ground, &self.landscape) {
            let layers = [Some(&self.picture), self.motion.as_ref()];
            let shadow = self.shadow.as_ref().map(|_| (Target::Shadow, Depth::Standard));
            let targets = layers.into_iter().flatten().map(|layer| (layer.target, layer.depth)).chain(shadow);
            prepared.ground = ground.prepare(device, queue, frame, &self.picture.look, landscape, targets);
        }
        prepared.effects.shadow = shadow;
        let pending = self.with_live(device, queue, |live, needed, to| live.ask(to.facts, needed))?;
        prepared.live = LiveCounts { made, pending, appearing: self.live_frames()[1] };
        Ok(prepared)
    }

    /// Makes all frames of live impostors that a frame needs, waits for them, and returns how many
    /// were added: for single pictures, before their [`prepare`](Self::prepare). Does nothing
    /// unless [`with_live_impostors`](Self::with_live_impostors) has enabled them.
    ///
    /// # Errors
    /// Same as [`prepare`](Self::prepare); errors of making a frame.
    pub fn warm(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: impl Into<Frame>,
        instances: &[Instance],
        casters: &[Instance],
    ) -> Result<u32> {
        let (frame, mut made) = (frame.into(), 0);
        while self.live.is_some() {
            let LiveCounts { made: added, pending, .. } =
                self.prepare_with_casters(device, queue, frame, instances, casters)?.live;
            made += added + self.with_live(device, queue, |live, needed, to| live.finish(needed, to))?;
            if pending == 0 {
                break;
            }
        }
        Ok(made)
    }

    fn live_frames(&self) -> [u32; 2] {
        self.live.as_ref().map_or([0; 2], |live| live.frames(&self.facts))
    }

    /// Calls `work` with the live impostors, what the last frame needs, and where frames go.
    fn with_live(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        work: impl FnOnce(&mut Live, &[&Needed], &mut live::Upload<'_>) -> Result<u32>,
    ) -> Result<u32> {
        let Some((live, layout)) = self.live.as_mut().zip(self.impostor_layout.as_ref()) else { return Ok(0) };
        let needed = self.shadow.iter().map(ShadowPass::needed).chain([self.picture.needed()]).collect::<Vec<_>>();
        let (facts, models) = (&mut self.facts, &mut self.models);
        work(live, &needed, &mut live::Upload { device, queue, layout, facts, models })
    }

    /// Draws the shadow map, if the look has shadows. Call it before beginning the render pass of
    /// [`render`](Self::render).
    pub fn render_before(&self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(shadow) = &self.shadow {
            shadow.render(encoder, &self.models, |pass| self.render_ground(pass, Target::Shadow, Depth::Standard));
        }
    }

    /// Draws the prepared frame. The pass must have the formats and sample count of the renderer's
    /// target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(landscape) = &self.landscape {
            if let Some(effects) = self.picture.effects.as_ref().filter(|_| self.shadow.is_some()) {
                pass.set_bind_group(bindings::EFFECTS, effects.map_bindings(), &[]);
            }
            landscape.render(pass);
        }
        self.render_ground(pass, self.picture.target, self.picture.depth);
        self.picture.render(pass, &self.models);
    }

    fn render_ground(&self, pass: &mut wgpu::RenderPass<'_>, target: Target, depth: Depth) {
        if let (Some(ground), Some(landscape)) = (&self.ground, &self.landscape) {
            ground.render(pass, target, depth, landscape);
        }
    }

    /// Draws motion vectors of the prepared frame, if [`with_motion`](Self::with_motion) has
    /// enabled them. A vector is the displacement of the visible point since the previous frame, to
    /// the right and down, as a fraction of the picture's width and height. The jitter of
    /// [`Frame::jitter_px`] is excluded. Clear the colour to 0, and the depth as for the picture.
    /// The growth of a leaf is not counted as motion. Sky and ground are included if the renderer
    /// draws them.
    pub fn render_motion(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(landscape) = &self.landscape_motion {
            landscape.render(pass);
        }
        if let Some(layer) = &self.motion {
            self.render_ground(pass, layer.target, layer.depth);
            layer.render(pass, &self.models);
        }
    }
}

/// Creates an [`Error::TooLarge`] about drawn scales.
fn scales_too_large(what: String, value: u64, limit: u64) -> Error {
    Error::TooLarge { what, value, limit, fix: "draw some plants with scales from the timeline".into() }
}
