//! Accuracy against time: every method at every level, from held-out views.

use super::{
    dolly::Dolly,
    frames::{FrameTimes, extraction_seconds},
    method::{Method, Reduced, Sample},
};
use foliage_lod::{
    Error, LookAt, Plant, Result,
    bounds::Aabb,
    gpu::{GpuDevice, guarded},
    measure::{self, Quality, Reference, matched_px, measured, pictures},
    software::{DrawList, DrawOptions, Image, Painter, leaf_fragments, mean_color},
};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeMap, btree_map::Entry};

/// Direction from the plant to the camera of the shown pictures: in front, a little to the right
/// and above.
pub(super) const FRONT: DVec3 = DVec3::new(0.45, 0.25, 1.0);

/// Measurements of one method at one level and size.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The plant's name.
    pub plant: String,
    /// The method's name.
    pub method: String,
    /// Fraction of the leaves drawn; for ready-made plants, of the leaf triangles.
    pub level: f64,
    /// Leaves drawn.
    pub leaves: u32,
    /// What is drawn.
    pub drawn: Drawn,
    /// Side of the pictures in pixels; the full plant fills them.
    pub pixels: u32,
    /// Mean quality over the held-out views.
    pub quality: Quality,
    /// Mean quality at the level's matched size.
    pub matched: Matched,
    /// Median frame time; NaN if not measured.
    pub frame_seconds: f64,
    /// Median time of extraction from all leaves to this many, on one core; NaN if the method does
    /// not extract.
    pub extraction_seconds: f64,
}

/// What is drawn of the leaves, as fractions of the full plant's. Half of the leaves are more than
/// half of the cost if they have more triangles than the others, or are larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Triangles of leaves drawn.
    pub triangles: u64,
    /// Leaves drawn, over the full plant's.
    pub leaf_share: f64,
    /// Triangles of leaves, over the full plant's.
    pub triangle_share: f64,
    /// [Fragments](leaf_fragments) of leaves over all held-out views, over the full plant's.
    pub fragment_share: f64,
}

/// Mean quality over the held-out views at the [matched size](matched_px).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matched {
    /// Side of the pictures in pixels; the full plant fills them.
    pub pixels: u32,
    /// Compared with the full plant at the same size.
    pub quality: Quality,
}

/// A picture for the picture table.
pub struct Shown {
    /// The method's name.
    pub method: String,
    /// Fraction of the leaves.
    pub level: f64,
    /// The picture, with a sky background.
    pub image: Image,
}

/// Options of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyOptions {
    /// Fractions of the leaves.
    pub levels: Vec<f64>,
    /// Sides of the pictures in pixels; frames are timed at the first.
    pub sizes: Vec<u32>,
    /// Side of the shown pictures in pixels.
    pub shown_px: u32,
}

impl Default for StudyOptions {
    /// 80, 50, 30, 15, 5 and 1 % of the leaves at 256 and 64 pixels.
    fn default() -> Self {
        Self { levels: vec![0.8, 0.5, 0.3, 0.15, 0.05, 0.01], sizes: vec![256, 64], shown_px: 200 }
    }
}

/// A plant with its reference pictures.
pub struct Study<'a> {
    plant: &'a Plant,
    options: &'a StudyOptions,
    cameras: Vec<LookAt>,
    /// Camera of the shown pictures.
    front: LookAt,
    crown: Aabb,
    /// Pictures of the full plant from all cameras, for each size.
    references: Vec<Reference>,
    /// Pictures at the matched sizes that were asked for, by their sides.
    matched: BTreeMap<u32, Reference>,
    /// Fragments of the full plant's leaves from all cameras, for each size.
    fragments: Vec<u64>,
}

impl<'a> Study<'a> {
    /// Renders the full plant from all held-out views.
    ///
    /// # Errors
    /// Errors from [`Painter::new`] and [`Painter::draw`].
    pub fn new(plant: &'a Plant, options: &'a StudyOptions) -> Result<Self> {
        let references = options.sizes.iter().map(|&side| Reference::new(plant, side)).collect::<Result<_>>()?;
        let cameras = measure::cameras(&plant.sphere());
        let list = DrawList::of_plant(plant);
        let crown = list.crown;
        let count = |&side: &u32| fragments(&list, &cameras, side);
        let fragments = options.sizes.iter().map(count).collect::<Result<_>>()?;
        let front = LookAt::framing(&plant.sphere(), FRONT, measure::FOV_Y, 1.0);
        Ok(Self { plant, options, cameras, front, crown, references, matched: BTreeMap::new(), fragments })
    }

    /// Mean shaded colour of the leaves, linear, over the held-out views.
    ///
    /// # Errors
    /// Errors from [`Painter::draw`].
    pub fn mean_shaded(&self) -> Result<[f32; 3]> {
        let painter = Painter::new(&self.plant.materials, &self.plant.textures)?;
        let bare = DrawOptions { wood: false, ..measured(None) };
        let list = DrawList::of_plant(self.plant);
        Ok(mean_color(&pictures(&painter, &list, &self.cameras, self.options.sizes[0], bare)?))
    }

    /// Quality of `sample` compared with the full plant, at the size with index `size`.
    ///
    /// # Errors
    /// Errors from [`Painter::draw`].
    pub fn quality(&self, sample: &Sample<'_>, size: usize) -> Result<Quality> {
        self.references[size].quality(&sample.reduced.painter()?, sample.reduced.draw_list(), sample.tone)
    }

    /// Quality of `sample` at the matched size of `level`.
    fn matched(&mut self, sample: &Sample<'_>, level: f64) -> Result<Matched> {
        let pixels = matched_px(level);
        let reference = match self.matched.entry(pixels) {
            Entry::Occupied(drawn) => drawn.into_mut(),
            Entry::Vacant(missing) => missing.insert(Reference::new(self.plant, pixels)?),
        };
        let quality = reference.quality(&sample.reduced.painter()?, sample.reduced.draw_list(), sample.tone)?;
        Ok(Matched { pixels, quality })
    }

    /// What `sample` draws, at the size with index `size`.
    fn drawn(&self, sample: &Sample<'_>, size: usize) -> Result<Drawn> {
        let triangles = sample.reduced.triangles();
        let fragments = fragments(&sample.reduced.draw_list(), &self.cameras, self.options.sizes[size])?;
        Ok(Drawn {
            triangles,
            leaf_share: f64::from(sample.reduced.leaves()) / self.plant.leaves.len() as f64,
            triangle_share: triangles as f64 / self.plant.leaf_triangles() as f64,
            fragment_share: fragments as f64 / self.fragments[size] as f64,
        })
    }

    /// All rows of a method. Times are measured at the largest size and NaN at the others. Frame
    /// times are also NaN without a device, after the device has failed, and for models that do not
    /// fit on it.
    ///
    /// # Errors
    /// Errors from the software renderer.
    pub fn rows(&mut self, method: &Method, gpu: Option<&GpuDevice>) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        let largest = self.options.sizes.iter().copied().max().unwrap_or(0);
        let mut times = gpu.and_then(|gpu| guarded(|| FrameTimes::new(gpu, largest)).ok());
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
            let matched = self.matched(&sample, level)?;
            for (size, &pixels) in self.options.sizes.iter().enumerate() {
                rows.push(Row {
                    plant: self.plant.name.clone(),
                    method: method.name.clone(),
                    level,
                    leaves: sample.reduced.leaves(),
                    drawn: self.drawn(&sample, size)?,
                    pixels,
                    quality: self.quality(&sample, size)?,
                    matched,
                    frame_seconds: if pixels == largest { frame_seconds } else { f64::NAN },
                    extraction_seconds: if pixels == largest { extraction_seconds } else { f64::NAN },
                });
            }
        }
        Ok(rows)
    }

    /// Pictures of the method at every level, from the front.
    ///
    /// # Errors
    /// Errors from [`Painter::draw`].
    pub fn shown(&self, method: &Method) -> Result<Vec<Shown>> {
        let levels = method.levels(&self.options.levels);
        levels
            .into_iter()
            .map(|level| {
                let sample = method.at(level);
                let list = DrawList { crown: self.crown, ..sample.reduced.draw_list() };
                let options = DrawOptions { tone: sample.tone, ..DrawOptions::default() };
                let image = sample.reduced.painter()?.draw(
                    &list,
                    &self.front.camera(self.options.shown_px),
                    [self.options.shown_px; 2],
                    &options,
                )?;
                Ok(Shown { method: method.name.clone(), level, image })
            })
            .collect()
    }

    /// Popping of a method while a camera backs away (see [`Dolly`]), on the sRGB scale
    /// of 0 to 255.
    ///
    /// # Errors
    /// Errors from [`Painter::draw`].
    pub fn pop(&self, method: &Method) -> Result<f64> {
        Dolly::new(self.plant.sphere(), self.crown, FRONT, measure::FOV_Y).largest_change(method)
    }

    /// Picture of the full plant, from the same camera as [`shown`](Self::shown).
    ///
    /// # Errors
    /// Errors from [`Painter::draw`].
    pub fn full_shown(&self) -> Result<Image> {
        let painter = Painter::new(&self.plant.materials, &self.plant.textures)?;
        let list = DrawList::of_plant(self.plant);
        painter.draw(
            &list,
            &self.front.camera(self.options.shown_px),
            [self.options.shown_px; 2],
            &DrawOptions::default(),
        )
    }
}

/// Fragments of the leaves of `list` in square pictures from all cameras.
fn fragments(list: &DrawList<'_>, cameras: &[LookAt], side: u32) -> Result<u64> {
    let counts = cameras.par_iter().map(|camera| leaf_fragments(list, &camera.camera(side), [side; 2]));
    Ok(counts.collect::<Result<Vec<u64>>>()?.into_iter().sum())
}
