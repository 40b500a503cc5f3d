//! Crossed cards, the plain way to draw a plant far away: upright quads through its trunk, each
//! with a picture of the plant from its side, cut out where the plant is not.
//!
//! Normals point away from the plant's middle and towards the viewer, so that cards are lit as one
//! round crown. Programs turn the normals of double-sided backs, which would then point inwards, so
//! each card has triangles and normals for both of its sides.
//!
//! Limits: the pictures are an impostor's, at its frames nearest to level and a third of a half
//! turn apart; from above, cards show their edges.

use crate::{
    FoliageModel, LookAt, Plant, Result,
    draw::pages::Pages,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat, Wrap, encode},
    model::{Impostor, Lattice},
    software::{Background, DrawOptions, draw_model, draw_plant},
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Diameter in pixels of a plant from which on down cards do: that of the hand-over to impostors.
pub const FAR_PX: f32 = 64.0;
/// Number of cards.
const CARDS: u32 = 3;
/// Pictures along each side of the texture.
const ACROSS: usize = 2;
/// Alpha from which on a texel is drawn, which is what programs assume where none is given.
const CUTOFF: f32 = 0.5;
/// Part of normals that points towards the viewer, where the part that points away from the middle
/// is 1 at the edge of a picture: with it, cards of an oak are as bright in three.js as the oak is.
const FACING: f32 = 0.5;
/// Part of the wood's height that is the foot of the trunk.
const FOOT: f32 = 0.05;
/// Views that coverage is compared in, their height above the horizon, and their field of view.
const VIEWS: u32 = 6;
const HEIGHT: f64 = 0.15;
const FOV_Y: f64 = 0.2;

/// Cards with pictures of a model's impostor as a plant of its own, each of them a leaf. They have
/// one material, cut out by alpha, whose texture holds all pictures. So much of the pictures is
/// drawn that all cards together cover as much as the plant does, at [`FAR_PX`] and on average over
/// six views.
///
/// # Errors
/// Those of [`draw_model`], such as a damaged texture.
pub fn far_cards(model: &FoliageModel, impostor: &Impostor) -> Result<Plant> {
    let cards = Cards::new(impostor, foot(model));
    let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
    let side = FAR_PX as u32;
    let views = (0..VIEWS).map(|view| {
        let turn = TAU * (f64::from(view) + 0.3) / f64::from(VIEWS);
        let direction = DVec3::new(libm::sin(turn), HEIGHT, libm::cos(turn));
        LookAt::framing(&model.sphere(), direction, FOV_Y, 1.0).camera(side)
    });
    let covered = |rgba: &[u8]| rgba.iter().skip(3).step_by(4).map(|&alpha| u64::from(alpha)).sum::<u64>();
    let mut wanted = 0;
    for camera in views.clone() {
        wanted += covered(&draw_model(model, model.leaves.len(), &camera, [side; 2], &options)?.rgba);
    }
    // The greatest coverage from which on texels are drawn with which enough is covered.
    let [mut enough, mut too_high] = [1_u8, u8::MAX];
    while enough + 1 < too_high {
        let least = enough + (too_high - enough) / 2;
        let plant = cards.plant(&model.name, least)?;
        let mut found = 0;
        for camera in views.clone() {
            found += covered(&draw_plant(&plant, &camera, [side; 2], &options)?.rgba);
        }
        if found >= wanted { enough = least } else { too_high = least }
    }
    cards.plant(&model.name, enough)
}

/// Pictures of the plant and where they are.
struct Cards<'a> {
    impostor: &'a Impostor,
    /// Point above or below which all cards cross.
    foot: Vec3,
    frames: Vec<u32>,
    /// Colour and coverage of the frames, one after another. What is not covered has the colours
    /// beside it, so that filtering leaves no dark seams.
    texels: Vec<u8>,
}

impl<'a> Cards<'a> {
    fn new(impostor: &'a Impostor, foot: Vec3) -> Self {
        let frame = |card: u32| {
            let turn = PI * f64::from(card) / f64::from(CARDS);
            let around = impostor.lattice.around(Vec3::new(libm::sin(turn) as f32, 0.0, libm::cos(turn) as f32));
            around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(frame, _)| frame)
        };
        let frames: Vec<u32> = (0..CARDS).map(frame).collect();
        let all = (impostor.frame_px * impostor.frame_px) as usize;
        let of_frames = |page: &'a [u8]| {
            let texels = page.as_chunks::<4>().0;
            frames.iter().flat_map(move |&frame| &texels[frame as usize * all..][..all])
        };
        let pages = Pages::of_frames(impostor.frame_px, of_frames(&impostor.color).zip(of_frames(&impostor.surface)));
        let texels = pages.levels.into_iter().next().map_or(Vec::new(), |level| level.color);
        Self { impostor, foot, frames, texels }
    }

    /// The cards, of which texels are drawn from a coverage on.
    fn plant(&self, name: &str, least: u8) -> Result<Plant> {
        let mut plant = Plant { name: name.to_owned(), ..Plant::default() };
        let side = self.impostor.frame_px as usize;
        let width = side * ACROSS;
        let mut rgba = vec![0; 4 * width * width];
        for (card, picture) in self.texels.chunks_exact(4 * side * side).enumerate() {
            let cell = [card % ACROSS, card / ACROSS];
            for (row, texels) in picture.chunks_exact(4 * side).enumerate() {
                let at = 4 * ((cell[1] * side + row) * width + cell[0] * side);
                rgba[at..at + 4 * side].copy_from_slice(texels);
            }
            if let Some(bounds) = bounds(picture, side, least) {
                self.push(&mut plant, card, cell.map(|at| at as f32), bounds);
            }
        }
        let factor = CUTOFF * 255.0 / f32::from(least);
        for alpha in rgba.iter_mut().skip(3).step_by(4) {
            // Rounded up, as texels that are just covered enough have to pass.
            *alpha = (f32::from(*alpha) * factor).ceil().min(255.0) as u8;
        }
        let bytes = encode::png(name, image::ColorType::Rgba8, [width as u32; 2], &rgba)?;
        plant.textures.push(Texture { name: "far".into(), format: TextureFormat::Png, bytes });
        plant.materials.push(Material {
            name: "far".into(),
            texture: Some(0),
            wrap: [Wrap::Clamp; 2],
            alpha_mode: AlphaMode::Mask,
            alpha_cutoff: CUTOFF,
            ..Material::default()
        });
        Ok(plant)
    }

    /// Adds the part of a card within `bounds`: two quads, left and right of the middle, on each
    /// side of it.
    fn push(&self, plant: &mut Plant, card: usize, cell: [f32; 2], [low, high]: [Vec2; 2]) {
        let Impostor { lattice, center, half_side, .. } = self.impostor;
        let towards = lattice.direction(self.frames[card]);
        let [right, up] = Lattice::axes(towards);
        // Moved along the view, which does not change what is seen, to where the cards cross.
        let from_center = self.foot - Vec3::from(*center);
        let forwards = towards * from_center.dot(towards);
        let middle = (0.5 + 0.5 * from_center.dot(right) / half_side).clamp(low.x, high.x);
        let corner = |[x, y]: [f32; 2], facing: f32| {
            let away = right * (2.0 * x - 1.0) + up * (1.0 - 2.0 * y);
            Vertex {
                position: (Vec3::from(*center) + away * *half_side + forwards).to_array(),
                normal: (away + towards * facing).normalize_or(Vec3::Y).to_array(),
                uv: ((Vec2::from(cell) + Vec2::new(x, y)) / ACROSS as f32).to_array(),
                color: [1.0; 4],
            }
        };
        let places = [low.x, middle, high.x].map(|x| [[x, high.y], [x, low.y]]);
        let side = |facing| places.as_flattened().iter().map(move |&at| corner(at, facing));
        let corners: Vec<Vertex> = side(FACING).chain(side(-FACING)).collect();
        let fronts = [0, 2].into_iter().flat_map(|i| [i, i + 2, i + 3, i, i + 3, i + 1]);
        let backs = [6, 8].into_iter().flat_map(|i| [i, i + 3, i + 2, i, i + 1, i + 3]);
        plant.push_leaf(&corners, &fronts.chain(backs).collect::<Vec<u32>>(), *center, 0);
    }
}

/// The middle of the foot of the trunk, at the height of the plant's centre; that centre of a plant
/// without wood. Cards that cross elsewhere show several trunks.
fn foot(model: &FoliageModel) -> Vec3 {
    let center = model.sphere().center().as_vec3();
    let heights = || model.wood.vertices.iter().map(|vertex| vertex.position[1]);
    let [low, high] = [heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max)];
    let is_low = |vertex: &&Vertex| vertex.position[1] <= low + FOOT * (high - low);
    let lowest: Vec<Vec3> = model.wood.vertices.iter().filter(is_low).map(|vertex| vertex.position.into()).collect();
    let sum = lowest.iter().map(|at| at.as_dvec3()).sum::<DVec3>();
    if lowest.is_empty() { center } else { (sum / lowest.len() as f64).as_vec3().with_y(center.y) }
}

/// Box around what is drawn of a picture and one texel on each side, as fractions of it.
fn bounds(picture: &[u8], side: usize, least: u8) -> Option<[Vec2; 2]> {
    let (mut low, mut high) = ([side; 2], [0; 2]);
    for (at, _) in picture.chunks_exact(4).enumerate().filter(|(_, texel)| texel[3] >= least) {
        for (axis, at) in [at % side, at / side].into_iter().enumerate() {
            low[axis] = low[axis].min(at.saturating_sub(1));
            high[axis] = high[axis].max((at + 2).min(side));
        }
    }
    let fractions = |at: [usize; 2]| Vec2::from(at.map(|at| at as f32)) / side as f32;
    (low[0] < high[0]).then(|| [fractions(low), fractions(high)])
}
