//! `foliage-lod inspect`: shows the contents of a model or scene, or which parts of a tree file
//! would become leaves and why.

use crate::{
    args, baking, curves,
    failure::Failure,
    output::{self, Steps, merged, recipe_json},
    progress::spinning,
    scene::{self, Opened},
};
use foliage_lod::{
    FoliageModel,
    bounds::{Aabb, Sphere},
    draw::gpu_bytes,
    effects::Counts,
    file,
    import::{self, Finding, Imported},
    material::Material,
    model::{MAGIC, ModelFile, Part, Precision},
    plant::Wood,
    wood,
};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::{Map, Value, json};
use std::{
    collections::{BTreeMap, HashSet},
    io::Read,
    path::Path,
};

/// Percentages of the leaves at which the error curve is printed.
const CURVE_PERCENTS: [u32; 9] = [100, 90, 80, 70, 50, 30, 15, 5, 1];

/// Runs the subcommand.
pub fn run(args: &args::Inspect) -> Result<(), Failure> {
    if scene::is_toml(&args.file) {
        return inspect_scene(args);
    }
    if is_model(&args.file) {
        let file = ModelFile::read(&args.file)?;
        return if args.json { output::line(model_json(&file)) } else { tell_model(&file) };
    }
    let imported = spinning("reading", || import::inspect(&args.file, &args.import.options()))?;
    if args.json { output::line(plant_json(&imported)) } else { tell_plant(&imported, args.all) }
}

/// Shows the plants and effects of a scene.
fn inspect_scene(args: &args::Inspect) -> Result<(), Failure> {
    let opened = Opened::open(&args.file, None, &mut Steps::new(true))?;
    let effects: Vec<&str> = Counts::of(&opened.file.effects).named().map(|(name, _)| name).collect();
    let plants_of = |model: usize| opened.plants_of(model) as u64;
    let models = || opened.file.models.iter().zip(&opened.models).enumerate();
    let leaves: u64 = models().map(|(i, (_, model))| plants_of(i) * model.leaves.len() as u64).sum();
    if args.json {
        let models: Vec<Value> = models()
            .map(|(i, (source, model))| {
                let wood = model.wood.triangles();
                json!({ "name": source.name, "plants": plants_of(i), "leaves": model.leaves.len(), "wood_triangles": wood })
            })
            .collect();
        let plants = opened.plants();
        return output::line(
            json!({ "kind": "scene", "plants": plants, "leaves": leaves, "models": models, "effects": effects }),
        );
    }
    let plants = HumanCount(opened.plants() as u64);
    output::line(format_args!("scene: {plants} plants, {} leaves in total", HumanCount(leaves)))?;
    for (i, (source, model)) in models() {
        let [leaves, wood] = [model.leaves.len(), model.wood.triangles()].map(|count| HumanCount(count as u64));
        let plants = HumanCount(plants_of(i));
        output::line(format_args!("model {}: {plants} plants, {leaves} leaves, {wood} wood triangles", source.name))?;
    }
    let effects = if effects.is_empty() { "none".into() } else { effects.join(", ") };
    output::line(format_args!("effects: {effects}"))
}

/// Whether the file starts with a model's magic bytes or has the extension `.vds`.
fn is_model(path: &Path) -> bool {
    let mut magic = [0; 8];
    let has_magic = file::open(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok()) && magic == MAGIC;
    has_magic || path.extension().is_some_and(|extension| extension == "vds")
}

/// Maximum number of lines for parts, warnings and materials, so that a file fits on a screen.
const MAX_PARTS: usize = 16;
const MAX_WARNINGS: usize = 8;
const MAX_MATERIALS: usize = 8;

fn tell_plant(Imported { plant, findings, warnings, .. }: &Imported, all: bool) -> Result<(), Failure> {
    let most = |most| if all { usize::MAX } else { most };
    match findings.len() > most(MAX_PARTS) {
        true => tell_some(&grouped(findings), MAX_PARTS, "kinds of parts")?,
        false => findings.iter().try_for_each(output::line)?,
    }
    let warnings: Vec<String> = warnings.iter().map(output::warning_line).collect();
    tell_some(&warnings, most(MAX_WARNINGS), "warnings")?;
    let leaves = plant.leaves.len();
    tell_counts("plant", &plant.name, leaves, plant.leaf_triangles(), plant.wood.triangles())?;
    tell_stems(&plant.wood)?;
    tell_some(&material_lines(&plant.materials), most(MAX_MATERIALS), "materials")?;
    tell_bounds(plant.aabb(), plant.sphere())
}

/// Prints the first `most` of `lines`, and how many more there are.
fn tell_some(lines: &[String], most: usize, what: &str) -> Result<(), Failure> {
    lines.iter().take(most).try_for_each(output::line)?;
    match lines.len().saturating_sub(most) {
        0 => Ok(()),
        more => output::line(format_args!("... and {more} more {what}; --all prints them")),
    }
}

/// One line for all parts with the same verdict, material and reason, those with most triangles
/// first.
fn grouped(findings: &[Finding]) -> Vec<String> {
    let mut groups: BTreeMap<(String, &str, &str), Vec<&Finding>> = BTreeMap::new();
    for finding in findings {
        groups.entry((finding.verdict.to_string(), &finding.material, &finding.reason)).or_default().push(finding);
    }
    let mut lines: Vec<(usize, String)> = groups.into_values().map(|parts| line_of(&parts)).collect();
    lines.sort_by_key(|(triangles, _)| std::cmp::Reverse(*triangles));
    lines.into_iter().map(|(_, line)| line).collect()
}

/// Number of triangles of parts of one kind, and their line.
fn line_of(parts: &[&Finding]) -> (usize, String) {
    let sum = |of: fn(&Finding) -> usize| parts.iter().map(|part| of(part)).sum::<usize>();
    let [triangles, pieces] = [sum(|part| part.triangles), sum(|part| part.pieces)];
    let line = match parts {
        [only] => only.to_string(),
        [first, ..] => {
            let Finding { name, material, verdict, reason, .. } = first;
            let count = parts.len();
            format!(
                "{verdict}: {count} parts like {name:?}, material {material:?}, {triangles} triangles in {pieces} pieces: {reason}"
            )
        }
        [] => String::new(),
    };
    (triangles, line)
}

fn tell_model(file: &ModelFile) -> Result<(), Failure> {
    output::skipped_lines(file).try_for_each(output::line)?;
    let model = &file.model;
    let leaves = model.leaves.len();
    tell_counts("model", &model.name, leaves, model.leaf_triangles(), model.wood.triangles())?;
    let recipe = &model.recipe;
    let intrinsic = match recipe.intrinsic {
        0.0 => String::new(),
        cost => format!(" with intrinsic cost {cost}"),
    };
    output::line(format_args!(
        "made with: preset {}, criterion {}{intrinsic}, compensate {}, {} views of {5} x {5} on {4}",
        recipe.preset,
        recipe.criterion,
        recipe.compensate,
        recipe.views,
        recipe.adapter.as_deref().unwrap_or("the CPU"),
        recipe.resolution
    ))?;
    output::line(format_args!("invariants: all hold; largest scale {}", model.max_scale))?;
    tell_storage(file)?;
    tell_outlines(model)?;
    tell_stems(&model.wood)?;
    if let Some(impostor) = &model.impostor {
        let bytes = DecimalBytes(impostor.gpu_bytes());
        output::line(format_args!("{}, {bytes} on the GPU", baking::summary(model)))?;
    }
    let way = if model.growth.tiles { "tiles" } else { "scale" };
    output::line(format_args!("leaves grow by {way}, with tone {:.2}", model.growth.tone))?;
    let cards = model.clusters.cards();
    if !cards.is_empty() {
        let leaves = cards.chunk_by(|a, b| a.leaf == b.leaf).count() as u64;
        output::line(format_args!(
            "{} leaves become pictures of those that they stand for: {} cards of {} texels",
            HumanCount(leaves),
            HumanCount(cards.len() as u64),
            HumanCount(model.clusters.texels().len() as u64)
        ))?;
    }
    material_lines(&model.materials).iter().try_for_each(output::line)?;
    tell_bounds(model.aabb(), model.sphere())?;
    let measured = match &model.curve {
        Some(curve) => format!("  wrong pixels of {}", curve.size_px),
        None => String::new(),
    };
    output::line(format_args!("leaves kept  error so far  largest scale{measured}"))?;
    for CurvePoint { percent, leaves, error, scale, error_px } in curve(model) {
        let measured = error_px.map_or_else(String::new, |px| format!("  {px:>18.4}"));
        output::line(format_args!("{leaves:>7} {percent:>3} %  {error:>12.6}  {scale:>13.3}{measured}"))?;
    }
    if model.curve.is_some() {
        output::line(curves::summary(model))?;
    }
    Ok(())
}

/// Prints the bytes of the file by part, and how exact its numbers are.
fn tell_storage(file: &ModelFile) -> Result<(), Failure> {
    let bytes = |bytes: f64| DecimalBytes(bytes.round() as u64);
    let total: u64 = file.parts.iter().chain(&file.skipped).map(|part| part.bytes).sum();
    let part = |Part { name, bytes }: &Part| format!("{} {}", name.replace('_', " "), DecimalBytes(*bytes));
    let parts: Vec<String> = file.parts.iter().chain(&file.skipped).map(part).collect();
    let a_leaf = bytes(total as f64 / file.model.leaves.len().max(1) as f64);
    let size = DecimalBytes(total);
    output::line(format_args!("file: version {}, {size}, {a_leaf} a leaf: {}", file.version, parts.join(", ")))?;
    let (copies, shapes) = (file.model.copies.len(), shapes(&file.model));
    if copies > 0 {
        let [copies, shapes] = [copies, shapes].map(|count| HumanCount(count as u64));
        output::line(format_args!("shapes: {shapes}, of which {copies} leaves are copies"))?;
    }
    output::line(format_args!("precision: {}", precision_line(&file.model.precision)))?;
    let [leaves, wood] = gpu_bytes(&file.model);
    let a_leaf = bytes(leaves as f64 / file.model.leaves.len().max(1) as f64);
    let [leaves, wood] = [leaves, wood].map(DecimalBytes);
    output::line(format_args!("on the GPU: leaves {leaves}, {a_leaf} a leaf, wood {wood}; textures not counted"))
}

/// Number of shapes that leaves share.
fn shapes(model: &FoliageModel) -> usize {
    model.copies.iter().map(|copy| copy.of).collect::<HashSet<_>>().len()
}

/// Prints how much of the leaves is left to draw within their outlines, if there are any.
fn tell_outlines(model: &FoliageModel) -> Result<(), Failure> {
    if model.outlines.is_empty() {
        return Ok(());
    }
    let left = 100.0 * model.to_plant().trimmed_share();
    output::line(format_args!("outlines: {}, which leave {left:.1} % of the leaves' area", model.outlines.len()))
}

/// Prints the number of stems by level, if there are any.
fn tell_stems(wood: &Wood) -> Result<(), Failure> {
    let levels = stem_levels(wood);
    if levels.is_empty() {
        return Ok(());
    }
    let stems = HumanCount(levels.iter().map(|&count| u64::from(count)).sum());
    let levels: Vec<String> = levels.iter().map(|&count| HumanCount(count.into()).to_string()).collect();
    output::line(format_args!("stems: {stems}, by level from the trunk up: {}", levels.join(", ")))
}

fn stem_levels(wood: &Wood) -> Vec<u32> {
    wood::levels(&wood::cut(wood).0)
}

fn precision_line(precision: &Precision) -> String {
    let Precision { position, normal_rad, uv, color } = *precision;
    let numbers = [
        ("positions", position, format!("{position:.1e}")),
        ("normals", normal_rad, format!("{:.2} degrees", normal_rad.to_degrees())),
        ("texture coordinates", uv, format!("{uv:.1e}")),
        ("colours", color, format!("{color:.1e}")),
    ];
    let of = |(what, error, told): (&str, f32, String)| match error {
        0.0 => format!("{what} exact"),
        _ => format!("{what} within {told}"),
    };
    numbers.map(of).join(", ")
}

fn tell_counts(
    kind: &str,
    name: &str,
    leaves: usize,
    leaf_triangles: usize,
    wood_triangles: usize,
) -> Result<(), Failure> {
    let [leaves, leaf_triangles, wood_triangles] =
        [leaves, leaf_triangles, wood_triangles].map(|count| HumanCount(count as u64));
    output::line(format_args!(
        "{kind} {name}: {leaves} leaves with {leaf_triangles} triangles, wood with {wood_triangles} triangles"
    ))
}

fn material_lines(materials: &[Material]) -> Vec<String> {
    let line = |(i, material): (usize, &Material)| {
        let texture = if material.texture.is_some() { "textured" } else { "plain" };
        let alpha = material.cutoff().map_or("opaque".into(), |cutoff| format!("alpha cutoff {cutoff}"));
        format!("material {i} {:?}: {texture}, {alpha}", material.name)
    };
    materials.iter().enumerate().map(line).collect()
}

fn tell_bounds(aabb: Aabb, sphere: Sphere) -> Result<(), Failure> {
    output::line(format_args!("bounds: {:?} to {:?}, radius {:.4}", aabb.min, aabb.max, sphere.radius))
}

fn plant_json(Imported { plant, origin, findings, warnings }: &Imported) -> Value {
    let findings: Vec<Value> = findings
        .iter()
        .map(|finding| {
            json!({
                "name": finding.name,
                "material": finding.material,
                "triangles": finding.triangles,
                "pieces": finding.pieces,
                "verdict": finding.verdict.to_string(),
                "reason": finding.reason,
            })
        })
        .collect();
    json!({
        "kind": "plant",
        "name": plant.name,
        "leaves": plant.leaves.len(),
        "leaf_triangles": plant.leaf_triangles(),
        "wood_triangles": plant.wood.triangles(),
        "stems": stem_levels(&plant.wood),
        "materials": materials_json(&plant.materials),
        "bounds": bounds_json(plant.aabb(), plant.sphere()),
        "origin": origin,
        "findings": findings,
        "warnings": output::warnings_json(warnings),
    })
}

fn model_json(file: &ModelFile) -> Value {
    let model = &file.model;
    let bytes_by =
        |parts: &[Part]| parts.iter().map(|part| (part.name.clone(), json!(part.bytes))).collect::<Map<_, _>>();
    let point = |p: CurvePoint| json!({ "percent": p.percent, "leaves": p.leaves, "error": p.error, "largest_scale": p.scale, "error_px": p.error_px });
    let curve: Vec<Value> = curve(model).into_iter().map(point).collect();
    let [leaf_bytes, wood_bytes] = gpu_bytes(model);
    let cards = model.clusters.cards();
    let about = json!({
        "kind": "model",
        "name": model.name,
        "leaves": model.leaves.len(),
        "leaf_triangles": model.leaf_triangles(),
        "wood_triangles": model.wood.triangles(),
        "materials": materials_json(&model.materials),
        "bounds": bounds_json(model.aabb(), model.sphere()),
        "enlarged_bounds": bounds_json(model.enlarged_aabb(), model.enlarged_sphere()),
        "max_scale": model.max_scale,
        "tone": model.growth.tone,
        "tiles": model.growth.tiles,
        "cards": cards.len(),
        "card_texels": model.clusters.texels().len(),
        "version": file.version,
        "bytes": bytes_by(&file.parts),
        "skipped": bytes_by(&file.skipped),
        "precision": output::precision_json(&model.precision),
        "shapes": shapes(model),
        "copies": model.copies.len(),
        "stems": stem_levels(&model.wood),
        "impostor": model.impostor.as_ref().map(baking::to_json),
        "gpu_bytes": { "leaves": leaf_bytes, "wood": wood_bytes },
        "outlines": model.outlines.len(),
        "area_left": model.to_plant().trimmed_share(),
        "error_curve": curve,
        "measured_curve": model.curve.as_ref().map(curves::to_json),
    });
    merged(recipe_json(&model.recipe), about)
}

fn materials_json(materials: &[Material]) -> Vec<Value> {
    let one = |material: &Material| json!({ "name": material.name, "texture": material.texture, "cutoff": material.cutoff() });
    materials.iter().map(one).collect()
}

fn bounds_json(aabb: Aabb, sphere: Sphere) -> Value {
    json!({ "min": aabb.min, "max": aabb.max, "center": sphere.center, "radius": sphere.radius })
}

/// Point of the error curve: the model at one active count.
struct CurvePoint {
    percent: u32,
    leaves: u32,
    /// Sum of the errors of all leaves pruned so far.
    error: f64,
    /// Largest scale of a drawn leaf.
    scale: f32,
    /// Error on the measured curve.
    error_px: Option<f64>,
}

fn curve(model: &FoliageModel) -> Vec<CurvePoint> {
    let count = model.leaves.len() as u32;
    let mut swap = foliage_lod::extract::Swap::new(model);
    CURVE_PERCENTS
        .into_iter()
        .map(|percent| {
            let leaves = (u64::from(count) * u64::from(percent)).div_ceil(100) as u32;
            swap.set_active(leaves);
            let pruned = &model.leaves[leaves as usize..];
            CurvePoint {
                percent,
                leaves,
                error: pruned.iter().fold(0.0, |sum, leaf| sum + f64::from(leaf.error)),
                scale: swap.scales()[..leaves as usize].iter().copied().fold(0.0, f32::max),
                error_px: model.curve.as_ref().map(|curve| curve.error_px(f64::from(leaves))),
            }
        })
        .collect()
}
