//! Live impostors on the GPU: textures that frames are uploaded to as threads make them.

use super::{
    frame_thread::FrameThread,
    impostor_buffers::{ImpostorBuffers, check_layers},
    layer::Buffers,
};
use crate::{
    Result,
    draw::{
        facts::{Facts, ModelFacts},
        instance::ModelId,
        live::Needed,
        records::CrownRecord,
    },
    model::{FoliageModel, Framing},
    software::{LiveImpostors, framing},
};
use slotmap::SecondaryMap;

/// Impostors that are made while plants are drawn.
pub(super) struct Live {
    options: LiveImpostors,
    models: SecondaryMap<ModelId, Source>,
}

/// Where the frames of one model come from.
struct Source {
    thread: FrameThread,
    framing: Framing,
    crown: CrownRecord,
}

/// Where frames are uploaded.
pub(super) struct Upload<'a> {
    pub(super) device: &'a wgpu::Device,
    pub(super) queue: &'a wgpu::Queue,
    pub(super) layout: &'a wgpu::BindGroupLayout,
    pub(super) facts: &'a mut Facts,
    pub(super) models: &'a mut Buffers,
}

impl Live {
    /// # Errors
    /// As [`LiveImpostors::check`].
    pub(super) fn new(options: LiveImpostors) -> Result<Self> {
        options.check()?;
        Ok(Self { options, models: SecondaryMap::new() })
    }

    /// What the impostor of a model will show; `None` for a plant without extent.
    ///
    /// # Errors
    /// [`Error::TooLarge`](crate::Error::TooLarge) if the device allows fewer texture layers than
    /// it will have frames.
    pub(super) fn framing(&self, device: &wgpu::Device, model: &FoliageModel) -> Result<Option<Framing>> {
        if model.sphere().radius.is_nan() || model.sphere().radius <= 0.0 {
            return Ok(None);
        }
        let framing = framing(model, &self.options.bake)?;
        check_layers(device, &framing)?;
        Ok(Some(framing))
    }

    /// Adds a model with this [`framing`](Self::framing).
    pub(super) fn insert(&mut self, id: ModelId, model: &FoliageModel, framing: Framing, crown: CrownRecord) {
        let thread = FrameThread::new(model, self.options.bake);
        self.models.insert(id, Source { thread, framing, crown });
    }

    pub(super) fn remove(&mut self, id: ModelId) {
        self.models.remove(id);
    }

    /// Uploads frames that are made, as many as the options allow, and returns how many.
    ///
    /// # Errors
    /// Those of making a frame.
    pub(super) fn upload(&mut self, to: &mut Upload<'_>) -> Result<u32> {
        let mut made = 0;
        for (id, source) in &self.models {
            if let Some(live) = to.facts.get_mut(id).and_then(|facts| facts.live.as_mut()) {
                live.advance(false);
            }
            while made < self.options.frames_at_once && source.upload(id, to, false)? {
                made += 1;
            }
        }
        Ok(made)
    }

    /// Makes all frames that are missing of the last picture, waits for them, and shows all frames
    /// wholly. Returns how many were uploaded.
    ///
    /// # Errors
    /// Those of making a frame.
    pub(super) fn finish(&mut self, needed: &[&Needed], to: &mut Upload<'_>) -> Result<u32> {
        let mut made = 0;
        for (id, source) in &mut self.models {
            let missing = to.facts.get(id).and_then(|facts| facts.live.as_ref());
            source.thread.ask(&missing.map_or_else(Vec::new, |live| Needed::missing(needed, id, live)))?;
            while source.upload(id, to, true)? {
                made += 1;
            }
            if let Some(live) = to.facts.get_mut(id).and_then(|facts| facts.live.as_mut()) {
                live.advance(true);
            }
        }
        Ok(made)
    }

    /// Asks for the frames that the plants of a picture wait for.
    ///
    /// # Errors
    /// [`Error::Gpu`](crate::Error::Gpu) if no thread can be started.
    pub(super) fn ask(&mut self, facts: &Facts, needed: &[&Needed]) -> Result<u32> {
        let mut pending = 0;
        for (id, source) in &mut self.models {
            let Some(live) = facts.get(id).and_then(|facts| facts.live.as_ref()) else { continue };
            let mut missing = Needed::missing(needed, id, live);
            pending += missing.len() as u32;
            if missing.is_empty() && self.options.ahead {
                missing = Needed::beside(needed, id, live);
            }
            source.thread.ask(&missing)?;
        }
        Ok(pending)
    }

    /// Number of frames of all models that are made, and of those that are not wholly shown.
    pub(super) fn frames(&self, facts: &Facts) -> [u32; 2] {
        let of_model = |id| facts.get(id).and_then(|facts| facts.live.as_ref());
        let counts = self.models.keys().filter_map(of_model).map(|live| [live.made(), live.appearing()]);
        counts.fold([0; 2], |sum, of| [0, 1].map(|i| sum[i] + of[i]))
    }
}

impl Source {
    /// Uploads one frame, if there is one.
    fn upload(&self, id: ModelId, to: &mut Upload<'_>, waits: bool) -> Result<bool> {
        let Some((frame, pages)) = self.thread.take(waits)? else { return Ok(false) };
        let Some((buffers, facts)) = to.models.get_mut(id).zip(to.facts.get_mut(id)) else { return Ok(false) };
        let ModelFacts { live, center, .. } = facts;
        let impostor = buffers
            .impostor
            .get_or_insert_with(|| ImpostorBuffers::new(to.device, to.layout, &self.framing, &self.crown, *center));
        impostor.write(to.queue, frame, &pages);
        live.iter_mut().for_each(|live| live.add(frame));
        Ok(true)
    }
}
