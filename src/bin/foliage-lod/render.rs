//! `foliage-lod render`: a model or a scene becomes a picture.

use crate::{
    args::{self, Method},
    drawing,
    failure::Failure,
    output::{self, Steps, grouped},
    pictures,
    planting::Planting,
    progress::spinning,
    scene::{self, Opened},
    staging::Staging,
};
use foliage_lod::{
    Error, Result,
    effects::{Contrast, CrownNormals, Effects, Fade, Translucency, Wind},
    extract::{
        LodPolicy, leaf_count,
        lod::{CookLambda, fewest_leaves},
    },
    file,
    model::FoliageModel,
    render::look::Look,
    simplify::raster::CpuFragments,
    stochastic::Stochastic,
};
use serde_json::{Map, Value, json};

/// Runs the subcommand.
pub fn run(args: &args::Render) -> std::result::Result<(), Failure> {
    check_numbers(args)?;
    file::check_writable(&args.output)?;
    file::check_apart(&args.output, [&args.model])?;
    let mut steps = Steps::new(args.json);
    if scene::is_toml(&args.model) {
        scene::refuse(&args.not_for_scenes())?;
        file::check_apart(&args.output, scene::files(&args.model)?)?;
        let mut opened = Opened::open(&args.model, &mut steps)?;
        let all = opened.plants();
        let staging = opened.staging(args.seconds, args.size, args.method == Method::Full);
        return finish(args, &staging, all, &mut steps);
    }
    let model = FoliageModel::read(&args.model)?;
    let planting = planting(args, &model)?;
    let look = Look { effects: effects(args), ..Look::default() };
    steps.done("read", format!("{}: {} leaves", model.name, grouped(model.leaves.len() as u64)))?;
    let plants = planting.plants.len();
    if args.method == Method::Stochastic {
        let plant = model.plant();
        let plant = spinning("shuffling", || Stochastic::new(&plant, args.seed, &mut CpuFragments::new()))?;
        steps.done("shuffle", format!("seed {}, visible share {:.2e}", args.seed, plant.visible_share))?;
        let area = args.area.rule();
        let drawn = |distance| {
            let n = active_count(args, &plant.model, distance);
            let lambda = n as f64 / plant.model.leaves.len() as f64;
            (n as f32, area.linear_scale(lambda, plant.visible_share) as f32)
        };
        return finish(
            args,
            &Staging::of_planting(&plant.model, &planting, look, args.seconds, drawn),
            plants,
            &mut steps,
        );
    }
    let drawn = |distance| (active_count(args, &model, distance) as f32, 1.0);
    finish(args, &Staging::of_planting(&model, &planting, look, args.seconds, drawn), plants, &mut steps)
}

fn finish(
    args: &args::Render,
    staging: &Staging<'_>,
    plants: usize,
    steps: &mut Steps,
) -> std::result::Result<(), Failure> {
    let drawing = spinning("drawing", || drawing::draw(args.raster, staging, args.size))?;
    drawing.image.write_png(&args.output)?;
    let trees = match (plants, staging.plants.len()) {
        (1, _) => String::new(),
        (all, seen) if all == seen => format!("{} trees, ", grouped(all as u64)),
        (all, seen) => format!("{} of {} trees, ", grouped(seen as u64), grouped(all as u64)),
    };
    let result = format!("{}: {trees}{} leaves on {}", args.output.display(), grouped(drawing.leaves), drawing.place());
    steps.done("draw", result)?;
    for (name, count) in drawing.effects.named() {
        let (simulated, skipped) = (grouped(count.simulated), grouped(count.skipped));
        if !args.json {
            output::line(format_args!("effect    {name}: simulated for {simulated}, skipped for {skipped}"))?;
        }
    }
    if args.json {
        let effects: Map<String, Value> = drawing
            .effects
            .named()
            .map(|(name, count)| (name.into(), json!({ "simulated": count.simulated, "skipped": count.skipped })))
            .collect();
        output::line(json!({
            "leaves_drawn": drawing.leaves,
            "instances": staging.plants.len(),
            "draws": drawing.draws,
            "effects": effects,
            "adapter": drawing.adapter,
            "seconds": steps.total_seconds(),
        }))?;
    }
    Ok(())
}

fn check_numbers(args: &args::Render) -> Result<()> {
    let refused = |option, value: f64, allowed: &str| Err(Error::invalid(option, value, allowed));
    match (args.distance, args.lod) {
        (Some(distance), _) if !(distance > 0.0 && distance.is_finite()) => {
            refused("--distance", distance.into(), "a number of radii above 0")
        }
        (_, Some(lod)) if !(0.0..=1.0).contains(&lod) => refused("--lod", lod.into(), "from 0 to 1"),
        _ if !args.seconds.is_finite() => refused("--seconds", args.seconds, "a finite number"),
        _ => Ok(()),
    }
}

fn planting(args: &args::Render, model: &FoliageModel) -> Result<Planting> {
    let sphere = model.sphere();
    let aspect = f64::from(args.size[0]) / f64::from(args.size[1]);
    match (&args.row, args.ring, args.grid) {
        (Some(distances), _, _) => Planting::row(&sphere, distances, aspect),
        (None, Some(count), _) => Planting::ring(&sphere, count, aspect),
        (None, None, Some(side)) => Planting::grid(&sphere, side, aspect),
        (None, None, None) => Ok(Planting::single(&sphere, args.distance, aspect)),
    }
}

/// Leaves that a plant `distance` radii away is drawn with.
fn active_count(args: &args::Render, model: &FoliageModel, distance: f32) -> u32 {
    let leaves = model.leaves.len() as u32;
    match (args.method, args.leaves_count, args.lod) {
        (Method::Full, _, _) => leaves,
        (_, Some(n), _) => n.min(leaves),
        (_, None, Some(lod)) => leaf_count(lod, leaves, 0),
        (Method::Vds, None, None) => pictures::count_at(model, distance),
        (Method::Stochastic, None, None) => {
            let lambda = CookLambda::default().lod(&pictures::sight(model, distance));
            leaf_count(lambda, leaves, fewest_leaves(leaves))
        }
    }
}

fn effects(args: &args::Render) -> Effects {
    let by = args.fade_by.into();
    Effects {
        fade: args.fade.map(|rule| match rule {
            args::FadeRule::Smoothstep => {
                Fade { by, smooth: true, half_width: PUBLISHED_HALF_WIDTH, ..Fade::default() }
            }
            rule => Fade { by, rule: rule.into(), half_width: PUBLISHED_HALF_WIDTH, ..Fade::default() },
        }),
        contrast: args.contrast.then(Contrast::default),
        crown_normals: args.crown_normals.then(CrownNormals::default),
        wind: args.wind.then(Wind::default),
        translucency: args.translucency.then(Translucency::default),
        ..Effects::default()
    }
}

/// Half the window of the published fades, in shares of all leaves.
const PUBLISHED_HALF_WIDTH: f32 = 0.1;
