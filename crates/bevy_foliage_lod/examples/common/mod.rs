#![allow(dead_code, reason = "no example uses all of it")]
//! What the examples share: options, a model, and an app that opens a window or writes a picture.

use bevy::{
    app::{AppExit, ScheduleRunnerPlugin},
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::TextureFormat,
        view::screenshot::{Screenshot, save_to_disk},
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_foliage_lod::{
    Foliage, FoliageAsset, FoliageLodPlugin,
    foliage_lod::{
        self, FoliageModel, continuous,
        grow::{GrowOptions, Species, grow},
        simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    },
};
use std::{str::FromStr, time::Duration};

/// Frames before a picture is taken: assets are uploaded, counts have settled.
const FRAMES: u32 = 12;

/// Options of the command line: `[MODEL] [--name value]...`.
#[derive(Resource, Debug, Clone)]
pub struct Options(Vec<String>);

impl Options {
    pub fn new() -> Self {
        Self(std::env::args().skip(1).collect())
    }

    /// The same with an option more.
    pub fn with(mut self, name: &str, value: &str) -> Self {
        self.0.extend([name.into(), value.into()]);
        self
    }

    /// The value of an option, or `otherwise` without it.
    pub fn get<T: FromStr>(&self, name: &str, otherwise: T) -> T {
        let at = self.0.iter().position(|option| option == name);
        let Some(value) = at.map(|at| self.0.get(at + 1).map_or("", String::as_str)) else { return otherwise };
        value.parse().unwrap_or_else(|_| fail(&format!("{name} {value:?} is not a value")))
    }

    /// Whether the option is there.
    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|option| option == name)
    }

    fn model(&self) -> Option<&str> {
        self.0.first().filter(|first| !first.starts_with("--")).map(String::as_str)
    }

    fn picture(&self) -> Option<String> {
        self.has("--picture").then(|| self.get("--picture", String::new()))
    }
}

/// Ends the program with one line.
pub fn fail(message: &str) -> ! {
    eprintln!("error: {message}");
    std::process::exit(2);
}

/// The model that the command line names, or a birch that is grown and simplified now.
pub fn model(options: &Options) -> FoliageModel {
    let made = || match options.model() {
        Some(path) => {
            let bytes = std::fs::read(path).map_err(|error| foliage_lod::Error::io(path, error))?;
            if continuous::is_glb(&bytes) { continuous::read(&bytes) } else { FoliageModel::from_bytes(&bytes) }
        }
        None => {
            let leaves = Some(options.get("--grow", 3000));
            let birch = grow(&Species::embedded("betula-populifolia")?, &GrowOptions { leaves, ..Default::default() })?;
            let mut model = simplify(&birch, &SimplifyOptions::fast(), &mut CpuFragments::new(), &mut Quiet)?.model;
            // Wood loses detail too.
            model.order_wood();
            Ok(model)
        }
    };
    made().unwrap_or_else(|error| fail(&error.to_string()))
}

/// Adds the model to the world's assets.
pub fn asset(world: &mut World) -> Handle<FoliageAsset> {
    let options = world.resource::<Options>().clone();
    let asset = FoliageAsset::new(model(&options), world).unwrap_or_else(|error| fail(&error.to_string()));
    world.resource_mut::<Assets<FoliageAsset>>().add(asset)
}

/// An app with a window, or with `--picture OUT.png [--size 640x360]` one that writes a picture and
/// ends.
pub fn app(options: &Options) -> App {
    let mut app = App::new();
    app.insert_resource(options.clone()).insert_resource(ClearColor(Color::srgb(0.62, 0.74, 0.88)));
    match options.picture() {
        None => app.add_plugins(DefaultPlugins),
        Some(_) => {
            let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
            // Pictures wait for pipelines, and time passes by frames.
            let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
            let plugins = DefaultPlugins.set(window).set(render).disable::<WinitPlugin>();
            let plugins = plugins.disable::<PipelinedRenderingPlugin>();
            app.add_plugins((plugins, ScheduleRunnerPlugin::run_loop(Duration::ZERO)))
                .insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)))
                .add_systems(Last, take_picture)
        }
    };
    app.add_plugins(FoliageLodPlugin);
    app
}

/// Spawns plants of the model in uneven rows around the middle; the distance between them.
pub fn plant_forest(world: &mut World, plants: u32) -> f32 {
    let model = asset(world);
    let sphere = world.resource::<Assets<FoliageAsset>>().get(&model).map(|asset| asset.model.sphere());
    let spacing = sphere.map_or(1.0, |sphere| 1.5 * sphere.radius as f32);
    let columns = (plants as f32).sqrt().ceil() as u32;
    let mut seed = 1_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / 16_777_216.0
    };
    for plant in 0..plants {
        let at = |number: u32, by: f32| (number as f32 - 0.5 * columns as f32 + 0.5 + 0.6 * (by - 0.5)) * spacing;
        let place = Vec3::new(at(plant % columns, random()), 0.0, at(plant / columns, random()));
        let turn = Quat::from_rotation_y(random() * std::f32::consts::TAU);
        let size = Vec3::splat(0.75 + 0.5 * random());
        let transform = Transform { translation: place, rotation: turn, scale: size };
        world.spawn((Foliage::new(model.clone()), transform));
    }
    spacing
}

/// Spawns a camera for the window or the picture, with the sun, light from the sky, and ground.
pub fn scene(world: &mut World, camera: impl Bundle, ground: f32) {
    let options = world.resource::<Options>().clone();
    let camera = world.spawn((Camera3d::default(), IsDefaultUiCamera, camera)).id();
    if options.picture().is_some() {
        let size: String = options.get("--size", "640x360".into());
        let sides: Vec<u32> = size.split('x').filter_map(|side| side.parse().ok()).collect();
        let [width, height] = sides[..] else { fail("--size takes WIDTHxHEIGHT") };
        let image = Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
        let image = world.resource_mut::<Assets<Image>>().add(image);
        world.entity_mut(camera).insert(RenderTarget::Image(image.into()));
    }
    world.insert_resource(GlobalAmbientLight { color: Color::srgb(0.75, 0.85, 1.0), brightness: 700.0, ..default() });
    let sun = DirectionalLight { illuminance: 9000.0, shadow_maps_enabled: true, ..default() };
    world.spawn((sun, Transform::from_xyz(4.0, 6.0, 5.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(ground, ground));
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
        base_color: Color::srgb(0.33, 0.42, 0.2),
        perceptual_roughness: 1.0,
        ..default()
    });
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material)));
}

/// Takes the picture, and ends once it is written.
fn take_picture(
    mut commands: Commands,
    options: Res<Options>,
    targets: Query<&RenderTarget>,
    taken: Query<(), With<Screenshot>>,
    mut frame: Local<u32>,
    mut exit: MessageWriter<AppExit>,
) {
    *frame += 1;
    let image = targets.iter().find_map(|target| target.as_image().cloned());
    let (Some(image), Some(path)) = (image, options.picture()) else { return };
    if *frame == options.get("--frames", FRAMES) {
        commands.spawn(Screenshot::image(image)).observe(save_to_disk(path));
    } else if *frame > options.get("--frames", FRAMES) + 2 && taken.is_empty() {
        exit.write(AppExit::Success);
    }
}
