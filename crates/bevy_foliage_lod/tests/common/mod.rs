//! An app without a window, whose pictures are read back.

#![allow(dead_code, reason = "no test uses all of it")]

use bevy::{
    app::{App, PluginsState},
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::{CachedPipelineState, PipelineCache, TextureFormat},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_foliage_lod::{
    FoliageLodPlugin,
    foliage_lod::{
        FoliageModel,
        grow::{GrowOptions, Species, grow},
        simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    },
};
use std::{
    path::PathBuf,
    sync::{Arc, LazyLock, Mutex},
    time::Duration,
};

/// Colour of what is behind plants.
pub const BACKDROP: [u8; 3] = [255, 0, 255];

/// A birch of 900 leaves.
pub static BIRCH: LazyLock<FoliageModel> = LazyLock::new(|| of_species("betula-populifolia", 900));

pub fn of_species(name: &str, leaves: u32) -> FoliageModel {
    let options = GrowOptions { leaves: Some(leaves), ..GrowOptions::default() };
    let plant = grow(&Species::embedded(name).unwrap(), &options).unwrap();
    let options = SimplifyOptions { resolution: 96, ..SimplifyOptions::paper() };
    let mut model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.order_wood();
    model
}

/// A folder of assets of one test.
pub fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// An app that has started, without a camera. Time passes by a twentieth of a second a frame.
pub fn app(assets: &std::path::Path) -> App {
    app_with(assets, |_| {})
}

/// The same with more plug-ins.
pub fn app_with(assets: &std::path::Path, more: impl FnOnce(&mut App)) -> App {
    let mut app = App::new();
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
    let files = AssetPlugin { file_path: assets.to_string_lossy().into(), ..default() };
    let plugins = DefaultPlugins.set(window).set(render).set(files);
    let plugins = plugins.disable::<WinitPlugin>().disable::<PipelinedRenderingPlugin>();
    app.add_plugins(plugins.disable::<bevy::log::LogPlugin>())
        .add_plugins(FoliageLodPlugin)
        .insert_resource(ClearColor(Color::srgb_u8(BACKDROP[0], BACKDROP[1], BACKDROP[2])))
        .insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
    more(&mut app);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app
}

/// Spawns a camera that draws a picture.
pub fn camera(app: &mut App, size: [u32; 2], view: impl Bundle) -> (Entity, Handle<Image>) {
    let image = Image::new_target_texture(size[0], size[1], TextureFormat::Rgba8UnormSrgb, None);
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let camera = app.world_mut().spawn((Camera3d::default(), view, RenderTarget::Image(image.clone().into()))).id();
    (camera, image)
}

/// Runs frames.
pub fn run(app: &mut App, frames: u32) {
    (0..frames).for_each(|_| app.update());
}

/// A picture: RGBA, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub size: [u32; 2],
    pub rgba: Vec<[u8; 4]>,
}

/// What a camera draws now, after some frames.
pub fn picture(app: &mut App, image: &Handle<Image>) -> Picture {
    run(app, 4);
    let cache = app.sub_app(RenderApp).world().resource::<PipelineCache>();
    for pipeline in cache.pipelines() {
        assert!(!matches!(pipeline.state, CachedPipelineState::Err(_)), "{:?}", pipeline.state);
    }
    let found: Arc<Mutex<Option<Image>>> = Arc::default();
    let put = found.clone();
    let take = move |taken: On<ScreenshotCaptured>| *put.lock().unwrap() = Some(taken.image.clone());
    app.world_mut().spawn(Screenshot::image(image.clone())).observe(take);
    for _ in 0..100 {
        app.update();
        if let Some(image) = found.lock().unwrap().take() {
            let rgba = image.data.as_ref().unwrap().as_chunks().0.to_vec();
            return Picture { size: [image.width(), image.height()], rgba };
        }
    }
    panic!("no picture was taken");
}

impl Picture {
    /// Whether something covers each pixel.
    pub fn covered(&self) -> Vec<bool> {
        self.rgba.iter().map(|&[r, g, b, _]| [r, g, b] != BACKDROP).collect()
    }

    /// Writes the picture to look at, if `FOLIAGE_PICTURES` names a folder.
    pub fn keep(&self, name: &str) {
        let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") else { return };
        let path = PathBuf::from(folder).join(format!("{name}.png"));
        let bytes: Vec<u8> = self.rgba.as_flattened().to_vec();
        let image =
            bevy_foliage_lod::foliage_lod::software::Image { width: self.size[0], height: self.size[1], rgba: bytes };
        image.write_png(path).unwrap();
    }
}
