//! Plants as a program handles them: counts by cameras, budgets, hidden, despawned and reloaded
//! plants, and files that cannot be loaded.

mod common;

use bevy::{
    asset::{AssetLoadFailedEvent, AssetLoader, LoadContext, LoadState, LoadedUntypedAsset, io::Reader},
    mesh::MeshTag,
    prelude::*,
    render::{RenderApp, render_resource::PipelineCache},
};
use bevy_foliage_lod::{
    FoliageMaterial,
    foliage_lod::export::{GlbOptions, write_continuous, write_glb},
    prelude::*,
};
use common::{BIRCH, app, app_with, camera, folder, picture, run};
use std::{any::TypeId, collections::HashSet};

fn birch(app: &mut App) -> Handle<FoliageAsset> {
    let asset = FoliageAsset::new(BIRCH.clone(), app.world_mut()).unwrap();
    app.world_mut().resource_mut::<Assets<FoliageAsset>>().add(asset)
}

fn radius() -> f32 {
    BIRCH.sphere().radius as f32
}

fn at(x: f32, z: f32) -> Transform {
    Transform::from_xyz(x, 0.0, z)
}

/// A camera at a distance, in radii, that looks at the origin.
fn looking(radii: f32) -> Transform {
    let eye = Vec3::new(0.0, 0.5, radii) * radius();
    Transform::from_translation(eye).looking_at(Vec3::Y * radius(), Vec3::Y)
}

fn leaves(app: &App, plant: Entity) -> f32 {
    app.world().get::<FoliageDetail>(plant).unwrap().leaves
}

fn parts(app: &mut App) -> Vec<(u32, Handle<Mesh>)> {
    let mut parts = app.world_mut().query::<(&MeshTag, &Mesh3d, &MeshMaterial3d<FoliageMaterial>)>();
    parts.iter(app.world()).map(|(tag, mesh, _)| (tag.value, mesh.0.clone())).collect()
}

#[test]
fn counts_follow_the_camera_that_shows_a_plant_largest() {
    let mut app = app(&folder("cameras"));
    let model = birch(&mut app);
    let plant = app.world_mut().spawn(Foliage::new(model)).id();
    run(&mut app, 3);
    assert_eq!(leaves(&app, plant), 0.0, "without a camera");
    let (far, _) = camera(&mut app, [64, 64], looking(40.0));
    run(&mut app, 2);
    let few = leaves(&app, plant);
    let (near, _) = camera(&mut app, [64, 64], (looking(2.5), Camera { order: 1, ..default() }));
    run(&mut app, 2);
    assert_eq!(leaves(&app, plant), BIRCH.leaves.len() as f32);
    app.world_mut().get_mut::<Camera>(near).unwrap().is_active = false;
    run(&mut app, 2);
    assert!(few > 0.0 && few < 100.0 && (leaves(&app, plant) - few).abs() <= 0.03 * few, "{few}");
    let few = leaves(&app, plant);
    app.world_mut().despawn(far);
    app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Share(0.5);
    run(&mut app, 2);
    assert_eq!(leaves(&app, plant), few, "nothing changes that no camera sees");
}

#[test]
fn hidden_plants_are_left_alone_and_records_of_despawned_ones_are_used_again() {
    let mut app = app(&folder("hidden"));
    let model = birch(&mut app);
    camera(&mut app, [64, 64], looking(5.0));
    let spawn = |app: &mut App, x: f32| app.world_mut().spawn((Foliage::new(model.clone()), at(x, 0.0))).id();
    let plants: Vec<Entity> = (0..3).map(|i| spawn(&mut app, i as f32)).collect();
    run(&mut app, 3);
    let tags = |app: &mut App| parts(app).into_iter().map(|part| part.0).collect::<HashSet<u32>>();
    assert_eq!(tags(&mut app), HashSet::from([0, 1, 2]));
    app.world_mut().entity_mut(plants[0]).insert(Visibility::Hidden);
    run(&mut app, 2);
    assert_eq!(app.world().resource::<FoliageStats>().plants, 2);
    app.world_mut().despawn(plants[1]);
    run(&mut app, 2);
    assert_eq!(tags(&mut app), HashSet::from([0, 2]), "its meshes are gone");
    spawn(&mut app, 4.0);
    run(&mut app, 2);
    assert_eq!(tags(&mut app), HashSet::from([0, 1, 2]));
    // A plant that is no longer one.
    app.world_mut().entity_mut(plants[2]).remove::<Foliage>();
    run(&mut app, 2);
    assert_eq!(tags(&mut app), HashSet::from([0, 1]));
    let all: Vec<Entity> = app.world_mut().query_filtered::<Entity, With<Foliage>>().iter(app.world()).collect();
    for plant in all {
        app.world_mut().despawn(plant);
    }
    run(&mut app, 3);
    assert_eq!(*app.world().resource::<FoliageStats>(), FoliageStats::default());
}

#[test]
fn a_budget_is_spent_by_the_plants_in_view_and_shares_go_first() {
    let mut app = app(&folder("budget"));
    let model = birch(&mut app);
    camera(&mut app, [64, 36], looking(12.0));
    let spawn = |app: &mut App, x: f32, z: f32| app.world_mut().spawn((Foliage::new(model.clone()), at(x, z))).id();
    for i in 0..5 {
        spawn(&mut app, (i as f32 - 2.0) * 2.0 * radius(), 0.0);
    }
    spawn(&mut app, 0.0, 40.0 * radius());
    let fixed = app.world_mut().spawn(Foliage { model: model.clone(), lod: FoliageLod::Share(0.2) }).id();
    app.insert_resource(FoliageBudget::new(1500.0));
    run(&mut app, 4);
    let stats = *app.world().resource::<FoliageStats>();
    assert_eq!((stats.plants, stats.in_view), (7, 6), "{stats:?}");
    assert!((stats.leaves - 1500.0).abs() < 30.0, "{stats:?}");
    assert_eq!(leaves(&app, fixed), (0.2 * BIRCH.leaves.len() as f64) as f32);
    for amount in [0.0, f64::NAN, -5.0, 1e12] {
        app.insert_resource(FoliageBudget::new(amount));
        run(&mut app, 80);
        let stats = *app.world().resource::<FoliageStats>();
        let all = if amount > 1.0 { 5.0 * BIRCH.leaves.len() as f64 } else { 0.0 };
        let expected = all + f64::from(leaves(&app, fixed));
        assert!((stats.leaves - expected).abs() < 0.02 * expected, "{amount}: {stats:?} {expected}");
    }
}

#[test]
fn turning_the_camera_changes_no_mesh_and_makes_no_pipeline() {
    let mut app = app(&folder("turning"));
    let model = birch(&mut app);
    let (eye, image) = camera(&mut app, [64, 64], looking(6.0));
    for i in 0..36 {
        let turn = Quat::from_rotation_y(i as f32 * 10.0_f32.to_radians());
        let place = turn * Vec3::new(0.0, 0.0, (3.0 + i as f32) * radius()) + looking(6.0).translation;
        app.world_mut().spawn((Foliage::new(model.clone()), Transform::from_translation(place)));
    }
    picture(&mut app, &image);
    let pipelines = |app: &App| app.sub_app(RenderApp).world().resource::<PipelineCache>().pipelines().count();
    // Once around, so that every plant has been in view.
    let turn = |app: &mut App| {
        app.world_mut().get_mut::<Transform>(eye).unwrap().rotate_y(3.0_f32.to_radians());
        app.update();
    };
    (0..120).for_each(|_| turn(&mut app));
    let before = (pipelines(&app), parts(&mut app));
    let mut changed = app.world_mut().query_filtered::<(), Or<(Changed<Mesh3d>, Changed<MeshTag>)>>();
    for _ in 0..300 {
        turn(&mut app);
        assert_eq!(changed.iter(app.world()).count(), 0);
    }
    assert_eq!((pipelines(&app), parts(&mut app)), before);
}

#[test]
fn files_that_cannot_be_loaded_are_told_and_good_ones_replace_them() {
    let files = folder("files");
    std::fs::write(files.join("broken.vds"), &BIRCH.to_bytes().unwrap()[..500]).unwrap();
    std::fs::write(files.join("text.vds"), "no model").unwrap();
    std::fs::write(files.join("birch.vds"), BIRCH.to_bytes().unwrap()).unwrap();
    let mut app = app(&files);
    let (_, image) = camera(&mut app, [64, 64], looking(4.0));
    let server = app.world().resource::<AssetServer>().clone();
    let failed: Vec<Handle<FoliageAsset>> = ["broken.vds", "text.vds", "none.vds"].map(|path| server.load(path)).into();
    let plants: Vec<Entity> =
        failed.iter().map(|model| app.world_mut().spawn(Foliage::new(model.clone())).id()).collect();
    let mut told = 0;
    for _ in 0..100 {
        app.update();
        told += app.world_mut().resource_mut::<Messages<AssetLoadFailedEvent<FoliageAsset>>>().drain().count();
        if told == 3 {
            break;
        }
    }
    assert_eq!(told, 3);
    assert!(failed.iter().all(|model| matches!(server.load_state(model), LoadState::Failed(_))));
    assert!(picture(&mut app, &image).covered().iter().all(|covered| !covered));
    // Another model.
    app.world_mut().get_mut::<Foliage>(plants[0]).unwrap().model = server.load("birch.vds");
    let until_drawn = |app: &mut App, plant: Entity| {
        for _ in 0..500 {
            if leaves(app, plant) > 0.0 {
                return;
            }
            app.update();
        }
        panic!("the model is not loaded");
    };
    until_drawn(&mut app, plants[0]);
    assert!(picture(&mut app, &image).covered().iter().any(|covered| *covered));
    // The file has changed.
    std::fs::write(files.join("text.vds"), BIRCH.to_bytes().unwrap()).unwrap();
    server.reload("text.vds");
    until_drawn(&mut app, plants[1]);
}

/// What another plug-in loads from files with an extension of glTF.
#[derive(Asset, TypePath)]
struct Scenery;

#[derive(Default, TypePath)]
struct SceneryLoader;

impl AssetLoader for SceneryLoader {
    type Asset = Scenery;
    type Settings = ();
    type Error = std::io::Error;

    async fn load(&self, _: &mut dyn Reader, _: &(), _: &mut LoadContext<'_>) -> std::io::Result<Scenery> {
        Ok(Scenery)
    }

    fn extensions(&self) -> &[&str] {
        &["glb"]
    }
}

#[test]
fn continuous_gltf_is_drawn_as_the_model_that_it_was_written_from_beside_other_loaders() {
    let files = folder("continuous");
    std::fs::write(files.join("birch.vds"), BIRCH.to_bytes().unwrap()).unwrap();
    let glb = write_continuous(&BIRCH, &GlbOptions { exact: true, ..GlbOptions::default() }).unwrap();
    std::fs::write(files.join("birch.glb"), &glb).unwrap();
    std::fs::write(files.join("birch.foliage.glb"), &glb).unwrap();
    std::fs::write(files.join("plain.glb"), write_glb(&BIRCH.to_plant()).unwrap()).unwrap();
    let mut app = app_with(&files, |app| {
        app.init_asset::<Scenery>().init_asset_loader::<SceneryLoader>();
    });
    app.world_mut().resource_mut::<FoliageSettings>().wood_error_px = 0.0;
    let (_, image) = camera(&mut app, [96, 96], looking(4.0));
    let server = app.world().resource::<AssetServer>().clone();
    let until = |app: &mut App, is_reached: &dyn Fn(&App) -> bool| {
        for _ in 0..500 {
            if is_reached(app) {
                return;
            }
            app.update();
        }
        panic!("nothing is loaded");
    };
    let drawn = |app: &mut App, path: &'static str| {
        let model: Handle<FoliageAsset> = server.load(path);
        let plant = app.world_mut().spawn(Foliage { model, lod: FoliageLod::Share(0.4) }).id();
        until(app, &|app| leaves(app, plant) > 0.0);
        let shown = picture(app, &image);
        app.world_mut().despawn(plant);
        shown
    };
    let [vds, glb] = ["birch.vds", "birch.glb"].map(|path| drawn(&mut app, path));
    assert!(vds.covered().iter().any(|covered| *covered) && vds == glb);
    // The same file as what others make of it.
    let scenery: Handle<Scenery> = server.load("birch.glb");
    let untyped = ["birch.glb", "birch.foliage.glb"].map(|path| server.load_builder().load_untyped(path));
    let plain: Handle<FoliageAsset> = server.load("plain.glb");
    until(&mut app, &|_| server.is_loaded(&scenery) && untyped.iter().all(|file| server.is_loaded(file)));
    let types =
        untyped.map(|file| app.world().resource::<Assets<LoadedUntypedAsset>>().get(&file).unwrap().handle.type_id());
    assert_eq!(types, [TypeId::of::<Scenery>(), TypeId::of::<FoliageAsset>()]);
    until(&mut app, &|_| server.load_state(&plain).is_failed());
    let LoadState::Failed(error) = server.load_state(&plain) else { panic!("a plain glTF has no leaves in order") };
    assert!(error.to_string().contains("is no continuous glTF") && error.to_string().contains("foliage-lod export"));
}

#[test]
fn what_is_not_drawn_costs_at_most_two_vertices_for_one_and_half_of_one_on_average() {
    let mut app = app(&folder("rungs"));
    let model = birch(&mut app);
    camera(&mut app, [64, 64], looking(5.0));
    let plant = app.world_mut().spawn(Foliage::new(model)).id();
    app.world_mut().resource_mut::<FoliageSettings>().window = 1.0;
    run(&mut app, 3);
    let all = BIRCH.leaves.len() as f32;
    let (least, steps) = (40.0_f32, 300);
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for step in (0..steps).chain((0..steps).rev()) {
        let count = least * (all / least).powf(step as f32 / (steps - 1) as f32);
        app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Share(count.floor() / all);
        app.update();
        let stats = app.world().resource::<FoliageStats>();
        let ratio = stats.leaves_processed as f64 / stats.leaves;
        assert!(ratio >= 1.0 - 1e-6);
        sum += ratio;
        worst = worst.max(ratio);
    }
    let mean = sum / f64::from(2 * steps);
    println!("{mean:.3} vertices for one on average, {worst:.3} at worst");
    assert!(mean < 1.5 && worst <= 2.05, "{mean} {worst}");
}
