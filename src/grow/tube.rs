//! Wood: every stem becomes a tapered tube of bark.
//!
//! The tube of a stem starts on the axis of its parent, inside the tube of the parent, so that
//! there is no visible gap; an arm above a fork starts on the ring of the fork. Tips are closed by
//! a cone. The foot of the trunk has extra rings for the flare and the lobes (Weber & Penn 1995,
//! section 4.4).

use super::{
    frame::sin_cos,
    paint::linear,
    species::Species,
    stem::{Node, Stem},
    weber_penn::flare,
};
use crate::{
    leaf::Vertex,
    plant::{Wood, WoodPart},
};
use glam::Vec3;
use std::f32::consts::TAU;

/// Heights of the extra rings of the trunk, as fractions of its length, to resolve the flare
/// (100^(1 - 8 t)).
const FOOT_RINGS: [f32; 5] = [0.008, 0.02, 0.04, 0.07, 0.12];
/// Fraction of the trunk over which the lobes fade out, from the foot.
const LOBE_HEIGHT: f32 = 0.35;
/// Radius from which wood is fully bark, in multiples of `twig_radius_m`.
const FULL_BARK: f32 = 3.0;

/// Builds the tubes of all stems as one part with material `material`.
pub(super) fn build_wood(species: &Species, stems: &[Stem], material: u32) -> Wood {
    let mut builder = Builder { species, twig_tint: species.bark.twig_tint.map(linear), wood: Wood::default() };
    for stem in stems {
        builder.push_tube(stem);
    }
    let mut wood = builder.wood;
    let indices = [0, wood.indices.len() as u32];
    wood.parts.push(WoodPart { indices, material });
    wood
}

struct Builder<'a> {
    species: &'a Species,
    /// Linear colour factor of thin twigs.
    twig_tint: [f32; 3],
    wood: Wood,
}

impl Builder<'_> {
    fn push_tube(&mut self, stem: &Stem) {
        let rings = rings(self.species, stem);
        let sides = self.species.levels[stem.level].sides;
        let repeats = (TAU * rings[0].radius / self.species.bark.size_m).round().max(1.0);
        let first_vertex = self.wood.vertices.len() as u32;
        let (tip, along) = (rings[rings.len() - 1], &rings[..rings.len() - 1]);
        for (ring, next) in along.iter().zip(&rings[1..]) {
            let slope = (ring.radius - next.radius) / ring.position.distance(next.position).max(1e-6);
            for side in 0..=sides {
                self.push_ring_vertex(stem, ring, side as f32 / sides as f32, repeats, slope);
            }
        }
        for side in 0..sides {
            let around = (side as f32 + 0.5) / sides as f32;
            let normal = outward(&tip, around) + tip.frame.heading;
            self.push_vertex(stem, &tip, tip.position, normal, around * repeats);
        }
        push_indices(&mut self.wood.indices, first_vertex, along.len() as u32, sides);
    }

    /// Adds a ring vertex at `around` (0 to 1). The first and last vertex of a ring share a
    /// position but not a texture coordinate.
    fn push_ring_vertex(&mut self, stem: &Stem, ring: &Node, around: f32, repeats: f32, slope: f32) {
        let outward = outward(ring, around);
        let lobe = if stem.level == 0 { lobe(self.species, ring.t, around) } else { 1.0 };
        let position = ring.position + outward * ring.radius * lobe;
        self.push_vertex(stem, ring, position, outward + ring.frame.heading * slope, around * repeats);
    }

    fn push_vertex(&mut self, stem: &Stem, ring: &Node, position: Vec3, normal: Vec3, u: f32) {
        let bark = &self.species.bark;
        let barkness = ((ring.radius / bark.twig_radius_m - 1.0) / (FULL_BARK - 1.0)).clamp(0.0, 1.0);
        let [r, g, b] = self.twig_tint.map(|twig| twig + (1.0 - twig) * barkness);
        self.wood.vertices.push(Vertex {
            position: position.to_array(),
            normal: normal.normalize_or(Vec3::Y).to_array(),
            uv: [u, -ring.t * stem.length / bark.size_m],
            color: [r, g, b, 1.0],
        });
    }
}

/// Rings of the tube; for a trunk, they include [`FOOT_RINGS`] and the flare.
fn rings(species: &Species, stem: &Stem) -> Vec<Node> {
    let mut rings = stem.nodes.clone();
    if stem.level == 0 {
        if stem.foot().t == 0.0 {
            rings.extend(FOOT_RINGS.iter().map(|&t| stem.at(t)));
            rings.sort_by(|a, b| a.t.total_cmp(&b.t));
            rings.dedup_by(|a, b| a.t == b.t);
        }
        for ring in &mut rings {
            ring.radius *= flare(&species.crown, ring.t);
        }
    }
    rings
}

/// Unit vector from the axis, rotated from the side of the frame by `around` of a full turn.
fn outward(ring: &Node, around: f32) -> Vec3 {
    let (sin, cos) = if around == 1.0 { (0.0, 1.0) } else { sin_cos(TAU * around) };
    ring.frame.side * cos + ring.frame.heading.cross(ring.frame.side) * sin
}

fn lobe(species: &Species, t: f32, around: f32) -> f32 {
    let crown = &species.crown;
    let fade = (1.0 - t / LOBE_HEIGHT).max(0.0);
    1.0 + crown.lobe_depth * fade * sin_cos(TAU * around * crown.lobes as f32).0
}

/// Adds two triangles per side between rings, and one per side at the tip.
fn push_indices(indices: &mut Vec<u32>, first: u32, rings: u32, sides: u32) {
    let stride = sides + 1;
    for ring in 0..rings - 1 {
        for side in 0..sides {
            let low = first + ring * stride + side;
            let high = low + stride;
            indices.extend([low, low + 1, high + 1, low, high + 1, high]);
        }
    }
    let last_ring = first + (rings - 1) * stride;
    let tip = first + rings * stride;
    for side in 0..sides {
        indices.extend([last_ring + side, last_ring + side + 1, tip + side]);
    }
}
