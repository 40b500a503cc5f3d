//! `foliage-lod render`: a model becomes a picture.

use crate::{
    args::{self, Method},
    drawing,
    failure::Failure,
    output::{self, Steps, grouped},
    pictures,
    planting::{Planting, Standing},
    progress::spinning,
};
use foliage_lod::{Error, extract::leaf_count, file, model::FoliageModel};
use serde_json::json;

/// Runs the subcommand.
pub fn run(args: &args::Render) -> Result<(), Failure> {
    check_numbers(args)?;
    file::check_writable(&args.output)?;
    let mut steps = Steps::new(args.json);
    let model = FoliageModel::read(&args.model)?;
    let planting = planting(args, &model)?;
    let counts: Vec<u32> = planting.plants.iter().map(|plant| active_count(args, &model, plant)).collect();
    steps.done("read", format!("{}: {} leaves", model.name, grouped(model.leaves.len() as u64)))?;
    let drawing = spinning("drawing", || drawing::draw(args.raster, &model, &planting, &counts, args.size))?;
    drawing.image.write_png(&args.output)?;
    let leaves_drawn: u64 = counts.iter().copied().map(u64::from).sum();
    let plants = if counts.len() == 1 { String::new() } else { format!("{} trees, ", grouped(counts.len() as u64)) };
    let result = format!("{}: {plants}{} leaves on {}", args.output.display(), grouped(leaves_drawn), drawing.place());
    steps.done("draw", result)?;
    if args.json {
        output::line(json!({
            "leaves_drawn": leaves_drawn,
            "instances": counts.len(),
            "draws": drawing.draws,
            "effects": {},
            "adapter": drawing.adapter,
            "seconds": steps.total_seconds(),
        }))?;
    }
    Ok(())
}

fn check_numbers(args: &args::Render) -> foliage_lod::Result<()> {
    let refused = |option, value: f32, allowed: &str| {
        Err(Error::InvalidOption { option, value: value.to_string(), allowed: allowed.into() })
    };
    match (args.distance, args.lod) {
        (Some(distance), _) if !(distance > 0.0 && distance.is_finite()) => {
            refused("--distance", distance, "a number of radii above 0")
        }
        (_, Some(lod)) if !(0.0..=1.0).contains(&lod) => refused("--lod", lod, "from 0 to 1"),
        _ => Ok(()),
    }
}

fn planting(args: &args::Render, model: &FoliageModel) -> foliage_lod::Result<Planting> {
    let sphere = model.sphere();
    let aspect = f64::from(args.size[0]) / f64::from(args.size[1]);
    match (&args.row, args.ring, args.grid) {
        (Some(distances), _, _) => Planting::row(&sphere, distances, aspect),
        (None, Some(count), _) => Planting::ring(&sphere, count, aspect),
        (None, None, Some(side)) => Planting::grid(&sphere, side, aspect),
        (None, None, None) => Ok(Planting::single(&sphere, args.distance, aspect)),
    }
}

fn active_count(args: &args::Render, model: &FoliageModel, plant: &Standing) -> u32 {
    let leaves = model.leaves.len() as u32;
    match (args.method, args.leaves_count, args.lod) {
        (Method::Full, _, _) => leaves,
        (Method::Vds, Some(n), _) => n.min(leaves),
        (Method::Vds, None, Some(lod)) => leaf_count(lod, leaves, 0),
        (Method::Vds, None, None) => pictures::count_at(model, plant.distance),
    }
}
