//! Limbs: the two levels of branches that turn about their feet in the wind.
//!
//! ```text
//! trunk            bends: all of the plant follows the displacement field over height
//! +- limb          level 1: a stem on a trunk, turns about its foot
//!    +- limb       level 2: a stem on that one, turns about its foot and rides on it
//!       +- stems   ride on it as one rigid piece, with their leaves
//! ```
//!
//! A limb's turn is a vector, the sum of two waves: along the wind, leaning downwind, and upwards.
//! Both have whole numbers of cycles in the wind's period, from the stiffness of the limb: thick
//! and short ones are faster and turn less. Limbs that follow each other on a stem have different
//! numbers of cycles, so that their motions are uncorrelated over a period whatever their phases.
//! The rotation of a turn `2 c` is Cayley's, `v + 2 (c x v + c x (c x v)) / (1 + c c)`: exact, so
//! distances on a limb do not change, and without trigonometry.
//!
//! What is on a limb of level 2 is displaced by the trunk as the limb's foot is, and turned with
//! the slope of the bend there: it keeps its shape to rounding. A limb of level 1 follows the bend
//! point by point, as does the trunk: large ascending limbs are a tree's crown, and would not bend
//! otherwise; and impostors, which know no limbs, bend alike. A leaf is displaced as the nearest
//! point of its stem is.
//!
//! After the two levels of branch motion of *SpeedTree*, and J. Weber, J. Penn, *Creation and
//! Rendering of Realistic Trees* (1995), where a stem's sway depends on its length and radius. Here
//! motion is inherited, and nothing is integrated.
//!
//! Limits: stems come from the wood's [order](crate::FoliageModel::wood_order); leaves belong to
//! the nearest. A limb does not bend by itself. While the motion of level 2 fades, leaves of
//! imported trees may part from their stems by a third of a pixel.

use super::wind::{BRANCH_LIFT, BRANCH_WAVES, LIMB_LEAN, LimbReach, Shape, Sway};
use crate::{
    hash::HASH_MULTIPLIER,
    model::FoliageModel,
    wood::{Stem, WoodOrder, nearest_triangles, stems},
};
use glam::{DVec3, Vec3};
use std::{collections::HashMap, f32::consts::TAU};

/// Number of levels of limbs.
const LEVELS: usize = 2;
/// Most limbs of a plant; further ones of level 2 ride on level 1.
const MOST_LIMBS: usize = u16::MAX as usize;
/// Share of the sway of the outermost branches that each level has. They add up to 1.
const SWAY_SHARES: [f32; LEVELS] = [0.6, 0.4];
/// Largest turn of a limb at each level, for a sway of the plant's height: limbs shorter than the
/// share over this move less.
const MOST_TURN: [f32; LEVELS] = [3.0, 6.0];
/// Reach of a limb over its radius from which on it is as flexible as any.
const SLENDER: f32 = 25.0;
/// Cycles per period of a limb as stiff as a trunk: one in 2.7 s; and the radius of that trunk,
/// over the plant's height.
const CYCLES_OF_TRUNK: [f32; 2] = [44.0, 0.03];
/// Least and most cycles per period of each level: one in 2.4 to 1.2 s, and in 1.5 to 0.8 s.
const CYCLES: [[f32; 2]; LEVELS] = [[50.0, 100.0], [80.0, 150.0]];
/// Cycles upwards over those along the wind.
const LIFT_CYCLES: f32 = 1.45;
/// Greatest part by which a limb's number of cycles differs from that of its stiffness.
const SPREAD: f32 = 0.15;
/// Number of limbs before one on the same stem whose numbers of cycles it does not have.
const APART: usize = 8;
/// Width of a stem without a parent over the widest one's, from which on it is a trunk: thinner
/// ones are the limbs of a bush.
const TRUNK: f32 = 0.4;
/// Steps of a phase, and of a leaf's height.
const STEPS: f32 = 65_536.0;

/// A stem that turns about its foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limb {
    pub(crate) foot: Vec3,
    /// Unit vector from the foot to the tip.
    pub(crate) axis: Vec3,
    /// Limb of level 1 that it grows on; 0 if it is one.
    pub(crate) below: u16,
    /// Turn in radians for a sway of the outermost branches of 1.
    pub(crate) turn: f32,
    /// Cycles per period along the wind and upwards.
    pub(crate) cycles: [u16; 2],
    /// Phases of both, in 65,536ths of a cycle.
    pub(crate) phases: [u16; 2],
}

/// What a leaf rides on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ride {
    /// Number of the limb; 0 for a trunk.
    pub(crate) limb: u16,
    /// Height of the nearest point of its stem, in 65,536ths of the plant's.
    pub(crate) height: u16,
}

/// The limbs of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Limbs {
    /// Limb 0 stands for none.
    pub(crate) limbs: Vec<Limb>,
    /// Limb of each stem of the wood.
    pub(crate) of_stem: Vec<u16>,
    /// What each leaf rides on.
    pub(crate) of_leaf: Vec<Ride>,
    reach: LimbReach,
}

impl Limbs {
    /// Finds the limbs of a valid model, whose wood has this order; `None` if no stem grows on
    /// another. `origin` is that of the space in which points are moved, in plant space. O(n log
    /// n).
    pub fn new(model: &FoliageModel, order: &WoodOrder, origin: DVec3) -> Option<Self> {
        let mut found = Finder::new(model, order);
        found.measure();
        found.tune();
        found.limbs.iter_mut().for_each(|limb| limb.foot = (limb.foot.as_dvec3() - origin).as_vec3());
        let Finder { limbs, of_stem, of_leaf, reach, .. } = found;
        (limbs.len() > 1).then_some(Self { limbs, of_stem, of_leaf, reach })
    }

    /// How far limbs move.
    pub fn reach(&self) -> LimbReach {
        self.reach
    }

    /// Number of limbs at levels 1 and 2.
    pub fn counts(&self) -> [usize; 2] {
        let first = self.limbs.iter().skip(1).filter(|limb| limb.below == 0).count();
        [first, self.limbs.len() - 1 - first]
    }

    /// Limb of a stem of the wood and the limb of level 1 that it grows on; 0 for none.
    pub fn of_stem(&self, stem: u32) -> [u16; 2] {
        let limb = self.of_stem.get(stem as usize).copied().unwrap_or_default();
        [limb, self.limbs[usize::from(limb)].below]
    }

    /// Motion of what is on a stem, at a point of it.
    pub fn on_stem(&self, stem: u32, point: Vec3, sway: &Sway) -> Carry {
        let limb = self.of_stem.get(stem as usize).copied().unwrap_or_default();
        self.carry(limb, point.y, sway)
    }

    /// Motion of a leaf.
    pub fn on_leaf(&self, leaf: u32, sway: &Sway) -> Carry {
        let Some(ride) = self.of_leaf.get(leaf as usize) else { return Carry::default() };
        self.carry(ride.limb, sway.base + f32::from(ride.height) / STEPS * sway.height, sway)
    }

    /// Motion of what is on a limb, attached at a y coordinate.
    fn carry(&self, limb: u16, y: f32, sway: &Sway) -> Carry {
        let own = &self.limbs[usize::from(limb)];
        let mut carry = Carry { shift: sway.bent(y), ..Carry::default() };
        let mut first = own;
        if own.below > 0 {
            let share = sway.limbs[1];
            let slope = Vec3::Y.cross(sway.bend.into()) * (sway.height_of(own.foot.y) / sway.height);
            (carry.feet[1], carry.turns[1]) = (own.foot, own.half_turn(sway, share) + slope * share);
            carry.shift = carry.shift.lerp(sway.bent(own.foot.y), share);
            first = &self.limbs[usize::from(own.below)];
        }
        (carry.feet[0], carry.turns[0]) = (first.foot, first.half_turn(sway, sway.limbs[0]));
        carry
    }
}

impl Limb {
    /// Half of the turn, as a vector.
    fn half_turn(&self, sway: &Sway, share: f32) -> Vec3 {
        let wave = |i: usize| {
            let cycles = f32::from(self.cycles[i]) * sway.clock + f32::from(self.phases[i]) / STEPS;
            (cycles.fract() * TAU).sin()
        };
        let along = LIMB_LEAN + (1.0 - LIMB_LEAN) * wave(0);
        let towards = Vec3::from(sway.along) * along + Vec3::Y * (BRANCH_LIFT * wave(1));
        self.axis.cross(towards) * (0.5 * share * sway.branches * self.turn)
    }
}

/// Motion of all that rides on a limb: a rotation about its foot, then one about the foot of the
/// limb that it grows on, then a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Carry {
    /// Feet of level 1 and level 2.
    feet: [Vec3; 2],
    /// Halves of their turns.
    turns: [Vec3; 2],
    shift: Vec3,
}

impl Carry {
    /// Displacement of a point at rest.
    pub fn offset(&self, point: Vec3) -> Vec3 {
        let second = change(self.turns[1], point - self.feet[1]);
        let first = change(self.turns[0], point + second - self.feet[0]);
        second + first + self.shift
    }

    /// A direction or an offset from a point, turned.
    pub fn turned(&self, vector: Vec3) -> Vec3 {
        let once = vector + change(self.turns[1], vector);
        once + change(self.turns[0], once)
    }
}

/// What Cayley's rotation by half a turn `c` adds to a vector.
fn change(c: Vec3, vector: Vec3) -> Vec3 {
    let across = c.cross(vector);
    (across + c.cross(across)) * (2.0 / (1.0 + c.length_squared()))
}

/// Finds limbs, in plant space.
struct Finder<'a> {
    model: &'a FoliageModel,
    order: &'a WoodOrder,
    shape: Shape,
    stems: Vec<Stem>,
    limbs: Vec<Limb>,
    /// Stem of each limb.
    stem_of: Vec<u32>,
    /// Distance from its foot to all that rides on each limb.
    reaches: Vec<f32>,
    of_stem: Vec<u16>,
    of_leaf: Vec<Ride>,
    reach: LimbReach,
}

impl<'a> Finder<'a> {
    /// Tells which stems are limbs, and what the others ride on.
    fn new(model: &'a FoliageModel, order: &'a WoodOrder) -> Self {
        let stems = stems(&model.wood, order);
        let none = Limb { foot: Vec3::ZERO, axis: Vec3::Y, below: 0, turn: 0.0, cycles: [0; 2], phases: [0; 2] };
        let mut limbs = vec![none];
        let mut stem_of = vec![0];
        let mut of_stem: Vec<u16> = Vec::with_capacity(stems.len());
        let is_finite = |stem: &&Stem| stem.width < f32::MAX;
        let roots = stems.iter().filter(is_finite).filter(|stem| stem.parent.is_none());
        let widest = roots.map(|stem| stem.width).fold(0.0, f32::max);
        for (number, stem) in (0..).zip(&stems) {
            let below = match stem.parent {
                Some(parent) => Some(of_stem[parent as usize]),
                None => (stem.width < TRUNK * widest).then_some(0),
            };
            let level = below
                .map_or(0, |below| if below == 0 { 1 } else { 2 + usize::from(limbs[usize::from(below)].below > 0) });
            let limb = match below {
                Some(below) if level <= LEVELS && limbs.len() <= MOST_LIMBS => {
                    let axis = (stem.tip - stem.foot).try_normalize().unwrap_or(Vec3::Y);
                    limbs.push(Limb { foot: stem.foot, axis, below, ..none });
                    stem_of.push(number);
                    (limbs.len() - 1) as u16
                }
                below => below.unwrap_or_default(),
            };
            of_stem.push(limb);
        }
        let reaches = vec![0.0; limbs.len()];
        let shape = Shape::new(&model.aabb());
        let reach = LimbReach { lean: 1.0, ..LimbReach::default() };
        Self { model, order, shape, stems, limbs, stem_of, reaches, of_stem, of_leaf: Vec::new(), reach }
    }

    /// Finds what leaves ride on, and how far all that rides on a limb is from its foot.
    fn measure(&mut self) {
        let pivots = || self.model.leaves.iter().map(|leaf| leaf.pivot);
        let nearest = nearest_triangles(&self.model.wood, pivots());
        let Shape { base, height, .. } = self.shape;
        let ride = |found: Option<(u32, Vec3)>| {
            let (triangle, point) = found?;
            let corners = self.corners(triangle);
            // The bend grows with the square of the height, and triangles stay flat.
            let squared = |corner: Vec3| ((corner.y - base) / height).clamp(0.0, 1.0).powi(2);
            let squared = weights(point, corners)
                .map_or(squared(point), |weights| (0..3).map(|i| weights[i] * squared(corners[i])).sum());
            let height = (squared.sqrt() * STEPS).round().clamp(0.0, STEPS - 1.0) as u16;
            let stem = self.order.triangle_stems[triangle as usize];
            Some(Ride { limb: self.of_stem[stem as usize], height })
        };
        let of_leaf = nearest.into_iter().map(|found| ride(found).unwrap_or(Ride { limb: 0, height: 0 })).collect();
        self.of_leaf = of_leaf;
        for (triangle, &stem) in (0..).zip(&self.order.triangle_stems) {
            for corner in self.corners(triangle) {
                extend(&mut self.reaches, &self.limbs, self.of_stem[stem as usize], corner);
            }
        }
        for (leaf, ride) in self.model.leaves.iter().zip(&self.of_leaf) {
            extend(&mut self.reaches, &self.limbs, ride.limb, leaf.pivot.into());
        }
    }

    /// Corners of a triangle of the wood.
    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let wood = &self.model.wood;
        [0, 1, 2].map(|i| wood.vertices[wood.indices[3 * triangle as usize + i] as usize].position.into())
    }

    /// Sets turns, cycles and phases.
    fn tune(&mut self) {
        let mut children: HashMap<Option<u32>, Vec<usize>> = HashMap::new();
        for limb in 1..self.limbs.len() {
            children.entry(self.stem(limb).parent).or_default().push(limb);
        }
        for (parent, mut limbs) in children {
            // Along what they grow on; of a bush, around its middle.
            let place = |limb: &usize| match parent.map(|parent| &self.stems[parent as usize]) {
                Some(parent) => (self.limbs[*limb].foot - parent.foot).dot(parent.tip - parent.foot),
                None => self.limbs[*limb].foot.x,
            };
            limbs.sort_by(|a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
            let mut before: Vec<[u16; 2]> = Vec::new();
            for limb in limbs {
                let last = &before[before.len().saturating_sub(APART)..];
                let apart = |i: usize, cycles: f32| {
                    let mut cycles = cycles.round() as u16;
                    while last.iter().any(|of| of[i] == cycles) {
                        cycles += 1;
                    }
                    cycles
                };
                let along = apart(0, self.cycles(limb));
                before.push([along, apart(1, f32::from(along) * LIFT_CYCLES)]);
                self.limbs[limb].cycles = before[before.len() - 1];
            }
        }
        for limb in 1..self.limbs.len() {
            let level = self.level(limb);
            let (turn, reach) = (self.turn(limb), self.reaches[limb]);
            self.limbs[limb].turn = turn;
            self.limbs[limb].phases = [0, 1].map(|i| self.phase(limb, i));
            self.reach.turns[level] = self.reach.turns[level].max(turn);
            self.reach.sways[level] = self.reach.sways[level].max(turn * reach);
            if level == 1 {
                let Shape { base, height, .. } = self.shape;
                let foot = ((self.limbs[limb].foot.y - base) / height).clamp(0.0, 1.0);
                self.reach.lean = self.reach.lean.max(foot * foot + 2.0 * foot * reach / height);
            }
        }
    }

    fn stem(&self, limb: usize) -> &Stem {
        &self.stems[self.stem_of[limb] as usize]
    }

    /// 0 for level 1, 1 for level 2.
    fn level(&self, limb: usize) -> usize {
        usize::from(self.limbs[limb].below > 0)
    }

    /// Length and radius of a limb, at least so large that neither is 0.
    fn size(&self, limb: usize) -> [f32; 2] {
        let least = 1e-4 * self.shape.height;
        let width = self.stem(limb).width;
        [self.reaches[limb].max(least), (0.5 * if width < f32::MAX { width } else { 0.0 }).max(0.1 * least)]
    }

    fn turn(&self, limb: usize) -> f32 {
        let ([length, radius], level) = (self.size(limb), self.level(limb));
        let largest = (SWAY_SHARES[level] / length).min(MOST_TURN[level] / self.shape.height);
        largest * (length / radius / SLENDER).min(1.0)
    }

    /// Cycles per period along the wind. A beam's frequency grows with its radius over the square
    /// of its length; roots of it stay within the range of trees.
    fn cycles(&self, limb: usize) -> f32 {
        let [length, radius] = self.size(limb);
        let [of_trunk, trunk_radius] = CYCLES_OF_TRUNK;
        let over_trunk = radius / (length * length) * self.shape.height / trunk_radius;
        let [least, most] = CYCLES[self.level(limb)];
        let stiff = (of_trunk * over_trunk.sqrt()).clamp(least, most);
        stiff * (1.0 + SPREAD * (2.0 * self.random(limb, 2) - 1.0))
    }

    /// A wave's phase: a smooth part, by which waves travel, and one of the limb's own.
    fn phase(&self, limb: usize, wave: usize) -> u16 {
        let Shape { base, height, axis, .. } = self.shape;
        let place = (self.limbs[limb].foot - Vec3::new(axis[0], base, axis[1])) / height;
        let cycles = self.random(limb, wave as u32) - place.dot(BRANCH_WAVES[wave]);
        (cycles.rem_euclid(1.0) * STEPS).min(STEPS - 1.0) as u16
    }

    /// A number from 0 to below 1.
    fn random(&self, limb: usize, salt: u32) -> f32 {
        let mixed = (self.stem_of[limb] ^ salt << 24).wrapping_mul(HASH_MULTIPLIER);
        let mixed = (mixed ^ mixed >> 15).wrapping_mul(HASH_MULTIPLIER);
        (mixed >> 8) as f32 / 16_777_216.0
    }
}

/// Weights of the corners at a point of a triangle; `None` if the triangle has no area.
fn weights(point: Vec3, [a, b, c]: [Vec3; 3]) -> Option<[f32; 3]> {
    let twice_area = (b - a).cross(c - a).length();
    let opposite = |p: Vec3, q: Vec3| (p - point).cross(q - point).length() / twice_area;
    (twice_area > 0.0).then(|| [opposite(b, c), opposite(c, a), opposite(a, b)])
}

/// Extends the reach of a limb, and of that below it, to a point.
fn extend(reaches: &mut [f32], limbs: &[Limb], limb: u16, point: Vec3) {
    let below = limbs[usize::from(limb)].below;
    for limb in [limb, below].map(usize::from) {
        reaches[limb] = reaches[limb].max(limbs[limb].foot.distance(point));
    }
}
