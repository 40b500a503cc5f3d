//! `foliage-lod render`: renders a model or a scene to a picture.

use crate::{
    args::{self, FadeRule, Method},
    drawing,
    failure::{Failure, complain},
    models,
    output::{self, Steps},
    pacing::{self, Settled},
    pictures,
    planting::Planting,
    progress::spinning,
    scene::{self, Opened},
    staging::Staging,
};
use foliage_lod::{
    Error, FoliageModel, Look, Result,
    draw::FarCounts,
    effects::{Contrast, CrownNormals, Effects, Fade, FadeRule as Rule, Translucency, Wind},
    extract::{self, CookLambda, Far, LodPolicy, fewest_leaves, leaf_count},
    file,
    gpu::guarded,
    scene::{Amount, BudgetEntry, budget::Spent, visibility::Estimate},
    simplify::CpuFragments,
    stochastic::Stochastic,
    terrain::ERROR_PX,
};
use indicatif::HumanCount;
use serde_json::{Map, Value, json};

/// Runs the subcommand.
pub fn run(args: &args::Render) -> std::result::Result<(), Failure> {
    check_numbers(args)?;
    file::check_writable(&args.output)?;
    file::check_apart(&args.output, [&args.model])?;
    let mut steps = Steps::new(args.json);
    if scene::is_toml(&args.model) {
        scene::refuse(&args.not_for_scenes())?;
        if args.budget.is_some() && args.method == Method::Full {
            return Err(Error::invalid("--budget", "given with --method full", "left out: all leaves are drawn").into());
        }
        let mut opened = Opened::open(&args.model, Some(&args.output), &mut steps)?;
        if args.method == Method::Full {
            opened.set_budget(None);
        } else if let Some(amount) = args.budget {
            let entry = opened.file.budget.unwrap_or(BudgetEntry::of(amount));
            opened.set_budget(Some(BudgetEntry { amount, ..entry }));
        }
        opened.file.tone &= args.tone == args::Switch::On;
        let mut timed = None;
        if let Some(BudgetEntry { amount, .. }) = opened.file.budget {
            opened.measure(&mut steps)?;
            if let Amount::Ms(ms) = amount {
                timed = Some(pacing::settle(args, &mut opened, ms, &mut steps)?);
            }
        }
        let all = opened.plants();
        let staging = opened.staging(args.seconds, args.size, args.method == Method::Full)?;
        return finish(args, &staging, all, timed, &mut steps);
    }
    if args.budget.is_some() {
        let allowed = "left out for a model: give a scene (.toml), or --leaves-count";
        return Err(Error::invalid("--budget", "given", allowed).into());
    }
    let model = models::read(&args.model)?;
    let planting = planting(args, &model)?;
    let far = args.far.map(|at_px| Far { at_px, ..Far::default() });
    far.map_or(Ok(()), |far| far.check())?;
    let tone = args.tone == args::Switch::On;
    let wood_error_px = args.wood_error.unwrap_or(Look::default().wood_error_px);
    let look = Look { effects: effects(args), tone, far, wood_error_px, ..Look::default() };
    look.check()?;
    steps.done("read", format!("{}: {} leaves", model.name, HumanCount(model.leaves.len() as u64)))?;
    let plants = planting.plants.len();
    if args.method == Method::Stochastic {
        let plant = model.to_plant();
        let plant = spinning("shuffling", || Stochastic::new(&plant, args.seed, &mut CpuFragments::new()))?;
        steps.done("shuffle", format!("seed {}, visible share {:.2e}", args.seed, plant.visible_share))?;
        let drawn = |distance| {
            let n = active_count(args, &plant.model, distance);
            let lambda = n as f64 / plant.model.leaves.len() as f64;
            (n as f32, args.area.linear_scale(lambda, plant.visible_share) as f32)
        };
        return finish(
            args,
            &Staging::of_planting(&plant.model, &planting, args.size[1], look, args.seconds, drawn),
            plants,
            None,
            &mut steps,
        );
    }
    let drawn = |distance| (active_count(args, &model, distance) as f32, 1.0);
    finish(
        args,
        &Staging::of_planting(&model, &planting, args.size[1], look, args.seconds, drawn),
        plants,
        None,
        &mut steps,
    )
}

fn finish(
    args: &args::Render,
    staging: &Staging<'_>,
    plants: usize,
    mut timed: Option<Settled>,
    steps: &mut Steps,
) -> std::result::Result<(), Failure> {
    let drawing = spinning("drawing", || match &mut timed {
        Some(Settled { drawer, .. }) => guarded(|| drawer.drawing(staging)),
        None => drawing::draw(args.raster, staging, args.size),
    })?;
    drawing.image.write_png(&args.output)?;
    let trees = match (plants, staging.plants.len()) {
        (1, _) => String::new(),
        (all, seen) if all == seen => format!("{} trees, ", HumanCount(all as u64)),
        (all, seen) => format!("{} of {} trees, ", HumanCount(seen as u64), HumanCount(all as u64)),
    };
    let result = format!(
        "{}: {trees}{} leaves on {}",
        args.output.display(),
        HumanCount(drawing.prepared.leaves),
        drawing.place()
    );
    steps.done("draw", result)?;
    if let Some((Spent { asked, used, fixed, mu, .. }, unit)) = staging.budget.filter(|_| !args.json) {
        let [of_all, used] = [asked, used].map(|of| HumanCount(of as u64));
        let one = if unit == "leaves" { "leaf" } else { "triangle" };
        output::line(format_args!("budget    {used} of {of_all} {unit}, at {mu:.2e} pixels a {one}"))?;
        if fixed > asked {
            complain(format_args!(
                "warning: wood and impostors alone take {} triangles: no leaf is left; ask for more, or set `[lod] \
                 wood_error` to more pixels",
                HumanCount(fixed as u64)
            ));
        }
    }
    if let Some(Estimate { crowns, hidden, shown, .. }) = staging.visibility.filter(|_| !args.json) {
        let [crowns, hidden] = [crowns, hidden].map(|count| HumanCount(count.into()));
        output::line(format_args!(
            "visible   {:.0} % of the crowns' area; of {hidden} of {crowns} crowns less than a tenth",
            100.0 * shown
        ))?;
    }
    let ground = drawing.prepared.ground;
    if ground.triangles > 0 && !args.json {
        output::line(format_args!("ground    {} triangles", HumanCount(ground.triangles.into())))?;
    }
    if ground.coarser > 0 {
        let px = ERROR_PX * f64::from(1_u32 << ground.coarser.min(31));
        complain(format_args!(
            "warning: the ground is up to {px} pixels off: make its map of heights smaller or smoother"
        ));
    }
    let FarCounts { leaves, both, impostors, faded } = drawing.prepared.far;
    if staging.look.far.is_some() && !args.json {
        let [leaves, both, impostors, faded] = [leaves, both, impostors, faded].map(|count| HumanCount(count.into()));
        output::line(format_args!(
            "far       {leaves} trees by leaves, {both} by both, {impostors} by impostors, {faded} faded"
        ))?;
    }
    if drawing.frames_made > 0 && !args.json {
        output::line(format_args!("live      {} frames of impostors made", HumanCount(drawing.frames_made.into())))?;
    }
    for (name, count) in drawing.prepared.effects.named() {
        let (simulated, skipped) = (HumanCount(count.simulated), HumanCount(count.skipped));
        if !args.json {
            output::line(format_args!("effect    {name}: simulated for {simulated}, skipped for {skipped}"))?;
        }
    }
    if args.json {
        let effects: Map<String, Value> = drawing
            .prepared
            .effects
            .named()
            .map(|(name, count)| (name.into(), json!({ "simulated": count.simulated, "skipped": count.skipped })))
            .collect();
        output::line(json!({
            "leaves_drawn": drawing.prepared.leaves,
            "wood_triangles": drawing.prepared.wood_triangles,
            "instances": staging.plants.len(),
            "draws": drawing.prepared.draws,
            "ground_triangles": ground.triangles,
            "plants_by": far_json(&drawing.prepared.far),
            "impostor_frames_made": drawing.frames_made,
            "effects": effects,
            "budget": staging.budget.map(|(spent, unit)| budget_json(spent, unit, timed.as_ref())),
            "visibility": staging.visibility.map(visibility_json),
            "adapter": drawing.adapter,
            "seconds": steps.total_seconds(),
        }))?;
    }
    Ok(())
}

/// What was spent of a budget.
fn budget_json(spent: Spent, unit: &str, timed: Option<&Settled>) -> Value {
    let (unit, asked, used) = timed.map_or((unit, spent.asked, spent.used), |of| ("ms", of.asked_ms, of.ms));
    json!({ "unit": unit, "asked": asked, "used": used, "mu": spent.mu, "floors": spent.floors })
}

/// What shows of plants behind others.
fn visibility_json(of: Estimate) -> Value {
    json!({ "crowns": of.crowns, "drawn": of.drawn, "hidden": of.hidden, "shown": of.shown })
}

/// Numbers of plants by what they are drawn with.
fn far_json(far: &FarCounts) -> Value {
    json!({ "leaves": far.leaves, "both": far.both, "impostor": far.impostors, "faded": far.faded })
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
        (None, None, None) if args.distance.is_none() && args.method == Method::Vds => {
            let drawn = pictures::drawn_sphere(model, active_count(args, model, pictures::FILLING_RADII));
            Ok(Planting::single(&drawn, None, aspect))
        }
        (None, None, None) => Ok(Planting::single(&sphere, args.distance, aspect)),
    }
}

/// Number of leaves to draw for a plant `distance` radii away.
fn active_count(args: &args::Render, model: &FoliageModel, distance: f32) -> u32 {
    let leaves = model.leaves.len() as u32;
    match (args.method, args.leaves_count, args.lod) {
        (Method::Full, _, _) => leaves,
        (_, Some(n), _) => n.min(leaves),
        (_, None, Some(lod)) => extract::active_count(model, lod),
        (Method::Vds, None, None) => pictures::count_at(model, distance),
        (Method::Stochastic, None, None) => {
            let lambda = CookLambda::default().lod(&pictures::sight(model, distance));
            leaf_count(lambda, leaves, fewest_leaves(leaves))
        }
    }
}

fn effects(args: &args::Render) -> Effects {
    let fade = |rule| {
        let (rule, smooth) = match rule {
            FadeRule::Window => (Rule::Window, false),
            FadeRule::Trailing => (Rule::Trailing, false),
            FadeRule::Relative => (Rule::Relative, false),
            FadeRule::Smoothstep => (Rule::Window, true),
        };
        Fade { by: args.fade_by, rule, smooth, half_width: PUBLISHED_HALF_WIDTH }
    };
    Effects {
        fade: args.fade.map(fade),
        contrast: args.contrast.then(Contrast::default),
        crown_normals: args.crown_normals.then(CrownNormals::default),
        wind: args.wind.then(Wind::default),
        translucency: args.translucency.then(Translucency::default),
        ..Effects::default()
    }
}

/// Half-width of the published fade `window`, and the maximum for `relative`, as a fraction of all
/// leaves.
const PUBLISHED_HALF_WIDTH: f32 = 0.1;
