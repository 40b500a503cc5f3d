//! Shadow pass: draws a shadow map of the sun before each picture.
//!
//! The map covers everything that the camera sees up to the effect's distance. Plants whose shadow
//! can fall on what it sees there are drawn with a share of their leaves; all others are skipped.
//! The map moves by whole texels, so that the shadows of static plants do not shimmer.
//!
//! Limits: one map, with no shadows beyond it; no shadow is finer than a texel.

use super::{
    bindings::layouts,
    layer::{Buffers, Layer},
    pipeline::Target,
    shadow_map::ShadowMap,
};
use crate::{
    Depth, Result,
    bounds::largest_scale,
    draw::{
        eye::Eye,
        facts::Facts,
        instance::{Frame, Instance},
        live::Needed,
        look::Look,
        sun::SunView,
    },
    effects::{Count, Effects, Shadow, Wind},
};
use glam::{DMat4, DVec3};

/// Error of the wood in texels of the map, over that in pixels of the picture: the edges of shadows
/// are softer than those of the wood.
const WOOD_ERROR: f32 = 2.0;

/// The shadow map, and the layer that draws it.
pub(super) struct ShadowPass {
    effect: Shadow,
    wind: Option<Wind>,
    towards_sun: DVec3,
    map: ShadowMap,
    layer: Layer,
    casters: Vec<Instance>,
}

impl ShadowPass {
    /// Creates the pass. `picture` holds the layouts of the picture's layer; the first two, of
    /// models and frames, are shared.
    pub(super) fn new(device: &wgpu::Device, look: &Look, effect: Shadow, picture: &[wgpu::BindGroupLayout]) -> Self {
        let effects = Effects { wind: look.effects.wind, ..Effects::default() };
        let towards_sun = look.lighting.towards_sun.as_dvec3();
        let wood_error_px = WOOD_ERROR * look.wood_error_px;
        let look = Look { effects, far: look.far, wood_error_px, tone: false, ..Look::default() };
        let of_effects = layouts(device, &look).into_iter().skip(2);
        let layouts = picture[..2].iter().cloned().chain(of_effects).collect();
        let map = ShadowMap::new(device, effect.resolution);
        Self {
            effect,
            wind: effects.wind,
            towards_sun,
            map,
            layer: Layer::new(device, Target::Shadow, look, layouts, None),
            casters: Vec::new(),
        }
    }

    /// The shadow map, for passes that sample it.
    pub(super) fn map(&self) -> &ShadowMap {
        &self.map
    }

    /// Prepares the plants that cast shadows. Returns the transform from world space to the sun's
    /// clip space, and the numbers of plants that cast shadows and that were skipped.
    ///
    /// # Errors
    /// Same as [`Layer::prepare`].
    pub(super) fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        models: &Facts,
        frame: &Frame,
        plants: &[Instance],
        scales: &wgpu::Buffer,
    ) -> Result<(DMat4, Count)> {
        let sun = SunView::new(frame, self.towards_sun, &self.effect);
        self.casters.clear();
        let mut count = Count::default();
        for plant in plants {
            let Some(model) = models.get(plant.model) else { continue };
            let (center, reach) = model.placed(plant);
            let leaf_reach = model.leaf_reaches[(plant.active as usize).min(model.leaves as usize)] * plant.leaf_scale;
            let swayed = self.wind.map_or(0.0, |wind| wind.reach(&model.shape, leaf_reach));
            let radius = reach + f64::from(swayed) * largest_scale(&plant.world_from_plant);
            let casts = sun.is_reached_by(center, radius);
            count.add(casts);
            if casts {
                let active = (plant.active * self.effect.lod).ceil().min(plant.active);
                self.casters.push(Instance { active, scales: None, window: 1.0, ..*plant });
            }
        }
        let eye = Eye::of_sun(frame, sun.camera);
        self.layer.prepare(device, queue, models, &eye, &self.casters, scales)?;
        Ok((sun.camera.clip_from_world, count))
    }

    /// Frames of live impostors that the prepared casters need.
    pub(super) fn needed(&self) -> &Needed {
        self.layer.needed()
    }

    /// Empties the draw lists, so that nothing casts shadows.
    pub(super) fn clear(&mut self) {
        self.layer.clear();
    }

    /// Drops the bind group, because the scale buffer was replaced.
    pub(super) fn forget_bindings(&mut self) {
        self.layer.forget_bindings();
    }

    /// Draws the map: plants, and what `others` draws.
    pub(super) fn render(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        models: &Buffers,
        others: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow map"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: self.map.view(),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(Depth::Standard.clear_value()),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        others(&mut pass);
        self.layer.render(&mut pass, models);
    }
}
