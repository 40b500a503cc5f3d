//! `foliage-lod simplify`: simplifies a tree file into a model.

use crate::{
    args, baking, curves,
    failure::{Failure, complain},
    output::{self, Steps},
    pictures,
    progress::spinning,
    raster::simplified,
};
use foliage_lod::{
    Error, FoliageModel, Plant, file,
    import::{self, ImportOptions, Imported},
    measure::{Reached, Target},
    plant::TRIM_CORNERS,
    simplify::{GrowBy, Simplified, Tried},
};
use foliage_lod_cli::report::offline::peak_bytes;
use indicatif::{DecimalBytes, HumanCount};
use serde_json::{Value, json};
use std::path::Path;

/// Percentages of the leaves that `--pictures` renders.
const PICTURE_PERCENTS: [u32; 3] = [100, 50, 15];
/// Width and height of these pictures in pixels.
const PICTURE_SIDE_PX: u32 = 768;

/// Runs the subcommand.
pub fn run(args: &args::Simplify) -> Result<(), Failure> {
    let options = args.options();
    options.validate()?;
    let targets = args.target.iter().map(|text| text.parse::<Target>()).collect::<Result<Vec<_>, _>>()?;
    check_outputs(args)?;
    let mut steps = Steps::new(args.json);
    let import_options = ImportOptions { max_memory_mb: args.max_memory, ..args.import.options() };
    let Imported { mut plant, warnings, .. } = spinning("reading", || import::load(&args.input, &import_options))?;
    warnings.iter().for_each(|warning| complain(output::warning_line(warning)));
    let import_seconds =
        steps.done("read", format!("{}: {} leaves", plant.name, HumanCount(plant.leaves.len() as u64)))?;
    if args.trim == args::Switch::On {
        plant.trim(TRIM_CORNERS)?;
    }
    let (Simplified { mut model, fragments, seconds, leaf_layers, trial }, rasteriser) =
        simplified(args.raster, &plant, &options)?;
    if options.grow_by == GrowBy::Tile && !model.growth.tiles {
        complain(
            "warning: leaves grow by scale, since none is cut out by alpha and fills a rectangle of its texture; \
             --growth scale does the same without a warning",
        );
    }
    if options.grow_by == GrowBy::Picture && model.clusters.cards().is_empty() {
        complain(
            "warning: no leaf becomes a picture of those that it stands for, since enlarged leaves show as much; \
             --growth auto does the same without a warning",
        );
    }
    let views = format!("{} views of {1} x {1}", options.views, options.resolution);
    steps.done("simplify", format!("{views} on {rasteriser}, {} fragments", HumanCount(fragments)))?;
    if !args.exact {
        model.quantize();
    }
    let mut wood_seconds = None;
    if args.wood_order == args::Switch::On && !model.wood.indices.is_empty() {
        model.order_wood();
        let stems = model.wood_order.as_ref().map_or(0, |order| order.stems.len());
        wood_seconds = Some(steps.done("wood", format!("{} stems", HumanCount(stems as u64)))?);
    }
    let mut curve_seconds = None;
    let is_thorough = matches!(args.preset, args::Preset::Balanced | args::Preset::Best);
    if args.curve.map_or(is_thorough, |curve| curve == args::Switch::On) {
        model.curve = Some(curves::measure(&model)?);
        curve_seconds = Some(steps.done("curve", curves::summary(&model))?);
    }
    if let Some(far) = &args.far {
        model.impostor = Some(baking::bake(&model, &far.0)?);
        steps.done("bake", baking::summary(&model))?;
    }
    let bytes = model.to_bytes()?;
    file::write_whole(&args.output, &bytes)?;
    let size = DecimalBytes(bytes.len() as u64);
    let write_seconds = steps.done("write", format!("{}, {size}", args.output.display()))?;
    if let Some(folder) = &args.pictures {
        draw_pictures(&model, folder, &mut steps)?;
    }
    let reached: Vec<Reached> =
        targets.into_iter().map(|target| reach(target, &plant, &model, &mut steps)).collect::<Result<_, _>>()?;
    if args.json {
        let about = json!({
            "leaves": model.leaves.len(),
            "fragments": fragments,
            "leaf_layers": leaf_layers,
            "max_scale": model.max_scale,
            "tone": model.growth.tone,
            "tiles": model.growth.tiles,
            "cards": model.clusters.cards().len(),
            "trial": trial.map(|trial| json!({ "scale": tried(trial.scale), "tile": tried(trial.tile) })),
            "cascade": options.cascade,
            "target_leaves": reached.first().map(|reached| reached.leaves),
            "targets": args.target.iter().zip(&reached).map(|(target, reached)| {
                json!({ "target": target, "leaves": reached.leaves, "share": f64::from(reached.leaves) / model.leaves.len() as f64 })
            }).collect::<Vec<_>>(),
            "seconds": {
                "import": import_seconds,
                "growth": seconds.growth,
                "fragments": seconds.fragments,
                "prune": seconds.prune,
                "wood": wood_seconds,
                "curve": curve_seconds,
                "write": write_seconds,
                "total": steps.total_seconds(),
            },
            "warnings": output::warnings_json(&warnings),
            "peak_bytes": peak_bytes(),
            "model_bytes": bytes.len(),
            "impostor": model.impostor.as_ref().map(baking::to_json),
            "precision": output::precision_json(&model.precision),
        });
        output::line(output::merged(output::recipe_json(&model.recipe), about))?;
    }
    Ok(())
}

/// What a trial showed of leaves that grow in one way.
fn tried(shown: Tried) -> Value {
    json!({ "rmse": shown.rmse, "xor": shown.xor, "grain": shown.grain })
}

/// Finds and prints the number of leaves that meets the bound.
fn reach(target: Target, plant: &Plant, model: &FoliageModel, steps: &mut Steps) -> Result<Reached, Failure> {
    let reached = spinning("searching", || target.reach(plant, model))?;
    let Reached { leaves, quality } = reached;
    let share = 100.0 * f64::from(leaves) / plant.leaves.len() as f64;
    let found = format!("SSIM {:.3}, RMSE {:.1}, XOR {:.2} %", quality.ssim, quality.rmse, 100.0 * quality.xor);
    let missed = if target.holds(&quality) { "" } else { "; the bound cannot be met" };
    let at = format!("at {} pixels", target.pixels);
    steps.done("target", format!("{} leaves ({share:.1} %): {found} {at}{missed}", HumanCount(leaves.into())))?;
    Ok(reached)
}

/// Rejects outputs that cannot be written, before the work starts.
fn check_outputs(args: &args::Simplify) -> Result<(), Error> {
    file::check_writable(&args.output)?;
    file::check_apart(&args.output, [&args.input])?;
    check_ending(&args.output)?;
    match &args.pictures {
        Some(folder) => file::check_writable(folder.join("100.png")),
        None => Ok(()),
    }
}

/// Rejects an output with the ending of another kind of file, with the command that writes such
/// files.
fn check_ending(output: &Path) -> Result<(), Error> {
    let ending = output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let model = output.with_extension("vds");
    let model = model.display();
    let allowed = match ending.as_str() {
        "vds" | "" => return Ok(()),
        "png" | "jpg" | "jpeg" | "webp" => {
            format!("a .vds file; to draw it: foliage-lod render {model} -o {}", output.with_extension("png").display())
        }
        "glb" | "gltf" | "obj" => {
            format!(
                "a .vds file such as {model}; for other programs: foliage-lod export {model} -o {}",
                output.with_extension("glb").display()
            )
        }
        _ => format!("a .vds file such as {model}"),
    };
    Err(Error::invalid("output", format!("{:?}", output.display().to_string()), allowed))
}

fn draw_pictures(model: &FoliageModel, folder: &Path, steps: &mut Steps) -> Result<(), Failure> {
    for percent in PICTURE_PERCENTS {
        let n = (model.leaves.len() as u32 * percent).div_ceil(100);
        let path = folder.join(format!("{percent}.png"));
        let image = spinning("drawing", || pictures::draw(model, n, None, [PICTURE_SIDE_PX; 2]))?;
        image.write_png(&path)?;
        steps.done("draw", format!("{}: {} leaves", path.display(), HumanCount(n.into())))?;
    }
    Ok(())
}
