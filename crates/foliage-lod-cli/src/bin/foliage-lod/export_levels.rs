//! Levels of `foliage-lod export`: which leaves they have, from which size on they are shown, and
//! the files that hold them.

use crate::{
    baking, curves,
    export_args::{Export, LevelOf, Textures},
    failure::Failure,
    interrupt,
    output::{self, Steps},
    progress::spinning,
};
use foliage_lod::{
    Error, FoliageModel, Plant,
    export::{FAR_PX, GlbOptions, Level, far_cards, resized, write_level, write_lods},
    measure::{Reached, Reference, Target},
    model::ErrorCurve,
    software::{BakeOptions, DrawList, Painter},
};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Rows of the screen that sizes refer to.
const ROWS: f32 = 1080.0;
/// Part of the last level's size at which cards follow it at the latest.
const HALF: f32 = 0.5;
/// What cards show, if the model has no impostor: few directions, since cards need three.
const BAKED: BakeOptions = BakeOptions { across: 4, frame_px: 128, is_whole_sphere: false };

/// A file to write.
pub struct File {
    /// Where to.
    pub path: PathBuf,
    /// What it is.
    pub kind: &'static str,
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Its numbers.
    pub about: Value,
}

/// A level and its numbers.
pub struct Made {
    kind: &'static str,
    plant: Plant,
    /// Part of the screen's height from which on down it is shown.
    coverage: f32,
    about: Value,
}

/// All levels, fine to coarse. The model's textures are made smaller, if that is asked.
pub fn levels(args: &Export, model: &mut FoliageModel, steps: &mut Steps) -> Result<Vec<Made>, Failure> {
    let cards = args.has_cards().then(|| cards(model, steps)).transpose()?;
    resize(args.textures, model, steps)?;
    let curve = match &model.curve {
        Some(curve) => curve.clone(),
        None => {
            let curve = curves::measure(model)?;
            steps.done("curve", "measured how wrong the model looks with fewer leaves")?;
            curve
        }
    };
    let mut made: Vec<(Level, Value)> = Vec::new();
    for (number, level) in args.levels.iter().enumerate() {
        let (mut level, about) = match level {
            LevelOf::Share(share) => (spinning("writing", || Level::new(model, *share))?, json!({})),
            LevelOf::Target(target) => reached(number, *target, model, steps)?,
        };
        if let Some((last, _)) = made.last() {
            if level.leaves >= last.leaves {
                let told =
                    format!("{} leaves after {}", HumanCount(level.leaves.into()), HumanCount(last.leaves.into()));
                return Err(refused(number, told));
            }
            level.size_px = level.size_px.min(last.size_px);
        }
        if level.tiled > 0 {
            let [cut, all] =
                [level.tiled as usize, level.plant.indices.len() / 3].map(|count| HumanCount(count as u64));
            let told = format!("LOD{number}: {cut} leaves that repeat their picture are cut, {all} triangles in all");
            steps.done("tiles", told + "; models made with --growth scale have fewer")?;
        }
        made.push((level, about));
    }
    let last_px = made.last().map_or(ROWS, |(level, _)| level.size_px.min(ROWS));
    let levels = made.into_iter().map(|(level, about)| measured(level, about, &curve));
    let cards = cards.map(|plant| {
        let about = json!({ "leaves": 0, "cards": plant.leaves.len() });
        sized("cards", plant, FAR_PX.min(HALF * last_px), about)
    });
    Ok(levels.chain(cards).collect())
}

/// The cards of a model, with the pictures of its impostor or of one made for them.
fn cards(model: &FoliageModel, steps: &mut Steps) -> Result<Plant, Failure> {
    let (impostor, told) = match &model.impostor {
        Some(impostor) => (impostor.clone(), "the model's impostor"),
        None => (baking::bake(model, &BAKED)?, "an impostor made for them"),
    };
    let plant = spinning("drawing", || far_cards(model, &impostor))?;
    steps.done("far", format!("{} crossed cards with pictures of {told}", plant.leaves.len()))?;
    Ok(plant)
}

/// The level of the fewest leaves that meet a bound, as it is written and against all leaves: by
/// bisection, as quality rises with leaves but for small steps.
fn reached(number: usize, target: Target, model: &FoliageModel, steps: &mut Steps) -> Result<(Level, Value), Failure> {
    let size_px = target.pixels as f32;
    let found = spinning("searching", || {
        let reference = Reference::new(&model.to_plant(), target.pixels)?;
        let painter = Painter::new(&model.materials, &model.textures)?;
        target.fewest(model.leaves.len() as u32, &mut |leaves| {
            interrupt::check()?;
            let level = Level::of_leaves(model, leaves, size_px)?;
            reference.quality(&painter, DrawList::of_plant(&level.plant), None)
        })
    });
    let Reached { leaves, quality } = found?;
    let told = format!("{target}: {} leaves, SSIM {:.3}", HumanCount(leaves.into()), quality.ssim);
    if !target.holds(&quality) {
        let allowed = format!("a bound that all leaves meet; they have SSIM {:.3}", quality.ssim);
        return Err(Error::invalid("levels", target, allowed).into());
    }
    steps.done("level", format!("LOD{number} by {told}"))?;
    let about = json!({ "target": target.to_string(), "ssim": quality.ssim, "rmse": quality.rmse, "xor": quality.xor });
    Ok((Level::of_leaves(model, leaves, size_px)?, about))
}

/// Halves textures as asked.
pub fn resize(to: Textures, model: &mut FoliageModel, steps: &mut Steps) -> Result<(), Failure> {
    let Some(side) = to.0 else { return Ok(()) };
    let smaller = spinning("resizing", || resized(&model.plant, side))?;
    let changed = smaller.iter().zip(&model.textures).filter(|(new, old)| new.bytes != old.bytes).count();
    let bytes: usize = smaller.iter().map(|texture| texture.bytes.len()).sum();
    let told = format!("{changed} of {} made smaller, {} in all", smaller.len(), DecimalBytes(bytes as u64));
    model.plant.textures = smaller;
    steps.done("textures", told)?;
    Ok(())
}

/// Rejects shares that do not fall, before the work starts.
pub fn check_levels(levels: &[LevelOf]) -> Result<(), Failure> {
    let mut least = f64::INFINITY;
    for (number, level) in levels.iter().enumerate() {
        let LevelOf::Share(share) = level else { continue };
        if *share >= least {
            return Err(refused(number, format!("{share} after {least}")));
        }
        least = *share;
    }
    Ok(())
}

fn refused(number: usize, told: String) -> Failure {
    Error::invalid("levels", format!("LOD{number} with {told}"), "from fine to coarse, each with fewer leaves").into()
}

/// A level with its numbers.
fn measured(level: Level, about: Value, curve: &ErrorCurve) -> Made {
    let size_px = level.size_px.min(ROWS);
    let error = curve.error_px(f64::from(level.leaves));
    let wrong_px = error * f64::from(size_px / curve.size_px).powf(f64::from(curve.size_power));
    let own = json!({ "leaves": level.leaves, "wrong_px": wrong_px, "tiled_leaves": level.tiled });
    sized("level", level.plant, size_px, output::merged(own, about))
}

fn sized(kind: &'static str, plant: Plant, size_px: f32, about: Value) -> Made {
    let wood = plant.wood.triangles();
    let coverage = size_px / ROWS;
    let sizes = json!({
        "triangles": plant.indices.len() / 3 + wood,
        "wood_triangles": wood,
        "size_px": size_px,
        "screen_coverage": coverage,
    });
    Made { kind, plant, coverage, about: output::merged(about, sizes) }
}

/// A file for each level, and one that tells of them.
pub fn in_files(
    options: &GlbOptions,
    name: &str,
    levels: Vec<Made>,
    mut paths: Vec<PathBuf>,
) -> Result<Vec<File>, Failure> {
    let told_in = paths.pop().unwrap_or_default();
    let mut files = Vec::new();
    let mut told = Vec::new();
    for (path, Made { kind, plant, about, .. }) in paths.into_iter().zip(levels) {
        let bytes = spinning("writing", || write_level(&plant, options))?;
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        told.push(output::merged(json!({ "file": file, "kind": kind }), about.clone()));
        files.push(File { path, kind, bytes, about });
    }
    let text = serde_json::to_string_pretty(&json!({ "model": name, "levels": told })).unwrap_or_default();
    files.push(File { path: told_in, kind: "levels", bytes: text.into_bytes(), about: json!({}) });
    Ok(files)
}

/// One file with all levels. Each is shown down to the size of the next one, the last at any.
pub fn in_one(options: &GlbOptions, path: PathBuf, levels: Vec<Made>) -> Result<File, Failure> {
    let plants: Vec<&Plant> = levels.iter().map(|level| &level.plant).collect();
    let coverages: Vec<f32> = levels.iter().skip(1).map(|level| level.coverage).chain([0.0]).collect();
    let bytes = spinning("writing", || write_lods(&plants, &coverages, options))?;
    let first = |key: &str| levels.first().map_or(Value::Null, |level| level.about[key].clone());
    let told: Vec<Value> =
        levels.iter().map(|level| output::merged(json!({ "kind": level.kind }), level.about.clone())).collect();
    let about = json!({ "leaves": first("leaves"), "triangles": first("triangles"), "levels": told });
    Ok(File { path, kind: "msft_lod", bytes, about })
}
