//! Instances and frames: the input of a draw, and its statistics.

#[cfg(feature = "software")]
use super::sprite::LEAST_PX;
use crate::{Camera, effects::Counts};
use glam::{DAffine3, DMat4, DVec2, DVec4};

slotmap::new_key_type! {
    /// Key of a model in a renderer. The key of a removed model is not used again.
    pub struct ModelId;
}

/// Range in a renderer's scale buffer that holds the drawn scales of one plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScalesId {
    pub(crate) first: u32,
    pub(crate) leaves: u32,
}

/// Camera and time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The camera.
    pub camera: Camera,
    /// Animation time in seconds.
    pub seconds: f64,
    /// Jitter: shift of the plants to the right and down, in pixels, for temporal antialiasing. The
    /// background is not shifted.
    pub jitter_px: [f64; 2],
    /// Camera and time of the previous frame, from which motion vectors are computed; `None` if
    /// there is none.
    pub before: Option<(Camera, f64)>,
}

impl Frame {
    /// The frame at time 0.
    pub fn new(camera: &Camera) -> Self {
        Self { camera: *camera, seconds: 0.0, jitter_px: [0.0; 2], before: None }
    }

    /// Returns the frame at another time.
    pub fn at(self, seconds: f64) -> Self {
        Self { seconds, ..self }
    }

    /// Returns the frame as the successor of `before`.
    pub fn after(self, before: &Self) -> Self {
        Self { before: Some((before.camera, before.seconds)), ..self }
    }
}

/// One plant to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// The model to draw.
    pub model: ModelId,
    /// Transform to world space. A transform that is not finite or not invertible hides the plant.
    pub world_from_plant: DAffine3,
    /// Transform in the previous frame, for motion vectors; `None` if it is unchanged.
    pub before: Option<DAffine3>,
    /// Active count, with a fraction. Clamped to the model's number of leaves; NaN draws only the
    /// wood.
    pub active: f32,
    /// Number of leaves at the end of the prefix that are in transition at once (see
    /// [`Transition`](crate::model::Transition)); less than 1 counts as 1. Ignored if the effect
    /// `fade` is on.
    pub window: f32,
    /// Factor applied to the drawn scale of every leaf; 1 except for stochastic pruning.
    pub leaf_scale: f32,
    /// The plant's own drawn scales; `None` takes them from the timeline. A plant's own scales
    /// belong to whole counts: the fraction and the window are then ignored.
    pub scales: Option<ScalesId>,
    /// Least share of the plant's samples that its impostor takes, from 0 to 1, whatever its size,
    /// as policies ask for that run out of leaves; `None` draws leaves at any size.
    pub far: Option<f32>,
    /// Tells plants apart where all would change at one size.
    pub seed: u32,
    /// Factor of its lit colour, linear, from 0 on; used if the look has
    /// [`tints`](super::Look::tints).
    pub tint: [f32; 3],
}

impl Instance {
    /// A plant with `active` leaves, a window of 1 and drawn scales from the timeline.
    pub fn new(model: ModelId, world_from_plant: DAffine3, active: f32) -> Self {
        Self {
            model,
            world_from_plant,
            before: None,
            active,
            window: 1.0,
            leaf_scale: 1.0,
            scales: None,
            far: Some(0.0),
            seed: 0,
            tint: [1.0; 3],
        }
    }
}

/// Draw statistics of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Prepared {
    /// Number of plants drawn.
    pub instances: u32,
    /// Number of plants skipped because their model is unknown or their transform cannot be drawn.
    pub skipped: u32,
    /// Number of leaves of all plants, including leaves in transition.
    pub leaves: u64,
    /// Triangles of all plants' wood, without those left out (see
    /// [`Look::wood_error_px`](super::Look::wood_error_px)).
    pub wood_triangles: u64,
    /// Number of draw calls.
    pub draws: u32,
    /// Counts of how often each enabled effect was simulated.
    pub effects: Counts,
    /// What the drawn plants are drawn with.
    pub far: FarCounts,
    /// Frames of live impostors.
    pub live: LiveCounts,
    /// Triangles of ground with heights.
    pub ground: GroundCounts,
}

/// Numbers of the drawn ground; 0 without a [`Terrain`](crate::terrain::Terrain).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GroundCounts {
    /// Triangles.
    pub triangles: u32,
    /// How often the error of the triangles was doubled so that there are not too many.
    pub coarser: u32,
}

#[cfg(feature = "software")]
impl GroundCounts {
    /// Those of a mesh.
    pub(crate) fn of(mesh: &crate::terrain::GroundMesh) -> Self {
        Self { triangles: (mesh.points.len() / 3) as u32, coarser: mesh.coarser }
    }
}

/// Numbers of frames of live impostors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LiveCounts {
    /// Frames that this picture added.
    pub made: u32,
    /// Frames that plants of this picture wait for, drawn with leaves meanwhile.
    pub pending: u32,
    /// Frames that are not wholly shown yet: the next pictures of a still camera differ.
    pub appearing: u32,
}

/// Numbers of plants by what they are drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FarCounts {
    /// Leaves and wood alone.
    pub leaves: u32,
    /// Leaves, wood and impostor, each in its share of the samples.
    pub both: u32,
    /// The impostor alone.
    pub impostors: u32,
    /// The impostor alone, smaller than it is drawn, so that part of its coverage is left.
    pub faded: u32,
}

#[cfg(feature = "software")]
impl FarCounts {
    /// Counts a plant of a diameter whose impostor takes this share of its samples.
    pub(crate) fn add(&mut self, share: f32, diameter_px: f32) {
        let count = match share {
            share if share <= 0.0 => &mut self.leaves,
            share if share >= 1.0 && diameter_px < LEAST_PX => &mut self.faded,
            share if share >= 1.0 => &mut self.impostors,
            _ => &mut self.both,
        };
        *count += 1;
    }
}

impl Frame {
    /// Jitter in clip space.
    pub(crate) fn jitter(&self) -> DVec2 {
        let [right, down] = self.jitter_px;
        DVec2::new(right / self.camera.aspect(), -down) * (2.0 / f64::from(self.camera.height_px))
    }

    /// The camera with the jitter applied; identical to the bit if there is no jitter.
    pub(crate) fn jittered(&self) -> Camera {
        if self.jitter_px == [0.0; 2] {
            return self.camera;
        }
        let shift = DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::Z, self.jitter().extend(0.0).extend(1.0));
        Camera { clip_from_world: shift * self.camera.clip_from_world, ..self.camera }
    }
}

impl From<Camera> for Frame {
    /// The frame at time 0.
    fn from(camera: Camera) -> Self {
        Self::new(&camera)
    }
}

impl From<&Camera> for Frame {
    /// The frame at time 0.
    fn from(camera: &Camera) -> Self {
        Self::new(camera)
    }
}
