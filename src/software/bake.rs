//! Bakes a model's impostor: draws all of its leaves and wood from every direction of a lattice.
//!
//! Each frame is orthographic and has the bounding sphere of the plant in its middle. The same
//! model gives the same bytes on any number of threads.

use super::{
    list::DrawList,
    painter::{Painter, mean_color},
    sprite::PlacedImpostor,
    tile::Surfaces,
    {Background, DrawOptions, Image},
};
use crate::{
    Camera, Depth, Error, LookAt, Result,
    bounds::Sphere,
    draw::{
        light::{Lighting, TOWARDS_SUN, luminance},
        mips::srgb_from_linear,
        pages::{Pages, surface_texel},
    },
    error::check_range,
    model::{FRAME_SIDES, FRAMES_ACROSS, FoliageModel, Impostor, Lattice},
    srgb::linear_bytes,
};
use glam::{DAffine3, DMat4, DVec3, DVec4, Vec3};
use rayon::prelude::*;

/// Pixels along each side of a texel.
const PIXELS_PER_TEXEL: u32 = 2;
/// Frames that are drawn before progress is told: one may take 30 MB.
const BATCH: u32 = 8;
/// Part of a texel's difference from the mean around it that is added to it: makes up for the
/// softness of pictures that are looked up between texels.
const SHARPENING: f32 = 0.5;
/// Diameters in pixels at which coverage is compared, and views at each.
const CORRECTED_AT: [u32; 2] = [64, 32];
const CORRECTION_VIEWS: u32 = 8;
/// Views at which brightness is compared, under each of these suns.
const SUN_VIEWS: u32 = 5;
const SUNS: [Vec3; 3] = [TOWARDS_SUN, Vec3::new(-1.0, 0.4, 0.2), Vec3::new(0.3, 0.5, -1.0)];
/// Vertical field of view of these views in radians: plants that are small on screen are far away.
const VIEW_FOV_Y: f64 = 0.05;
/// Side of what they show over the plant's diameter: a sprite's soft edge reaches beyond it.
const VIEW_MARGIN: f64 = 1.1;
/// Exponents of coverage that may correct it.
const EXPONENTS: [f32; 2] = [0.25, 2.0];
/// Halvings of that range.
const HALVINGS: u32 = 7;

/// How an impostor is baked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BakeOptions {
    /// Frames along each side of the lattice: 2 to 16, at least 3 for the whole sphere.
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
        let lattice = Lattice { across: self.across, is_whole_sphere: self.is_whole_sphere };
        check_range("bake.across", self.across, lattice.least()..=FRAMES_ACROSS[1])?;
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
/// Coverage is corrected by one exponent, and colour by one factor, so that sprites cover as much
/// as the plant does and are as bright, on average over views between the frames.
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
    Compared { painter: &painter, list: &list, sphere }.corrected(impostor)
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
    let sums: Vec<Surfaces> = (0..frame_px * frame_px).map(|at| sum_of(pixels, frame_px, at)).collect();
    let all = super::samples::SAMPLES as f32 * (PIXELS_PER_TEXEL * PIXELS_PER_TEXEL) as f32;
    let texel = |(at, sum): (u32, &Surfaces)| {
        if sum.samples == 0.0 {
            return ([0; 4], [0; 4]);
        }
        let [x, y] = [at % frame_px, at / frame_px];
        let (mut around, mut count) = (Surfaces::default(), 0);
        for row in y.saturating_sub(1)..(y + 2).min(frame_px) {
            for column in x.saturating_sub(1)..(x + 2).min(frame_px) {
                around.add(&sums[(row * frame_px + column) as usize]);
                count += 1;
            }
        }
        let sharper = |own: f32, mean: f32| own + SHARPENING * (own - mean);
        let (own, mean) = (sum.albedo / sum.samples, around.albedo / around.samples);
        let [r, g, b] = [0, 1, 2].map(|i| srgb_from_linear(sharper(own[i], mean[i]).max(0.0)));
        let coverage = sharper(sum.samples, around.samples / count as f32) / all;
        // A sliver of a surface stays one.
        let coverage = ((coverage * 255.0 + 0.5) as u8).max(1);
        let normal = sum.normal / sum.samples;
        let parts = [normal.dot(right), normal.dot(up), normal.dot(towards).max(0.0)];
        let is_leaf = sum.leaves >= 0.5 * sum.samples;
        ([r, g, b, coverage], surface_texel(parts, sum.depth / sum.samples, is_leaf))
    };
    (0..).zip(&sums).map(texel).collect()
}

/// Sum of the pixels of a texel.
fn sum_of(pixels: &[Surfaces], frame_px: u32, at: u32) -> Surfaces {
    let row_px = (frame_px * PIXELS_PER_TEXEL) as usize;
    let [x, y] = [at % frame_px, at / frame_px].map(|at| (at * PIXELS_PER_TEXEL) as usize);
    let mut sum = Surfaces::default();
    let side = PIXELS_PER_TEXEL as usize;
    (0..side * side).for_each(|i| sum.add(&pixels[(y + i / side) * row_px + x + i % side]));
    sum
}

/// Compares sprites of an impostor with the plant.
struct Compared<'a> {
    painter: &'a Painter<'a>,
    list: &'a DrawList<'a>,
    sphere: Sphere,
}

impl Compared<'_> {
    /// The impostor with the coverage of its texels raised to the power with which sprites cover as
    /// much as the plant does, and its colours multiplied so that they are as bright.
    fn corrected(&self, impostor: Impostor) -> Result<Impostor> {
        let views: Vec<Camera> =
            CORRECTED_AT.into_iter().flat_map(|side| views(&self.sphere, side, CORRECTION_VIEWS)).collect();
        let options = bare(Lighting::default());
        let wanted = covered(&self.plant(&views, &options)?);
        // The greater the exponent, the less is covered.
        let [mut low, mut high] = EXPONENTS;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if covered(&self.sprites(&raised(&impostor, middle), &views, &options)?) > wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        let impostor = raised(&impostor, 0.5 * (low + high));
        let views: Vec<Camera> = self::views(&self.sphere, CORRECTED_AT[0], SUN_VIEWS).collect();
        let (mut plant, mut sprites) = (Vec::new(), Vec::new());
        for towards_sun in SUNS {
            let options = bare(Lighting { towards_sun, ..Lighting::default() });
            plant.extend(self.plant(&views, &options)?);
            sprites.extend(self.sprites(&impostor, &views, &options)?);
        }
        let [plant, sprites] = [plant, sprites].map(|images| luminance(mean_color(&images).into()));
        Ok(if sprites > 0.0 { brightened(impostor, plant / sprites) } else { impostor })
    }

    fn plant(&self, views: &[Camera], options: &DrawOptions) -> Result<Vec<Image>> {
        let draw = |camera: &Camera| self.painter.draw(self.list, camera, [camera.height_px; 2], options);
        views.par_iter().map(draw).collect()
    }

    fn sprites(&self, impostor: &Impostor, views: &[Camera], options: &DrawOptions) -> Result<Vec<Image>> {
        let pages = Pages::new(impostor);
        let placed = PlacedImpostor {
            impostor,
            pages: &pages,
            crown: self.list.crown,
            world_from_plant: DAffine3::IDENTITY,
            sway: None,
            share: 1.0,
            seed: 0,
        };
        let draw = |camera: &Camera| self.painter.draw_all(&[], &[placed], camera, [camera.height_px; 2], options);
        views.par_iter().map(draw).collect()
    }
}

fn bare(lighting: Lighting) -> DrawOptions {
    DrawOptions { background: Background::Transparent, lighting, ..DrawOptions::default() }
}

/// Sum of the coverage of all pixels.
fn covered(images: &[Image]) -> u64 {
    images.iter().flat_map(|image| image.rgba.iter().skip(3).step_by(4)).map(|&alpha| u64::from(alpha)).sum()
}

/// The impostor with its coverage raised to a power.
fn raised(impostor: &Impostor, exponent: f32) -> Impostor {
    let mut raised = impostor.clone();
    for alpha in raised.color.iter_mut().skip(3).step_by(4).filter(|alpha| **alpha > 0) {
        let coverage = libm::powf(f32::from(*alpha) / 255.0, exponent);
        *alpha = ((coverage * 255.0 + 0.5) as u8).max(1);
    }
    raised
}

/// The impostor with its colours multiplied by a factor.
fn brightened(mut impostor: Impostor, gain: f32) -> Impostor {
    let linear = linear_bytes();
    for texel in impostor.color.as_chunks_mut::<4>().0 {
        texel[..3].iter_mut().for_each(|byte| *byte = srgb_from_linear(linear[*byte as usize] * gain));
    }
    impostor
}

/// So many views between the frames, all around and from level to steep.
fn views(sphere: &Sphere, side_px: u32, count: u32) -> impl Iterator<Item = Camera> {
    (0..count).map(move |i| {
        let turn = 0.37 + f64::from(i) * std::f64::consts::TAU / f64::from(count);
        let height = 0.07 + 0.88 / f64::from(count) * f64::from(i * 3 % count);
        let direction = DVec3::new(libm::sin(turn), height, libm::cos(turn));
        LookAt::framing(sphere, direction, VIEW_FOV_Y, VIEW_MARGIN).camera(side_px)
    })
}
