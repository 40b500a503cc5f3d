//! One tree, and a slider for the number of its leaves.
//!
//! `cargo run --example tree [MODEL] [--share 0.3] [--wind] [--picture OUT.png]`; without a
//! model, a birch is grown. Left and right change the number of leaves, space lets it follow the
//! camera, up and down move the camera.

mod common;

use bevy::prelude::*;
use bevy_foliage_lod::prelude::*;
use common::Options;

fn main() -> AppExit {
    let options = Options::new();
    let mut app = common::app(&options);
    if options.has("--wind") {
        app.init_resource::<FoliageWind>();
    }
    app.add_systems(Startup, setup).add_systems(Update, (change, show).chain()).run()
}

#[derive(Component)]
struct Slider;

#[derive(Component)]
struct Label;

fn setup(world: &mut World) {
    let options = world.resource::<Options>().clone();
    let model = common::asset(world);
    let sphere = world.resource::<Assets<FoliageAsset>>().get(&model).map(|asset| asset.model.sphere());
    let Some(sphere) = sphere else { return };
    let center = sphere.center().as_vec3();
    let center = Vec3::new(center.x, center.y, center.z);
    let radius = sphere.radius as f32;
    let lod = if options.has("--share") { FoliageLod::Share(options.get("--share", 1.0)) } else { FoliageLod::Auto };
    world.spawn(Foliage { model, lod });
    let eye = center + Vec3::new(0.0, 0.1, 1.0) * (options.get("--distance", 2.6) * radius);
    common::scene(world, Transform::from_translation(eye).looking_at(center, Vec3::Y), 40.0 * radius);
    let at = |bottom: f32| Node { position_type: PositionType::Absolute, bottom: px(bottom), left: px(0), ..default() };
    let bar = Node { height: px(BAR), ..at(0.0) };
    world.spawn((Slider, bar, BackgroundColor(Color::srgb(0.9, 0.95, 0.8))));
    world.spawn((Label, Text::default(), TextFont::from_font_size(14.0), at(1.5 * BAR)));
}

/// Changes the number of leaves by the keys and the slider, and moves the camera.
fn change(
    keys: Res<ButtonInput<KeyCode>>,
    mouse: Res<ButtonInput<MouseButton>>,
    windows: Query<&Window>,
    time: Res<Time>,
    mut plants: Query<(&mut Foliage, &FoliageDetail)>,
    mut cameras: Query<&mut Transform, With<Camera3d>>,
    models: Res<Assets<FoliageAsset>>,
) {
    let Ok((mut plant, detail)) = plants.single_mut() else { return };
    let Some(leaves) = models.get(&plant.model).map(|model| model.leaf_count() as f32) else { return };
    let turn = |key: KeyCode| f32::from(keys.pressed(key)) * time.delta_secs();
    let step = turn(KeyCode::ArrowRight) - turn(KeyCode::ArrowLeft);
    let pointed = windows.iter().find_map(|window| {
        let at = window.cursor_position().filter(|at| at.y > window.height() - 2.0 * BAR)?;
        mouse.pressed(MouseButton::Left).then(|| at.x / window.width())
    });
    if let Some(share) = pointed {
        plant.lod = FoliageLod::Share(share);
    } else if step != 0.0 {
        plant.lod = FoliageLod::Share((detail.leaves / leaves * (1.5 * step).exp()).clamp(0.001, 1.0));
    } else if keys.just_pressed(KeyCode::Space) {
        plant.lod = FoliageLod::Auto;
    }
    let nearer = (turn(KeyCode::ArrowDown) - turn(KeyCode::ArrowUp)).exp();
    cameras.iter_mut().for_each(|mut camera| camera.translation *= Vec3::new(nearer, 1.0, nearer));
}

/// Height of the slider in pixels.
const BAR: f32 = 14.0;

fn show(
    plants: Query<(&Foliage, &FoliageDetail)>,
    models: Res<Assets<FoliageAsset>>,
    mut bars: Query<&mut Node, With<Slider>>,
    mut labels: Query<&mut Text, With<Label>>,
) {
    let Ok((plant, detail)) = plants.single() else { return };
    let Some(leaves) = models.get(&plant.model).map(|model| model.leaf_count()) else { return };
    bars.iter_mut().for_each(|mut bar| bar.width = percent(100.0 * detail.leaves / leaves as f32));
    let follows = if matches!(plant.lod, FoliageLod::Auto) { ", by size" } else { "" };
    labels.iter_mut().for_each(|mut text| text.0 = format!("{:.0} of {leaves} leaves{follows}", detail.leaves));
}
