//! Crossed cards, the plain way to draw a plant far away: upright quads through its middle, each
//! with a picture of the plant from its side, cut out where the plant is not.
//!
//! Limits: the pictures are an impostor's, at its frames nearest to level and a third of a half
//! turn apart; from above, cards show their edges.

use super::coverage::keep_coverage;
use crate::{
    Plant, Result,
    draw::pages::Pages,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat, Wrap, encode},
    model::{Impostor, Lattice},
};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Diameter in pixels of a plant from which on down cards do: that of the hand-over to impostors.
pub const FAR_PX: f32 = 64.0;
/// Number of cards.
const CARDS: u32 = 3;
/// Pictures along each side of the texture.
const ACROSS: u32 = 2;
/// Alpha from which on a texel is drawn, which is what programs assume where none is given.
const CUTOFF: f32 = 0.5;

/// Cards with pictures of a plant as a plant of its own, each of them a leaf. They have one
/// material, cut out by alpha and seen from both sides, whose texture holds all pictures, and
/// normals towards the viewer that they face, since programs turn the normals of backs.
///
/// # Errors
/// None in practice: the texture is encoded in memory.
pub fn far_cards(impostor: &Impostor, name: &str) -> Result<Plant> {
    let side = impostor.frame_px as usize;
    let frames = frames(&impostor.lattice);
    let texels = |page: &[u8], frame: u32| {
        page.as_chunks::<4>().0.iter().copied().skip(frame as usize * side * side).take(side * side).collect()
    };
    let [colors, surfaces]: [Vec<Vec<[u8; 4]>>; 2] = [&impostor.color, &impostor.surface]
        .map(|page| frames.iter().map(|&frame| texels(page, frame)).collect());
    // With colours beside what is covered, so that filtering leaves no dark seams.
    let pages = Pages::of_frames(impostor.frame_px, colors.iter().flatten().zip(surfaces.iter().flatten()));
    let mut filled = pages.levels[0].color.clone();
    keep_coverage(&mut filled, CUTOFF);
    let mut plant = Plant { name: name.to_owned(), ..Plant::default() };
    let width = side * ACROSS as usize;
    let mut rgba = vec![0; 4 * width * width];
    for (card, (&frame, picture)) in frames.iter().zip(filled.chunks_exact(4 * side * side)).enumerate() {
        let cell = [card % ACROSS as usize, card / ACROSS as usize];
        for (row, texels) in picture.chunks_exact(4 * side).enumerate() {
            let at = 4 * ((cell[1] * side + row) * width + cell[0] * side);
            rgba[at..at + 4 * side].copy_from_slice(texels);
        }
        let Some([low, high]) = bounds(picture, side) else { continue };
        let towards = impostor.lattice.direction(frame);
        let [right, up] = Lattice::axes(towards);
        let corner = |at: Vec2| {
            let place = right * (2.0 * at.x - 1.0) + up * (1.0 - 2.0 * at.y);
            Vertex {
                position: (Vec3::from(impostor.center) + place * impostor.half_side).to_array(),
                normal: towards.to_array(),
                uv: ((Vec2::new(cell[0] as f32, cell[1] as f32) + at) / ACROSS as f32).to_array(),
                color: [1.0; 4],
            }
        };
        let corners = [[low.x, high.y], [high.x, high.y], [high.x, low.y], [low.x, low.y]];
        plant.push_leaf(&corners.map(|at| corner(at.into())), &[0, 1, 2, 0, 2, 3], impostor.center, 0);
    }
    let bytes = encode::png(name, image::ColorType::Rgba8, [width as u32; 2], &rgba)?;
    plant.textures.push(Texture { name: "far".into(), format: TextureFormat::Png, bytes });
    plant.materials.push(Material {
        name: "far".into(),
        texture: Some(0),
        wrap: [Wrap::Clamp; 2],
        alpha_mode: AlphaMode::Mask,
        alpha_cutoff: CUTOFF,
        double_sided: true,
        ..Material::default()
    });
    Ok(plant)
}

/// The frame of each card.
fn frames(lattice: &Lattice) -> Vec<u32> {
    let frame = |card: u32| {
        let turn = PI * card as f32 / CARDS as f32;
        let around = lattice.around(Vec3::new(libm::sinf(turn), 0.0, libm::cosf(turn)));
        around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(frame, _)| frame)
    };
    (0..CARDS).map(frame).collect()
}

/// Box around what is drawn of a picture and one texel on each side, as fractions of it.
fn bounds(picture: &[u8], side: usize) -> Option<[Vec2; 2]> {
    let (mut low, mut high) = ([side; 2], [0; 2]);
    let least = (255.0 * CUTOFF) as u8;
    for (at, _) in picture.chunks_exact(4).enumerate().filter(|(_, texel)| texel[3] > least) {
        for (axis, at) in [at % side, at / side].into_iter().enumerate() {
            low[axis] = low[axis].min(at.saturating_sub(1));
            high[axis] = high[axis].max((at + 2).min(side));
        }
    }
    let fractions = |at: [usize; 2]| Vec2::from(at.map(|at| at as f32)) / side as f32;
    (low[0] < high[0]).then(|| [fractions(low), fractions(high)])
}
