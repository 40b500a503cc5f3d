//! Wood with less detail: what its order, stems left out by their width alone and other
//! simplifiers cost at equal sizes, and how far each is from all wood, against the plant's diameter
//! in pixels.
//!
//! All ways are drawn by the same renderer from the same held-out views
//! ([`far_cameras`](measure::far_cameras)): the wood alone, and the plant with as many leaves as
//! the default policy draws at that size. Each is compared with all wood, in the latter case with
//! the same leaves. The simplifiers get as many triangles as the order draws.
//!
//! Limits: one light. In the pictures of stems left out by width, those that are widened come
//! nearer to the eye, which the GPU drawer avoids. Frames of four plants, in which fixed costs
//! count as well.

use super::{
    frames::median,
    impostors::{ROUNDS, compared, four, policy_count},
    study::FRONT,
};
use foliage_lod::{
    Camera, Error, FoliageModel, FoliageRenderer, Instance, Look, LookAt, Result,
    draw::{ModelId, Stems},
    gpu::{GpuDevice, Offscreen, TARGET, guarded},
    measure::{self, Quality},
    plant::{Wood, WoodPart},
    software::{Image, SoftwareRenderer},
};
use glam::{DAffine3, Vec3};
use rayon::prelude::*;
use std::time::Instant;

/// Diameters in pixels.
pub const DIAMETERS: [u32; 4] = [256, 128, 64, 48];
/// Error in pixels that the order is drawn at, and the width below which stems are left out.
pub const ERROR_PX: f32 = 0.5;
/// Names of the ways that need no other library.
pub const WAYS: [&str; 3] = ["all wood", "order", "stems by width"];

/// Measurements of one way at one size.
#[derive(Debug, Clone, PartialEq)]
pub struct WoodRow {
    /// Name of the way.
    pub way: &'static str,
    /// Diameter of the plant's bounding sphere in pixels.
    pub diameter_px: u32,
    /// Triangles of the wood.
    pub triangles: u64,
    /// Mean quality of the wood alone over the held-out views, against all wood.
    pub alone: Quality,
    /// Leaves that the default policy draws at this size.
    pub leaves: u32,
    /// Mean quality of the plant with these leaves, against all wood and the same leaves.
    pub with_leaves: Quality,
    /// Median times of a frame of four plants, of their wood alone and with the leaves; NaN if not
    /// measured.
    pub frame_seconds: [f64; 2],
    /// The wood alone from the front, and with the leaves.
    pub images: [Image; 2],
}

/// Measures a model whose wood has an order, at all diameters. `check` can return an error to stop.
///
/// # Errors
/// [`Error::InvalidOption`] for a model without an order, errors from the software renderer and
/// from `check`.
pub fn measure(
    model: &FoliageModel,
    gpu: Option<&GpuDevice>,
    check: &mut dyn FnMut() -> Result<()>,
) -> Result<Vec<WoodRow>> {
    if model.wood_order.is_none() {
        return Err(Error::invalid("wood order", "none", "a model with one"));
    }
    let plain = FoliageModel { wood_order: None, ..model.clone() };
    let mut timer = gpu.and_then(|gpu| guarded(|| Timer::new(gpu, [&plain, model])).ok());
    let stems = Stems::new(&plain);
    let drawer = Drawer::new(&[&plain, model])?;
    let mut rows = Vec::new();
    for diameter_px in DIAMETERS {
        check()?;
        let triangles = drawer.triangles(1, diameter_px)?;
        let width = ERROR_PX / (diameter_px as f32 / (2.0 * model.sphere().radius as f32));
        let others = others(&plain, by_width(&plain.wood, &stems, width), triangles);
        let all: Vec<&FoliageModel> =
            [&plain, model].into_iter().chain(others.iter().map(|(_, other)| other)).collect();
        let drawer = Drawer::new(&all)?;
        let names: Vec<&'static str> = WAYS[..2].iter().copied().chain(others.iter().map(|(name, _)| *name)).collect();
        let leaves = policy_count(model, diameter_px);
        let seconds = match timer.as_mut().map(|timer| guarded(|| timer.medians(&all, leaves, diameter_px))) {
            Some(Err(Error::Gpu { .. } | Error::TooLarge { .. })) => {
                timer = None;
                vec![[f64::NAN; 2]; all.len()]
            }
            Some(seconds) => seconds?,
            None => vec![[f64::NAN; 2]; all.len()],
        };
        let full_alone = drawer.pictures(0, 0, diameter_px)?;
        let full_with = drawer.pictures(0, leaves, diameter_px)?;
        for (number, (way, frame_seconds)) in names.into_iter().zip(seconds).enumerate() {
            let against = |full: &[Image], leaves| -> Result<Quality> {
                let others = if number == 0 { Vec::new() } else { drawer.pictures(number, leaves, diameter_px)? };
                Ok(compared(full, if number == 0 { full } else { &others })?.quality())
            };
            rows.push(WoodRow {
                way,
                diameter_px,
                triangles: drawer.triangles(number, diameter_px)?,
                alone: against(&full_alone, 0)?,
                leaves,
                with_leaves: against(&full_with, leaves)?,
                frame_seconds,
                images: [drawer.front(number, 0, diameter_px)?, drawer.front(number, leaves, diameter_px)?],
            });
        }
    }
    Ok(rows)
}

/// The model with other wood: stems left out by width, and what the simplifiers make of it.
fn others(plain: &FoliageModel, by_width: Wood, triangles: u64) -> Vec<(&'static str, FoliageModel)> {
    let with = |(name, wood): (&'static str, Wood)| {
        let mut model = plain.clone();
        model.wood = wood;
        (name, model)
    };
    #[cfg(feature = "peers")]
    let peers = super::peers::simplified_wood(&plain.wood, triangles);
    #[cfg(not(feature = "peers"))]
    let (peers, _) = (Vec::new(), triangles);
    [(WAYS[2], by_width)].into_iter().chain(peers).map(with).collect()
}

/// Wood without most stems thinner than a width, the others of them as wide as that.
fn by_width(wood: &Wood, stems: &Stems, width: f32) -> Wood {
    let drawn = stems.levels.drawn(width);
    let mut vertices = wood.vertices.clone();
    for (vertex, own) in vertices.iter_mut().zip(&stems.widths) {
        let widened = 0.5 * (drawn.width - own.abs()).max(0.0) * Vec3::from(vertex.normal).normalize_or_zero();
        vertex.position = (Vec3::from(vertex.position) + widened).to_array();
    }
    let corners = &stems.corners[..drawn.corners.end as usize];
    let (mut indices, mut parts): (Vec<u32>, Vec<WoodPart>) = (Vec::new(), Vec::new());
    for part in &wood.parts {
        let first = indices.len() as u32;
        if parts.iter().all(|other| other.material != part.material) {
            indices.extend(corners.iter().filter(|corner| corner.1 == part.material).map(|corner| corner.0));
            parts.push(WoodPart { indices: [first, indices.len() as u32], material: part.material });
        }
    }
    Wood { vertices, indices, parts }
}

fn look(wood_error_px: f32) -> Look {
    Look { wood_error_px, ..Look::default() }
}

/// Draws pictures on the CPU, where wood without an order is always drawn as it is.
struct Drawer<'a> {
    renderer: SoftwareRenderer<'a>,
    ids: Vec<ModelId>,
    model: &'a FoliageModel,
}

impl<'a> Drawer<'a> {
    /// The first model is the plant with all of its wood.
    fn new(models: &[&'a FoliageModel]) -> Result<Self> {
        let mut renderer = SoftwareRenderer::new(look(ERROR_PX))?;
        let ids = models.iter().map(|model| renderer.add_model(model)).collect::<Result<Vec<_>>>()?;
        Ok(Self { renderer, ids, model: models[0] })
    }

    fn instance(&self, model: usize, leaves: u32) -> Instance {
        Instance::new(self.ids[model], DAffine3::IDENTITY, leaves as f32)
    }

    /// Triangles of a model's wood that are drawn.
    fn triangles(&self, model: usize, diameter_px: u32) -> Result<u64> {
        let camera = measure::far_camera(&self.model.sphere(), [0.0; 2], diameter_px);
        let side = camera.height_px;
        Ok(self.renderer.cutout(camera, &[self.instance(model, 0)], [side; 2])?.prepared.wood_triangles)
    }

    /// Cut-outs from the held-out views.
    fn pictures(&self, model: usize, leaves: u32, diameter_px: u32) -> Result<Vec<Image>> {
        let plants = [self.instance(model, leaves)];
        let picture = |camera: &Camera| Ok(self.renderer.cutout(*camera, &plants, [camera.height_px; 2])?.image);
        measure::far_cameras(&self.model.sphere(), diameter_px).par_iter().map(picture).collect()
    }

    fn front(&self, model: usize, leaves: u32, side: u32) -> Result<Image> {
        let camera = LookAt::framing(&self.model.sphere(), FRONT, measure::FOV_Y, 1.0).camera(side);
        Ok(self.renderer.draw(camera, &[self.instance(model, leaves)], [side; 2])?.image)
    }
}

/// Times frames of four plants on the GPU.
struct Timer<'a> {
    gpu: &'a GpuDevice,
    /// Draws all wood.
    whole: FoliageRenderer,
    /// Draws wood at the error.
    reduced: FoliageRenderer,
    /// The plant with all of its wood; with its order; and without, for stems by width.
    ids: [ModelId; 3],
}

impl<'a> Timer<'a> {
    /// Takes the model without an order and the one with it.
    fn new(gpu: &'a GpuDevice, [plain, ordered]: [&FoliageModel; 2]) -> Result<Self> {
        let (device, queue) = (gpu.device(), gpu.queue());
        let mut whole = FoliageRenderer::new(device, TARGET, look(0.0))?;
        let mut reduced = FoliageRenderer::new(device, TARGET, look(ERROR_PX))?;
        let ids = [
            whole.add_model(device, queue, plain)?,
            reduced.add_model(device, queue, ordered)?,
            reduced.add_model(device, queue, plain)?,
        ];
        Ok(Self { gpu, whole, reduced, ids })
    }

    /// Median times of frames of the wood alone and with the leaves; the ways, in the order of the
    /// rows, are drawn in turn.
    fn medians(&mut self, models: &[&FoliageModel], leaves: u32, diameter_px: u32) -> Result<Vec<[f64; 2]>> {
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let (camera, places) = four(&models[0].sphere(), diameter_px);
        let target = Offscreen::new(self.gpu, [camera.height_px; 2])?;
        let peers = models[WAYS.len()..].iter().map(|model| self.whole.add_model(device, queue, model));
        let peers = peers.collect::<Result<Vec<_>>>()?;
        let ids: Vec<ModelId> = self.ids.into_iter().chain(peers).collect();
        let mut times = vec![[Vec::new(), Vec::new()]; ids.len()];
        for round in 0..=ROUNDS {
            for ((number, &id), times) in ids.iter().enumerate().zip(&mut times) {
                let foliage = if (1..WAYS.len()).contains(&number) { &mut self.reduced } else { &mut self.whole };
                for (active, times) in [0, leaves].into_iter().zip(times) {
                    let plants = places.map(|place| Instance::new(id, place, active as f32));
                    let started = Instant::now();
                    foliage.prepare(device, queue, camera, &plants)?;
                    target.draw(foliage)?;
                    if round > 0 {
                        times.push(started.elapsed().as_secs_f64());
                    }
                }
            }
        }
        ids[WAYS.len()..].iter().for_each(|&id| {
            self.whole.remove_model(id);
        });
        Ok(times.iter_mut().map(|both| both.each_mut().map(|times| median(times))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foliage_lod::{
        grow::{GrowOptions, Species, grow},
        stochastic::shuffled,
    };

    fn hazel() -> FoliageModel {
        let species = Species::embedded("hazel").unwrap();
        shuffled(&grow(&species, &GrowOptions { leaves: Some(60), ..GrowOptions::default() }).unwrap(), 1).unwrap()
    }

    #[test]
    fn the_order_draws_fewer_triangles_the_smaller_the_plant_is_and_covers_what_all_wood_does() {
        let mut model = hazel();
        assert!(measure(&model, None, &mut || Ok(())).is_err(), "it has no order");
        model.order_wood();
        let mut checks = 0;
        let rows = measure(&model, None, &mut || {
            checks += 1;
            Ok(())
        });
        let rows = rows.unwrap();
        assert_eq!(checks, DIAMETERS.len());
        let mut before = u64::MAX;
        for px in DIAMETERS {
            let [full, order, by_width] = WAYS.map(|way| row_of(&rows, way, px));
            assert_eq!(full.triangles, model.wood.triangles() as u64);
            assert_eq!([full.alone.rmse, full.alone.xor, full.with_leaves.rmse, full.with_leaves.xor], [0.0; 4]);
            assert!(order.triangles < before && by_width.triangles < full.triangles, "{} at {px}", order.triangles);
            before = order.triangles;
            assert!(order.alone.coverage.abs() < 0.15, "{} at {px}", order.alone.coverage);
            assert!(order.with_leaves.xor < order.alone.xor, "leaves hide wood");
            assert_eq!(order.images.each_ref().map(|image| image.width), [px; 2]);
        }
        for row in &rows {
            let order = row_of(&rows, "order", row.diameter_px);
            assert!(row.frame_seconds.iter().all(|seconds| seconds.is_nan()) && row.leaves == order.leaves);
            let is_given = row.way.starts_with("meshopt") && row.way != "meshopt simplify";
            assert!(!is_given || row.triangles <= order.triangles, "{}: {}", row.way, row.triangles);
        }
        assert_eq!(rows.iter().any(|row| row.way.starts_with("meshopt")), cfg!(feature = "peers"));
    }

    fn row_of<'a>(rows: &'a [WoodRow], way: &str, px: u32) -> &'a WoodRow {
        rows.iter().find(|row| row.way == way && row.diameter_px == px).unwrap()
    }

    #[test]
    fn of_wood_by_width_only_wide_stems_are_as_they_were() {
        let model = hazel();
        let stems = Stems::new(&model);
        assert_eq!(by_width(&model.wood, &stems, 0.0).triangles(), model.wood.triangles());
        let width = model.sphere().radius as f32 / 64.0;
        let wood = by_width(&model.wood, &stems, width);
        assert!(wood.triangles() * 4 < model.wood.triangles(), "{}", wood.triangles());
        let drawn = stems.levels.drawn(width).width;
        for (i, (vertex, was)) in wood.vertices.iter().zip(&model.wood.vertices).enumerate() {
            let moved = Vec3::from(vertex.position).distance(was.position.into());
            let missing = 0.5 * (drawn - stems.widths[i].abs()).max(0.0);
            assert!((moved - missing).abs() < 1e-4, "{moved}, not {missing}");
        }
    }
}
