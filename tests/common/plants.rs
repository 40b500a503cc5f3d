//! Small plants with every kind of leaf, generated from a seed.

use foliage_lod::{
    Plant,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat},
    plant::WoodPart,
};
use glam::{Quat, Vec3};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// A number from 0 up to but not including 1.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A point in the unit ball.
    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let p = Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if p.length_squared() <= 1.0 {
                return p;
            }
        }
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.in_ball();
            if p.length_squared() > 0.01 {
                return p.normalize();
            }
        }
    }
}

pub fn vertex(position: Vec3, normal: Vec3, uv: [f32; 2]) -> Vertex {
    Vertex { position: position.to_array(), normal: normal.to_array(), uv, color: [1.0; 4] }
}

/// An empty plant with one opaque material.
pub fn bare(name: &str) -> Plant {
    Plant {
        name: name.into(),
        materials: vec![Material { name: "leaf".into(), ..Material::default() }],
        ..Plant::default()
    }
}

/// Adds a flat card: `base` is the middle of its base edge, `along` its length, `across` its width.
pub fn push_card(plant: &mut Plant, base: Vec3, along: Vec3, across: Vec3, pivot: Vec3) {
    let (vertices, indices) = card(base, along, across);
    plant.push_leaf(&vertices, &indices, pivot.to_array(), 0);
}

fn card(base: Vec3, along: Vec3, across: Vec3) -> (Vec<Vertex>, Vec<u32>) {
    let normal = along.cross(across).try_normalize().unwrap_or(Vec3::Y);
    let corner = |u: f32, v: f32| vertex(base + across * (u - 0.5) + along * v, normal, [u, v]);
    (vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], vec![0, 1, 2, 0, 2, 3])
}

fn card_axes(random: &mut Random, size: f32) -> (Vec3, Vec3) {
    let along = random.direction() * size;
    let across = along.cross(random.direction()).try_normalize().unwrap_or(Vec3::X) * size * 0.7;
    (along, across)
}

/// Randomly oriented cards in a ball of radius 1. Their projections cover the ball's silhouette
/// about `layers` times.
pub fn quads(count: usize, layers: f32, seed: u64) -> Plant {
    let mut random = Random(seed);
    let mut plant = bare("quads");
    let size = (layers * 8.0 / count as f32).sqrt();
    for _ in 0..count {
        let base = random.in_ball();
        let (along, across) = card_axes(&mut random, size);
        push_card(&mut plant, base, along, across, base);
    }
    plant
}

/// Fronds of four triangles, bent along their length.
pub fn bent(count: usize, seed: u64) -> Plant {
    let mut random = Random(seed);
    let mut plant = bare("bent");
    let size = (24.0 / count as f32).sqrt();
    for _ in 0..count {
        let base = random.in_ball();
        let (along, across) = card_axes(&mut random, size);
        let normal = along.cross(across).normalize() * size * 0.3;
        let mut vertices = Vec::new();
        for (v, lift) in [(0.0, 0.0), (0.5, 1.0), (1.0, 0.2)] {
            for u in [0.0, 1.0] {
                vertices.push(vertex(base + along * v + across * (u - 0.5) + normal * lift, normal, [u, v]));
            }
        }
        plant.push_leaf(&vertices, &[0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4], base.to_array(), 0);
    }
    plant
}

/// Leaves of two cards crossed at right angles; the pivot is their common centre.
pub fn crossed(count: usize, seed: u64) -> Plant {
    let mut random = Random(seed);
    let mut plant = bare("crossed");
    let size = (16.0 / count as f32).sqrt();
    for _ in 0..count {
        let centre = random.in_ball();
        let (along, across) = card_axes(&mut random, size);
        let turned = along.cross(across).normalize() * size * 0.7;
        let (mut vertices, mut indices) = card(centre - along * 0.5, along, across);
        let (more, triangles) = card(centre - along * 0.5, along, turned);
        indices.extend(triangles.iter().map(|index| index + 4));
        vertices.extend(more);
        plant.push_leaf(&vertices, &indices, centre.to_array(), 0);
    }
    plant
}

/// Leaves of 24 vertices that are one leaf turned, scaled and placed at random; every third has the
/// texture of another, and each its own colour.
pub fn repeated(count: usize, seed: u64) -> Plant {
    let mut random = Random(seed);
    let mut plant = bare("repeated");
    let strip: Vec<u32> = (0..11).flat_map(|row| [0, 1, 3, 0, 3, 2].map(|corner| 2 * row + corner)).collect();
    for leaf in 0..count {
        let turn = Quat::from_scaled_axis(random.in_ball() * 3.0);
        let (size, place) = (0.2 * random.between(0.75, 1.25), random.in_ball());
        let color = [0; 3].map(|_: u32| random.unit());
        let corner = |i: u32| {
            let (along, side) = ((i / 2) as f32 / 11.0, (i % 2) as f32 - 0.5);
            let at = Vec3::new(side * (1.0 - along * along), along, 0.4 * along * along);
            let normal = Vec3::new(0.3 * side, -0.8 * along, 1.0).normalize();
            let uv = [side + 0.5 + (leaf % 3 / 2) as f32, along];
            let vertex = vertex(place + turn * at * size, turn * normal, uv);
            Vertex { color: [color[0], color[1], color[2], 1.0], ..vertex }
        };
        let vertices: Vec<Vertex> = (0..24).map(corner).collect();
        plant.push_leaf(&vertices, &strip, place.to_array(), 0);
    }
    plant
}

/// Every second leaf coincides with the one before, with reversed winding.
pub fn twins(count: usize, seed: u64) -> Plant {
    let mut random = Random(seed);
    let mut plant = bare("twins");
    let size = (24.0 / count as f32).sqrt();
    for _ in 0..count / 2 {
        let base = random.in_ball();
        let (along, across) = card_axes(&mut random, size);
        let (vertices, indices) = card(base, along, across);
        plant.push_leaf(&vertices, &indices, base.to_array(), 0);
        let reversed: Vec<u32> = indices.iter().rev().copied().collect();
        plant.push_leaf(&vertices, &reversed, base.to_array(), 0);
    }
    plant
}

/// Cards around a trunk and a slab of wood, which hide part of them.
pub fn with_wood(count: usize, seed: u64) -> Plant {
    let mut plant = quads(count, 3.0, seed);
    plant.name = "wood".into();
    plant.materials.push(Material { name: "bark".into(), ..Material::default() });
    let slab = |low: Vec3, high: Vec3, plant: &mut Plant| {
        let first = plant.wood.vertices.len() as u32;
        for i in 0..8 {
            let pick = |bit: u32, axis: usize| if i >> bit & 1 == 1 { high[axis] } else { low[axis] };
            plant.wood.vertices.push(vertex(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2)), Vec3::Y, [0.0; 2]));
        }
        for face in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            for corner in [0, 1, 2, 0, 2, 3] {
                plant.wood.indices.push(first + face[corner]);
            }
        }
    };
    slab(Vec3::new(-0.1, -1.0, -0.1), Vec3::new(0.1, 0.8, 0.1), &mut plant);
    slab(Vec3::new(-0.7, -0.05, -0.2), Vec3::new(0.7, 0.05, 0.25), &mut plant);
    plant.wood.parts.push(WoodPart { indices: [0, plant.wood.indices.len() as u32], material: 1 });
    plant
}

/// Cards with holes: their texture has 8 x 8 texels with an opaque ring.
pub fn masked(count: usize, seed: u64) -> Plant {
    let mut plant = quads(count, 3.0, seed);
    plant.name = "masked".into();
    plant.materials[0].alpha_mode = AlphaMode::Mask;
    plant.materials[0].texture = Some(0);
    let ring = |x: i32, y: i32| (4..14).contains(&((2 * x - 7).pow(2) / 4 + (2 * y - 7).pow(2) / 4));
    let pixels = (0..64).flat_map(|i| [80, 160, 60, if ring(i % 8, i / 8) { 255 } else { 0 }]).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_raw(8, 8, pixels).unwrap();
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    plant.textures.push(Texture { name: "ring".into(), format: TextureFormat::Png, bytes: bytes.into_inner() });
    plant
}

/// A closed box of six cards.
pub fn closed_box(min: Vec3, max: Vec3) -> Plant {
    let mut plant = bare("box");
    plant.materials[0].double_sided = true;
    let edges = max - min;
    for axis in 0..3 {
        let edge = |turn: usize| Vec3::AXES[(axis + turn) % 3] * edges[(axis + turn) % 3];
        for corner in [min, min + edge(0)] {
            let base = corner + edge(2) * 0.5;
            push_card(&mut plant, base, edge(1), edge(2), base);
        }
    }
    plant
}
