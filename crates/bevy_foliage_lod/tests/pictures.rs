//! Pictures by Bevy, beside those of the library's own renderer.

mod common;

use bevy::{
    asset::uuid_handle,
    camera::Projection,
    core_pipeline::{
        prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass},
        tonemapping::Tonemapping,
    },
    prelude::*,
    render::render_resource::AsBindGroup,
    shader::ShaderRef,
};
use bevy_foliage_lod::{
    FoliageAsset,
    foliage_lod::{
        Camera as Viewer, FoliageModel, Instance, LodPolicy, Look, LookAt,
        effects::Wind,
        extract::{Far, Sight},
        glam::{DAffine3, DVec3},
        material::Material as Surface,
        model::Transition,
        software::{BakeOptions, SoftwareRenderer, bake},
    },
    prelude::*,
};
use common::{BIRCH, Picture, app, app_with, camera, folder, of_species, picture, run};
use std::{
    sync::{Arc, LazyLock},
    time::Duration,
};

/// The birch, with an impostor.
static BAKED: LazyLock<FoliageModel> = LazyLock::new(|| {
    let impostor = bake(&BIRCH, &BakeOptions::default(), &mut |_| true).unwrap();
    FoliageModel { impostor: Some(impostor), ..BIRCH.clone() }
});

const SIZE: [u32; 2] = [1024, 1024];
/// Side of the squares of pixels that are compared: which samples of one pixel are covered is a
/// matter of chance.
const SQUARE: usize = 4;

/// The model as an asset, drawn with a share of its leaves and all of its wood.
fn plant(app: &mut App, model: &FoliageModel, share: f32) -> Entity {
    let asset = FoliageAsset::new(model.clone(), app.world_mut()).unwrap();
    let asset = app.world_mut().resource_mut::<Assets<FoliageAsset>>().add(asset);
    app.world_mut().resource_mut::<FoliageSettings>().wood_error_px = 0.0;
    app.world_mut().spawn(Foliage { model: asset, lod: FoliageLod::Share(share) }).id()
}

/// A camera that shows all of a model, here and there.
fn view(model: &FoliageModel) -> (LookAt, (Transform, Projection)) {
    let look = LookAt::framing(&model.sphere(), DVec3::new(0.3, 0.15, 1.0), 0.6, 1.3);
    let [eye, target] = [look.eye, look.target].map(|point| Vec3::from_array(point.as_vec3().to_array()));
    let fov = look.fov_y_radians as f32;
    let projection = PerspectiveProjection { fov, near: look.near as f32, ..default() };
    (look, (Transform::from_translation(eye).looking_at(target, Vec3::Y), Projection::Perspective(projection)))
}

/// Part of each pixel that the library's renderer covers.
fn own_coverage(model: &FoliageModel, viewer: &Viewer, active: f32) -> Vec<f32> {
    let mut renderer = SoftwareRenderer::new(Look { wood_error_px: 0.0, ..Look::default() }).unwrap();
    let id = renderer.add_model(model).unwrap();
    let window = Transition::SMOOTH_WINDOW;
    let instance = Instance { window, ..Instance::new(id, DAffine3::IDENTITY, active) };
    let drawing = renderer.cutout(*viewer, &[instance], SIZE).unwrap();
    drawing.image.rgba.chunks_exact(4).map(|texel| f32::from(texel[3]) / 255.0).collect()
}

/// Part of each pixel that is dark before a white backdrop.
fn coverage(picture: &Picture) -> Vec<f32> {
    let linear = |byte: u8| LinearRgba::from(Color::srgb_u8(byte, byte, byte)).red;
    picture.rgba.iter().map(|texel| 1.0 - linear(texel[0])).collect()
}

/// Sums over squares of pixels.
fn squares(coverage: &[f32]) -> Vec<f32> {
    let columns = SIZE[0] as usize / SQUARE;
    let mut sums = vec![0.0; columns * SIZE[1] as usize / SQUARE];
    for (at, coverage) in coverage.iter().enumerate() {
        let [x, y] = [at % SIZE[0] as usize, at / SIZE[0] as usize];
        sums[y / SQUARE * columns + x / SQUARE] += coverage;
    }
    sums
}

/// Sum of the differences over the sum of the second.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / b.iter().sum::<f32>()
}

#[test]
fn silhouettes_are_those_of_the_librarys_own_renderer() {
    let oak = of_species("english-oak", 3000);
    // Leaves and wood whose materials differ in nothing that Bevy tells pipelines apart by.
    let mut bare = BIRCH.clone();
    bare.plant
        .materials
        .iter_mut()
        .for_each(|material| *material = Surface { double_sided: true, ..Surface::default() });
    bare.plant.outlines.clear();
    for (name, model) in [("birch", &*BIRCH), ("oak", &oak), ("bare birch", &bare)] {
        let (look, bevy_view) = view(model);
        let mut app = app(&folder("silhouettes"));
        app.insert_resource(ClearColor(Color::WHITE)).insert_resource(GlobalAmbientLight::NONE);
        let (_, image) = camera(&mut app, SIZE, (bevy_view, Msaa::Sample4, Tonemapping::None));
        let plant = plant(&mut app, model, 1.0);
        for share in [1.0, 0.3, 0.05] {
            app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Share(share);
            let drawn = picture(&mut app, &image);
            drawn.keep(&format!("{name}-{share}"));
            let active = share * model.leaves.len() as f32;
            let own = own_coverage(model, &look.camera(SIZE[1]), active);
            let difference = difference(&squares(&coverage(&drawn)), &squares(&own));
            let [a, b] = [coverage(&drawn), own].map(|of| of.iter().sum::<f32>());
            println!("{name} at {share}: {:.2} % of the silhouette differs, area {:.4}", 100.0 * difference, a / b);
            assert!(difference < 0.02, "{name} at {share}: {difference}");
        }
    }
}

/// A scene with the sun, ground and the birch, and a camera beside it.
fn lit(name: &str, share: f32, passes: impl Bundle) -> (App, Entity, Handle<Image>) {
    let mut app = app(&folder(name));
    let (_, view) = view(&BIRCH);
    let (_, image) = camera(&mut app, [192, 192], (view, Msaa::Off, passes));
    let plant = plant(&mut app, &BAKED, share);
    let world = app.world_mut();
    let sun = DirectionalLight { shadow_maps_enabled: true, ..default() };
    world.spawn((sun, Transform::from_xyz(3.0, 4.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let ground = world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(100.0, 100.0));
    let white = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
    world.spawn((Mesh3d(ground), MeshMaterial3d(white)));
    (app, plant, image)
}

fn luminance(picture: &Picture) -> Vec<f32> {
    picture.rgba.iter().map(|texel| texel[..3].iter().map(|byte| f32::from(*byte)).sum::<f32>() / 3.0).collect()
}

fn mean_difference(a: &Picture, b: &Picture) -> f32 {
    let sum: f32 = luminance(a).iter().zip(luminance(b)).map(|(a, b)| (a - b).abs()).sum();
    sum / a.rgba.len() as f32
}

#[test]
fn shadows_are_those_of_the_leaves_that_are_drawn() {
    let (mut app, plant, image) = lit("shadows", 1.0, ());
    // The lower rows show ground, sunlit or not.
    let dark = |picture: &Picture| {
        let ground = luminance(picture).into_iter().skip(picture.rgba.len() * 3 / 4);
        ground.filter(|luminance| *luminance < 120.0).count()
    };
    let full = picture(&mut app, &image);
    full.keep("shadows-full");
    app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Share(0.1);
    let few = picture(&mut app, &image);
    few.keep("shadows-few");
    app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Share(0.0);
    let none = picture(&mut app, &image);
    none.keep("shadows-none");
    let [full, few, none] = [&full, &few, &none].map(dark);
    println!("{full}, {few} and {none} pixels in the shadow");
    assert!(none * 5 < few && few * 2 > full && few < full, "{full} {few} {none}");
}

#[test]
fn all_prepasses_and_deferred_shading_show_the_same_picture_of_leaves_and_impostors() {
    for far in [None, Some(Far { at_px: 1024.0, ..Far::default() })] {
        let name = if far.is_some() { "far" } else { "near" };
        let drawn = |passes: &str, bundle: fn(&mut EntityWorldMut)| {
            let (mut app, plant, image) = lit(&format!("{passes}-{name}"), 0.2, ());
            if far.is_some() {
                app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Policy(Arc::new(EveryLeaf));
            }
            app.world_mut().resource_mut::<FoliageSettings>().far = far;
            let camera = app.world_mut().query_filtered::<Entity, With<Camera3d>>().single(app.world()).unwrap();
            bundle(&mut app.world_mut().entity_mut(camera));
            if passes == "deferred" {
                app.insert_resource(bevy::pbr::DefaultOpaqueRendererMethod::deferred());
            }
            let shown = picture(&mut app, &image);
            shown.keep(&format!("passes-{passes}-{name}"));
            assert_eq!(app.world().resource::<FoliageStats>().impostors, u32::from(far.is_some()));
            shown
        };
        let forward = drawn("forward", |_| {});
        let prepasses = drawn("prepasses", |camera| {
            camera.insert((DepthPrepass, NormalPrepass, MotionVectorPrepass));
        });
        let deferred = drawn("deferred", |camera| {
            camera.insert((DepthPrepass, DeferredPrepass, MotionVectorPrepass));
        });
        let differences = [&prepasses, &deferred].map(|other| mean_difference(&forward, other));
        println!("{name}: prepasses and deferred differ by {differences:?} of 255");
        assert!(differences[0] < 0.5 && differences[1] < 1.0, "{differences:?}");
    }
}

#[test]
fn the_wind_moves_leaves_and_wood_and_without_it_nothing_moves() {
    let (mut app, _, image) = lit("wind", 0.3, MotionVectorPrepass);
    let still = picture(&mut app, &image);
    assert_eq!(picture(&mut app, &image), still);
    app.init_resource::<FoliageWind>();
    let moved = picture(&mut app, &image);
    moved.keep("wind");
    let later = picture(&mut app, &image);
    assert!(mean_difference(&still, &moved) > 0.5 && mean_difference(&moved, &later) > 0.2);
    app.world_mut().remove_resource::<FoliageWind>();
    assert_eq!(picture(&mut app, &image), still);
}

/// Shows motion vectors in place of what is behind it.
#[derive(Asset, TypePath, AsBindGroup, Clone, Default)]
struct ShowMotion {}

const MOTION: Handle<Shader> = uuid_handle!("9b1f5d3e-0e7b-4a8e-9a55-3f6a1c2b7d90");

impl Material for ShowMotion {
    fn fragment_shader() -> ShaderRef {
        MOTION.into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Blend
    }
}

/// Mean motion in pixels over those pixels that are covered, and over the others.
fn motion(app: &mut App, covered: &[bool], image: &Handle<Image>) -> [Vec2; 2] {
    let shown = picture(app, image);
    let mean = |is_covered: bool| {
        let of = shown.rgba.iter().zip(covered).filter(|(_, covered)| **covered == is_covered);
        let vectors: Vec<Vec2> = of
            .map(|(texel, _)| {
                let linear = LinearRgba::from(Color::srgb_u8(texel[0], texel[1], 0));
                (Vec2::new(linear.red, linear.green) - 0.5) / 38.4 * 192.0
            })
            .collect();
        vectors.iter().sum::<Vec2>() / vectors.len() as f32
    };
    [true, false].map(mean)
}

#[test]
fn motion_vectors_are_those_of_leaves_and_wood_or_of_the_impostor() {
    for far in [None, Some(Far { at_px: 1024.0, ..Far::default() })] {
        let mut app = app_with(&folder("motion"), |app| {
            app.add_plugins(MaterialPlugin::<ShowMotion>::default());
        });
        let shader = Shader::from_wesl(include_str!("motion.wesl"), "motion.wesl");
        app.world_mut().resource_mut::<Assets<Shader>>().insert(MOTION.id(), shader).unwrap();
        let (look, (eye, projection)) = view(&BIRCH);
        let passes = (Msaa::Off, Tonemapping::None, DepthPrepass, MotionVectorPrepass);
        let (_, image) = camera(&mut app, [192, 192], (eye, projection, passes));
        let plant = plant(&mut app, &BAKED, 0.4);
        if far.is_some() {
            app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Policy(Arc::new(EveryLeaf));
        }
        app.world_mut().resource_mut::<FoliageSettings>().far = far;
        let covered = picture(&mut app, &image).covered();
        assert_eq!(app.world().resource::<FoliageStats>().impostors, u32::from(far.is_some()));
        // A screen before the camera.
        let world = app.world_mut();
        let screen = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(9.0, 9.0));
        let material = world.resource_mut::<Assets<ShowMotion>>().add(ShowMotion {});
        let place = Transform { translation: eye.translation + eye.forward() * 0.5, ..eye };
        world.spawn((Mesh3d(screen), MeshMaterial3d(material), place));
        let [still, beside] = motion(&mut app, &covered, &image);
        assert!(still.length() < 0.1 && beside.length() < 0.1, "{still} {beside}");
        // Wind moves the plant alone.
        app.insert_resource(FoliageWind(Wind { strength: 0.1, ..Wind::default() }));
        let most = |app: &mut App| {
            let motions: Vec<[Vec2; 2]> = (0..6).map(|_| motion(app, &covered, &image)).collect();
            [0, 1].map(|i| motions.iter().map(|motion| motion[i].length()).fold(0.0, f32::max))
        };
        let [windy, beside] = most(&mut app);
        println!("in the wind: {windy} px a frame, beside {beside}");
        assert!(windy > 0.08 && beside < 0.3 * windy, "{windy} {beside}");
        app.world_mut().remove_resource::<FoliageWind>();
        // A plant that moves across the picture by a tenth of a radius a frame.
        let step = 0.02 * BIRCH.sphere().radius as f32;
        let right = eye.right() * step;
        let mover = move |mut plants: Query<&mut Transform, With<Foliage>>, mut frame: Local<u32>| {
            // To and fro, so that it stays in place on average.
            *frame += 1;
            let sign = if frame.is_multiple_of(2) { 1.0 } else { -1.0 };
            plants.iter_mut().for_each(|mut place| place.translation += right * sign);
        };
        app.add_systems(Update, mover);
        let [moved, _] = motion(&mut app, &covered, &image);
        let distance = (look.eye - look.target).length() as f32;
        let expected = step / distance / (0.5 * look.fov_y_radians as f32).tan() * 96.0;
        println!("moved: {moved}, {expected} px expected");
        let is_expected = (moved.x.abs() - expected).abs() < 0.15 * expected && moved.y.abs() < 0.1 * expected;
        assert!(is_expected, "{moved} {expected}");
    }
}

/// A lit scene of a plant with all leaves that is some 90 pixels across, before white.
fn distant(name: &str) -> (App, Handle<Image>) {
    let model = &*BAKED;
    let mut app = app(&folder(name));
    app.insert_resource(ClearColor(Color::WHITE));
    app.insert_resource(GlobalAmbientLight { brightness: 800.0, ..default() });
    let (look, (eye, projection)) = view(model);
    // Eight times as far as the whole picture.
    let away = eye.translation - eye.forward() * (7.0 * (look.eye - look.target).length() as f32);
    let eye = Transform { translation: away, ..eye };
    let (_, image) = camera(&mut app, SIZE, (eye, projection, Msaa::Sample4, Tonemapping::None));
    let sun = DirectionalLight { illuminance: 3000.0, ..default() };
    app.world_mut().spawn((sun, Transform::from_xyz(3.0, 4.0, 6.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let plant = plant(&mut app, model, 1.0);
    app.world_mut().get_mut::<Foliage>(plant).unwrap().lod = FoliageLod::Policy(Arc::new(EveryLeaf));
    (app, image)
}

/// A picture in which plants are handed over at a size.
fn handed_over(app: &mut App, image: &Handle<Image>, at_px: f32) -> Picture {
    app.world_mut().resource_mut::<FoliageSettings>().far = Some(Far { at_px, ..Far::default() });
    picture(app, image)
}

/// Light that a plant takes from the backdrop, in each channel.
fn taken(picture: &Picture) -> [f32; 3] {
    [0, 1, 2].map(|channel| {
        let linear = |texel: &[u8; 4]| LinearRgba::from(Color::srgb_u8(texel[channel], 0, 0)).red;
        picture.rgba.iter().map(|texel| 1.0 - linear(texel)).sum::<f32>()
    })
}

#[test]
fn far_plants_are_handed_over_to_impostors_that_look_the_same() {
    let (mut app, image) = distant("far");
    let at = |app: &mut App, at_px: f32| {
        let shown = handed_over(app, &image, at_px);
        shown.keep(&format!("far-{at_px}"));
        (taken(&shown), app.world().resource::<FoliageStats>().impostors)
    };
    let (near, none) = at(&mut app, 0.0);
    let (far, one) = at(&mut app, 1024.0);
    assert_eq!((none, one), (0, 1));
    let changes = |other: [f32; 3]| [0, 1, 2].map(|i| other[i] / near[i] - 1.0);
    println!("the impostor takes {:?} more light", changes(far));
    assert!(changes(far).iter().all(|change| change.abs() < 0.05), "{:?}", changes(far));
    // On the way coverage stays.
    for at_px in [70.0, 80.0, 90.0, 100.0, 110.0] {
        let (between, _) = at(&mut app, at_px);
        println!("handed over at {at_px}: {:?}", changes(between));
        assert!(changes(between).iter().all(|change| change.abs() < 0.06), "{at_px}: {:?}", changes(between));
    }
}

/// Mean x coordinate of what is covered of the plant's top fifth, in pixels.
fn top(picture: &Picture) -> f32 {
    let coverage = coverage(picture);
    let rows: Vec<&[f32]> = coverage.chunks(SIZE[0] as usize).collect();
    let first = rows.iter().position(|row| row.iter().sum::<f32>() > 0.5).unwrap();
    let last = rows.iter().rposition(|row| row.iter().sum::<f32>() > 0.5).unwrap();
    let (mut sum, mut weight) = (0.0, 0.0);
    for row in &rows[first..first + (last - first) / 5] {
        for (x, covered) in row.iter().enumerate() {
            sum += x as f32 * covered;
            weight += covered;
        }
    }
    sum / weight
}

#[test]
fn impostors_bend_with_the_wind_as_leaves_and_wood_do() {
    let (mut app, image) = distant("far-wind");
    let pause = |app: &mut App, frames: u32| {
        let pass = |millis| bevy::time::TimeUpdateStrategy::ManualDuration(Duration::from_millis(millis));
        app.insert_resource(pass(50));
        run(app, frames);
        app.insert_resource(pass(0));
    };
    pause(&mut app, 1);
    let still = [0.0, 1024.0].map(|at_px| top(&handed_over(&mut app, &image, at_px)));
    // What bends is the trunk.
    app.insert_resource(FoliageWind(Wind { strength: 0.06, branches: 0.0, flutter: 0.0, ..Wind::default() }));
    let mut bends = Vec::new();
    for moment in 0..4 {
        pause(&mut app, 15);
        let near = handed_over(&mut app, &image, 0.0);
        let far = handed_over(&mut app, &image, 1024.0);
        assert_eq!(app.world().resource::<FoliageStats>().impostors, 1);
        assert_eq!(handed_over(&mut app, &image, 1024.0), far, "time stands still");
        near.keep(&format!("far-wind-{moment}-leaves"));
        far.keep(&format!("far-wind-{moment}-impostor"));
        let bent = [top(&near) - still[0], top(&far) - still[1]];
        println!("the top is {bent:?} px beside where it is at rest");
        // A pixel goes by the wind at its own height, not at that of what has bent down to it.
        assert!((bent[0] - bent[1]).abs() < 0.1 * bent[0].abs() + 0.15, "{bent:?}");
        bends.push(bent[1]);
        let [all, others] = [&near, &far].map(taken);
        for at_px in [80.0, 100.0] {
            let between = taken(&handed_over(&mut app, &image, at_px));
            let changes = [0, 1, 2].map(|i| [between[i] / all[i] - 1.0, others[i] / all[i] - 1.0]);
            println!("handed over at {at_px}: {changes:?}");
            assert!(changes.as_flattened().iter().all(|change| change.abs() < 0.06), "{at_px}: {changes:?}");
        }
    }
    let [least, most] = [f32::min, f32::max].map(|of| bends.iter().copied().reduce(of).unwrap());
    assert!(bends.iter().any(|bend| bend.abs() > 2.0) && most - least > 1.0, "{bends:?}");
}

/// Draws every leaf.
struct EveryLeaf;

impl LodPolicy for EveryLeaf {
    fn lod_outside(&self, _: &Sight) -> f32 {
        1.0
    }
}
