//! A forest of a thousand trees, each with as many leaves as it shows.
//!
//! `cargo run --example forest [MODEL] [--plants 1000] [--budget LEAVES] [--still]
//! [--picture OUT.png]`; without a model, a birch is grown.

mod common;

use bevy::{light::CascadeShadowConfigBuilder, prelude::*};
use bevy_foliage_lod::prelude::*;
use common::Options;

fn main() -> AppExit {
    let options = Options::new();
    let mut app = common::app(&options);
    if !options.has("--still") {
        app.init_resource::<FoliageWind>();
    }
    if options.has("--budget") {
        app.insert_resource(FoliageBudget::new(options.get("--budget", 0.0)));
    }
    app.add_systems(Startup, setup).add_systems(Last, report).run()
}

fn setup(world: &mut World) {
    let options = world.resource::<Options>().clone();
    let plants: u32 = options.get("--plants", 1000);
    let spacing = common::plant_forest(world, plants);
    let side = (plants as f32).sqrt() * spacing;
    let eye = Vec3::new(0.0, 1.2 * spacing, 0.5 * side + 2.0 * spacing);
    common::scene(
        world,
        Transform::from_translation(eye).looking_at(Vec3::new(0.0, 0.6 * spacing, 0.0), Vec3::Y),
        4.0 * side,
    );
    let far = CascadeShadowConfigBuilder { num_cascades: 2, maximum_distance: 0.6 * side, ..default() }.build();
    let mut suns = world.query_filtered::<Entity, With<DirectionalLight>>();
    let suns: Vec<Entity> = suns.iter(world).collect();
    for sun in suns {
        world.entity_mut(sun).insert(far.clone());
    }
}

/// Tells once what is drawn.
fn report(stats: Res<FoliageStats>, mut last: Local<u32>) {
    if stats.in_view > 0 && *last == 10 {
        let FoliageStats { plants, in_view, impostors, leaves, leaves_processed, wood_triangles } = *stats;
        info!(
            "{in_view} of {plants} plants in view, {impostors} as impostors: {leaves:.0} leaves, {leaves_processed} processed; \
             {wood_triangles} triangles of wood"
        );
    }
    *last += 1;
}
