//! Plants far away: coverage and mean colour of the drawers, compared with many samples per pixel.
//!
//! Every leaf is drawn, at distances at which leaves, texels and stems are far smaller than a
//! pixel. The reference is a picture of 64 samples per pixel that tests the full textures. Pictures
//! of the drawers are averaged over sixteen offsets within a pixel, so that a plant's position on
//! the pixel grid does not matter.

use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Result,
    draw::Frame,
    gpu::{GpuDevice, Offscreen, TARGET, TargetFormat},
    measure::measured,
    software::{DrawList, DrawOptions, Image, Painter},
};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

/// Distances in radii of the plant's bounding sphere.
pub const DISTANCES: [f64; 5] = [6.0, 12.0, 24.0, 48.0, 96.0];
/// Width and height of the pictures in pixels.
const SIDE_PX: u32 = 512;
/// Pixels of the reference along a side of a pixel; each has sixteen samples.
const FINER: u32 = 2;
/// Number of offsets within a pixel, all different along each axis: a vertical trunk of less than a
/// pixel shows in its share of them.
const OFFSETS: u32 = 16;
/// Vertical field of view in degrees.
const FOV_DEG: f64 = 50.0;
/// Direction from the plant to the camera.
const DIRECTION: DVec3 = DVec3::new(0.55, 0.2, 1.0);

/// Coverage and mean colour of a plant in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Covered area in pixels.
    pub coverage_px: f64,
    /// Mean colour of the covered area, on the sRGB scale of 0 to 255.
    pub color: Vec3,
}

impl Seen {
    /// Difference in coverage relative to `truth`.
    pub fn coverage_error(&self, truth: &Self) -> f64 {
        self.coverage_px / truth.coverage_px - 1.0
    }

    /// Largest difference of a channel of the mean colour from that of `truth`.
    pub fn color_error(&self, truth: &Self) -> f64 {
        f64::from((self.color - truth.color).abs().max_element())
    }
}

/// One plant at one distance.
#[derive(Debug, Clone, PartialEq)]
pub struct FarRow {
    /// Distance in radii.
    pub distance: f64,
    /// The reference.
    pub truth: Seen,
    /// The CPU.
    pub cpu: Seen,
    /// The GPU with one sample per pixel and with four; `None` without a device.
    pub gpu: Option<[Seen; 2]>,
}

/// Measures a model at all distances.
///
/// # Errors
/// Errors from the drawers.
pub fn measure(model: &FoliageModel, gpu: Option<&GpuDevice>) -> Result<Vec<FarRow>> {
    let painter = Painter::new(&model.materials, &model.textures)?;
    let list = DrawList::of_model(model, model.leaves.len());
    let mut gpus = match gpu {
        Some(gpu) => Some([Gpu::new(gpu, model, 1)?, Gpu::new(gpu, model, TARGET.samples)?]),
        None => None,
    };
    let row = |&distance: &f64| {
        let camera = camera(model, distance);
        let frame = Frame::new(&camera.camera(SIDE_PX));
        let frames: Vec<Frame> = offsets().map(|jitter_px| Frame { jitter_px, ..frame }).collect();
        let gpu = match &mut gpus {
            Some([one, four]) => Some([one.seen(model, &frames)?, four.seen(model, &frames)?]),
            None => None,
        };
        let truth = truth(&painter, &list, &camera)?;
        Ok(FarRow { distance, truth, cpu: on_cpu(&painter, &list, &frames)?, gpu })
    };
    DISTANCES.iter().map(row).collect()
}

fn camera(model: &FoliageModel, distance: f64) -> LookAt {
    let sphere = model.sphere();
    let framing = LookAt::framing(&sphere, DIRECTION, FOV_DEG.to_radians(), 1.0);
    LookAt { eye: sphere.center() + DIRECTION.normalize() * (distance * sphere.radius), ..framing }
}

fn truth(painter: &Painter<'_>, list: &DrawList<'_>, camera: &LookAt) -> Result<Seen> {
    let side = FINER * SIDE_PX;
    let options = DrawOptions { full_textures: true, ..measured(None) };
    let image = painter.draw(list, &camera.camera(side), [side; 2], &options)?;
    Ok(seen(&[image], f64::from(FINER * FINER), false))
}

fn on_cpu(painter: &Painter<'_>, list: &DrawList<'_>, frames: &[Frame]) -> Result<Seen> {
    let image = |frame: &Frame| painter.draw(list, &shifted(frame), [SIDE_PX; 2], &measured(None));
    let images: Vec<Image> = frames.par_iter().map(image).collect::<Result<_>>()?;
    Ok(seen(&images, 1.0, false))
}

fn offsets() -> impl Iterator<Item = [f64; 2]> {
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(OFFSETS) - 0.5;
    // The points of J. M. Hammersley (1960).
    let reversed = |i: u32| i.reverse_bits() >> (u32::BITS - OFFSETS.ilog2());
    (0..OFFSETS).map(move |i| [middle(i), middle(reversed(i))])
}

/// The camera of a frame, shifted by its jitter.
fn shifted(frame: &Frame) -> foliage_lod::Camera {
    let [right, down] = frame.jitter_px.map(|px| 2.0 * px / f64::from(SIDE_PX));
    let shift = glam::DMat4::from_translation(DVec3::new(right, -down, 0.0));
    foliage_lod::Camera { clip_from_world: shift * frame.camera.clip_from_world, ..frame.camera }
}

/// A renderer and its target.
struct Gpu {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    id: foliage_lod::draw::ModelId,
}

impl Gpu {
    fn new(gpu: &GpuDevice, model: &FoliageModel, samples: u32) -> Result<Self> {
        let target = Offscreen::with_samples(gpu, [SIDE_PX; 2], samples)?;
        let mut foliage = FoliageRenderer::new(gpu.device(), TargetFormat { samples, ..TARGET }, Look::default())?;
        let id = foliage.add_model(gpu.device(), gpu.queue(), model)?;
        Ok(Self { gpu: gpu.clone(), target, foliage, id })
    }

    fn seen(&mut self, model: &FoliageModel, frames: &[Frame]) -> Result<Seen> {
        let instance = Instance::new(self.id, DAffine3::IDENTITY, model.leaves.len() as f32);
        let mut images = Vec::new();
        for frame in frames {
            self.foliage.prepare(self.gpu.device(), self.gpu.queue(), *frame, &[instance])?;
            images.push(self.target.cutout(&self.foliage)?);
        }
        Ok(seen(&images, 1.0, true))
    }
}

/// Coverage and mean colour of pictures with `per_px` of their pixels per pixel. `is_multiplied`
/// says whether their colour is multiplied by alpha.
fn seen(images: &[Image], per_px: f64, is_multiplied: bool) -> Seen {
    let (mut color, mut covered) = ([0.0_f64; 3], 0.0);
    for pixel in images.iter().flat_map(|image| image.rgba.chunks_exact(4)).filter(|pixel| pixel[3] > 0) {
        let alpha = f64::from(pixel[3]) / 255.0;
        covered += alpha;
        for (sum, &byte) in color.iter_mut().zip(pixel) {
            *sum += linear(byte) * if is_multiplied { 1.0 } else { alpha };
        }
    }
    let color = color.map(|sum| encoded(sum / covered.max(f64::MIN_POSITIVE)) as f32);
    Seen { coverage_px: covered / (per_px * images.len() as f64), color: color.into() }
}

fn linear(byte: u8) -> f64 {
    let value = f64::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

pub(super) fn encoded(linear: f64) -> f64 {
    255.0 * if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
