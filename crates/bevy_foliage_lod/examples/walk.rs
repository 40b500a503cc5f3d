//! A walk through a forest within a budget of leaves, with an overlay of what is drawn.
//!
//! `cargo run --example walk [MODEL] [--plants 400] [--budget 200000] [--picture OUT.png]`;
//! without a model, a birch is grown. Up and down change the budget.

mod common;

use bevy::prelude::*;
use bevy_foliage_lod::prelude::*;
use common::Options;

/// Height of the eye over the ground, as a share of the distance between trees.
const EYE: f32 = 0.22;

fn main() -> AppExit {
    let options = Options::new();
    let mut app = common::app(&options);
    app.insert_resource(FoliageBudget::new(options.get("--budget", 200_000.0)))
        .init_resource::<FoliageWind>()
        .add_systems(Startup, setup)
        .add_systems(Update, (walk, change_budget, show).chain())
        .run()
}

/// The way that is walked.
#[derive(Resource)]
struct Way {
    spacing: f32,
    length: f32,
}

#[derive(Component)]
struct Overlay;

fn setup(world: &mut World) {
    let options = world.resource::<Options>().clone();
    let plants: u32 = options.get("--plants", 400);
    let spacing = common::plant_forest(world, plants);
    let length = (plants as f32).sqrt() * spacing;
    world.insert_resource(Way { spacing, length });
    common::scene(world, Transform::default(), 4.0 * length);
    let text = (Text::default(), TextFont::from_font_size(14.0), TextColor(Color::WHITE));
    let place =
        Node { position_type: PositionType::Absolute, top: px(8), left: px(8), padding: px(6).all(), ..default() };
    world.spawn((Overlay, text, place, BackgroundColor(Color::srgba(0.0, 0.0, 0.0, 0.6))));
}

fn walk(time: Res<Time>, way: Res<Way>, mut cameras: Query<&mut Transform, With<Camera3d>>) {
    // Half a tree's distance a second, between two rows.
    let along = (0.5 * way.spacing * time.elapsed_secs()) % way.length;
    let eye = Vec3::new(0.5 * way.spacing, EYE * way.spacing, 0.4 * way.length - along);
    for mut camera in &mut cameras {
        *camera = Transform::from_translation(eye).looking_to(Vec3::new(0.12, 0.1, -1.0), Vec3::Y);
    }
}

fn change_budget(keys: Res<ButtonInput<KeyCode>>, mut budget: ResMut<FoliageBudget>) {
    if keys.pressed(KeyCode::ArrowUp) {
        budget.leaves *= 1.02;
    }
    if keys.pressed(KeyCode::ArrowDown) {
        budget.leaves /= 1.02;
    }
}

fn show(
    stats: Res<FoliageStats>,
    budget: Res<FoliageBudget>,
    time: Res<Time<Real>>,
    mut overlay: Query<&mut Text, With<Overlay>>,
    mut mean: Local<f32>,
) {
    *mean += 0.05 * (1e3 * time.delta_secs() - *mean);
    let FoliageStats { plants, in_view, impostors, leaves, leaves_processed, wood_triangles } = *stats;
    for mut text in &mut overlay {
        text.0 = format!(
            "budget   {:.0} leaves\ndrawn    {leaves:.0} leaves, {leaves_processed} processed\n\
             plants   {in_view} of {plants} in view, {impostors} as impostors\nwood     {wood_triangles} triangles\nframe    {:.1} ms",
            budget.leaves, *mean
        );
    }
}
