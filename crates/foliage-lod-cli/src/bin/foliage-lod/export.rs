//! `foliage-lod export`: writes models for other programs.

use crate::{
    args::{self, Preset},
    export_levels::{File, check_levels, in_files, in_one, levels, resize},
    failure::{Failure, complain},
    models,
    output::{self, Steps},
    progress::spinning,
    raster::simplified,
};
use foliage_lod::{
    Error, FoliageModel, Plant,
    export::{page, write_continuous},
    file,
    grow::{GrowOptions, Species, grow},
    import::{self, ImportOptions, Imported},
    simplify::{GrowBy, SimplifyOptions},
};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::json;
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

/// Runs the subcommand.
pub fn run(args: &args::Export) -> Result<(), Failure> {
    check_levels(&args.levels)?;
    check_output(args)?;
    let mut steps = Steps::new(args.json);
    let mut model = model(args, &mut steps)?;
    let has_levels = !args.levels.is_empty();
    let tiled = model.tiled_leaves() as u64;
    if tiled > 0 && !has_levels {
        complain(format_args!(
            "warning: {} leaves repeat their picture once they are enlarged, which glTF cannot say; they show one \
             larger picture instead. Models made with --growth scale look the same everywhere",
            HumanCount(tiled)
        ));
    }
    let cards = model.clusters.cards().len() as u64;
    if cards > 0 && !has_levels {
        complain(format_args!(
            "warning: {} pictures of leaves that one stands for are left out, since a continuous glTF knows no such \
             cards; that leaf is enlarged instead. Models made with --growth scale look the same everywhere",
            HumanCount(cards)
        ));
    }
    if has_levels && !model.wood.indices.is_empty() && model.wood_order.is_none() {
        model.order_wood();
        steps.done("wood", "in the order in which it loses detail")?;
    }
    let files = if has_levels {
        let levels = levels(args, &mut model, &mut steps)?;
        match args.msft_lod {
            true => vec![in_one(&args.options(), args.output.clone(), levels)?],
            false => in_files(&args.options(), &model.name, levels, outputs(args))?,
        }
    } else {
        resize(args.textures, &mut model, &mut steps)?;
        vec![continuous(args, &model)?]
    };
    if model.growth.tone > 0.0 {
        steps.done("tone", "left out: enlarged leaves keep their own colours in other programs")?;
    }
    file::write_all(&files.iter().map(|file| (&file.path, &file.bytes)).collect::<Vec<_>>())?;
    let mut written = Vec::new();
    for File { path, kind, bytes, about } in files {
        let told =
            ["leaves", "cards"].iter().find_map(|what| about[what].as_u64().filter(|&count| count > 0).zip(Some(what)));
        let told = told.map_or(String::new(), |(count, what)| format!("{} {what}, ", HumanCount(count)));
        steps.done("write", format!("{}: {told}{}", path.display(), DecimalBytes(bytes.len() as u64)))?;
        let file = json!({ "path": path.display().to_string(), "kind": kind, "bytes": bytes.len() });
        written.push(output::merged(file, about));
    }
    if args.json {
        output::line(json!({ "leaves": model.leaves.len(), "files": written, "seconds": steps.total_seconds() }))?;
    }
    Ok(())
}

/// The model, or what a tree is simplified to.
fn model(args: &args::Export, steps: &mut Steps) -> Result<FoliageModel, Failure> {
    if ends_with(&args.input, "vds") {
        let model = models::read(&args.input)?;
        steps.done("read", format!("{}: {} leaves", model.name, HumanCount(model.leaves.len() as u64)))?;
        return Ok(model);
    }
    let plant = plant(args)?;
    steps.done("read", format!("{}: {} leaves", plant.name, HumanCount(plant.leaves.len() as u64)))?;
    // Leaves that repeat their picture would show one larger one, or be many triangles.
    let options = SimplifyOptions { grow_by: GrowBy::Scale, ..args.preset.unwrap_or(Preset::Balanced).options() };
    let (made, rasteriser) = simplified(args.raster, &plant, &options)?;
    steps.done("simplify", format!("on {rasteriser}, {} fragments", HumanCount(made.fragments)))?;
    Ok(made.model)
}

/// The tree of a file or of a species.
fn plant(args: &args::Export) -> Result<Plant, Failure> {
    if is_species(&args.input) {
        let species = Species::named(&args.input)?;
        return Ok(spinning("growing", || grow(&species, &GrowOptions::default()))?);
    }
    let Imported { plant, warnings, .. } = spinning("reading", || import::load(&args.input, &args.import.options()))?;
    warnings.iter().for_each(|warning| complain(output::warning_line(warning)));
    Ok(plant)
}

fn continuous(args: &args::Export, model: &FoliageModel) -> Result<File, Failure> {
    let glb = spinning("writing", || write_continuous(model, &args.options()))?;
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

/// Whether the name ends in a dot and this.
fn ends_with(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

/// Whether the input names a species: a file may have any name but that of an embedded one.
fn is_species(input: &Path) -> bool {
    ends_with(input, "toml") || (input.extension().is_none() && !input.exists())
}

/// Files that are written: of levels, one for each and the last one to tell of them.
fn outputs(args: &args::Export) -> Vec<PathBuf> {
    if args.levels.is_empty() || args.msft_lod {
        return vec![args.output.clone()];
    }
    let named = |ending: String| {
        let mut name = OsString::from(args.output.file_stem().unwrap_or_default());
        name.push(ending);
        args.output.with_file_name(name)
    };
    let count = args.levels.len() + usize::from(args.has_cards());
    (0..count).map(|number| named(format!("_LOD{number}.glb"))).chain([named("_lods.json".into())]).collect()
}

/// Rejects outputs that cannot be written or are the input, before the work starts.
fn check_output(args: &args::Export) -> Result<(), Error> {
    let output: &Path = &args.output;
    for path in outputs(args) {
        file::check_writable(&path)?;
        file::check_apart(&path, [&args.input])?;
    }
    let refused = |allowed: &str| {
        let input = format!("{:?}", args.input.display().to_string());
        Err(Error::invalid("the input", input, allowed))
    };
    let imports = args.import.options() != ImportOptions::default();
    if ends_with(&args.input, "vds") && (args.preset.is_some() || imports) {
        return refused("a tree with --preset and the options of the import; of a model, --z-up turns the output");
    }
    if is_species(&args.input) {
        if let Err(Error::InvalidOption { .. }) = Species::named(&args.input) {
            let all = Species::EMBEDDED.join(", ");
            return refused(&format!(
                "a model (.vds), a tree (.glb, .gltf, .obj), or a species: {all}, or a .toml file"
            ));
        }
        if imports {
            return refused("a tree file (.glb, .gltf, .obj) with the options of the import; species need none");
        }
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
