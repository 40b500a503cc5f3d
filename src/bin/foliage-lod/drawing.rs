//! Draws plants, on a GPU where one answers.

use crate::{args::Raster, planting::Planting};
use foliage_lod::{
    Error, Result,
    model::FoliageModel,
    render::{
        device::{GpuDevice, GpuOptions},
        foliage::{FoliageRenderer, Instance},
        image::Image,
        offscreen::{Offscreen, TARGET},
        software::{DrawList, DrawOptions, Painter, Placed},
    },
};
use std::collections::BTreeMap;

/// Most triangles in one picture drawn on the CPU: 2 GB.
const MOST_CPU_TRIANGLES: u64 = 1 << 23;

/// A picture and how it was made.
pub struct Drawing {
    /// The picture.
    pub image: Image,
    /// Draw calls.
    pub draws: u32,
    /// Name of the adapter; `None` on the CPU.
    pub adapter: Option<String>,
}

impl Drawing {
    /// What a step line calls it.
    pub fn place(&self) -> &str {
        self.adapter.as_deref().unwrap_or("the CPU")
    }
}

/// Draws the first `counts[i]` leaves of plant `i`.
///
/// # Errors
/// Those of the GPU when only it would do, else those of the CPU drawer, and [`Error::TooLarge`] for a picture that takes
/// too much memory there.
pub fn draw(
    raster: Raster,
    model: &FoliageModel,
    planting: &Planting,
    counts: &[u32],
    size: [u32; 2],
) -> Result<Drawing> {
    match raster {
        Raster::Cpu => on_cpu(model, planting, counts, size),
        Raster::Gpu => on_gpu(model, planting, counts, size),
        Raster::Auto => on_gpu(model, planting, counts, size).or_else(|_| on_cpu(model, planting, counts, size)),
    }
}

fn on_gpu(model: &FoliageModel, planting: &Planting, counts: &[u32], size: [u32; 2]) -> Result<Drawing> {
    let gpu = GpuDevice::new(&GpuOptions::from_env())?;
    let target = Offscreen::new(&gpu, size)?;
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET);
    let id = foliage.add_model(gpu.device(), gpu.queue(), model)?;
    let instance =
        |(plant, &count): (&crate::planting::Standing, &u32)| Instance::new(id, plant.world_from_plant, count as f32);
    let instances: Vec<_> = planting.plants.iter().zip(counts).map(instance).collect();
    let prepared = foliage.prepare(gpu.device(), gpu.queue(), &planting.camera, &instances)?;
    let image = target.picture(&foliage)?;
    Ok(Drawing { image, draws: prepared.draws, adapter: Some(gpu.adapter_name()) })
}

fn on_cpu(model: &FoliageModel, planting: &Planting, counts: &[u32], size: [u32; 2]) -> Result<Drawing> {
    check_triangles(model, counts)?;
    let lists: BTreeMap<u32, DrawList<'_>> =
        counts.iter().map(|&count| (count, DrawList::of_model(model, count as usize))).collect();
    let plants = planting.plants.iter().zip(counts);
    let placed: Vec<_> = plants.map(|(plant, count)| Placed::new(&lists[count], plant.world_from_plant)).collect();
    let painter = Painter::new(&model.materials, &model.textures)?;
    let image = painter.draw_placed(&placed, &planting.camera, size, &DrawOptions::default())?;
    Ok(Drawing { image, draws: 1, adapter: None })
}

fn check_triangles(model: &FoliageModel, counts: &[u32]) -> Result<()> {
    let of_leaves = |&count: &u32| {
        let last = (count as usize).checked_sub(1).and_then(|last| model.leaves.get(last));
        last.map_or(0, |leaf| u64::from(leaf.indices[1] / 3))
    };
    let wood = model.wood.triangles() as u64 * counts.len() as u64;
    let value = wood + counts.iter().map(of_leaves).sum::<u64>();
    if value <= MOST_CPU_TRIANGLES {
        return Ok(());
    }
    let fix = "draw fewer trees, lower --lod, or use --raster gpu".into();
    Err(Error::TooLarge { what: "triangles drawn on the CPU".into(), value, limit: MOST_CPU_TRIANGLES, fix })
}
