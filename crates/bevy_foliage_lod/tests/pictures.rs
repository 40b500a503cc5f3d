//! Pictures by Bevy, beside those of the library's own renderer.

mod common;

use bevy::{
    camera::{Exposure, Projection},
    core_pipeline::{
        prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass},
        tonemapping::Tonemapping,
    },
    prelude::*,
};
use bevy_foliage_lod::{
    FoliageAsset,
    foliage_lod::{
        Camera as Viewer, FoliageModel, Instance, Look, LookAt,
        glam::{DAffine3, DVec3},
        model::Transition,
        software::SoftwareRenderer,
    },
    prelude::*,
};
use common::{BIRCH, Picture, app, camera, folder, of_species, picture};

const SIZE: [u32; 2] = [256, 256];

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

/// Sum of the differences over the sum of the second.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / b.iter().sum::<f32>()
}

#[test]
fn silhouettes_are_those_of_the_librarys_own_renderer() {
    let oak = of_species("english-oak", 3000);
    for (name, model) in [("birch", &*BIRCH), ("oak", &oak)] {
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
            let difference = difference(&coverage(&drawn), &own);
            println!("{name} at {share}: {:.2} % of the silhouette differs", 100.0 * difference);
            assert!(difference < 0.02, "{name} at {share}: {difference}");
        }
    }
}
