//! Bakes a model's impostor: draws all of its leaves and wood from every direction of a lattice.
//!
//! Each frame is orthographic and has the bounding sphere of the plant in its middle. The same
//! model gives the same bytes on any machine and any number of threads.

use super::{
    list::DrawList,
    painter::Painter,
    sprite::PlacedImpostor,
    tile::Surfaces,
    {Background, DrawOptions},
};
use crate::{
    Camera, Depth, Error, LookAt, Result,
    bounds::{Aabb, Sphere},
    draw::{
        mips::srgb_from_linear,
        pages::{Pages, surface_texel},
    },
    error::check_range,
    model::{FRAME_SIDES, FRAMES_ACROSS, FoliageModel, Impostor, Lattice},
};
use glam::{DAffine3, DMat4, DVec3, DVec4, Vec3};
use rayon::prelude::*;

/// Pixels along each side of a texel.
const PIXELS_PER_TEXEL: u32 = 2;
/// Frames that are drawn before progress is told: one may take 30 MB.
const BATCH: u32 = 8;
/// Diameters in pixels at which coverage is compared, and views at each.
const CORRECTED_AT: [u32; 2] = [64, 32];
const CORRECTION_VIEWS: u32 = 8;
/// Exponents of coverage that may correct it.
const EXPONENTS: [f32; 2] = [0.25, 2.0];
/// Halvings of that range.
const HALVINGS: u32 = 7;

/// How an impostor is baked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BakeOptions {
    /// Frames along each side of the lattice: 2 to 16.
    pub across: u32,
    /// Side of a frame in texels: a multiple of 4 from 8 to 256.
    pub frame_px: u32,
    /// Whether the plant is seen from below too.
    pub is_whole_sphere: bool,
}

impl Default for BakeOptions {
    /// 12 x 12 frames of 64 texels over the upper hemisphere.
    fn default() -> Self {
        Self { across: 12, frame_px: 64, is_whole_sphere: false }
    }
}

impl BakeOptions {
    /// Checks the sizes.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first one out of its range.
    pub fn check(&self) -> Result<()> {
        check_range("bake.across", self.across, FRAMES_ACROSS[0]..=FRAMES_ACROSS[1])?;
        check_range("bake.frame_px", self.frame_px, FRAME_SIDES[0]..=FRAME_SIDES[1])?;
        if self.frame_px.is_multiple_of(4) {
            return Ok(());
        }
        Err(Error::invalid("bake.frame_px", self.frame_px, "a multiple of 4"))
    }
}

/// Bakes the impostor of a model. `advance` is told the number of frames drawn, of
/// `options.across` squared; baking stops if it returns false.
///
/// Coverage is corrected by one exponent, so that sprites cover as much as the plant does, on
/// average over views between the frames.
///
/// # Errors
/// [`Error::InvalidOption`] for options out of range or a plant without extent,
/// [`Error::Unreadable`] for a damaged texture, [`Error::Interrupted`] if `advance` returns false.
pub fn bake(model: &FoliageModel, options: &BakeOptions, advance: &mut dyn FnMut(u64) -> bool) -> Result<Impostor> {
    options.check()?;
    let BakeOptions { across, frame_px, is_whole_sphere } = *options;
    let sphere = model.sphere();
    if sphere.radius.is_nan() || sphere.radius <= 0.0 {
        return Err(Error::invalid("model", "a single point", "a plant with an extent"));
    }
    let lattice = Lattice { across, is_whole_sphere };
    let half_side = Impostor::half_side_of(sphere.radius as f32, frame_px);
    let list = DrawList::of_model(model, model.leaves.len());
    let painter = Painter::new(&model.materials, &model.textures)?;
    let center = sphere.center();
    let frame = |frame: u32| {
        let camera = camera(center, f64::from(half_side), lattice.direction(frame), frame_px * PIXELS_PER_TEXEL);
        let pixels = painter.surfaces(&list, &camera, [frame_px * PIXELS_PER_TEXEL; 2])?;
        Ok(texels(&pixels, frame_px, lattice.direction(frame)))
    };
    let mut frames = Vec::with_capacity(lattice.frames() as usize);
    for first in (0..lattice.frames()).step_by(BATCH as usize) {
        if !advance(u64::from(first)) {
            return Err(Error::Interrupted);
        }
        let batch = first..(first + BATCH).min(lattice.frames());
        frames.extend(batch.into_par_iter().map(frame).collect::<Result<Vec<_>>>()?);
    }
    let (color, surface): (Vec<[u8; 4]>, Vec<[u8; 4]>) = frames.into_iter().flatten().unzip();
    let impostor = Impostor {
        lattice,
        frame_px,
        center: center.as_vec3().to_array(),
        half_side,
        color: color.into_flattened(),
        surface: surface.into_flattened(),
    };
    corrected(impostor, &painter, &list, &sphere)
}

/// The orthographic camera of a frame.
fn camera(center: DVec3, half_side: f64, towards_viewer: Vec3, side_px: u32) -> Camera {
    let [right, up] = Lattice::axes(towards_viewer).map(Vec3::as_dvec3);
    let towards = towards_viewer.as_dvec3();
    let row = |axis: DVec3, scale: f64, offset: f64| (axis * scale).extend(offset - axis.dot(center) * scale);
    let rows =
        [row(right, 1.0 / half_side, 0.0), row(up, 1.0 / half_side, 0.0), row(towards, 0.5 / half_side, 0.5), DVec4::W];
    Camera {
        clip_from_world: DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose(),
        // Far enough that surfaces are turned towards it as seen along parallel rays.
        eye: center + towards * (1e4 * half_side),
        height_px: side_px,
        depth: Depth::Reversed,
    }
}

/// Bytes of both pages of the frame whose pixels are these, several to a texel.
fn texels(pixels: &[Surfaces], frame_px: u32, towards: Vec3) -> Vec<([u8; 4], [u8; 4])> {
    let [right, up] = Lattice::axes(towards);
    let row_px = (frame_px * PIXELS_PER_TEXEL) as usize;
    let texel = |at: u32| {
        let [x, y] = [at % frame_px, at / frame_px].map(|at| (at * PIXELS_PER_TEXEL) as usize);
        let mut sum = Surfaces::default();
        let side = PIXELS_PER_TEXEL as usize;
        (0..side * side).for_each(|i| sum.add(&pixels[(y + i / side) * row_px + x + i % side]));
        if sum.samples == 0.0 {
            return ([0; 4], [0; 4]);
        }
        let all = super::samples::SAMPLES as f32 * (side * side) as f32;
        let [r, g, b] = (sum.albedo / sum.samples).to_array().map(srgb_from_linear);
        // A sliver of a surface stays one.
        let coverage = ((sum.samples / all * 255.0 + 0.5) as u8).max(1);
        let normal = sum.normal / sum.samples;
        let parts = [normal.dot(right), normal.dot(up), normal.dot(towards).max(0.0)];
        let is_leaf = sum.leaves >= 0.5 * sum.samples;
        ([r, g, b, coverage], surface_texel(parts, sum.depth / sum.samples, is_leaf))
    };
    (0..frame_px * frame_px).map(texel).collect()
}

/// The impostor with the coverage of its texels raised to the power with which sprites cover as
/// much as the plant does.
fn corrected(impostor: Impostor, painter: &Painter<'_>, list: &DrawList<'_>, sphere: &Sphere) -> Result<Impostor> {
    let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
    let views: Vec<Camera> = CORRECTED_AT.into_iter().flat_map(|side| views(sphere, side)).collect();
    let covered = |image: &super::Image| {
        image.rgba.iter().skip(3).step_by(4).map(|&alpha| u64::from(alpha)).sum::<u64>() as f32
            / (image.width * image.height) as f32
    };
    let plant: Vec<f32> = views
        .par_iter()
        .map(|camera| Ok(covered(&painter.draw(list, camera, [camera.height_px; 2], &options)?)))
        .collect::<Result<_>>()?;
    let wanted: f32 = plant.iter().sum();
    let raised = |exponent: f32| {
        let mut raised = impostor.clone();
        for alpha in raised.color.iter_mut().skip(3).step_by(4).filter(|alpha| **alpha > 0) {
            let coverage = libm::powf(f32::from(*alpha) / 255.0, exponent);
            *alpha = ((coverage * 255.0 + 0.5) as u8).max(1);
        }
        raised
    };
    let found = |impostor: &Impostor| -> Result<f32> {
        let pages = Pages::new(impostor);
        let placed = PlacedImpostor {
            impostor,
            pages: &pages,
            crown: Aabb::EMPTY,
            world_from_plant: DAffine3::IDENTITY,
            sway: None,
            share: 1.0,
        };
        let of_view = |camera: &Camera| {
            let image = painter.draw_all(&[], &[placed], camera, [camera.height_px; 2], &options)?;
            Ok(covered(&image))
        };
        Ok(views.par_iter().map(of_view).collect::<Result<Vec<_>>>()?.into_iter().sum())
    };
    // The greater the exponent, the less is covered.
    let [mut low, mut high] = EXPONENTS;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if found(&raised(middle))? > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(raised(0.5 * (low + high)))
}

/// Views between the frames, all around and from level to steep.
fn views(sphere: &Sphere, side_px: u32) -> impl Iterator<Item = Camera> {
    (0..CORRECTION_VIEWS).map(move |i| {
        let turn = 0.37 + f64::from(i) * std::f64::consts::TAU / f64::from(CORRECTION_VIEWS);
        let height = 0.07 + 0.11 * f64::from(i * 3 % CORRECTION_VIEWS);
        let direction = DVec3::new(libm::sin(turn), height, libm::cos(turn));
        LookAt::framing(sphere, direction, 0.2, 1.0).camera(side_px)
    })
}
