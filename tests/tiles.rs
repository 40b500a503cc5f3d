//! Growth by tiling: enlarged cut-out leaves repeat their pictures, on the CPU as on the GPU, with
//! every effect, and continuously.
#![cfg(all(feature = "measure", feature = "render", feature = "simplify"))]

mod common;

use common::{gpu::difference, stage::Stage};
use foliage_lod::{
    Error, FoliageModel, Frame, Instance, Look, LookAt, Swap, Timeline,
    draw::Variant,
    effects::{Effects, Fade, FadeBy, Shadow, Wind},
    grow::{GrowOptions, Species, grow},
    model::{Growth, Transition},
    simplify::{CpuFragments, GrowBy, Observer, Quiet, Simplified, SimplifyOptions, simplify},
    software::{Image, SoftwareRenderer},
};
use glam::{DAffine3, DVec3};

const SIZE: [u32; 2] = [192, 192];

fn simplified(species: &str, leaves: u32, grow_by: GrowBy) -> Simplified {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 96, grow_by, tone: false, ..SimplifyOptions::balanced() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap()
}

fn oak() -> FoliageModel {
    simplified("english-oak", 1500, GrowBy::Tile).model
}

/// The same model, growing by scale.
fn scaled(model: &FoliageModel) -> FoliageModel {
    FoliageModel { growth: Growth::default(), ..model.clone() }
}

fn frame(model: &FoliageModel) -> Frame {
    Frame::new(&LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).camera(SIZE[1])).at(3.0)
}

fn stage(model: &FoliageModel, effects: Effects) -> Option<Stage> {
    Stage::new(model, Look { effects, ..Look::default() }, frame(model), SIZE)
}

fn painted(model: &FoliageModel, effects: Effects, active: f32) -> Image {
    let mut foliage = SoftwareRenderer::new(Look { effects, ..Look::default() }).unwrap();
    let id = foliage.add_model(model).unwrap();
    foliage.draw(frame(model), &[Instance::new(id, DAffine3::IDENTITY, active)], SIZE).unwrap().image
}

#[test]
fn a_trial_decides_for_tiles_in_a_dense_crown_and_a_sparse_one_is_not_tried() {
    let dense = simplified("english-oak", 1500, GrowBy::Auto);
    let trial = dense.trial.unwrap();
    println!("{:.2} layers, {trial:?}", dense.leaf_layers);
    assert!(dense.model.growth.tiles && trial.tile.rmse < trial.scale.rmse, "{trial:?}");
    assert!(dense.model == simplified("english-oak", 1500, GrowBy::Tile).model);
    let sparse = simplified("betula-populifolia", 60, GrowBy::Auto);
    assert!(sparse.leaf_layers < 2.0 && sparse.trial.is_none(), "{} {:?}", sparse.leaf_layers, sparse.trial);
    assert!(sparse.model == simplified("betula-populifolia", 60, GrowBy::Scale).model);
    for grow_by in [GrowBy::Scale, GrowBy::Tile] {
        assert_eq!(simplified("english-oak", 300, grow_by).trial, None);
    }
}

#[test]
fn a_trial_finds_the_same_with_any_number_of_threads_and_can_be_stopped() {
    let species = Species::embedded("english-oak").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(600), ..GrowOptions::default() }).unwrap();
    let tried = |threads| {
        let options = SimplifyOptions { resolution: 64, threads, ..SimplifyOptions::balanced() };
        simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap()
    };
    let one = tried(1);
    for threads in [2, 5] {
        let several = tried(threads);
        assert!(one.trial.is_some() && one.trial == several.trial && one.model == several.model, "{threads}");
    }
    struct Stop;
    impl Observer for Stop {
        fn phase(&mut self, name: &str, total: u64) {
            assert_eq!((name, total), ("growth", 1200));
        }

        fn advance(&mut self, _: u64) -> bool {
            false
        }
    }
    let stopped = simplify(&plant, &SimplifyOptions::balanced(), &mut CpuFragments::new(), &mut Stop);
    assert!(matches!(stopped, Err(Error::Interrupted)), "{stopped:?}");
}

#[test]
fn tiles_are_kept_in_the_file_and_swaps_and_timelines_agree() {
    let model = oak();
    assert_eq!(FoliageModel::from_bytes(&model.to_bytes().unwrap()).unwrap(), model);
    let mut packed = model.clone();
    packed.quantize();
    assert_eq!(FoliageModel::from_bytes(&packed.to_bytes().unwrap()).unwrap(), packed);
    let (mut swap, timeline) = (Swap::new(&model), Timeline::new(&model));
    for active in [1500, 700, 90, 300, 1] {
        swap.set_active(active);
        let transition = Transition::new(f64::from(active), 1.0, 1500);
        let scales: Vec<f32> = (0..active).map(|leaf| timeline.scale_at(leaf, &transition)).collect();
        assert_eq!(swap.scales()[..active as usize], scales);
    }
}

#[test]
fn the_gpu_repeats_pictures_as_the_cpu_does() {
    let model = oak();
    let Some(mut tiled) = stage(&model, Effects::default()) else { return };
    let mut plain = stage(&scaled(&model), Effects::default()).unwrap();
    let full = tiled.draw(1500.0);
    assert!(full == plain.draw(1500.0), "every leaf");
    // Pictures of unscaled leaves.
    let (as_usual, _) = difference(&full, &painted(&model, Effects::default(), 1500.0));
    for active in [400.0, 120.0, 40.0] {
        let (with, without) = (tiled.draw(active), plain.draw(active));
        let by_cpu = painted(&model, Effects::default(), active);
        if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
            let path = std::path::Path::new(&folder).join(format!("tiles-{active}.png"));
            let pictures = [without.clone(), with.clone(), by_cpu.clone()];
            Image::side_by_side(&pictures, 4).write_png(path).unwrap();
        }
        let shown = difference(&with, &without).0;
        let (mean, percentile) = difference(&with, &by_cpu);
        println!("{active}: tiles change {shown:.2}; CPU differs by {mean:.2}, with every leaf by {as_usual:.2}");
        assert!(shown > 1.0 && mean < 1.5 * as_usual && percentile < 48, "{shown} {mean} {percentile}");
    }
    let variants = tiled.foliage.diagnostics().leaf_variants;
    assert_eq!(variants, [Variant::default(), Variant { tiles: true, ..Variant::default() }]);
    assert_eq!(plain.foliage.diagnostics().leaf_variants, [Variant::default()]);
}

#[test]
fn tiles_go_with_wind_fades_and_shadows() {
    let model = oak();
    let effects = Effects {
        fade: Some(Fade { by: FadeBy::Alpha, half_width: 0.05, ..Fade::default() }),
        wind: Some(Wind::default()),
        ..Effects::default()
    };
    let Some(mut moving) = stage(&model, effects) else { return };
    let (mean, percentile) = difference(&moving.draw(120.5), &painted(&model, effects, 120.5));
    let scaled = scaled(&model);
    let by_scale = stage(&scaled, effects).unwrap().draw(120.5);
    let (mean_by_scale, _) = difference(&by_scale, &painted(&scaled, effects, 120.5));
    println!("in the wind: CPU differs by {mean:.2}, by scale by {mean_by_scale:.2}");
    assert!(mean < 1.4 * mean_by_scale && percentile < 48, "{mean} {percentile}");
    let shadow = Effects { shadow: Some(Shadow { lod: 0.3, ..Shadow::default() }), ..Effects::default() };
    let lit = stage(&model, Effects::default()).unwrap().draw(120.0);
    assert!(difference(&stage(&model, shadow).unwrap().draw(120.0), &lit).0 > 0.3);
}

#[test]
fn no_leaf_flips_while_leaves_go_one_by_one() {
    let model = oak();
    let largest = |model: &FoliageModel| {
        let pictures: Vec<Image> =
            (0..120).map(|step| painted(model, Effects::default(), 100.0 - 0.5 * step as f32)).collect();
        pictures.windows(2).map(|pair| difference(&pair[0], &pair[1]).0).fold(0.0, f64::max)
    };
    let [tiles, scale] = [largest(&model), largest(&scaled(&model))];
    println!("largest change of half a leaf, from 100 to 40 leaves: {tiles:.3} with tiles, {scale:.3} by scale");
    assert!(tiles < 2.0 * scale, "{tiles} {scale}");
}
