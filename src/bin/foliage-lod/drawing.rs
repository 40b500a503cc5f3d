//! Draws what is staged, on a GPU where one answers.

use crate::{
    args::Raster,
    raster::{open, tell_fallback},
    staging::{Shown, Staging},
};
use foliage_lod::{
    Error, Result,
    effects::{Counts, Fade, wind::Shape},
    material::{Material, Texture},
    model::{FoliageModel, Timeline},
    render::{
        device::GpuDevice,
        foliage::{FoliageRenderer, Frame, Instance},
        guard::guarded,
        image::Image,
        offscreen::{Offscreen, TARGET},
        software::{Background, DrawList, DrawOptions, Drawn, Painter, Placed, Tone, mean_leaf_color},
    },
};
use std::collections::HashMap;

/// Most triangles in one picture drawn on the CPU: 2 GB.
const MOST_CPU_TRIANGLES: u64 = 1 << 23;

/// A picture and how it was made.
pub struct Drawing {
    /// The picture.
    pub image: Image,
    /// Draw calls.
    pub draws: u32,
    /// Leaves of all plants, those on their way included.
    pub leaves: u64,
    /// For how much each effect was simulated.
    pub effects: Counts,
    /// Name of the adapter; `None` on the CPU.
    pub adapter: Option<String>,
}

impl Drawing {
    /// What a step line calls it.
    pub fn place(&self) -> &str {
        self.adapter.as_deref().unwrap_or("the CPU")
    }
}

/// Draws what is staged.
///
/// # Errors
/// Those of the GPU when only it would do, else those of the CPU drawer, and [`Error::TooLarge`] for a picture that takes
/// too much memory there.
pub fn draw(raster: Raster, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    match raster {
        Raster::Cpu => on_cpu(staging, size),
        Raster::Gpu => on_gpu(open()?, staging, size),
        Raster::Auto => match open() {
            Err(_) => on_cpu(staging, size),
            Ok(gpu) => on_gpu(gpu, staging, size).or_else(|error| {
                tell_fallback(&error);
                on_cpu(staging, size)
            }),
        },
    }
}

fn on_gpu(gpu: GpuDevice, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    guarded(|| draw_on_gpu(gpu, staging, size))
}

fn draw_on_gpu(gpu: GpuDevice, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    let target = Offscreen::new(&gpu, size)?;
    let (device, queue) = (gpu.device(), gpu.queue());
    let mut foliage = FoliageRenderer::with_look(device, TARGET, staging.look);
    let added = staging.models.iter().map(|model| foliage.add_model(device, queue, model));
    let ids = added.collect::<Result<Vec<_>>>()?;
    let instance = |plant: &Shown| Instance {
        leaf_scale: plant.leaf_scale,
        ..Instance::new(ids[plant.model], plant.world_from_plant, plant.active)
    };
    let instances: Vec<_> = staging.plants.iter().map(instance).collect();
    let frame = Frame::new(&staging.camera, size[1]).at(staging.seconds);
    let casters: Vec<_> = staging.casters.iter().map(instance).collect();
    let prepared = foliage.prepare_with_casters(device, queue, frame, &instances, &casters)?;
    let image = target.picture(&foliage)?;
    let (draws, leaves, effects) = (prepared.draws, prepared.leaves, prepared.effects);
    Ok(Drawing { image, draws, leaves, effects, adapter: Some(gpu.adapter_name()) })
}

/// Everything but shadows is simulated here: the CPU draws a picture, not an animation.
fn on_cpu(staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    check_triangles(staging)?;
    let Staging { models, plants, look, .. } = staging;
    let effects = &look.effects;
    let lighting = look.lighting();
    let (materials, textures, first_materials) = merged(models);
    let timelines: Vec<Timeline> = models.iter().map(Timeline::new).collect();
    let mut counts = Counts::of(effects);
    let key = |plant: &Shown| (plant.model, plant.active.to_bits(), plant.leaf_scale.to_bits());
    let mut lists = HashMap::new();
    let fade = effects.fade.unwrap_or(Fade { half_width: 0.0, ..Fade::default() });
    for plant in plants {
        let model = &models[plant.model];
        let transition = fade.transition(f64::from(plant.active), model.leaves.len() as u32);
        counts.add_leaves(&transition);
        lists.entry(key(plant)).or_insert_with(|| {
            let drawn = Drawn { transition, by: fade.by, leaf_scale: plant.leaf_scale };
            let mut list = DrawList::of_drawn(model, &timelines[plant.model], &drawn);
            list.parts.iter_mut().for_each(|part| part.material += first_materials[plant.model]);
            list
        });
    }
    let means = models.iter().map(|model| mean_leaf_color(model, &lighting));
    let means: Vec<_> = if effects.contrast.is_some() { means.collect::<Result<_>>()? } else { Vec::new() };
    let shapes: Vec<Shape> = models.iter().map(|model| Shape::new(&model.aabb())).collect();
    let moment = effects.wind.map(|wind| wind.at(staging.seconds));
    let mut placed = Vec::new();
    for plant in plants {
        let leaves = models[plant.model].leaves.len();
        let tone =
            effects.contrast.map(|effect| Tone { kept: effect.kept(plant.active, leaves), mean: means[plant.model] });
        let sway = moment.map(|moment| moment.sway(&shapes[plant.model], &plant.world_from_plant));
        placed.push(Placed { tone, sway, ..Placed::new(&lists[&key(plant)], plant.world_from_plant) });
        counts.add_plant();
    }
    // The CPU casts no shadows.
    counts.shadow.iter_mut().for_each(|count| count.skipped = plants.len() as u64);
    let painter = Painter::new(&materials, &textures)?;
    let background = look.landscape().map_or(Background::Sky, Background::Landscape);
    let options = DrawOptions { lighting, background, ..DrawOptions::default() };
    let image = painter.draw_placed(&placed, &staging.camera, size, &options)?;
    let of_leaves = |placed: &Placed<'_>| placed.list.parts.iter().filter(|part| part.leaf.is_some()).count() as u64;
    let leaves = placed.iter().map(of_leaves).sum();
    Ok(Drawing { image, draws: 1, leaves, effects: counts, adapter: None })
}

/// Materials and textures of all models, and where each model's materials begin.
fn merged(models: &[FoliageModel]) -> (Vec<Material>, Vec<Texture>, Vec<u32>) {
    let (mut materials, mut textures, mut firsts) = (Vec::new(), Vec::new(), Vec::new());
    for model in models {
        firsts.push(materials.len() as u32);
        let first_texture = textures.len() as u32;
        let moved = |material: &Material| Material {
            texture: material.texture.map(|texture| texture + first_texture),
            ..material.clone()
        };
        materials.extend(model.materials.iter().map(moved));
        textures.extend(model.textures.iter().cloned());
    }
    (materials, textures, firsts)
}

fn check_triangles(staging: &Staging<'_>) -> Result<()> {
    let of_plant = |plant: &Shown| {
        let model = &staging.models[plant.model];
        let last = (plant.active.ceil() as usize).min(model.leaves.len()).checked_sub(1);
        let of_leaves = last.map_or(0, |last| u64::from(model.leaves[last].indices[1] / 3));
        model.wood.triangles() as u64 + of_leaves
    };
    let value = staging.plants.iter().map(of_plant).sum::<u64>();
    if value <= MOST_CPU_TRIANGLES {
        return Ok(());
    }
    let fix = "draw fewer trees, lower --lod, or use --raster gpu".into();
    Err(Error::TooLarge { what: "triangles drawn on the CPU".into(), value, limit: MOST_CPU_TRIANGLES, fix })
}
