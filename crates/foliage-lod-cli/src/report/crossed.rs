//! Crossed cards, the plain way to draw a plant far away: upright quads through its middle, each
//! with a picture of the plant from its side, cut out where the plant is not.
//!
//! Limits: the pictures are an impostor's, at its frames nearest to level and a sixth of a turn
//! apart; from above, cards show their edges.

use foliage_lod::{
    Plant, Result,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat, Wrap},
    model::{Impostor, Lattice},
    software::Image,
};
use glam::Vec3;
use std::f32::consts::PI;

/// Number of cards.
const CARDS: u32 = 3;

/// The cards as a plant, each of them a leaf. `gain` multiplies their colours.
pub(super) fn crossed(impostor: &Impostor, gain: f32) -> Result<Plant> {
    let mut plant = Plant { name: "crossed cards".into(), ..Plant::default() };
    for card in 0..CARDS {
        let (sin, cos) = (PI * card as f32 / CARDS as f32).sin_cos();
        let around = impostor.lattice.around(Vec3::new(sin, 0.0, cos));
        let frame = around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(frame, _)| frame);
        plant.textures.push(Texture {
            name: format!("side {card}"),
            format: TextureFormat::Png,
            bytes: picture(impostor, frame).encode_png()?,
        });
        plant.materials.push(Material {
            name: format!("side {card}"),
            base_color: [gain, gain, gain, 1.0],
            texture: Some(card),
            wrap: [Wrap::Clamp; 2],
            alpha_mode: AlphaMode::Mask,
            double_sided: true,
            ..Material::default()
        });
        let towards = impostor.lattice.direction(frame);
        let [right, up] = Lattice::axes(towards);
        let corner = |[u, v]: [f32; 2]| {
            let at = (right * (2.0 * u - 1.0) + up * (1.0 - 2.0 * v)) * impostor.half_side;
            Vertex {
                position: (Vec3::from(impostor.center) + at).to_array(),
                normal: towards.to_array(),
                uv: [u, v],
                color: [1.0; 4],
            }
        };
        let corners = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(corner);
        plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], impostor.center, card);
    }
    Ok(plant)
}

/// A frame's colours and coverage; what is not covered has the mean colour, so that filtering
/// leaves no dark seam.
fn picture(impostor: &Impostor, frame: u32) -> Image {
    let side = impostor.frame_px;
    let bytes = (4 * side * side) as usize;
    let mut rgba = impostor.color[frame as usize * bytes..][..bytes].to_vec();
    let (mut sum, mut count) = ([0_u64; 3], 0);
    for texel in rgba.chunks_exact(4).filter(|texel| texel[3] > 0) {
        sum.iter_mut().zip(texel).for_each(|(sum, &byte)| *sum += u64::from(byte));
        count += 1;
    }
    let mean = sum.map(|sum| (sum / u64::max(count, 1)) as u8);
    rgba.chunks_exact_mut(4).filter(|texel| texel[3] == 0).for_each(|texel| texel[..3].copy_from_slice(&mean));
    Image { width: side, height: side, rgba }
}
