//! Leaf cards, distributed over the thinnest stems in exactly the requested number.
//!
//! After Weber & Penn 1995, section 4.5 (leaves along the last stems, placed like children) and 4.9
//! (leaves turn towards the light). Where we differ: the leaf count applies to the whole tree and
//! is distributed over the total bearing length of the twigs, so that any number is met exactly;
//! the card size depends on the count so that the crown stays as dense.

use super::{
    paint::linear,
    species::{LeafStyle, Species},
    stem::{Node, Stem},
};
use crate::random::Random;
use crate::{Plant, leaf::Vertex};
use glam::Vec3;

/// Bounds of the factor applied to card size if the leaf count is not that of the species.
const SIZE_FACTOR: [f32; 2] = [0.25, 3.0];
/// Maximum random shift of a leaf along its twig, either way, as a fraction of the even spacing.
const SPACING_JITTER: f32 = 0.4;
/// Maximum random rotation of a leaf about its twig, either way, in degrees.
const ROLL_JITTER: f32 = 40.0;
/// Weight of light from outside relative to light from above: leaves at the sides face outwards.
const OUTWARD_LIGHT: f32 = 1.5;
/// Vertex indices of the two triangles of a card.
const CARD: [u32; 6] = [0, 1, 2, 0, 2, 3];
/// Separates the random stream of the leaves from that of the stems.
const LEAF_STREAM: u64 = 0x6C65_6166;

/// A stem that bears leaves, from `from` to its tip.
struct Twig<'a> {
    stem: &'a Stem,
    from: f32,
    /// Bearing length of this and all earlier twigs, in metres.
    end_m: f64,
}

/// Appends `count` leaves with material `material`.
pub(super) fn push_leaves(plant: &mut Plant, species: &Species, stems: &[Stem], count: u32, seed: u64, material: u32) {
    let twigs = bearing_twigs(species, stems);
    let foliage = Foliage::new(species, &twigs, count);
    let total_m = twigs.last().map_or(0.0, |twig| twig.end_m);
    let (mut twig, mut start_m, mut on_twig) = (0, 0.0, 0);
    for i in 0..count {
        let mut random = Random::of_part(seed ^ LEAF_STREAM, u64::from(i));
        let place = f64::from(i) + 0.5 + f64::from(SPACING_JITTER * random.signed());
        let at_m = place / f64::from(count) * total_m;
        while at_m >= twigs[twig].end_m && twig + 1 < twigs.len() {
            (start_m, on_twig) = (twigs[twig].end_m, 0);
            twig += 1;
        }
        let share = ((at_m - start_m) / (twigs[twig].end_m - start_m)).clamp(0.0, 1.0) as f32;
        let gathered = share + species.leaf.cluster * share * (1.0 - share);
        let node = twigs[twig].stem.at(twigs[twig].from + (1.0 - twigs[twig].from) * gathered);
        let (vertices, pivot) = foliage.card(&node, on_twig, &mut random);
        plant.push_leaf(&vertices, &CARD, pivot, material);
        on_twig += 1;
    }
}

/// Stems of the levels that bear leaves; if no stem reaches these levels, the stems of the thinnest
/// level present.
fn bearing_twigs<'a>(species: &Species, stems: &'a [Stem]) -> Vec<Twig<'a>> {
    let thinnest = stems.iter().map(|stem| stem.level).max().unwrap_or(0);
    let first_level = thinnest.min(species.levels.len() - species.leaf.levels as usize);
    let mut end_m = 0.0;
    let bearing = stems.iter().filter(|stem| stem.level >= first_level);
    bearing
        .map(|stem| {
            let bare = if stem.level == 0 { species.crown.base } else { species.levels[stem.level].bare };
            let from = bare.max(stem.foot().t);
            end_m += f64::from(stem.length * (1.0 - from));
            Twig { stem, from, end_m }
        })
        .collect()
}

/// Properties shared by all cards of a tree.
struct Foliage<'a> {
    style: &'a LeafStyle,
    length_m: f32,
    /// Mean position of the feet of the twigs: leaves face away from it.
    center: Vec3,
    /// Linear factor that turns `color` into `color_dark`.
    dark: [f32; 3],
}

impl<'a> Foliage<'a> {
    fn new(species: &'a Species, twigs: &[Twig], count: u32) -> Self {
        let style = &species.leaf;
        let density = (species.leaves as f32 / count as f32).sqrt();
        let sum: Vec3 = twigs.iter().map(|twig| twig.stem.foot().position).sum();
        let ratio = |i: usize| (linear(style.color_dark[i]) / linear(style.color[i]).max(1e-3)).min(1.0);
        Self {
            style,
            length_m: style.length_m * density.clamp(SIZE_FACTOR[0], SIZE_FACTOR[1]),
            center: sum / twigs.len().max(1) as f32,
            dark: [ratio(0), ratio(1), ratio(2)],
        }
    }

    /// Card number `on_twig` of a twig, attached at `node`: its corners and the middle of its foot.
    fn card(&self, node: &Node, on_twig: u32, random: &mut Random) -> ([Vertex; 4], [f32; 3]) {
        let style = self.style;
        let roll = (style.rotate * on_twig as f32 + ROLL_JITTER * random.signed()).to_radians();
        let down = random.vary(style.down_angle, style.down_angle_v).to_radians();
        let rolled = node.frame.rolled(roll);
        let radial = rolled.side.cross(rolled.heading);
        let foot = node.position + radial * node.radius;
        let heading = rolled.pitched(down).heading;
        let heading = (heading - Vec3::Y * style.droop).normalize_or(heading);
        let light = (Vec3::Y + OUTWARD_LIGHT * (foot - self.center).normalize_or_zero()).normalize_or(Vec3::Y);
        let facing = light * style.light + random_direction(random) * (1.0 - style.light);
        let normal = (facing - heading * facing.dot(heading)).normalize_or(heading.any_orthonormal_vector());
        let length_m = self.length_m * random.vary(1.0, style.length_v);
        let half_width = heading.cross(normal) * (0.5 * style.aspect * length_m);
        let along = heading * length_m;
        let color = self.tint(random.unit());
        let corner = |position: Vec3, uv: [f32; 2]| Vertex {
            position: position.to_array(),
            normal: normal.to_array(),
            uv,
            color,
        };
        let corners = [
            corner(foot - half_width, [0.0, 1.0]),
            corner(foot + half_width, [1.0, 1.0]),
            corner(foot + half_width + along, [1.0, 0.0]),
            corner(foot - half_width + along, [0.0, 0.0]),
        ];
        (corners, foot.to_array())
    }

    /// Colour factor from dark (`share` 0) to bright (1).
    fn tint(&self, share: f32) -> [f32; 4] {
        let mix = |dark: f32| dark + (1.0 - dark) * share;
        [mix(self.dark[0]), mix(self.dark[1]), mix(self.dark[2]), 1.0]
    }
}

/// Uniformly distributed random direction, by rejection sampling of a cube.
fn random_direction(random: &mut Random) -> Vec3 {
    loop {
        let point = Vec3::new(random.signed(), random.signed(), random.signed());
        if point.length_squared() <= 1.0 {
            return point.normalize_or(Vec3::Y);
        }
    }
}
