//! What accuracy costs in time: every method at every level, seen from held-out views, beside what each preset took to make.

use super::{
    dolly::Dolly,
    frames::{FrameTimes, extraction_seconds},
    held_out,
    method::{Method, Reduced, Sample, measured},
    metrics::{Comparison, Quality},
};
use crate::{
    Error, Plant, Result,
    bounds::Aabb,
    render::{
        camera::Camera,
        device::GpuDevice,
        guard::guarded,
        image::Image,
        software::{DrawList, DrawOptions, Painter, mean_color},
    },
};
use glam::DVec3;
use rayon::prelude::*;

/// From where plants are shown: in front, a little to the right and above.
const FRONT: DVec3 = DVec3::new(0.45, 0.25, 1.0);

/// One method at one level and size.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The plant's name.
    pub plant: String,
    /// The method's name.
    pub method: String,
    /// Share of the leaves (for given plants: of the leaf triangles) that is drawn.
    pub level: f64,
    /// Leaves drawn.
    pub leaves: u32,
    /// Side of the pictures, which the full plant fills.
    pub pixels: u32,
    /// Mean over the held-out views.
    pub quality: Quality,
    /// Median time of a frame; NaN where it was not measured.
    pub frame_seconds: f64,
    /// Median time from all leaves to this many, in one core; NaN where there is nothing to extract.
    pub extraction_seconds: f64,
}

/// A picture for the table of pictures.
pub struct Shown {
    /// The method's name.
    pub method: String,
    /// Share of the leaves.
    pub level: f64,
    /// What it looks like before the sky.
    pub image: Image,
}

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOptions {
    /// Shares of the leaves.
    pub levels: Vec<f64>,
    /// Sides of the pictures; frames are timed at the first.
    pub sizes: Vec<u32>,
    /// Side of the pictures that are shown.
    pub shown_px: u32,
}

impl Default for StudyOptions {
    /// 80, 50, 30, 15, 5 and 1 % of the leaves at 256 and 64 pixels.
    fn default() -> Self {
        Self { levels: vec![0.8, 0.5, 0.3, 0.15, 0.05, 0.01], sizes: vec![256, 64], shown_px: 200 }
    }
}

/// A plant with the pictures that others are compared with.
pub struct Study<'a> {
    plant: &'a Plant,
    options: &'a StudyOptions,
    cameras: Vec<Camera>,
    /// From where it is shown.
    front: Camera,
    crown: Aabb,
    /// For each size the pictures of the full plant.
    full: Vec<Vec<Image>>,
}

impl<'a> Study<'a> {
    /// Draws the full plant from all held-out views.
    ///
    /// # Errors
    /// Those of [`Painter::new`] and [`Painter::draw`].
    pub fn new(plant: &'a Plant, options: &'a StudyOptions) -> Result<Self> {
        let cameras = held_out::cameras(&plant.sphere());
        let painter = Painter::new(&plant.materials, &plant.textures)?;
        let list = DrawList::of_plant(plant);
        let full = options.sizes.iter().map(|&side| pictures(&painter, &list, &cameras, side, measured(None)));
        let full = full.collect::<Result<_>>()?;
        let crown = list.crown;
        let front = Camera::framing(&plant.sphere(), FRONT, held_out::FOV_Y, 1.0);
        Ok(Self { plant, options, cameras, front, crown, full })
    }

    /// Mean shaded colour of the leaves, linear, over the held-out views.
    ///
    /// # Errors
    /// Those of [`Painter::draw`].
    pub fn mean_shaded(&self) -> Result<[f32; 3]> {
        let painter = Painter::new(&self.plant.materials, &self.plant.textures)?;
        let bare = DrawOptions { wood: false, ..measured(None) };
        let list = DrawList::of_plant(self.plant);
        Ok(mean_color(&pictures(&painter, &list, &self.cameras, self.options.sizes[0], bare)?))
    }

    /// How far `sample` is from the full plant at the size of that number.
    ///
    /// # Errors
    /// Those of [`Painter::draw`].
    pub fn quality(&self, sample: &Sample<'_>, size: usize) -> Result<Quality> {
        let painter = sample.reduced.painter()?;
        let list = DrawList { crown: self.crown, ..sample.reduced.draw_list() };
        let reduced = pictures(&painter, &list, &self.cameras, self.options.sizes[size], measured(sample.tone))?;
        let pairs = self.full[size].par_iter().zip(&reduced);
        let sums: Vec<Comparison> =
            pairs.map(|(full, reduced)| Comparison::of(full, reduced)).collect::<Result<_>>()?;
        Ok(sums.into_iter().fold(Comparison::default(), Comparison::plus).quality())
    }

    /// All rows of a method. Frames are timed where there is a device, until it fails, and where the model fits it.
    ///
    /// # Errors
    /// Those of the drawing on the CPU.
    pub fn rows(&self, method: &Method, gpu: Option<&GpuDevice>) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        let mut times = gpu.and_then(|gpu| guarded(|| FrameTimes::new(gpu, self.options.sizes[0])).ok());
        for level in method.levels(&self.options.levels) {
            let sample = method.at(level);
            let mut measured = |times: &mut FrameTimes<'_>| guarded(|| times.median(&sample.reduced, &self.cameras));
            let frame_seconds = match times.as_mut().map(&mut measured) {
                Some(Err(Error::Gpu { .. })) => {
                    times = None;
                    f64::NAN
                }
                Some(Err(Error::TooLarge { .. })) | None => f64::NAN,
                Some(seconds) => seconds?,
            };
            let extraction_seconds = match sample.reduced {
                Reduced::Prefix(model, count) => extraction_seconds(model, count),
                Reduced::Whole(_) => f64::NAN,
            };
            for (size, &pixels) in self.options.sizes.iter().enumerate() {
                rows.push(Row {
                    plant: self.plant.name.clone(),
                    method: method.name.clone(),
                    level,
                    leaves: sample.reduced.leaves(),
                    pixels,
                    quality: self.quality(&sample, size)?,
                    frame_seconds: if size == 0 { frame_seconds } else { f64::NAN },
                    extraction_seconds: if size == 0 { extraction_seconds } else { f64::NAN },
                });
            }
        }
        Ok(rows)
    }

    /// The method at every level, from the front.
    ///
    /// # Errors
    /// Those of [`Painter::draw`].
    pub fn shown(&self, method: &Method) -> Result<Vec<Shown>> {
        let levels = method.levels(&self.options.levels);
        levels
            .into_iter()
            .map(|level| {
                let sample = method.at(level);
                let list = DrawList { crown: self.crown, ..sample.reduced.draw_list() };
                let options = DrawOptions { tone: sample.tone, ..DrawOptions::default() };
                let image = sample.reduced.painter()?.draw(&list, &self.front, [self.options.shown_px; 2], &options)?;
                Ok(Shown { method: method.name.clone(), level, image })
            })
            .collect()
    }

    /// How much a method pops while a camera backs away (see [`Dolly`]), in sRGB bytes.
    ///
    /// # Errors
    /// Those of [`Painter::draw`].
    pub fn pop(&self, method: &Method) -> Result<f64> {
        Dolly::new(self.plant.sphere(), self.crown, FRONT, held_out::FOV_Y).largest_change(method)
    }

    /// The full plant, as [`shown`](Self::shown).
    ///
    /// # Errors
    /// Those of [`Painter::draw`].
    pub fn full_shown(&self) -> Result<Image> {
        let painter = Painter::new(&self.plant.materials, &self.plant.textures)?;
        let list = DrawList::of_plant(self.plant);
        painter.draw(&list, &self.front, [self.options.shown_px; 2], &DrawOptions::default())
    }
}

fn pictures(
    painter: &Painter<'_>,
    list: &DrawList<'_>,
    cameras: &[Camera],
    side: u32,
    options: DrawOptions,
) -> Result<Vec<Image>> {
    cameras.par_iter().map(|camera| painter.draw(list, camera, [side; 2], &options)).collect()
}
