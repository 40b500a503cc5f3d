//! `foliage-lod report SCENE`: measures the savings from level of detail and the cost of effects in
//! a scene.

use crate::{
    args, budget_study,
    failure::{Failure, complain},
    interrupt,
    output::Steps,
    progress::spinning,
    scene::{FIRST_LEAVES, Opened},
    staging::Shown,
};
use foliage_lod::{
    Error, Frame,
    draw::gpu_bytes,
    gpu::{GpuDevice, guarded},
    scene::{Amount, BudgetEntry},
};
use foliage_lod_cli::report::{
    page::SceneReport,
    scene_costs::{Cost, Scene, Seen, Shot, cases, measure},
};
use indicatif::HumanCount;
use serde_json::{Value, json};
use std::path::Path;

/// Number of frames measured along the camera's path.
const SHOTS: u32 = 3;
/// Time in seconds between these frames.
const SECONDS_BETWEEN: f64 = 10.0;
/// Maximum number of times that each frame is drawn.
const ROUNDS: usize = 3;
/// Seconds from one frame to the next, for motion vectors.
const FRAME_SECONDS: f64 = 1.0 / 60.0;

/// Measures one scene.
pub fn study(
    path: &Path,
    args: &args::Report,
    gpu: Option<&GpuDevice>,
    steps: &mut Steps,
) -> Result<SceneReport, Failure> {
    let Some(gpu) = gpu else {
        let reason = "measuring the costs of a scene needs an adapter".into();
        let fix = "install a Vulkan driver (software: Mesa's lavapipe), or leave the scene out".into();
        return Err(Error::Gpu { reason, fix }.into());
    };
    let mut opened = Opened::open(path, None, steps)?;
    if let Some(BudgetEntry { amount: Amount::Ms(_), .. }) = opened.file.budget {
        complain(format_args!(
            "warning: the scene's budget of milliseconds is measured as {} leaves; give it leaves or triangles",
            HumanCount(FIRST_LEAVES as u64)
        ));
    }
    opened.bake(steps)?;
    let shots: Vec<Shot> = (0..SHOTS)
        .map(|i| shot(&mut opened, f64::from(i) * SECONDS_BETWEEN, args.size))
        .collect::<Result<_, Error>>()?;
    let cases = cases(&opened.look());
    let advance = |_| interrupt::check();
    let scene = Scene { models: &opened.models, terrain: opened.terrain.as_ref(), shots: &shots };
    let measure = || measure(gpu, &scene, &cases, args.size, ROUNDS, advance);
    let costs = spinning("measuring", || guarded(measure))?;
    for cost in &costs {
        let Cost { name, frame_seconds, ratio, .. } = cost;
        let leaves = HumanCount(cost.leaves);
        steps.done(
            "measure",
            format!("{name}: {:.1} ms per frame, {ratio:.3} of the first, {leaves} leaves", 1e3 * frame_seconds),
        )?;
    }
    let budgets = if args.budgets { budget_study::study(gpu, &mut opened, args.size, steps)? } else { Vec::new() };
    let gpu_bytes = opened.models.iter().flat_map(gpu_bytes).sum();
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    Ok(SceneReport { name, plants: opened.plants(), costs, budgets, gpu_bytes })
}

fn shot(opened: &mut Opened, seconds: f64, size: [u32; 2]) -> Result<Shot, Error> {
    let frame = |seconds| {
        let camera = opened.camera(seconds, f64::from(size[0]) / f64::from(size[1]));
        Frame::new(&camera.camera(size[1])).at(seconds)
    };
    let (before, frame) = (frame(seconds), frame(seconds + FRAME_SECONDS));
    let camera = frame.camera;
    opened.follow(camera.eye, true)?;
    let effects = opened.file.effects;
    let mut both = |casters: bool| {
        [true, false].map(|full| {
            let plants =
                if casters { opened.casters(&camera, full, &effects) } else { opened.shown(&camera, full, None) };
            let seen = |plant: &Shown| Seen {
                model: plant.model,
                world_from_plant: plant.world_from_plant,
                active: plant.active,
                far: plant.far,
                seed: plant.seed,
                tint: plant.tint.to_array(),
            };
            plants.iter().map(seen).collect::<Vec<_>>()
        })
    };
    Ok(Shot { frame: frame.after(&before), seen: both(false), casters: both(true) })
}

/// The measurements as JSON, one object per case.
pub fn json_rows(report: &SceneReport) -> Vec<Value> {
    let row = |cost: &Cost| {
        let effects: serde_json::Map<String, Value> = cost
            .effects
            .named()
            .map(|(name, count)| (name.into(), json!({ "simulated": count.simulated, "skipped": count.skipped })))
            .collect();
        json!({
            "scene": report.name,
            "drawn": cost.name,
            "frame_seconds": cost.frame_seconds,
            "ratio": cost.ratio,
            "plants": cost.plants,
            "leaves": cost.leaves,
            "wood_triangles": cost.wood_triangles,
            "effect_bytes": cost.effect_bytes,
            "effects": effects,
        })
    };
    report.costs.iter().map(row).collect()
}
