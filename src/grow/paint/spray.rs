//! What is painted on one leaf card: a spray of leaves on its shoot, or compound leaves on their stalks.

use super::{blade, canvas::Canvas, mixed, shaded, unit_color};
use crate::grow::{
    frame::sin_cos,
    random::Random,
    species::{Blade, LeafStyle},
};
use glam::Vec2;

/// Leaves of an oak spray; English oak crowds them at the shoot's end.
const OAK_LEAVES: u32 = 9;
/// Leaves of a birch spray.
const BIRCH_LEAVES: u32 = 9;
/// Compound leaves of a pecan spray.
const PECAN_LEAVES: u32 = 3;
/// Pairs of leaflets of a pecan leaf, besides the one at its end (nine to seventeen leaflets in nature).
const PECAN_PAIRS: u32 = 6;
/// Young shoots and stalks, sRGB.
const STALK: [f32; 3] = [0.40, 0.38, 0.20];
/// Stalks of the gray birch's drooping twigs, sRGB.
const BIRCH_TWIG: [f32; 3] = [0.36, 0.25, 0.16];

/// One leaf of a spray.
struct Placed {
    foot: Vec2,
    /// Radians from straight up, to the right.
    angle: f32,
    length: f32,
    /// Sideways bend of the tip over the length.
    bend: f32,
    /// Factor on the colour.
    shade: f32,
}

/// Paints the card of `style`.
pub(super) fn paint(canvas: &mut Canvas, style: &LeafStyle, seed: u64) {
    let random = &mut Random::new(seed);
    let color = unit_color(style.color);
    match style.blade {
        Blade::Lobed => paint_oak(canvas, color, random),
        Blade::Pinnate => paint_pecan(canvas, color, random),
        Blade::Toothed => paint_birch(canvas, color, random),
    }
}

fn paint_oak(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    let end = Vec2::new(0.02, 0.50);
    stroke(canvas, Vec2::ZERO, end, [0.016, 0.009], STALK);
    for i in 0..OAK_LEAVES {
        let share = i as f32 / (OAK_LEAVES - 1) as f32;
        let foot = end * (0.22 + 0.78 * share);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.55 - 1.25 * share) + 0.12 * random.signed();
        let length = random.vary(0.44, 0.04);
        let leaf = Placed { foot, angle, length, bend: -0.10 * side, shade: shade(share, random) };
        leaf.paint(canvas, color, blade::oak);
    }
    let last = Placed { foot: end, angle: 0.06, length: 0.48, bend: 0.03, shade: 1.05 };
    last.paint(canvas, color, blade::oak);
}

fn paint_birch(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    let end = Vec2::new(-0.02, 0.72);
    stroke(canvas, Vec2::ZERO, end, [0.012, 0.006], BIRCH_TWIG);
    for i in 0..BIRCH_LEAVES {
        let share = i as f32 / (BIRCH_LEAVES - 1) as f32;
        let node = end * (0.12 + 0.88 * share);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.35 - 0.75 * share) + 0.15 * random.signed();
        let foot = node + direction(angle) * 0.07;
        stroke(canvas, node, foot, [0.006, 0.004], STALK);
        let length = random.vary(0.30, 0.03);
        let leaf = Placed { foot, angle: 0.85 * angle, length, bend: 0.08 * side, shade: shade(share, random) };
        leaf.paint(canvas, color, blade::birch);
    }
    let last = Placed { foot: end, angle: -0.1, length: 0.27, bend: 0.04, shade: 1.05 };
    last.paint(canvas, color, blade::birch);
}

fn paint_pecan(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    for i in 0..PECAN_LEAVES {
        let lean = [-0.62, 0.58, -0.03][i as usize % 3];
        let length = [0.74, 0.76, 0.80][i as usize % 3];
        paint_compound_leaf(canvas, shaded(color, [0.88, 0.95, 1.03][i as usize % 3]), lean, length, random);
    }
}

/// Leaflets in pairs along a stalk that bows outwards.
fn paint_compound_leaf(canvas: &mut Canvas, color: [f32; 3], lean: f32, length: f32, random: &mut Random) {
    let at = |share: f32| {
        let angle = lean * (0.45 + 0.55 * share);
        direction(angle) * length * share
    };
    for pair in 0..PECAN_PAIRS {
        let share = 0.30 + 0.70 * pair as f32 / PECAN_PAIRS as f32;
        stroke(canvas, at(share - 0.15), at(share), [0.009, 0.008], STALK);
        stroke(canvas, Vec2::ZERO, at(0.15), [0.012, 0.009], STALK);
        for side in [-1.0, 1.0] {
            let angle = lean + side * random.vary(1.05 - 0.35 * share, 0.06);
            // Leaflets grow towards the end of the leaf.
            let leaflet = length * (0.20 + 0.13 * share) * random.vary(1.0, 0.06);
            let shade = shade(share, random);
            let placed = Placed { foot: at(share), angle, length: leaflet, bend: -0.22 * side, shade };
            placed.paint(canvas, color, blade::pecan);
        }
    }
    stroke(canvas, at(0.85), at(1.0), [0.008, 0.006], STALK);
    let last = Placed { foot: at(1.0), angle: lean, length: 0.28 * length, bend: 0.05, shade: 1.05 };
    last.paint(canvas, color, blade::pecan);
}

/// Leaves lower on the shoot are darker, no two alike.
fn shade(share: f32, random: &mut Random) -> f32 {
    random.vary(0.84 + 0.16 * share, 0.07)
}

/// Unit vector at `angle` radians from straight up, to the right.
fn direction(angle: f32) -> Vec2 {
    let (sin, cos) = sin_cos(angle);
    Vec2::new(sin, cos)
}

impl Placed {
    fn paint(&self, canvas: &mut Canvas, color: [f32; 3], blade: fn(Vec2, [f32; 3]) -> Option<[f32; 3]>) {
        let along = direction(self.angle);
        let across = Vec2::new(along.y, -along.x);
        let color = mixed(shaded(color, self.shade), [0.5, 0.5, 0.2], 0.06);
        canvas.stamp(self.foot + along * 0.5 * self.length, 0.75 * self.length, |p| {
            let from_foot = (p - self.foot) / self.length;
            let (x, y) = (from_foot.dot(across), from_foot.dot(along));
            blade(Vec2::new(x - self.bend * y * y, y), color)
        });
    }
}

/// A straight stalk from `a` to `b`, of half the widths given.
fn stroke(canvas: &mut Canvas, a: Vec2, b: Vec2, widths: [f32; 2], color: [f32; 3]) {
    let span = b - a;
    let length_squared = span.length_squared().max(1e-9);
    canvas.stamp((a + b) * 0.5, 0.5 * span.length() + widths[0], |p| {
        let share = ((p - a).dot(span) / length_squared).clamp(0.0, 1.0);
        let half_width = 0.5 * (widths[0] + (widths[1] - widths[0]) * share);
        let distance = p.distance(a + span * share);
        (distance <= half_width).then(|| shaded(color, 1.1 - 0.3 * distance / half_width))
    });
}
