//! Paints a leaf card: a spray of leaves on its shoot, or compound leaves on their stalks.

use super::{blade, canvas::Canvas, mixed, shaded, unit_color};
use crate::grow::{
    frame::sin_cos,
    species::{Blade, LeafStyle},
};
use crate::random::Random;
use glam::Vec2;

/// Number of leaves on each shoot of an oak spray; English oak crowds them at the end of the shoot.
const OAK_LEAVES: u32 = 7;
/// Number of leaves along the shoot of a birch spray, besides the one at its end.
const BIRCH_LEAVES: u32 = 11;
/// Compound leaves of a pecan spray: lean in radians, length, and brightness.
const PECAN_LEAVES: [(f32, f32, f32); 3] = [(-0.50, 0.70, 0.86), (0.46, 0.72, 0.93), (-0.02, 0.80, 1.03)];
/// Number of leaflet pairs of a pecan leaf, besides the leaflet at its end (nine to seventeen
/// leaflets in nature).
const PECAN_PAIRS: u32 = 6;
/// Number of straight segments of the bowed stalk of a compound leaf.
const STALK_PIECES: u32 = 6;
/// Number of blades of a tuft of grass.
const GRASS_BLADES: u32 = 9;
/// Number of straight pieces of a blade of grass.
const GRASS_PIECES: u32 = 8;
/// Number of leaflet pairs of a fern's pinna.
const FERN_PAIRS: u32 = 15;
/// sRGB colour of young shoots and stalks.
const STALK: [f32; 3] = [0.40, 0.38, 0.20];
/// sRGB colour of the drooping twigs of the gray birch.
const BIRCH_TWIG: [f32; 3] = [0.36, 0.25, 0.16];

/// One leaf of a spray.
struct Placed {
    foot: Vec2,
    /// Angle in radians from straight up, clockwise.
    angle: f32,
    length: f32,
    /// Sideways bend of the tip, as a fraction of the length.
    bend: f32,
    /// Brightness factor applied to the colour.
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
        Blade::Grass => paint_grass(canvas, color, random),
        Blade::Pinna => paint_pinna(canvas, color, random),
    }
}

/// Paints three shoots, each with its leaves crowded around its end.
fn paint_oak(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    let shoots = [
        (Vec2::new(0.0, 0.10), Vec2::new(-0.18, 0.38), -0.80),
        (Vec2::new(0.0, 0.18), Vec2::new(0.19, 0.48), 0.75),
        (Vec2::ZERO, Vec2::new(0.01, 0.65), -0.05),
    ];
    for (number, (foot, end, angle)) in shoots.into_iter().enumerate() {
        stroke(canvas, foot, end, [0.016, 0.009], STALK);
        let light = 0.84 + 0.08 * number as f32;
        for i in 0..OAK_LEAVES {
            // From the sides inwards, so the middle leaf is on top.
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let share = 1.0 - i as f32 / (OAK_LEAVES - 1) as f32;
            let turn = angle + side * 1.75 * share + 0.14 * random.signed();
            let foot = end - (end - foot) * 0.32 * share;
            let shade = light * random.vary(1.0 - 0.12 * share, 0.06);
            let length = random.vary(0.33, 0.02);
            Placed { foot, angle: turn, length, bend: -0.10 * side, shade }.paint(canvas, color, blade::oak);
        }
    }
}

/// Paints leaves alternating along the drooping shoot, each on its stalk.
fn paint_birch(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    let end = Vec2::new(-0.02, 0.72);
    stroke(canvas, Vec2::ZERO, end, [0.012, 0.006], BIRCH_TWIG);
    for i in 0..BIRCH_LEAVES {
        let share = i as f32 / (BIRCH_LEAVES - 1) as f32;
        let node = end * (0.16 + 0.84 * share);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.30 - 0.75 * share) + 0.15 * random.signed();
        let foot = node + direction(angle) * 0.08;
        stroke(canvas, node, foot, [0.006, 0.004], STALK);
        let length = random.vary(0.30, 0.03);
        let leaf = Placed { foot, angle: 0.85 * angle, length, bend: 0.08 * side, shade: shade(share, random) };
        leaf.paint(canvas, color, blade::birch);
    }
    let last = Placed { foot: end, angle: -0.1, length: 0.25, bend: 0.04, shade: 1.05 };
    last.paint(canvas, color, blade::birch);
}

/// Paints compound leaves in a fan, the middle one on top.
fn paint_pecan(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    for (lean, length, light) in PECAN_LEAVES {
        paint_compound_leaf(canvas, shaded(color, light), lean, length, random);
    }
}

/// Paints blades that rise from the foot and bow to their own side, the outer ones first and
/// shorter.
fn paint_grass(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    let half_width = canvas.half_width();
    for i in 0..GRASS_BLADES {
        // From the sides inwards.
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let out = 1.0 - i as f32 / GRASS_BLADES as f32;
        let foot = Vec2::new(side * 0.22 * out * half_width, 0.0);
        let tip = Vec2::new(side * random.vary(0.75 * out, 0.15) * half_width, random.vary(0.96 - 0.4 * out, 0.03));
        let wide = random.vary(0.032, 0.006);
        let light = random.vary(1.0 - 0.22 * out, 0.08);
        // Upright at the foot, leaning more and more.
        let at = |share: f32| Vec2::new(foot.x + (tip.x - foot.x) * share * share, tip.y * share);
        for piece in 0..GRASS_PIECES {
            let [from, to] = [piece, piece + 1].map(|i| i as f32 / GRASS_PIECES as f32);
            let widths = [from, to].map(|share| wide * (1.0 - share * share) + 0.004);
            let pale = mixed(shaded(color, light * (0.72 + 0.4 * from)), [0.62, 0.62, 0.36], 0.25 * from);
            stroke(canvas, at(from), at(to), widths, pale);
        }
    }
}

/// Paints a rib with leaflets in pairs, the tip last.
fn paint_pinna(canvas: &mut Canvas, color: [f32; 3], random: &mut Random) {
    stroke(canvas, Vec2::ZERO, Vec2::new(0.0, 0.96), [0.018, 0.005], STALK);
    let reach = 0.96 * canvas.half_width();
    for pair in 0..FERN_PAIRS {
        let share = pair as f32 / FERN_PAIRS as f32;
        let length = reach * (1.0 - share).sqrt() * random.vary(1.02 - 0.1 * share, 0.03);
        for side in [-1.0, 1.0] {
            let foot = Vec2::new(0.0, 0.03 + 0.92 * share);
            let angle = side * random.vary(1.28 - 0.35 * share, 0.05);
            let leaflet = Placed { foot, angle, length, bend: -0.12 * side, shade: shade(share, random) };
            leaflet.paint(canvas, color, blade::fern);
        }
    }
    let last = Placed { foot: Vec2::new(0.0, 0.9), angle: 0.0, length: 0.1, bend: 0.0, shade: 1.05 };
    last.paint(canvas, color, blade::fern);
}

/// Paints leaflets in pairs along a stalk that bows outwards.
fn paint_compound_leaf(canvas: &mut Canvas, color: [f32; 3], lean: f32, length: f32, random: &mut Random) {
    let at = |share: f32| direction(lean * (0.6 + 0.4 * share)) * length * share;
    for piece in 0..STALK_PIECES {
        let [from, to] = [piece, piece + 1].map(|i| i as f32 / STALK_PIECES as f32);
        stroke(canvas, at(from), at(to), [0.013 - 0.006 * from, 0.013 - 0.006 * to], STALK);
    }
    for pair in 0..PECAN_PAIRS {
        let share = 0.24 + 0.74 * pair as f32 / PECAN_PAIRS as f32;
        for side in [-1.0, 1.0] {
            let angle = lean + side * random.vary(1.12 - 0.45 * share, 0.07);
            // Leaflets are larger towards the end of the leaf.
            let leaflet = length * (0.25 + 0.13 * share) * random.vary(1.0, 0.06);
            let shade = shade(share, random);
            let placed = Placed { foot: at(share), angle, length: leaflet, bend: -0.20 * side, shade };
            placed.paint(canvas, color, blade::pecan);
        }
    }
    let last = Placed { foot: at(1.0), angle: lean, length: 0.26 * length, bend: 0.05, shade: 1.05 };
    last.paint(canvas, color, blade::pecan);
}

/// Random brightness, darker for leaves lower on the shoot.
fn shade(share: f32, random: &mut Random) -> f32 {
    random.vary(0.84 + 0.16 * share, 0.07)
}

/// Unit vector at `angle` radians clockwise from straight up.
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

/// Paints a straight stalk from `a` to `b`; `widths` are its widths at the two ends.
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
