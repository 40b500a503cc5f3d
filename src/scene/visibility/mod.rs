//! How much of each plant shows behind other plants: weights for a [budget](super::budget).
//!
//! ```text
//! crowns in view, near to far --discs on a small picture--> transmittance
//!                                                      --> share of each crown that shows
//!                                                      --> weight: up at once, down slowly
//! ```
//!
//! Crowns are translucent: a walker in a forest sees a few trees, and through them parts of others.
//! So nothing is culled. On a picture of some 30,000 pixels a plant is drawn by its
//! [parts](CrownShape::parts) where it is large, a few hundred small ellipsoids of leaves and of
//! wood where these are, and as one disc of its crown's [opacity](CrownShape::opacity) where it is
//! small. All are drawn from near to far, whatever plant they are of; each takes its share of what
//! the ones before it pass. What shows of a plant is what it takes over what it would take alone. A
//! plant that hardly shows has a small weight in the budget, and other plants get its leaves.
//!
//! An estimate takes several frames. Weights are eighths of an octave: the greatest of the last
//! estimates counts, a weight rises at once and falls by 8 octaves a second, so that nothing that
//! comes out from behind a tree is bare, and a camera that stands still changes nothing.
//!
//! What is opaque hides crowns whose nearest part is behind it: [ground](Visibility::set_ground),
//! and what the host [tells](Visibility::set_opaque).
//!
//! A [budget](super::budget) adds that share of the power of a plant's error. Measured on pictures
//! of forests against every leaf: the power of that share of the error trusts the estimate more,
//! which is better in dense forests with 10 % of the leaves, and worse than no weights with 3 %.
//! Least weights of 1/32 instead of 1/256 are worse at both.
//!
//! Limits: crowns below two pixels of the small picture, about 16 on a screen of 1080 rows, hide
//! nothing and show in full, and so do parts around the camera. Parts turn about the vertical with
//! their plants, which are taken to stand upright. Ground hides nothing from orthographic cameras.
//! What shows is of plants at rest with all leaves. With 3 % of the leaves little is gained: most
//! of the error is then at the outlines of trees that show in full, and within the crown around the
//! eye.

mod buffer;
mod ground;
mod parts;
mod seen;
mod shape;
mod weights;

use crate::{Camera, terrain::HeightMap};
use buffer::Buffer;
use glam::DVec3;
use ground::Ground;
pub use parts::Part;
use seen::{Disc, SEEN_PX, Seen};
pub use shape::CrownShape;
use weights::Weights;

/// Rows of the picture that crowns are drawn on.
pub const ROWS: u32 = 135;
/// Frames that one estimate takes. What comes into sight has its full share after twice as many.
pub const FRAMES: u32 = 4;
/// Estimates of which the greatest counts.
const KEPT: usize = 4;
/// Steps by which a weight falls in a second.
const FALL: f32 = 64.0;
/// Part of what shows that rounding may take.
const ROUNDING: f32 = 1e-3;

/// A crown in view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown<'a> {
    /// Number of the plant.
    pub instance: u32,
    /// Centre, in the world.
    pub center: DVec3,
    /// Half of its width and of its height.
    pub half: [f64; 2],
    /// Share of light from behind that it takes, from 0 to 1.
    pub opacity: f32,
    /// What it is drawn by where it is large; none if it is drawn as one disc at any size.
    pub parts: Parts<'a>,
}

/// Where the parts of a plant are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parts<'a> {
    /// The parts of its model, see [`CrownShape::parts`].
    pub parts: &'a [Part],
    /// Centre of its bounding sphere, in the world.
    pub center: DVec3,
    /// Radius of that sphere.
    pub radius: f64,
    /// Cosine and sine of its turn about the vertical.
    pub turn: [f32; 2],
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
    /// Plants in the picture that is drawn.
    plants: Vec<Drawn>,
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

/// A plant on the small picture.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    instance: u32,
    /// Pixels that it covers alone, and that show.
    alone: f32,
    shown: f32,
    /// How much what shows of it counts, from 0 to 1.
    counts: f32,
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
    pub fn update<'a>(&mut self, camera: &Camera, crowns: impl Iterator<Item = Crown<'a>>, seconds: Option<f64>) {
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
            self.end();
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
    fn begin<'a>(&mut self, camera: &Camera, crowns: impl Iterator<Item = Crown<'a>>) {
        (self.next, self.found) = (0, Found::default());
        self.is_whole = self.pass == 0;
        self.pass = self.pass.wrapping_add(1).max(1);
        let Self { buffer, ground, plants, discs, states, pass, .. } = self;
        buffer.clear(camera.aspect());
        if let Some(ground) = ground.as_mut().filter(|_| !camera.is_orthographic()) {
            ground.look(camera, buffer.size()[0]);
            buffer.put(|pixel| ground.nearness(pixel));
        }
        plants.clear();
        discs.clear();
        let mut count = 0;
        let seen = Seen::new(camera, buffer.size());
        for crown in crowns {
            count += 1;
            if states.len() <= crown.instance as usize {
                states.resize(crown.instance as usize + 1, UNKNOWN);
            }
            let (first, plant) = (discs.len(), plants.len() as u32);
            let Some(diameter) = seen.discs(&crown, plant, discs) else { continue };
            let alone = buffer.covered(discs[first..].iter().map(|disc| (disc.middle, disc.half, disc.opacity)));
            let state = &mut states[crown.instance as usize];
            state.in_view = *pass;
            if alone <= 0.0 {
                *state = UNKNOWN;
                discs.truncate(first);
                continue;
            }
            let counts = ((diameter - SEEN_PX[0]) / (SEEN_PX[1] - SEEN_PX[0])).clamp(0.0, 1.0);
            plants.push(Drawn { instance: crown.instance, alone, shown: 0.0, counts });
        }
        // What comes into view shows until it is known.
        states.iter_mut().filter(|state| state.in_view != *pass).for_each(|state| *state = UNKNOWN);
        let instance = |disc: &Disc| plants[disc.plant as usize].instance;
        discs.sort_unstable_by(|a, b| {
            let [one, other] = [a, b].map(|disc| (instance(disc), disc.middle.map(f32::to_bits)));
            a.distance.total_cmp(&b.distance).then_with(|| one.cmp(&other))
        });
        self.estimate.crowns = count;
        self.estimate.drawn = plants.len() as u32;
    }

    fn draw(&mut self, at: usize) {
        let Disc { front, plant, middle, half, opacity, .. } = self.discs[at];
        self.plants[plant as usize].shown += self.buffer.draw(middle, half, front, opacity);
    }

    /// Ends an estimate.
    fn end(&mut self) {
        let Self { plants, states, found, weights, pass, is_whole, .. } = self;
        for Drawn { instance, alone, shown, counts } in plants.drain(..) {
            found.area += f64::from(alone);
            found.shown += f64::from(shown);
            let visible = (shown / alone * (1.0 + ROUNDING)).min(1.0);
            found.hidden += u32::from(visible < 0.1);
            let steps = weights.steps(1.0 + counts * (visible - 1.0));
            let state = &mut states[instance as usize];
            if state.pass == 0 || *pass != state.pass.wrapping_add(1) {
                // What was not part of the last estimate starts anew.
                state.last = [steps; KEPT];
                state.weight = if *is_whole { f32::from(steps) } else { state.weight };
            }
            state.last.rotate_right(1);
            state.last[0] = steps;
            state.pass = *pass;
        }
    }
}
