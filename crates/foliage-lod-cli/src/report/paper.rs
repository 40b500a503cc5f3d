//! Repeats section 6 of C. Gasch et al., "Multiresolution Foliage Rendering", with the same
//! species, leaf counts and questions.
//!
//! - Figure 3: frame time against distance, for three species, with the camera orbiting each.
//! - Figure 4: extraction time against distance.
//! - Figure 5: frame time against the number of trees, with level of detail; for oaks also with all
//!   leaves.
//! - Figure 6: an oak with 80, 30 and 15 % of its leaves.
//! - Figure 7: nine oaks, with about the paper's fraction of their leaves.
//!
//! The paper reports frames per second; this report uses milliseconds per frame, since costs add up
//! in them. Distances are in radii. The paper does not state the range of its camera distances or
//! the bounds of its policy: both are the defaults of [`Blend`].
//!
//! Limits: times depend on the adapter in use; on a software adapter they are CPU times.

use super::{
    frames::median,
    plot::{Line, Plot},
};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Result, Swap,
    draw::ModelId,
    extract::{Blend, LodPolicy, REFERENCE_FOV_Y, Sight, fewest_leaves, leaf_count},
    gpu::{GpuDevice, Offscreen, TARGET},
    software::Image,
};
use glam::{DAffine3, DVec3};
use std::time::Instant;

/// Distances of figures 3 and 4, in radii.
const DISTANCES: [f32; 11] = [3.0, 6.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0];
/// Trees per side of the square forests of figure 5.
const FOREST_SIDES: [usize; 5] = [1, 2, 3, 4, 5];
/// Fractions of the leaves in figure 6.
const SHARES: [f32; 3] = [0.8, 0.3, 0.15];
/// The paper's fraction of the leaves of nine trees with 20,000 leaves each.
const NINE_TREES_SHARE: f32 = 49_680.0 / 180_000.0;
/// Spacing of the trees of a forest, in radii.
const SPACING_RADII: f64 = 1.6;
/// Number of frames per orbit; the median is reported.
const FRAMES: usize = 5;
/// Screen height in pixels for the level of detail.
const HEIGHT_PX: f32 = 1080.0;

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Number of the figure in the paper.
    pub figure: u8,
    /// Name of the species.
    pub species: String,
    /// `vds` (level of detail) or `full` (all leaves).
    pub method: &'static str,
    /// Distance to the tree, or to the centre of the forest, in radii of a tree.
    pub distance_radii: f32,
    /// Number of trees.
    pub trees: usize,
    /// Leaves drawn, over all trees.
    pub leaves: u64,
    /// Median frame time in milliseconds; NaN if not measured.
    pub frame_ms: f64,
    /// Median time of extraction from the previous distance, in microseconds; NaN if not measured.
    pub extraction_us: f64,
}

/// Results of the section's experiments.
pub struct PaperReport {
    /// All measurements.
    pub rows: Vec<Row>,
    /// Figure 6: pictures of the oak at 80, 30 and 15 %.
    pub shares: Vec<Image>,
    /// Figure 7: nine oaks.
    pub nine: Image,
}

impl PaperReport {
    /// Runs all experiments with `models`, the oak first, in pictures of `size`. `begins` receives
    /// the name of each figure as it starts.
    ///
    /// # Errors
    /// Errors from the device and from [`FoliageRenderer::add_model`].
    pub fn measure(
        gpu: &GpuDevice,
        models: &[FoliageModel],
        size: [u32; 2],
        mut begins: impl FnMut(&str),
    ) -> Result<Self> {
        let mut stage = Stage::new(gpu, models, size)?;
        let mut rows = Vec::new();
        begins("figures 3 and 4: frame and extraction time against distance");
        for number in 0..models.len() {
            stage.against_distance(number, &mut rows)?;
        }
        begins("figure 5: frame time against the number of trees");
        for number in 0..models.len() {
            stage.against_trees(number, "vds", &mut rows)?;
        }
        stage.against_trees(0, "full", &mut rows)?;
        begins("figures 6 and 7: pictures");
        let shares = SHARES.iter().map(|&share| stage.share(share)).collect::<Result<_>>()?;
        let nine = stage.nine(&mut rows)?;
        Ok(Self { rows, shares, nine })
    }

    /// All measurements as comma-separated values, with a header. Numbers that were not measured
    /// are empty.
    pub fn csv(&self) -> String {
        let number = |value: f64| if value.is_nan() { String::new() } else { format!("{value:.3}") };
        let line = |row: &Row| {
            let Row { figure, species, method, distance_radii, trees, leaves, frame_ms, extraction_us } = row;
            let (frame_ms, extraction_us) = (number(*frame_ms), number(*extraction_us));
            format!("{figure},{species},{method},{distance_radii},{trees},{leaves},{frame_ms},{extraction_us}\n")
        };
        let header = "figure,species,method,distance_radii,trees,leaves,frame_ms,extraction_us\n";
        self.rows.iter().map(line).fold(header.to_string(), |csv, line| csv + &line)
    }

    /// Figures 3, 4 and 5 as SVG documents, each with its file name.
    ///
    /// # Errors
    /// [`Error::Unreadable`](foliage_lod::Error::Unreadable) if a plot cannot be drawn.
    pub fn plots(&self) -> Result<Vec<(&'static str, String)>> {
        let distance = "distance (radii)";
        let figure_3 = Plot {
            title: "Frame time against distance",
            x_axis: distance,
            y_axis: "ms per frame",
            lines: self.lines(3, |row| [row.distance_radii.into(), row.frame_ms]),
        };
        let figure_4 = Plot {
            title: "Extraction time against distance",
            x_axis: distance,
            y_axis: "microseconds from the previous distance",
            lines: self.lines(4, |row| [row.distance_radii.into(), row.extraction_us]),
        };
        let figure_5 = Plot {
            title: "Frame time against the number of trees",
            x_axis: "trees",
            y_axis: "ms per frame",
            lines: self.lines(5, |row| [row.trees as f64, row.frame_ms]),
        };
        Ok(vec![
            ("figure-3.svg", figure_3.svg()?),
            ("figure-4.svg", figure_4.svg()?),
            ("figure-5.svg", figure_5.svg()?),
        ])
    }

    /// One line per species and method of a figure.
    fn lines(&self, figure: u8, point: impl Fn(&Row) -> [f64; 2]) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for row in self.rows.iter().filter(|row| row.figure == figure) {
            let is_reference = row.method == "full";
            let name = if is_reference { format!("{}, all leaves", row.species) } else { row.species.clone() };
            match lines.iter_mut().find(|line| line.name == name) {
                Some(line) => line.points.push(point(row)),
                None => lines.push(Line { name, points: vec![point(row)], is_reference }),
            }
        }
        lines
    }
}

/// A device with the models and the target.
struct Stage<'a> {
    gpu: &'a GpuDevice,
    models: &'a [FoliageModel],
    ids: Vec<ModelId>,
    target: Offscreen,
    foliage: FoliageRenderer,
    aspect: f64,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a GpuDevice, models: &'a [FoliageModel], size: [u32; 2]) -> Result<Self> {
        let target = Offscreen::new(gpu, size)?;
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default())?;
        let add = |model| foliage.add_model(gpu.device(), gpu.queue(), model);
        let ids = models.iter().map(add).collect::<Result<_>>()?;
        Ok(Self { gpu, models, ids, target, foliage, aspect: f64::from(size[0]) / f64::from(size[1]) })
    }

    fn against_distance(&mut self, number: usize, rows: &mut Vec<Row>) -> Result<()> {
        let model = &self.models[number];
        let leaves = model.leaves.len() as u32;
        let radius = model.sphere().radius;
        let mut swap = Swap::new(model);
        for distance_radii in DISTANCES {
            let active = count(leaves, distance_radii);
            let extraction_us = extraction_us(&mut swap, active);
            let row = |figure, method, drawn: u32, frame_ms, extraction_us| Row {
                figure,
                species: model.name.clone(),
                method,
                distance_radii,
                trees: 1,
                leaves: drawn.into(),
                frame_ms,
                extraction_us,
            };
            let instance = |active: u32| self.instance(number, DVec3::ZERO, active);
            let scenes = [("vds", active), ("full", leaves)].map(|(method, n)| (method, n, instance(n)));
            for (method, n, instance) in scenes {
                let distance = f64::from(distance_radii) * radius;
                let frame_ms = self.median_frame_ms(number, distance, |_, instances| instances.push(instance))?;
                rows.push(row(3, method, n, frame_ms, f64::NAN));
            }
            rows.push(row(4, "vds", active, f64::NAN, extraction_us));
        }
        Ok(())
    }

    fn against_trees(&mut self, number: usize, method: &'static str, rows: &mut Vec<Row>) -> Result<()> {
        let model = &self.models[number];
        let (sphere, leaves) = (model.sphere(), model.leaves.len() as u32);
        for side in FOREST_SIDES {
            let places = places(side, sphere.radius);
            let half_diagonal = places.last().map_or(0.0, |place| place.length());
            let distance = half_diagonal + 3.0 * sphere.radius;
            let (ids, mut drawn) = (self.ids[number], 0);
            let frame_ms = self.median_frame_ms(number, distance, |eye, instances| {
                for &place in &places {
                    let radii = (sphere.center() + place).distance(eye) / sphere.radius;
                    let active = if method == "full" { leaves } else { count(leaves, radii as f32) };
                    instances.push(standing(ids, place, active));
                }
                drawn = instances.iter().map(|instance| instance.active as u64).sum();
            })?;
            rows.push(Row {
                figure: 5,
                species: model.name.clone(),
                method,
                distance_radii: (distance / sphere.radius) as f32,
                trees: places.len(),
                leaves: drawn,
                frame_ms,
                extraction_us: f64::NAN,
            });
        }
        Ok(())
    }

    /// The oak with a fraction of its leaves, filling the picture.
    fn share(&mut self, share: f32) -> Result<Image> {
        let model = &self.models[0];
        let camera = LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).with_aspect(self.aspect);
        let active = (share * model.leaves.len() as f32).round() as u32;
        let instance = self.instance(0, DVec3::ZERO, active);
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), camera.camera(self.target.size()[1]), &[instance])?;
        self.target.picture(&self.foliage)
    }

    /// Nine oaks, from the distance at which they are drawn with about the paper's fraction of all
    /// leaves.
    fn nine(&mut self, rows: &mut Vec<Row>) -> Result<Image> {
        let model = &self.models[0];
        let (sphere, leaves) = (model.sphere(), model.leaves.len() as u32);
        let places = places(3, sphere.radius);
        let counts = |eye: DVec3| -> Vec<u32> {
            let radii = |place: &DVec3| ((sphere.center() + *place).distance(eye) / sphere.radius) as f32;
            places.iter().map(|place| count(leaves, radii(place))).collect()
        };
        let eye_at = |radii: f64| sphere.center() + DVec3::new(0.35, 0.3, 1.0).normalize() * radii * sphere.radius;
        let share = |eye: DVec3| counts(eye).iter().sum::<u32>() as f32 / (places.len() as u32 * leaves) as f32;
        // The fraction falls with distance, so bisect.
        let (mut near, mut far) = (3.0, 60.0);
        for _ in 0..30 {
            let middle = 0.5 * (near + far);
            if share(eye_at(middle)) > NINE_TREES_SHARE { near = middle } else { far = middle }
        }
        let eye = eye_at(near);
        let counts = counts(eye);
        let around = places.iter().map(|place| place.length()).fold(0.0, f64::max) + sphere.radius;
        let camera = LookAt {
            fov_y_radians: 2.0 * (around / (near * sphere.radius)).asin() / self.aspect,
            ..camera(eye, sphere.center(), self.aspect)
        };
        let instances: Vec<Instance> =
            places.iter().zip(&counts).map(|(&place, &active)| self.instance(0, place, active)).collect();
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), camera.camera(self.target.size()[1]), &instances)?;
        rows.push(Row {
            figure: 7,
            species: model.name.clone(),
            method: "vds",
            distance_radii: near as f32,
            trees: places.len(),
            leaves: counts.iter().map(|&count| u64::from(count)).sum(),
            frame_ms: f64::NAN,
            extraction_us: f64::NAN,
        });
        self.target.picture(&self.foliage)
    }

    fn instance(&self, number: usize, place: DVec3, active: u32) -> Instance {
        standing(self.ids[number], place, active)
    }

    /// Median time of the frames of an orbit around a model's centre; `fill` lists the plants for
    /// an eye position.
    fn median_frame_ms(
        &mut self,
        number: usize,
        distance: f64,
        mut fill: impl FnMut(DVec3, &mut Vec<Instance>),
    ) -> Result<f64> {
        let middle = self.models[number].sphere().center();
        let (mut times, mut instances) = (Vec::new(), Vec::new());
        // The first frame is a warm-up and does not count.
        for frame in 0..=FRAMES {
            let turn = frame as f64 / FRAMES as f64 * std::f64::consts::TAU;
            let eye = middle + DVec3::new(turn.sin(), 0.25, turn.cos()).normalize() * distance;
            let started = Instant::now();
            instances.clear();
            fill(eye, &mut instances);
            let camera = camera(eye, middle, self.aspect);
            self.foliage.prepare(
                self.gpu.device(),
                self.gpu.queue(),
                camera.camera(self.target.size()[1]),
                &instances,
            )?;
            self.target.draw(&self.foliage)?;
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        Ok(median(&mut times[1..]))
    }
}

fn standing(model: ModelId, place: DVec3, active: u32) -> Instance {
    let world_from_plant = DAffine3::from_translation(place);
    Instance::new(model, world_from_plant, active as f32)
}

fn camera(eye: DVec3, target: DVec3, aspect: f64) -> LookAt {
    let near = eye.distance(target) * 1e-3;
    LookAt { eye, target, up: DVec3::Y, fov_y_radians: REFERENCE_FOV_Y.into(), aspect, near }
}

fn count(leaves: u32, radii: f32) -> u32 {
    let sight = Sight { distance: radii, radius: 1.0, fov_y: REFERENCE_FOV_Y, height_px: HEIGHT_PX };
    leaf_count(Blend::default().lod(&sight), leaves, fewest_leaves(leaves))
}

/// Positions of a square of trees around the origin, row by row; the last is a corner.
fn places(side: usize, radius: f64) -> Vec<DVec3> {
    let at = |i: usize| (i as f64 - 0.5 * (side - 1) as f64) * SPACING_RADII * radius;
    (0..side * side).map(|i| DVec3::new(at(i % side), 0.0, at(i / side))).collect()
}

/// Median time of moving `swap` to `n` leaves from its current count; it stays at `n`.
fn extraction_us(swap: &mut Swap, n: u32) -> f64 {
    let before = swap.active();
    let mut times = [0.0; 21];
    for time in &mut times {
        swap.set_active(before);
        let started = Instant::now();
        swap.set_active(n);
        *time = started.elapsed().as_secs_f64() * 1e6;
    }
    median(&mut times)
}
