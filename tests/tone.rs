//! Tone: enlarged leaves are drawn nearer to the plant's mean colour, on the CPU as on the GPU, and
//! nothing else changes.
#![cfg(all(feature = "measure", feature = "render", feature = "simplify"))]

mod common;

use common::{gpu::difference, stage::Stage};
use foliage_lod::{
    FoliageModel, Frame, Instance, Look, LookAt,
    draw::Variant,
    effects::{Contrast, Effects},
    grow::{GrowOptions, Species, grow},
    measure::Reference,
    model::Growth,
    simplify::{CpuFragments, GrowBy, Quiet, SimplifyOptions, simplify},
    software::{DrawList, Image, Painter, SoftwareRenderer, model_toning},
};
use glam::{DAffine3, DVec3};

const SIZE: [u32; 2] = [160, 160];

/// A birch of 900 leaves, and the number of leaves that lie behind each other.
fn birch() -> (FoliageModel, f64) {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(900), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, grow_by: GrowBy::Scale, ..SimplifyOptions::balanced() };
    let simplified = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap();
    (simplified.model, simplified.leaf_layers)
}

fn without_tone(model: &FoliageModel) -> FoliageModel {
    FoliageModel { growth: Growth::default(), ..model.clone() }
}

fn frame(model: &FoliageModel) -> Frame {
    Frame::new(&LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).camera(SIZE[1]))
}

fn stage(model: &FoliageModel, look: Look) -> Option<Stage> {
    Stage::new(model, look, frame(model), SIZE)
}

fn painted(model: &FoliageModel, look: Look, active: f32) -> Image {
    let mut foliage = SoftwareRenderer::new(look).unwrap();
    let id = foliage.add_model(model).unwrap();
    foliage.draw(frame(model), &[Instance::new(id, DAffine3::IDENTITY, active)], SIZE).unwrap().image
}

#[test]
fn tone_reduces_the_error_most_where_leaves_hide_each_other_least() {
    let (model, layers) = birch();
    assert!((1.0..5.0).contains(&layers), "{layers}");
    assert!((0.1..0.3).contains(&model.growth.tone), "{}", model.growth.tone);
    assert_eq!(FoliageModel::from_bytes(&model.to_bytes().unwrap()).unwrap(), model);
    let reference = Reference::new(&model.to_plant(), 96).unwrap();
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    let tone = model_toning(&model, &Default::default()).unwrap().unwrap();
    for n in [450, 135, 45] {
        let rmse = |tone| reference.quality(&painter, DrawList::of_model(&model, n), tone).unwrap().rmse;
        let [with, without] = [Some(tone), None].map(rmse);
        println!("{n} leaves: RMSE {with:.2} with tone, {without:.2} without");
        assert!(with < without, "{n}: {with} {without}");
    }
}

#[test]
fn without_tone_every_pixel_is_that_of_plain_scaling() {
    let (model, _) = birch();
    let plain = without_tone(&model);
    let off = Look { tone: false, ..Look::default() };
    for active in [900.0, 300.0, 20.0] {
        assert!(painted(&model, off, active) == painted(&plain, Look::default(), active), "{active}");
    }
    assert!(painted(&model, Look::default(), 900.0) == painted(&plain, Look::default(), 900.0));
    let Some(mut toned) = stage(&model, off) else { return };
    let mut untoned = stage(&plain, Look::default()).unwrap();
    for active in [900.0, 300.0, 20.0] {
        assert!(toned.draw(active) == untoned.draw(active), "{active}");
    }
    for stage in [toned, untoned] {
        let found = stage.foliage.diagnostics();
        assert_eq!((found.leaf_variants, found.effect_bytes), (vec![Variant::default()], 0));
    }
}

#[test]
fn the_gpu_tones_as_the_cpu_does_and_contrast_gives_way() {
    let (model, _) = birch();
    let model = FoliageModel { growth: Growth { tone: 0.5, tiles: false }, ..model };
    let Some(mut toned) = stage(&model, Look::default()) else { return };
    let mut plain = stage(&without_tone(&model), Look::default()).unwrap();
    let contrast =
        Look { effects: Effects { contrast: Some(Contrast::default()), ..Effects::default() }, ..Look::default() };
    let mut both = stage(&model, contrast).unwrap();
    for active in [300.0, 60.0] {
        let with = toned.draw(active);
        let (shown, _) = difference(&with, &plain.draw(active));
        let (mean, percentile) = difference(&with, &painted(&model, Look::default(), active));
        let (untoned_mean, _) =
            difference(&plain.draw(active), &painted(&without_tone(&model), Look::default(), active));
        println!("{active}: tone changes {shown:.2}; CPU differs by {mean:.2}, without tone by {untoned_mean:.2}");
        assert!(shown > 0.3 && mean < untoned_mean + 0.1 && percentile < 48, "{shown} {mean} {percentile}");
        assert!(both.draw(active) == with, "{active}");
        assert!(painted(&model, contrast, active) == painted(&model, Look::default(), active), "{active}");
    }
    assert_eq!(toned.foliage.diagnostics().leaf_variants, [Variant { tone: true, ..Variant::default() }]);
}
