//! Draws the frames of an impostor, one by one, from all leaves and the wood of a model.
//!
//! Each frame is orthographic and has the bounding sphere of the plant in its middle.

use super::{bake_options::BakeOptions, list::DrawList, painter::Painter, tile::Surfaces};
use crate::{
    Camera, Depth, Error, Result,
    bounds::Sphere,
    draw::{
        mips::srgb_from_linear,
        pages::{Pages, surface_texel},
    },
    model::{FoliageModel, Framing, Lattice},
};
use glam::{DMat4, DVec3, DVec4, Vec3};

/// Pixels along each side of a texel.
const PIXELS_PER_TEXEL: u32 = 2;

/// Part of a texel's difference from the mean around it that is added to it: makes up for the
/// softness of pictures that are looked up between texels.
const SHARPENING: f32 = 0.5;

/// Texels of both pages of a frame, rows from the top; see [`Impostor`](crate::model::Impostor).
pub(super) type Texels = Vec<([u8; 4], [u8; 4])>;

/// Draws frames of a model's impostor.
pub(super) struct Baker<'a> {
    pub(super) painter: Painter<'a>,
    pub(super) list: DrawList<'a>,
    pub(super) sphere: Sphere,
    pub(super) framing: Framing,
}

impl<'a> Baker<'a> {
    /// Decodes the model's textures.
    ///
    /// # Errors
    /// As [`bake`](super::bake()), except that it is never interrupted.
    pub(super) fn new(model: &'a FoliageModel, options: &BakeOptions) -> Result<Self> {
        Ok(Self {
            painter: Painter::new(&model.materials, &model.textures)?,
            list: DrawList::of_model(model, model.leaves.len()),
            sphere: model.sphere(),
            framing: framing(model, options)?,
        })
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// As [`Painter::draw`].
    pub(super) fn frame(&self, frame: u32) -> Result<Texels> {
        let Framing { lattice, frame_px, half_side, .. } = self.framing;
        let side_px = frame_px * PIXELS_PER_TEXEL;
        let camera = camera(self.sphere.center(), f64::from(half_side), lattice.direction(frame), side_px);
        let pixels = self.painter.surfaces(&self.list, &camera, [side_px; 2])?;
        Ok(texels(&pixels, frame_px, lattice.direction(frame)))
    }
}

/// What the frames of a model's impostor show.
///
/// # Errors
/// [`Error::InvalidOption`] for options out of range or a plant without extent.
pub(crate) fn framing(model: &FoliageModel, options: &BakeOptions) -> Result<Framing> {
    options.check()?;
    let BakeOptions { across, frame_px, is_whole_sphere } = *options;
    let sphere = model.sphere();
    if sphere.radius.is_nan() || sphere.radius <= 0.0 {
        return Err(Error::invalid("model", "a single point", "a plant with an extent"));
    }
    Ok(Framing {
        lattice: Lattice { across, is_whole_sphere },
        frame_px,
        center: sphere.center().as_vec3().to_array(),
        half_side: Framing::half_side_of(sphere.radius as f32, frame_px),
    })
}

/// Pages of one frame with these texels.
pub(super) fn pages(frame_px: u32, texels: &Texels) -> Pages {
    Pages::of_frames(frame_px, texels.iter().map(|(color, surface)| (color, surface)))
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
fn texels(pixels: &[Surfaces], frame_px: u32, towards: Vec3) -> Texels {
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
