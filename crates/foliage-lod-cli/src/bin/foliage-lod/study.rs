//! `foliage-lod report PLANT...`: measures accuracy against time and writes one page.

use crate::{
    args, baking, budget_study,
    failure::{Failure, complain},
    interrupt,
    output::{self, Steps},
    progress::{Bars, spinning},
    scene, scene_study,
};
use foliage_lod::{
    Error, FoliageModel, Plant, Result,
    file::{check_writable, write_whole},
    gpu::{GpuDevice, GpuOptions, guarded},
    grow::{GrowOptions, Species, grow},
    import::{self, ImportOptions},
    measure::Quality,
    model::Growth,
    simplify::CpuFragments,
    software::BakeOptions,
    stochastic::{AreaRule, Stochastic, shuffled},
};
use foliage_lod_cli::report::{
    Method, Study, StudyOptions, Toned,
    far::{self, FarRow},
    impostors::{self, SmallRow, Way},
    offline::{self, OfflineRow},
    page::{self, PlantReport, SceneReport},
    rows,
    study::Row,
    wood::{self, WoodRow},
};
use indicatif::HumanCount;
use serde_json::{Value, json};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// Seed of all random orders.
const SEED: u64 = 1;
/// Methods shown as pictures, in addition to the presets and the `--against` chain.
const SHOWN: [&str; 2] = ["random", "cook"];
/// Preset whose prefixes are compared with impostors, and whose wood loses detail.
const SMALL: &str = "balanced";

/// Runs the subcommand.
pub fn run(args: &args::Report) -> std::result::Result<(), Failure> {
    if args.budgets && !args.plants.iter().any(|name| scene::is_toml(Path::new(name))) {
        let allowed = "given with a scene (.toml), such as data/scenes/forest.toml";
        return Err(Error::invalid("--budgets", "given without a scene", allowed).into());
    }
    for (option, is_given) in [("--far", args.far.is_some()), ("--wood", args.wood)] {
        if is_given && args.plants.iter().all(|name| scene::is_toml(Path::new(name))) {
            let allowed = "left out, or given with a tree: scenes are measured as they are";
            return Err(Error::invalid(option, "given with scenes alone", allowed).into());
        }
    }
    let folder = &args.output;
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    check_writable(folder.join("report.html"))?;
    let options = StudyOptions { sizes: args.pixels.clone(), levels: args.levels.clone(), ..StudyOptions::default() };
    // Frames are timed only if there is a device; the rest needs none.
    let gpu = GpuDevice::new(&GpuOptions::from_env()).ok();
    let mut steps = Steps::new(args.json);
    let (mut reports, mut scenes) = (Vec::new(), Vec::new());
    for name in &args.plants {
        if scene::is_toml(Path::new(name)) {
            scenes.push(scene_study::study(Path::new(name), args, gpu.as_ref(), &mut steps)?);
            continue;
        }
        let plant = load(name, args, &mut steps)?;
        reports.push(study(&plant, args, &options, gpu.as_ref(), &mut steps)?);
    }
    if let Some(Err(error)) = gpu.as_ref().map(GpuDevice::check) {
        complain(format_args!("warning: some frame times are missing: {error}"));
    }
    let adapter = gpu.as_ref().map(GpuDevice::adapter_name);
    let adapter = adapter.as_deref();
    write(&reports, &scenes, adapter, folder)?;
    steps.done("write", format!("report.html, report.csv, report.json in {}", folder.display()))?;
    if args.json {
        output::line(json(&reports, &scenes, adapter))?;
    }
    Ok(())
}

/// Grows an embedded species or reads a file.
fn load(name: &str, args: &args::Report, steps: &mut Steps) -> std::result::Result<Plant, Failure> {
    let plant = match Species::embedded(name) {
        Ok(species) => {
            let options = GrowOptions { leaves: args.leaves, ..GrowOptions::default() };
            spinning("growing", || grow(&species, &options))?
        }
        Err(_) => spinning("reading", || import::load(Path::new(name), &ImportOptions::default()))?.plant,
    };
    steps.done("read", format!("{}: {} leaves", plant.name, HumanCount(plant.leaves.len() as u64)))?;
    Ok(plant)
}

fn study(
    plant: &Plant,
    args: &args::Report,
    options: &StudyOptions,
    gpu: Option<&GpuDevice>,
    steps: &mut Steps,
) -> std::result::Result<PlantReport, Failure> {
    let mut study = spinning("drawing", || Study::new(plant, options))?;
    let mut offline = Vec::new();
    let mut methods = Vec::new();
    for preset in offline::presets() {
        let (row, method) = offline::measure(plant, &study, &preset, &mut CpuFragments::new(), &mut Bars::new())?;
        tell_model(&row, steps)?;
        offline.push(row);
        methods.push(method);
    }
    if !args.brief {
        for variant in offline::variants() {
            let (row, _) = offline::measure(plant, &study, &variant, &mut CpuFragments::new(), &mut Bars::new())?;
            tell_model(&row, steps)?;
            offline.push(row);
        }
    }
    let presets = methods.len();
    let peers = spinning("shuffling", || peers(plant, args, options, &study, &methods))?;
    methods.extend(peers);
    let (mut rows, mut shown, mut pops) = (Vec::new(), Vec::new(), Vec::new());
    for (number, method) in methods.iter().enumerate() {
        let of_method = spinning(&format!("measuring {}", method.name), || study.rows(method, gpu))?;
        let is_shown = number < presets
            || SHOWN.contains(&method.name.as_str())
            || number >= methods.len() - args.against_methods();
        if is_shown {
            shown.extend(study.shown(method)?);
        }
        let pop = spinning(&format!("measuring popping of {}", method.name), || study.pop(method))?;
        tell_rows(method, &of_method, pop, steps)?;
        pops.push((method.name.clone(), pop));
        rows.extend(of_method);
        interrupt::check()?;
    }
    let far = if args.brief { Vec::new() } else { spinning("measuring far away", || far_rows(plant, gpu))? };
    let small = match args.far {
        Some(args::Frames(sizes)) => small_rows(&methods, &sizes, gpu, steps)?,
        None => Vec::new(),
    };
    let wood = if args.wood { wood_rows(&methods, gpu, steps)? } else { Vec::new() };
    let full = study.full_shown()?;
    let (name, leaves) = (plant.name.clone(), plant.leaves.len() as u32);
    Ok(PlantReport { plant: name, leaves, rows, pops, offline, far, small, wood, full, shown })
}

/// The full plant far away; without the GPU once it has failed or where the plant does not fit on
/// it.
fn far_rows(plant: &Plant, gpu: Option<&GpuDevice>) -> Result<Vec<FarRow>> {
    let model = shuffled(plant, SEED)?;
    match guarded(|| far::measure(&model, gpu)) {
        Err(Error::Gpu { .. } | Error::TooLarge { .. }) if gpu.is_some() => far::measure(&model, None),
        rows => rows,
    }
}

/// The plant at small sizes; without frame times once the device has failed.
fn small_rows(
    methods: &[Method],
    sizes: &BakeOptions,
    gpu: Option<&GpuDevice>,
    steps: &mut Steps,
) -> std::result::Result<Vec<SmallRow>, Failure> {
    let preset = methods.iter().find(|method| method.name == SMALL);
    let Some(model) = preset.and_then(Method::model) else { return Ok(Vec::new()) };
    let model = FoliageModel { impostor: Some(baking::bake(model, sizes)?), ..model.clone() };
    steps.done("bake", baking::summary(&model))?;
    let rows = spinning("measuring small sizes", || impostors::measure(&model, gpu, &mut interrupt::check))?;
    let rmse = |way: Way| {
        let told = rows.iter().filter(|row| row.way == way);
        told.map(|row| format!("{} px {:.1}", row.diameter_px, row.quality.rmse)).collect::<Vec<_>>().join(", ")
    };
    steps.done("measure", format!("impostor: RMSE {}; prefix {}", rmse(Way::Impostor), rmse(Way::Prefix)))?;
    Ok(rows)
}

/// The wood with less detail; none of a plant without wood.
fn wood_rows(
    methods: &[Method],
    gpu: Option<&GpuDevice>,
    steps: &mut Steps,
) -> std::result::Result<Vec<WoodRow>, Failure> {
    let preset = methods.iter().find(|method| method.name == SMALL);
    let Some(mut model) = preset.and_then(Method::model).cloned() else { return Ok(Vec::new()) };
    spinning("ordering the wood", || model.order_wood());
    if model.wood_order.is_none() {
        steps.done("measure", "wood: none")?;
        return Ok(Vec::new());
    }
    let rows = spinning("measuring the wood", || wood::measure(&model, gpu, &mut interrupt::check))?;
    let told = rows.iter().filter(|row| row.way == wood::WAYS[1]);
    let told = told.map(|row| format!("{} px {} triangles", row.diameter_px, row.triangles)).collect::<Vec<_>>();
    steps.done("measure", format!("wood: {} of {} triangles", told.join(", "), model.wood.triangles()))?;
    Ok(rows)
}

/// Methods that the presets are compared with; the `--against` chain comes last.
fn peers(
    plant: &Plant,
    args: &args::Report,
    options: &StudyOptions,
    study: &Study<'_>,
    presets: &[Method],
) -> Result<Vec<Method>> {
    let mean = study.mean_shaded()?;
    let toned = presets.iter().filter_map(Method::model).find(|model| model.growth.tone > 0.0);
    let stochastic = Stochastic::new(plant, SEED, &mut CpuFragments::new())?;
    let cook = |name, area, toned| Method::stochastic(name, stochastic.clone(), area, toned);
    let mut methods = vec![
        Method::of_model("random", shuffled(plant, SEED)?),
        cook("cook", AreaRule::Visible, Toned::Contrast(mean)),
        cook("cook, no contrast", AreaRule::Visible, Toned::Not),
        cook("gomez, linear 1/lambda", AreaRule::Linear, Toned::Not),
    ];
    // The same tone for other methods, and none for ours.
    if let Some(model) = toned.filter(|_| !args.brief) {
        let tone = model.growth.tone;
        methods.push(cook("cook, tone", AreaRule::Visible, Toned::Scale(mean, tone)));
        for preset in presets {
            let Some(model) = preset.model() else { continue };
            let (name, growth) = (&preset.name, model.growth);
            let other = match growth.tone > 0.0 {
                true => Method::of_model(&format!("{name}, no tone"), model.clone()),
                false => {
                    let growth = Growth { tone, ..growth };
                    Method::of_toned_model(&format!("{name}, tone"), FoliageModel { growth, ..model.clone() }, mean)
                }
            };
            methods.push(other);
        }
    }
    #[cfg(feature = "peers")]
    methods.extend(foliage_lod_cli::report::peers::meshoptimizer(plant, &options.levels));
    #[cfg(not(feature = "peers"))]
    let _ = options;
    if !args.against.is_empty() {
        let triangles = plant.leaf_triangles().max(1) as f64;
        let load = |path: &PathBuf| {
            let level = import::load(path, &ImportOptions::default())?.plant;
            Ok((level.leaf_triangles() as f64 / triangles, Arc::new(level)))
        };
        methods.push(Method::given("against", args.against.iter().map(load).collect::<Result<_>>()?));
    }
    Ok(methods)
}

fn tell_model(row: &OfflineRow, steps: &mut Steps) -> std::result::Result<(), Failure> {
    let OfflineRow { preset, criterion, compensate, resolution, views, .. } = row;
    let cascade = if row.cascade { ", cascade" } else { "" };
    let what = format!("{preset}: {criterion}, {compensate}, {views} views of {resolution} x {resolution}{cascade}");
    steps.done("simplify", format!("{what}; RMSE {:.1} at 15 %", row.quality.rmse))?;
    Ok(())
}

fn tell_rows(method: &Method, rows: &[Row], pop: f64, steps: &mut Steps) -> std::result::Result<(), Failure> {
    let largest = rows.iter().map(|row| row.pixels).max();
    let told = rows.iter().filter(|row| Some(row.pixels) == largest);
    let told: Vec<String> = told.map(|row| format!("{:.0} % {:.1}", 100.0 * row.level, row.quality.rmse)).collect();
    steps.done("measure", format!("{}: RMSE {}; popping {pop:.2}", method.name, told.join(", ")))?;
    Ok(())
}

fn write(reports: &[PlantReport], scenes: &[SceneReport], adapter: Option<&str>, folder: &Path) -> Result<()> {
    write_whole(folder.join("report.csv"), rows::csv(reports.iter().flat_map(|report| &report.rows)).as_bytes())?;
    write_whole(folder.join("report.json"), json(reports, scenes, adapter).to_string().as_bytes())?;
    write_whole(folder.join("report.html"), page::html(reports, scenes, adapter)?.as_bytes())
}

/// The report as JSON, which has no NaN: numbers that were not measured become null.
fn json(reports: &[PlantReport], scenes: &[SceneReport], adapter: Option<&str>) -> Value {
    let rows: Vec<Value> = reports.iter().flat_map(|report| &report.rows).map(json_row).collect();
    let offline: Vec<Value> = reports.iter().flat_map(|report| &report.offline).map(json_offline).collect();
    let pop = |report: &PlantReport| {
        let plant = report.plant.clone();
        report
            .pops
            .clone()
            .into_iter()
            .map(move |(method, change)| json!({ "plant": plant, "method": method, "change": change }))
    };
    let pops: Vec<Value> = reports.iter().flat_map(pop).collect();
    let far =
        |report: &PlantReport| -> Vec<Value> { report.far.iter().map(|row| json_far(&report.plant, row)).collect() };
    let far: Vec<Value> = reports.iter().flat_map(far).collect();
    let small = |report: &PlantReport| -> Vec<Value> {
        report.small.iter().map(|row| json_small(&report.plant, row)).collect()
    };
    let small: Vec<Value> = reports.iter().flat_map(small).collect();
    let wood =
        |report: &PlantReport| -> Vec<Value> { report.wood.iter().map(|row| json_wood(&report.plant, row)).collect() };
    let wood: Vec<Value> = reports.iter().flat_map(wood).collect();
    let budgets: Vec<Value> =
        scenes.iter().flat_map(|scene| budget_study::json_rows(&scene.name, &scene.budgets)).collect();
    let scenes: Vec<Value> = scenes.iter().flat_map(scene_study::json_rows).collect();
    json!({
        "adapter": adapter, "rows": rows, "pops": pops, "far": far, "impostors": small, "wood": wood,
        "offline": offline, "scenes": scenes, "budgets": budgets,
    })
}

fn json_far(plant: &str, row: &FarRow) -> Value {
    let seen = |seen: &far::Seen| json!({ "coverage_px": seen.coverage_px, "color": seen.color.to_array() });
    json!({
        "plant": plant,
        "distance": row.distance,
        "reference": seen(&row.truth),
        "cpu": seen(&row.cpu),
        "gpu": row.gpu.iter().flatten().map(seen).collect::<Vec<_>>(),
    })
}

fn json_small(plant: &str, row: &SmallRow) -> Value {
    json!({
        "plant": plant,
        "method": row.way.name(),
        "diameter_px": row.diameter_px,
        "leaves": row.leaves,
        "rmse": row.quality.rmse,
        "ssim": row.quality.ssim,
        "flip": row.quality.flip,
        "coverage": row.quality.coverage,
        "xor": row.quality.xor,
        "grain": row.quality.grain,
        "color": row.color,
        "change_per_degree": row.change,
        "frame_seconds": row.frame_seconds,
        "bytes": row.bytes,
    })
}

fn json_wood(plant: &str, row: &WoodRow) -> Value {
    let seen = |quality: &Quality, seconds: f64| {
        json!({
            "rmse": quality.rmse,
            "ssim": quality.ssim,
            "coverage": quality.coverage,
            "xor": quality.xor,
            "frame_seconds": seconds,
        })
    };
    json!({
        "plant": plant,
        "method": row.way,
        "diameter_px": row.diameter_px,
        "triangles": row.triangles,
        "leaves": row.leaves,
        "alone": seen(&row.alone, row.frame_seconds[0]),
        "with_leaves": seen(&row.with_leaves, row.frame_seconds[1]),
    })
}

fn json_row(row: &Row) -> Value {
    let (quality, drawn, matched) = (&row.quality, &row.drawn, &row.matched);
    json!({
        "plant": row.plant,
        "method": row.method,
        "level": row.level,
        "leaves": row.leaves,
        "triangles": drawn.triangles,
        "leaf_share": drawn.leaf_share,
        "triangle_share": drawn.triangle_share,
        "fragment_share": drawn.fragment_share,
        "pixels": row.pixels,
        "rmse": quality.rmse,
        "ssim": quality.ssim,
        "flip": quality.flip,
        "coverage": quality.coverage,
        "xor": quality.xor,
        "grain": quality.grain,
        "matched_pixels": matched.pixels,
        "matched_rmse": matched.quality.rmse,
        "matched_ssim": matched.quality.ssim,
        "matched_flip": matched.quality.flip,
        "matched_coverage": matched.quality.coverage,
        "matched_xor": matched.quality.xor,
        "matched_grain": matched.quality.grain,
        "frame_seconds": row.frame_seconds,
        "extraction_seconds": row.extraction_seconds,
    })
}

fn json_offline(row: &OfflineRow) -> Value {
    json!({
        "plant": row.plant,
        "preset": row.preset,
        "resolution": row.resolution,
        "views": row.views,
        "criterion": row.criterion,
        "compensate": row.compensate,
        "cascade": row.cascade,
        "seconds": row.seconds,
        "peak_bytes": row.peak_bytes,
        "rmse": row.quality.rmse,
        "ssim": row.quality.ssim,
        "coverage": row.quality.coverage,
        "xor": row.quality.xor,
        "grain": row.quality.grain,
    })
}
