//! `foliage-lod export`: writes models for other programs.

use crate::{
    args::{self, Preset},
    curves,
    failure::{Failure, complain},
    models,
    output::{self, Steps},
    progress::spinning,
    raster::simplified,
};
use foliage_lod::{
    Error, FoliageModel,
    export::{GlbOptions, Level, page, write_continuous, write_level},
    file,
    import::{self, ImportOptions, Imported},
    simplify::{GrowBy, SimplifyOptions},
};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Runs the subcommand.
pub fn run(args: &args::Export) -> Result<(), Failure> {
    check_output(args)?;
    let mut steps = Steps::new(args.json);
    let mut model = model(args, &mut steps)?;
    let tiled = model.tiled_leaves() as u64;
    if tiled > 0 {
        complain(format_args!(
            "warning: {} leaves repeat their picture once they are enlarged, which glTF cannot say; they show one \
             larger picture instead. Models made with --growth scale look the same everywhere",
            HumanCount(tiled)
        ));
    }
    if !args.levels.is_empty() && !model.wood.indices.is_empty() && model.wood_order.is_none() {
        model.order_wood();
        steps.done("wood", "in the order in which it loses detail")?;
    }
    let files = if args.levels.is_empty() { vec![continuous(args, &model)?] } else { levels(args, &model)? };
    if model.growth.tone > 0.0 {
        steps.done("tone", "left out: enlarged leaves keep their own colours in other programs")?;
    }
    let mut written = Vec::new();
    for File { path, kind, bytes, about } in files {
        file::write_whole(&path, &bytes)?;
        let told = about["leaves"].as_u64().map_or(String::new(), |leaves| format!("{} leaves, ", HumanCount(leaves)));
        steps.done("write", format!("{}: {told}{}", path.display(), DecimalBytes(bytes.len() as u64)))?;
        let file = json!({ "path": path.display().to_string(), "kind": kind, "bytes": bytes.len() });
        written.push(output::merged(file, about));
    }
    if args.json {
        output::line(json!({ "leaves": model.leaves.len(), "files": written, "seconds": steps.total_seconds() }))?;
    }
    Ok(())
}

/// A file to write.
struct File {
    path: PathBuf,
    kind: &'static str,
    bytes: Vec<u8>,
    about: Value,
}

/// The model, or what a tree file is simplified to.
fn model(args: &args::Export, steps: &mut Steps) -> Result<FoliageModel, Failure> {
    if ends_with(&args.input, "vds") {
        let model = models::read(&args.input)?;
        steps.done("read", format!("{}: {} leaves", model.name, HumanCount(model.leaves.len() as u64)))?;
        return Ok(model);
    }
    let options = args.import.options();
    let Imported { plant, warnings, .. } = spinning("reading", || import::load(&args.input, &options))?;
    warnings.iter().for_each(|warning| complain(output::warning_line(warning)));
    steps.done("read", format!("{}: {} leaves", plant.name, HumanCount(plant.leaves.len() as u64)))?;
    // Leaves that repeat their picture would show one larger one.
    let options = SimplifyOptions { grow_by: GrowBy::Scale, ..args.preset.unwrap_or(Preset::Balanced).options() };
    let (made, rasteriser) = simplified(args.raster, &plant, &options)?;
    steps.done("simplify", format!("on {rasteriser}, {} fragments", HumanCount(made.fragments)))?;
    Ok(made.model)
}

fn options(args: &args::Export) -> GlbOptions {
    GlbOptions { exact: args.exact, z_up: args.z_up, scale: args.scale }
}

fn continuous(args: &args::Export, model: &FoliageModel) -> Result<File, Failure> {
    let glb = spinning("writing", || write_continuous(model, &options(args)))?;
    let is_page = ends_with(&args.output, "html");
    let (kind, bytes) = if is_page { ("page", page(&glb, &model.name).into_bytes()) } else { ("continuous", glb) };
    let triangles = model.indices.len() / 3 + model.wood.triangles();
    let about = json!({
        "leaves": model.leaves.len(),
        "triangles": triangles,
        "max_scale": model.max_scale,
        "tiled_leaves": model.tiled_leaves(),
    });
    Ok(File { path: args.output.clone(), kind, bytes, about })
}

/// A file for each level, and one that tells of them.
fn levels(args: &args::Export, model: &FoliageModel) -> Result<Vec<File>, Failure> {
    let curve = match &model.curve {
        Some(curve) => curve.clone(),
        None => curves::measure(model)?,
    };
    let mut paths = outputs(args);
    let told_in = paths.pop().unwrap_or_default();
    let mut files = Vec::new();
    for (path, &lod) in paths.into_iter().zip(&args.levels) {
        let (level, bytes) = spinning("writing", || {
            let level = Level::new(model, lod);
            let bytes = write_level(&level.plant, &options(args));
            bytes.map(|bytes| (level, bytes))
        })?;
        // On a screen of 1080 rows.
        let size_px = level.size_px.min(1080.0);
        let error = curve.error_px(f64::from(level.leaves));
        let error_px = error * f64::from(size_px / curve.size_px).powf(f64::from(curve.size_power));
        let about = json!({
            "leaves": level.leaves,
            "triangles": level.plant.indices.len() / 3 + level.plant.wood.triangles(),
            "wood_triangles": level.plant.wood.triangles(),
            "size_px": size_px,
            "screen_coverage": size_px / 1080.0,
            "wrong_px": error_px,
        });
        files.push(File { path, kind: "level", bytes, about });
    }
    let told: Vec<Value> = files
        .iter()
        .map(|file| {
            let name = file.path.file_name().unwrap_or_default().to_string_lossy();
            output::merged(json!({ "file": name }), file.about.clone())
        })
        .collect();
    let text = serde_json::to_string_pretty(&json!({ "model": model.name, "levels": told })).unwrap_or_default();
    files.push(File { path: told_in, kind: "levels", bytes: text.into_bytes(), about: json!({}) });
    Ok(files)
}

/// Whether the name ends in a dot and this.
fn ends_with(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

/// Files that are written: of levels, one for each and the last one to tell of them.
fn outputs(args: &args::Export) -> Vec<PathBuf> {
    if args.levels.is_empty() {
        return vec![args.output.clone()];
    }
    let stem = args.output.file_stem().unwrap_or_default().to_string_lossy();
    let of_levels = (0..args.levels.len()).map(|number| format!("{stem}_LOD{number}.glb"));
    of_levels.chain([format!("{stem}_lods.json")]).map(|name| args.output.with_file_name(name)).collect()
}

/// Rejects outputs that cannot be written or are the input, before the work starts.
fn check_output(args: &args::Export) -> Result<(), Error> {
    let output: &Path = &args.output;
    for path in outputs(args) {
        file::check_writable(&path)?;
        file::check_apart(&path, [&args.input])?;
    }
    if ends_with(&args.input, "vds") && (args.preset.is_some() || args.import.options() != ImportOptions::default()) {
        let allowed = "a tree file with --preset and the options of the import; of a model, --z-up turns the output";
        return Err(Error::invalid("the input", format!("{:?}", args.input.display().to_string()), allowed));
    }
    let is_page = ends_with(output, "html") && args.levels.is_empty();
    if !is_page && !ends_with(output, "glb") {
        let named = format!("{:?}", output.display().to_string());
        let page = if args.levels.is_empty() { ", or a page (.html)" } else { "" };
        let allowed = format!("a .glb file such as {}{page}", output.with_extension("glb").display());
        return Err(Error::invalid("output", named, allowed));
    }
    Ok(())
}
