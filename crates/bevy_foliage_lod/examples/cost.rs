//! Frame times of plants with every leaf, with as many as they show, and of three discrete levels.
//!
//! `cargo run --release --example cost [MODEL] [--plants 1|100|1000] [--rounds 5]
//! [--size 320x180]`; without a model, a birch is grown. Writes a table; no window is opened.

mod common;

use bevy::{
    app::PluginsState,
    camera::visibility::VisibilityRange,
    light::{CascadeShadowConfig, CascadeShadowConfigBuilder},
    prelude::*,
    render::{render_resource::PollType, renderer::RenderDevice},
};
use bevy_foliage_lod::prelude::*;
use common::Options;
use std::time::Instant;

/// Shares of the leaves of the discrete levels, and distances in radii up to which each is shown.
const LEVELS: [(f32, f32); 3] = [(1.0, 5.0), (0.33, 12.0), (0.11, 1e6)];
/// Width of the cross-fade between them, as a share of the distance.
const FADE: f32 = 0.1;

/// How plants are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
enum How {
    EveryLeaf,
    Auto,
    Discrete,
}

fn main() {
    let options = Options::new().with("--picture", "none.png");
    let rounds: usize = options.get("--rounds", 5);
    println!("plants  how        frame, ms (median of {rounds})  vertices");
    let only: u32 = options.get("--plants", 0);
    let all: [(u32, &[How]); 3] = [
        (1, &[How::EveryLeaf, How::Auto, How::Discrete]),
        (100, &[How::EveryLeaf, How::Auto, How::Discrete]),
        (1000, &[How::Auto]),
    ];
    for (plants, hows) in all.into_iter().filter(|(plants, _)| [0, *plants].contains(&only)) {
        // In turns, so that what else the machine does meets all alike.
        let mut apps: Vec<App> = hows.iter().map(|how| app(&options, plants, *how)).collect();
        let mut times = vec![Vec::new(); apps.len()];
        for _ in 0..rounds {
            for (app, times) in apps.iter_mut().zip(&mut times) {
                times.push(frame(app));
            }
        }
        for ((how, app), times) in hows.iter().zip(&mut apps).zip(&mut times) {
            times.sort_by(f64::total_cmp);
            println!("{plants:>6}  {how:<10?} {:>26.1}  {:>8}", times[times.len() / 2], vertices(app));
        }
    }
}

fn app(options: &Options, plants: u32, how: How) -> App {
    let mut app = common::app(options);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    let world = app.world_mut();
    let spacing = common::plant_forest(world, plants);
    let side = (plants as f32).sqrt() * spacing;
    let eye = Vec3::new(0.0, 0.9 * spacing, 0.5 * side + 1.5 * spacing);
    common::scene(world, Transform::from_translation(eye).looking_at(Vec3::Y * 0.5 * spacing, Vec3::Y), 4.0 * side);
    let all: Vec<(Entity, Foliage, Transform)> =
        world.query::<(Entity, &Foliage, &Transform)>().iter(world).map(|(e, f, t)| (e, f.clone(), *t)).collect();
    for (entity, plant, place) in all {
        match how {
            How::Auto => {}
            How::EveryLeaf => world.get_mut::<Foliage>(entity).into_iter().for_each(|mut plant| {
                plant.lod = FoliageLod::Share(1.0);
            }),
            How::Discrete => {
                world.despawn(entity);
                // The distance between plants is 1.5 radii.
                let mut from = 0.0;
                for (share, radii) in LEVELS {
                    let until = radii * spacing / 1.5;
                    let range = VisibilityRange {
                        start_margin: from..from * (1.0 + FADE),
                        end_margin: until..until * (1.0 + FADE),
                        use_aabb: false,
                    };
                    let lod = FoliageLod::Share(share);
                    world.spawn((Foliage { model: plant.model.clone(), lod }, place, range));
                    from = until;
                }
            }
        }
    }
    // One cascade, so that each pass is drawn once.
    let mut suns = world.query::<&mut CascadeShadowConfig>();
    let cascade = CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 2.0 * side, ..default() }.build();
    suns.iter_mut(world).for_each(|mut sun| *sun = cascade.clone());
    // Uploads, pipelines and counts settle.
    for _ in 0..3 {
        frame(&mut app);
    }
    app
}

/// Milliseconds of one frame, until the GPU is done.
fn frame(app: &mut App) -> f64 {
    let start = Instant::now();
    app.update();
    let device = app.world().resource::<RenderDevice>();
    if let Err(error) = device.poll(PollType::wait_indefinitely()) {
        common::fail(&error.to_string());
    }
    1e3 * start.elapsed().as_secs_f64()
}

/// Vertices of what is in view.
fn vertices(app: &mut App) -> u64 {
    let world = app.world_mut();
    let mut plants = world.query::<(&FoliageDetail, &Children)>();
    let mut shown = world.query::<&ViewVisibility>();
    let mut is_shown = |child: Entity| shown.get(world, child).is_ok_and(|visible| visible.get());
    let counts = plants.iter(world).filter(|(_, children)| children.iter().any(&mut is_shown));
    counts.map(|(detail, _)| u64::from(detail.vertices)).sum()
}
