//! How much of each plant shows behind other plants: weights for a [budget](super::budget).
//!
//! ```text
//! crowns in view, near to far --discs on a small picture--> transmittance
//!                                                      --> share of each crown that shows
//!                                                      --> weight: up at once, down slowly
//! ```
//!
//! Crowns are translucent: a walker in a forest sees a few trees, and through them parts of others.
//! So nothing is culled. Each crown is a disc of its model's [opacity](CrownShape::opacity); drawn
//! from near to far on a picture of some 30,000 pixels, what shows of one is the mean
//! transmittance before it, and it takes its share of what passes on. A plant that hardly shows has
//! a small weight in the budget, and other plants get its leaves.
//!
//! An estimate takes several frames. Weights are eighths of an octave: the greatest of the last
//! estimates counts, a weight rises at once and falls by 8 octaves a second, so that nothing that
//! comes out from behind a tree is bare, and a camera that stands still changes nothing.
//!
//! What is opaque hides crowns whose nearest part is behind it: [ground](Visibility::set_ground),
//! and what the host [tells](Visibility::set_opaque).
//!
//! Limits: trunks hide nothing. Crowns below two pixels of the small picture, about 16 on a screen
//! of 1080 rows, hide nothing and show in full, and so do those around the camera. Ground hides
//! nothing from orthographic cameras. What shows is of crowns at rest.

mod buffer;
mod ground;
mod shape;

use crate::{Camera, terrain::HeightMap};
use buffer::Buffer;
use glam::DVec3;
use ground::Ground;
pub use shape::CrownShape;

/// Rows of the picture that crowns are drawn on.
pub const ROWS: u32 = 135;
/// Frames that one estimate takes. What comes into sight has its full share after twice as many.
pub const FRAMES: u32 = 4;
/// Estimates of which the greatest counts.
const KEPT: usize = 4;
/// Steps of a weight per octave.
const STEPS: f32 = 8.0;
/// Least weight, in steps: 1/256.
const LEAST: i8 = -64;
/// Steps by which a weight falls in a second.
const FALL: f32 = 64.0;
/// Diameters in pixels of the small picture over which what shows begins to count.
const SEEN_PX: [f32; 2] = [2.0, 4.0];

/// A crown in view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown {
    /// Number of the plant.
    pub instance: u32,
    /// Centre, in the world.
    pub center: DVec3,
    /// Half of its width and of its height.
    pub half: [f64; 2],
    /// Share of light from behind that it takes, from 0 to 1.
    pub opacity: f32,
}

/// What was estimated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// Number of crowns in view.
    pub crowns: u32,
    /// Number of those that were drawn, being large enough.
    pub drawn: u32,
    /// Number of those of which less than a tenth shows.
    pub hidden: u32,
    /// Share of their area that shows.
    pub shown: f32,
}

/// How much of each plant shows behind others, from frame to frame.
#[derive(Debug, Default)]
pub struct Visibility {
    buffer: Buffer,
    ground: Option<Ground>,
    discs: Vec<Disc>,
    /// First of the discs that are still to be drawn.
    next: usize,
    states: Vec<State>,
    /// Number of the estimate that is being made, from 1 on.
    pass: u32,
    is_whole: bool,
    estimate: Estimate,
    found: Found,
    weights: Weights,
}

#[derive(Debug, Default)]
struct Found {
    area: f64,
    shown: f64,
    hidden: u32,
}

/// A crown on the small picture.
#[derive(Debug, Clone, Copy)]
struct Disc {
    /// Distances of its middle and of its nearest part from the eye.
    distance: f32,
    front: f32,
    instance: u32,
    middle: [f32; 2],
    half: [f32; 2],
    opacity: f32,
}

/// What is known of a plant.
#[derive(Debug, Clone, Copy)]
struct State {
    /// The last estimates, in steps.
    last: [i8; KEPT],
    /// Its weight, in steps.
    weight: f32,
    /// Estimate of which it was last part.
    pass: u32,
    /// Estimate that it was last in view of.
    in_view: u32,
}

const UNKNOWN: State = State { last: [0; KEPT], weight: 0.0, pass: 0, in_view: 0 };

impl Visibility {
    /// Nothing is known yet: everything shows.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets all plants, as when their numbers change, and after a cut of the camera: the next
    /// frame makes a whole estimate.
    pub fn reset(&mut self) {
        self.states.clear();
        self.discs.clear();
        (self.next, self.pass) = (0, 0);
    }

    /// Forgets all plants without making a whole estimate: all show, until they are known.
    pub(super) fn forget(&mut self) {
        let pass = self.pass;
        self.reset();
        self.pass = pass;
    }

    /// Draws what hides plants but is none, such as houses and hills: the distance from the eye of
    /// what is seen at a place of the picture, from (-1, -1) in the lower left to (1, 1) in the
    /// upper right, or infinity. It counts from the next estimate on, until it is given anew;
    /// `None` takes it away.
    pub fn set_opaque(&mut self, distance: Option<impl FnMut([f32; 2]) -> f32>, aspect: f64) {
        self.buffer.set_opaque(distance, aspect);
    }

    /// Lets ground hide what is behind it, or none. Like what is opaque it is looked at when an
    /// estimate begins (see [`Horizon`](crate::terrain::Horizon)), some 8,000 places of it.
    pub fn set_ground(&mut self, heights: Option<&HeightMap>) {
        // Level ground hides nothing that stands on it.
        self.ground = heights.filter(|heights| !heights.is_level()).map(Ground::new);
    }

    /// Goes on by one frame, `seconds` after the last one; `None` stands for a picture by itself,
    /// for which everything is estimated anew. O(crowns), sorting aside; `crowns` is only read when
    /// an estimate begins.
    pub fn update(&mut self, camera: &Camera, crowns: impl Iterator<Item = Crown>, seconds: Option<f64>) {
        if seconds.is_none() {
            self.reset();
        }
        let begins = self.next == self.discs.len();
        if begins {
            self.begin(camera, crowns);
        }
        // A frame finds the crowns and the others draw them, but the first estimate is made at
        // once: without it everything would show.
        let drawn = match (self.is_whole, begins) {
            (true, _) => self.discs.len(),
            (false, true) => 0,
            (false, false) => self.discs.len().div_ceil(FRAMES as usize - 1),
        };
        let end = (self.next + drawn).min(self.discs.len());
        for at in self.next..end {
            self.draw(at);
        }
        self.next = end;
        if self.next == self.discs.len() {
            self.estimate.hidden = self.found.hidden;
            self.estimate.shown = if self.found.area > 0.0 { (self.found.shown / self.found.area) as f32 } else { 1.0 };
        }
        let fall = seconds.map_or(f32::INFINITY, |seconds| FALL * seconds.max(0.0) as f32);
        for state in &mut self.states {
            let target = f32::from(state.last.into_iter().max().unwrap_or_default());
            state.weight = if fall.is_nan() { target } else { (state.weight - fall).max(target) };
        }
    }

    /// Weight of a plant, from 1/256 to 1: what shows of it. Plants that are not known show.
    pub fn weight(&self, instance: u32) -> f32 {
        self.states.get(instance as usize).map_or(1.0, |state| self.weights.of(state.weight))
    }

    /// What was last estimated.
    pub fn estimate(&self) -> Estimate {
        self.estimate
    }

    /// Begins an estimate.
    fn begin(&mut self, camera: &Camera, crowns: impl Iterator<Item = Crown>) {
        (self.next, self.found) = (0, Found::default());
        self.is_whole = self.pass == 0;
        self.pass = self.pass.wrapping_add(1).max(1);
        let Self { buffer, ground, discs, states, pass, .. } = self;
        buffer.clear(camera.aspect());
        if let Some(ground) = ground.as_mut().filter(|_| !camera.is_orthographic()) {
            ground.look(camera, buffer.size()[0]);
            buffer.put(|pixel| ground.nearness(pixel));
        }
        discs.clear();
        let mut count = 0;
        let seen = Seen::new(camera, buffer.size());
        discs.extend(crowns.filter_map(|crown| {
            count += 1;
            if states.len() <= crown.instance as usize {
                states.resize(crown.instance as usize + 1, UNKNOWN);
            }
            let disc = seen.disc(&crown);
            if disc.is_some() {
                states[crown.instance as usize].in_view = *pass;
            }
            disc
        }));
        // What comes into view shows until it is known.
        states.iter_mut().filter(|state| state.in_view != *pass).for_each(|state| *state = UNKNOWN);
        discs.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.instance.cmp(&b.instance)));
        self.estimate.crowns = count;
        self.estimate.drawn = discs.len() as u32;
    }

    fn draw(&mut self, at: usize) {
        let Disc { front, instance, middle, half, opacity, .. } = self.discs[at];
        let Some([area, shown]) = self.buffer.draw(middle, half, front, opacity) else {
            self.states[instance as usize] = UNKNOWN;
            return;
        };
        self.found.area += f64::from(area);
        self.found.shown += f64::from(shown);
        let visible = shown / area;
        self.found.hidden += u32::from(visible < 0.1);
        let counts = ((2.0 * half[0].max(half[1]) - SEEN_PX[0]) / (SEEN_PX[1] - SEEN_PX[0])).clamp(0.0, 1.0);
        let steps = self.weights.steps(1.0 + counts * (visible - 1.0));
        let state = &mut self.states[instance as usize];
        if state.pass == 0 || self.pass != state.pass.wrapping_add(1) {
            // What was not part of the last estimate starts anew.
            state.last = [steps; KEPT];
            state.weight = if self.is_whole { f32::from(steps) } else { state.weight };
        }
        state.last.rotate_right(1);
        state.last[0] = steps;
        state.pass = self.pass;
    }
}

/// How crowns are seen on the small picture.
struct Seen<'a> {
    camera: &'a Camera,
    size: [f32; 2],
    /// Pixels over a unit of length, at a clip-space w of 1.
    scale: f64,
    /// Squares of cosine and sine of the camera's pitch.
    pitch: [f64; 2],
}

impl<'a> Seen<'a> {
    fn new(camera: &'a Camera, size: [u32; 2]) -> Self {
        let row = camera.clip_from_world.row(3).truncate();
        // An orthographic camera looks along its depth.
        let forwards = if camera.is_orthographic() { camera.clip_from_world.row(2).truncate() } else { row };
        let down = forwards.normalize_or_zero().y;
        let scale = camera.pixels_per_unit() * f64::from(size[1]) / f64::from(camera.height_px);
        Self { camera, size: size.map(|side| side as f32), scale, pitch: [1.0 - down * down, down * down] }
    }

    /// The disc of a crown; `None` if it is too small to count, around the eye or behind it.
    fn disc(&self, crown: &Crown) -> Option<Disc> {
        let clip = self.camera.clip_from_world * crown.center.extend(1.0);
        let [wide, high] = crown.half;
        let distance = crown.center.distance(self.camera.eye);
        let front = distance - wide.max(high);
        let is_around = !self.camera.is_orthographic() && front <= 0.0;
        if clip.w <= 0.0 || is_around || !clip.is_finite() {
            return None;
        }
        let scale = self.scale / clip.w;
        let high = (high * high * self.pitch[0] + wide * wide * self.pitch[1]).sqrt();
        let half = [(wide * scale) as f32, (high * scale) as f32];
        let is_seen = half[0].is_finite() && half[1].is_finite() && 2.0 * half[0].max(half[1]) > SEEN_PX[0];
        let x = (0.5 + 0.5 * (clip.x / clip.w) as f32) * self.size[0];
        let y = (0.5 + 0.5 * (clip.y / clip.w) as f32) * self.size[1];
        let opacity = if crown.opacity.is_nan() { 0.0 } else { crown.opacity.clamp(0.0, 1.0) };
        let [distance, front] = [distance, front].map(|distance| distance as f32);
        is_seen.then_some(Disc { distance, front, instance: crown.instance, middle: [x, y], half, opacity })
    }
}

/// Weights by the number of steps below 1.
#[derive(Debug)]
struct Weights(Vec<f32>);

impl Default for Weights {
    fn default() -> Self {
        let step = |steps: i32| libm::exp2f(-(steps as f32) / STEPS);
        Self((0..=-i32::from(LEAST)).map(step).collect())
    }
}

impl Weights {
    /// Weight of a number of steps, between whole ones too.
    fn of(&self, steps: f32) -> f32 {
        let below = (-steps).clamp(0.0, (self.0.len() - 1) as f32);
        let [low, high] = [below.floor(), below.ceil()].map(|at| self.0[at as usize]);
        low + (high - low) * below.fract()
    }

    /// Number of steps of a weight, rounded down.
    fn steps(&self, weight: f32) -> i8 {
        let below = self.0.partition_point(|&other| other > weight * 1.000_01);
        -(below.min(self.0.len() - 1) as i8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_eighths_of_an_octave() {
        let weights = Weights::default();
        for steps in LEAST..=0 {
            assert_eq!(weights.steps(weights.of(f32::from(steps))), steps);
        }
        assert_eq!((weights.of(-8.0), weights.of(9.0), weights.of(-1e9)), (0.5, 1.0, 1.0 / 256.0));
        assert_eq!([1.0, 2.0, 0.0, f32::NAN].map(|weight| weights.steps(weight)), [0, 0, LEAST, 0]);
        assert!(weights.of(-4.5) < weights.of(-4.0) && weights.of(-4.5) > weights.of(-5.0));
    }
}
