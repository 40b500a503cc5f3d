//! Impostors whose frames are made while plants are drawn: which frames a model has, and which ones
//! the plants of a picture wait for.
//!
//! A plant keeps its leaves until all frames are there that its sprite blends. The sprite then
//! appears over some pictures, so that nothing pops: the less a frame weighs, the less its age
//! counts, so a sprite that turns towards a frame made just before stays whole.

use super::instance::ModelId;
use crate::model::Lattice;
use glam::Vec3;
use slotmap::SecondaryMap;

/// Pictures over which a sprite appears once its frames are made.
const APPEARS_OVER: u8 = 16;

/// Frames of one model's impostor.
#[derive(Debug, Clone)]
pub(crate) struct LiveFrames {
    lattice: Lattice,
    /// For each frame the part of it that is shown, in [`APPEARS_OVER`]ths: 0 until it is made.
    shown: Vec<f32>,
    /// Whether all frames are wholly shown.
    is_whole: bool,
}

impl LiveFrames {
    /// No frame is made yet.
    pub(crate) fn new(lattice: Lattice) -> Self {
        Self { lattice, shown: vec![0.0; lattice.frames() as usize], is_whole: false }
    }

    /// Number of frames that are made.
    pub(crate) fn made(&self) -> u32 {
        self.shown.iter().filter(|&&shown| shown > 0.0).count() as u32
    }

    /// Number of frames that are made and not wholly shown.
    pub(crate) fn appearing(&self) -> u32 {
        self.shown.iter().filter(|&&shown| shown > 0.0 && shown < 1.0).count() as u32
    }

    /// Adds a frame that is made.
    pub(crate) fn add(&mut self, frame: u32) {
        self.shown[frame as usize] = self.shown[frame as usize].max(1.0 / f32::from(APPEARS_OVER));
    }

    /// Shows more of the frames, for the next picture; all of them if `at_once`.
    pub(crate) fn advance(&mut self, at_once: bool) {
        if self.is_whole {
            return;
        }
        let step = if at_once { 1.0 } else { 1.0 / f32::from(APPEARS_OVER) };
        self.shown.iter_mut().filter(|shown| **shown > 0.0).for_each(|shown| *shown = (*shown + step).min(1.0));
        self.is_whole = self.shown.iter().all(|&shown| shown >= 1.0);
    }

    /// Part that is shown of a sprite that blends these frames: none if one is missing.
    fn part(&self, blended: [(u32, f32); 3]) -> f32 {
        let parts = blended.map(|(frame, weight)| (self.shown[frame as usize], weight));
        if parts.iter().any(|&(shown, weight)| weight > 0.0 && shown == 0.0) {
            return 0.0;
        }
        1.0 - parts.iter().map(|(shown, weight)| (1.0 - shown) * weight).sum::<f32>()
    }
}

/// How much the plants of a picture weigh the frames of their models, made or not.
#[derive(Debug, Clone, Default)]
pub(crate) struct Needed(SecondaryMap<ModelId, Vec<f32>>);

impl Needed {
    pub(super) fn clear(&mut self) {
        self.0.values_mut().for_each(|weights| weights.fill(0.0));
    }

    /// Share of a plant that its impostor takes, of the share that it would take with all frames.
    /// `from_center` is the eye's position relative to the middle of the frames, in the plant's
    /// space, if there is one.
    pub(super) fn available(
        &mut self,
        share: f32,
        id: ModelId,
        live: Option<&LiveFrames>,
        from_center: impl FnOnce() -> Option<Vec3>,
    ) -> f32 {
        let Some(live) = live.filter(|live| share > 0.0 && !live.is_whole) else { return share };
        let Some(from_center) = from_center() else { return 0.0 };
        let blended = live.lattice.around(from_center);
        if let Some(entry) = self.0.entry(id) {
            let weights = entry.or_insert_with(|| vec![0.0; live.shown.len()]);
            blended.iter().for_each(|&(frame, weight)| weights[frame as usize] += weight);
        }
        share * live.part(blended)
    }

    /// Missing frames of a model that plants wait for, those first that matter most.
    pub(crate) fn missing(all: &[&Self], id: ModelId, live: &LiveFrames) -> Vec<u32> {
        let weights = Self::weights(all, id, live);
        let is_missing = |&(at, weight): &(usize, f32)| weight > 0.0 && live.shown[at] == 0.0;
        let mut missing: Vec<(usize, f32)> = weights.into_iter().enumerate().filter(is_missing).collect();
        missing.sort_by(|a, b| b.1.total_cmp(&a.1));
        missing.into_iter().map(|(frame, _)| frame as u32).collect()
    }

    /// Missing frames beside those that plants use.
    pub(crate) fn beside(all: &[&Self], id: ModelId, live: &LiveFrames) -> Vec<u32> {
        let weights = Self::weights(all, id, live);
        let across = live.lattice.across;
        let is_used = |frame: u32| {
            let [x, y] = [frame % across, frame / across];
            let near = |at: u32| at.saturating_sub(1)..=(at + 1).min(across - 1);
            near(y).any(|y| near(x).any(|x| weights[(y * across + x) as usize] > 0.0))
        };
        (0..live.lattice.frames()).filter(|&frame| live.shown[frame as usize] == 0.0 && is_used(frame)).collect()
    }

    fn weights(all: &[&Self], id: ModelId, live: &LiveFrames) -> Vec<f32> {
        let mut sums = vec![0.0; live.shown.len()];
        for weights in all.iter().filter_map(|needed| needed.0.get(id)) {
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
        }
        sums
    }
}
