//! `foliage-lod render`: a model becomes a picture.

use crate::{
    args::{self, Method},
    failure::Failure,
    output::{self, Steps, grouped},
    pictures,
    progress::spinning,
};
use foliage_lod::{Error, extract::leaf_count, file, model::FoliageModel};
use serde_json::json;

/// Distance in radii from which a picture without `--distance` takes its level of detail: where the plant fills it.
const FILLING_RADII: f32 = 2.0;

/// Runs the subcommand.
pub fn run(args: &args::Render) -> Result<(), Failure> {
    check_numbers(args)?;
    file::check_writable(&args.output)?;
    let mut steps = Steps::new(args.json);
    let model = FoliageModel::read(&args.model)?;
    let n = active_count(args, &model);
    steps.done("read", format!("{}: {} leaves", model.name, grouped(model.leaves.len() as u64)))?;
    let image = spinning("drawing", || pictures::draw(&model, n, args.distance, args.size))?;
    image.write_png(&args.output)?;
    steps.done("draw", format!("{}: {} leaves", args.output.display(), grouped(n)))?;
    if args.json {
        output::line(json!({
            "leaves_drawn": n,
            "instances": 1,
            "draws": 1,
            "effects": {},
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

fn active_count(args: &args::Render, model: &FoliageModel) -> u32 {
    let leaves = model.leaves.len() as u32;
    match (args.method, args.leaves_count, args.lod) {
        (Method::Full, _, _) => leaves,
        (Method::Vds, Some(n), _) => n.min(leaves),
        (Method::Vds, None, Some(lod)) => leaf_count(lod, leaves, 0),
        (Method::Vds, None, None) => pictures::count_at(model, args.distance.unwrap_or(FILLING_RADII)),
    }
}
