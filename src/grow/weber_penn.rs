//! Grows the stems of a species level by level, from the trunk to the twigs.
//!
//! After Jason Weber and Joseph Penn, "Creation and Rendering of Realistic Trees", SIGGRAPH 1995.
//! Stems are in levels, each with its own parameters (section 4.1: curve, forks; 4.2: angles of
//! forks; 4.3: number, length and angle of children; 4.4: radius, taper, flare; 4.8: attraction to
//! light).
//!
//! Where we differ:
//! - The random part of the curve bends about a random axis, not only in the plane of the curve, so
//!   limbs become gnarled.
//! - The arms of a fork each deviate by half the angle and are thinned ([`FORK_THINNING`]). They
//!   are not bent back; the lift does that.
//! - Several trunks may rise from one root (for clumps of birches).
//! - The lift is a constant angle per stem, on every level. The pruning envelope (4.6) and wind
//!   (4.7) are omitted.
//!
//! Limits: stems ignore one another, so crowns with very many limbs may self-intersect.

use super::{
    frame::{Frame, sin_cos},
    species::{Crown, Level, Shape, Species},
    stem::{Node, Stem},
};
use crate::random::Random;
use crate::{Error, Result};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Maximum number of stems of a tree: it keeps the wood near a million triangles.
pub(super) const MAX_STEMS: usize = 100_000;
/// Radius of the arms of a fork relative to the radius below it. At 0.71 two arms have the
/// cross-section of one (Leonardo's rule); the value is higher because the taper reduces the radius
/// too.
const FORK_THINNING: f32 = 0.85;
/// Minimum stem radius in metres: anything thinner would only shimmer on screen.
const LEAST_RADIUS_M: f32 = 0.0015;
/// Minimum stem length in metres: some shapes give the topmost limbs zero length.
const LEAST_LENGTH_M: f32 = 0.001;
/// Maximum random shift of a child along its parent, either way, as a fraction of the even spacing.
const CHILD_JITTER: f32 = 0.35;
/// Minimum height of stems above the ground, as a fraction of the height of the tree: stems level
/// out before they get lower.
const GROUND_CLEARANCE: f32 = 0.13;
/// Distance of the trunks from the centre of their common root, in trunk radii.
const TRUNK_SPREAD: f32 = 1.4;

/// A stem that has not been grown yet.
#[derive(Clone, Copy)]
struct Shoot {
    level: usize,
    /// Its first node; an arm of a fork starts on the ring at the fork.
    node: Node,
    /// Its frame after the first node.
    frame: Frame,
    length_m: f32,
    foot_radius_m: f32,
    /// Length divided by the maximum length that the species allows on this parent: short limbs get
    /// fewer branches.
    relative_length: f32,
    seed: u64,
}

/// Grows every stem. The first stem is a trunk, and every stem comes after its parent.
///
/// # Errors
/// [`TooLarge`](Error::TooLarge) for more than [`MAX_STEMS`] stems.
pub(super) fn grow_stems(species: &Species, seed: u64) -> Result<Vec<Stem>> {
    let mut grower = Grower { species, fork_error: vec![0.0; species.levels.len()], pending: Vec::new() };
    let mut stems = Vec::new();
    grower.plant_trunks(&mut Random::new(seed));
    while let Some(shoot) = grower.pending.pop() {
        stems.push(grower.grow_stem(shoot));
        let planned = stems.len() + grower.pending.len();
        if planned > MAX_STEMS {
            return Err(Error::TooLarge {
                what: format!("{}: the number of stems", species.name),
                value: planned as u64,
                limit: MAX_STEMS as u64,
                fix: "lower levels[..].branches or levels[..].splits".into(),
            });
        }
    }
    Ok(stems)
}

struct Grower<'a> {
    species: &'a Species,
    /// Per level, the rounding remainder of the number of forks (section 4.2).
    fork_error: Vec<f32>,
    pending: Vec<Shoot>,
}

impl Grower<'_> {
    fn plant_trunks(&mut self, random: &mut Random) {
        let crown = &self.species.crown;
        let level = &self.species.levels[0];
        for trunk in 0..crown.trunks {
            let height_m = random.vary(crown.height_m, crown.height_v_m);
            let length_m = height_m * random.vary(level.length, level.length_v);
            let foot_radius_m = length_m * crown.ratio;
            let azimuth = TAU * (trunk as f32 + 0.3 * random.signed()) / crown.trunks as f32;
            let mut frame = Frame::UP.rolled(azimuth);
            let mut position = Vec3::ZERO;
            if crown.trunks > 1 {
                frame = frame.pitched(random.vary(crown.lean, 0.3 * crown.lean).to_radians());
                let outward = Vec3::new(frame.heading.x, 0.0, frame.heading.z).normalize_or_zero();
                position = outward * foot_radius_m * TRUNK_SPREAD;
            }
            let node = Node { position, frame, radius: foot_radius_m, t: 0.0 };
            let seed = random.bits();
            self.pending.push(Shoot { level: 0, node, frame, length_m, foot_radius_m, relative_length: 1.0, seed });
        }
    }

    fn grow_stem(&mut self, shoot: Shoot) -> Stem {
        let mut random = Random::new(shoot.seed);
        let stem = self.grow_axis(&shoot, &mut random);
        if shoot.level + 1 < self.species.levels.len() {
            self.set_children(&stem, &shoot, &mut random);
        }
        stem
    }

    /// Grows an axis segment by segment, with bends and forks. The other arms of forks are added to
    /// `pending`.
    fn grow_axis(&mut self, shoot: &Shoot, random: &mut Random) -> Stem {
        let level = &self.species.levels[shoot.level];
        let segments = level.segments;
        let step_m = shoot.length_m / segments as f32;
        let mut node = shoot.node;
        let mut foot_radius_m = shoot.foot_radius_m;
        let mut nodes = vec![node];
        node.frame = shoot.frame;
        let first = (shoot.node.t * segments as f32 + 0.5) as u32;
        for segment in first..segments {
            node.frame = bent(node.frame, level, segment, random);
            if shoot.level > 0 {
                node.frame = self.kept_off_the_ground(node, step_m);
            }
            node.position += node.frame.heading * step_m;
            node.t = (segment + 1) as f32 / segments as f32;
            node.radius = self.radius_m(shoot.level, foot_radius_m, node.t);
            nodes.push(node);
            let arms = if segment + 1 < segments { self.arms(shoot.level, level) } else { 1 };
            if arms > 1 {
                foot_radius_m *= FORK_THINNING;
                node.frame = self.fork(shoot, node, foot_radius_m, arms, random);
            }
        }
        Stem { level: shoot.level, length: shoot.length_m, nodes }
    }

    /// The frame of the node, levelled if the next step would lead below [`GROUND_CLEARANCE`].
    fn kept_off_the_ground(&self, node: Node, step_m: f32) -> Frame {
        let lowest = GROUND_CLEARANCE * self.species.crown.height_m;
        let heading = node.frame.heading;
        if heading.y < 0.0 && node.position.y + heading.y * step_m < lowest {
            return node.frame.lifted(-libm::asinf(heading.y.max(-1.0)));
        }
        node.frame
    }

    /// Number of arms after a segment, by error diffusion: 1 + `splits` on average, evenly spaced.
    fn arms(&mut self, index: usize, level: &Level) -> u32 {
        let wanted = level.splits + self.fork_error[index];
        let forks = (wanted + 0.5).floor().max(0.0);
        self.fork_error[index] = wanted - forks;
        1 + forks as u32
    }

    /// Adds all arms but the first to `pending`; returns the frame of the first.
    fn fork(&mut self, shoot: &Shoot, node: Node, foot_radius_m: f32, arms: u32, random: &mut Random) -> Frame {
        let level = &self.species.levels[shoot.level];
        let roll = PI * random.signed();
        let arm_frame = |arm: u32, random: &mut Random| {
            let axis = node.frame.rolled(roll + TAU * arm as f32 / arms as f32).side;
            let angle = random.vary(level.split_angle, level.split_angle_v).max(0.0);
            node.frame.turned(axis, 0.5 * angle.to_radians())
        };
        for arm in 1..arms {
            let frame = arm_frame(arm, random);
            let seed = random.bits();
            self.pending.push(Shoot { node, frame, foot_radius_m, seed, ..*shoot });
        }
        arm_frame(0, random)
    }

    /// Radius at `t` (section 4.4), without the [`flare`] of the trunk.
    fn radius_m(&self, level: usize, foot_radius_m: f32, t: f32) -> f32 {
        (foot_radius_m * (1.0 - self.species.levels[level].taper * t)).max(LEAST_RADIUS_M)
    }

    fn set_children(&mut self, stem: &Stem, shoot: &Shoot, random: &mut Random) {
        let crown = &self.species.crown;
        let child = &self.species.levels[stem.level + 1];
        let bare = if stem.level == 0 { crown.base } else { self.species.levels[stem.level].bare };
        let from = bare.max(stem.foot().t);
        let wanted = child.branches as f32 * (1.0 - from) / (1.0 - bare) * density(shoot);
        let count = (wanted + 0.5) as u32;
        let mut roll = PI * random.signed();
        for i in 0..count {
            let share = (i as f32 + 0.5 + CHILD_JITTER * random.signed()) / count as f32;
            let node = stem.at(from + (1.0 - from) * share);
            roll += random.vary(child.rotate, child.rotate_v).to_radians();
            let height = (1.0 - node.t) / (1.0 - bare);
            let greatest = random.vary(child.length, child.length_v);
            let length_m = match stem.level {
                0 => stem.length * greatest * crown.shape.ratio(height),
                _ => greatest * (stem.length - 0.6 * node.t * stem.length),
            };
            let length_m = length_m.max(LEAST_LENGTH_M);
            let down = down_angle(child, height, random);
            let shrunk = libm::powf(length_m / stem.length, crown.ratio_power);
            let foot_radius_m = (shoot.foot_radius_m * shrunk).clamp(LEAST_RADIUS_M, node.radius.max(LEAST_RADIUS_M));
            let frame = node.frame.rolled(roll).pitched(down.to_radians());
            self.pending.push(Shoot {
                level: stem.level + 1,
                node: Node { frame, radius: foot_radius_m, t: 0.0, ..node },
                frame,
                length_m,
                foot_radius_m,
                relative_length: length_m / (stem.length * child.length),
                seed: random.bits(),
            });
        }
    }
}

/// Fraction of the maximum number of children that a stem has (section 4.3): lower on short limbs.
fn density(parent: &Shoot) -> f32 {
    if parent.level == 0 { 1.0 } else { 0.2 + 0.8 * parent.relative_length.min(1.0) }
}

/// Angle in degrees between parent and child (section 4.3); `height` is 0 at the tip of the parent,
/// 1 at its lowest child.
fn down_angle(child: &Level, height: f32, random: &mut Random) -> f32 {
    if child.down_angle_v >= 0.0 {
        return random.vary(child.down_angle, child.down_angle_v);
    }
    child.down_angle - child.down_angle_v * (2.0 * Shape::Conical.ratio(height) - 1.0)
}

/// The frame of the next segment (section 4.1; the random axis and the lift are ours).
fn bent(frame: Frame, level: &Level, segment: u32, random: &mut Random) -> Frame {
    let segments = level.segments as f32;
    let curve = match (level.curve_back == 0.0, 2 * segment < level.segments) {
        (true, _) => level.curve / segments,
        (false, true) => 2.0 * level.curve / segments,
        (false, false) => 2.0 * level.curve_back / segments,
    };
    let frame = frame.pitched(curve.to_radians());
    let axis = frame.rolled(PI * random.signed()).side;
    let gnarl = random.signed() * level.curve_v / segments;
    frame.turned(axis, gnarl.to_radians()).lifted((level.lift / segments).to_radians())
}

impl Shape {
    /// `ShapeRatio` of section 4.3: `height` is 1 at the lowest limb, 0 at the top.
    fn ratio(self, height: f32) -> f32 {
        let height = height.clamp(0.0, 1.0);
        match self {
            Self::Conical => 0.2 + 0.8 * height,
            Self::Spherical => 0.2 + 0.8 * sin_cos(PI * height).0,
            Self::Hemispherical => 0.2 + 0.8 * sin_cos(0.5 * PI * height).0,
            Self::Cylindrical => 1.0,
            Self::TaperedCylindrical => 0.5 + 0.5 * height,
            Self::Flame if height <= 0.7 => height / 0.7,
            Self::Flame => (1.0 - height) / 0.3,
            Self::InverseConical => 1.0 - 0.8 * height,
            Self::TendFlame if height <= 0.7 => 0.5 + 0.5 * height / 0.7,
            Self::TendFlame => 0.5 + 0.5 * (1.0 - height) / 0.3,
        }
    }
}

/// Factor applied to the trunk's radius at `height`, a fraction of the trunk's length (`Flare` of
/// section 4.4).
pub(super) fn flare(crown: &Crown, height: f32) -> f32 {
    let above_foot = (1.0 - 8.0 * height).max(0.0);
    1.0 + crown.flare * (libm::powf(100.0, above_foot) - 1.0) / 100.0
}
