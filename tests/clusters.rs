//! Pictures of clusters: a leaf that stands for others becomes a card that shows them, on the CPU
//! as on the GPU, with every effect, and leaf by leaf.
#![cfg(all(feature = "measure", feature = "render", feature = "simplify"))]

mod common;

use common::{gpu::difference, stage::Stage};
use foliage_lod::{
    FoliageModel, Frame, Instance, Look, LookAt, Plant, Swap, Timeline,
    effects::{Effects, Fade, FadeBy, Shadow, Wind},
    export::Level,
    extract::leaf_count,
    grow::{GrowOptions, Species, grow},
    measure::{Quality, Reference, matched_px},
    model::{ClusterCard, Clusters, EMPTY, Transition},
    simplify::{CpuFragments, GrowBy, Quiet, SimplifyOptions, simplify},
    software::{DrawList, DrawOptions, Image, Painter, SoftwareRenderer, Toning, draw_model, draw_plant, model_toning},
};
use glam::{DAffine3, DVec3};
use std::sync::OnceLock;

const SIZE: [u32; 2] = [192, 192];
const LEAVES: u32 = 700;

/// A birch with so few leaves that they hardly hide each other.
fn birch() -> Plant {
    let species = Species::embedded("betula-populifolia").unwrap();
    grow(&species, &GrowOptions { leaves: Some(LEAVES), ..GrowOptions::default() }).unwrap()
}

fn simplified(plant: &Plant, grow_by: GrowBy, threads: usize) -> FoliageModel {
    let options = SimplifyOptions { resolution: 128, grow_by, threads, ..SimplifyOptions::balanced() };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn model() -> &'static FoliageModel {
    static MODEL: OnceLock<FoliageModel> = OnceLock::new();
    MODEL.get_or_init(|| simplified(&birch(), GrowBy::Picture, 2))
}

/// The same model without cards.
fn plain() -> FoliageModel {
    FoliageModel { clusters: Clusters::default(), ..model().clone() }
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

fn quality(model: &FoliageModel, reference: &Reference, count: u32) -> Quality {
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    let tone = model_toning(model, &Default::default()).unwrap();
    reference.quality(&painter, DrawList::of_model(model, count as usize), tone).unwrap()
}

#[test]
fn cards_show_a_sparse_crown_better_and_change_nothing_else() {
    let (model, plain) = (model(), plain());
    assert!(!model.clusters.cards().is_empty());
    let plant = birch();
    assert!(plain == simplified(&plant, GrowBy::Auto, 2));
    assert!(*model == simplified(&plant, GrowBy::Picture, 1), "threads");
    for (level, most) in [(0.15, 1.03), (0.05, 0.95)] {
        let count = leaf_count(level as f32, LEAVES, 1);
        let reference = Reference::new(&plant, matched_px(level)).unwrap();
        let [with, without] = [model, &plain].map(|model| quality(model, &reference, count));
        println!("{level}: {with:?}, without {without:?}");
        assert!(with.xor < most * without.xor && with.rmse < 1.03 * without.rmse, "{level}");
    }
}

#[test]
fn a_leaf_or_one_of_its_cards_is_there_and_pictures_only_gain_leaves() {
    let model = model();
    let timeline = Timeline::with_cards(model);
    let cards = model.clusters.cards();
    let mut shown_before = vec![0; cards.len()];
    for n in (1..=LEAVES).rev() {
        let transition = Transition::new(f64::from(n), 1.0, LEAVES);
        let mut of_leaf = vec![0; LEAVES as usize];
        for (number, card) in cards.iter().enumerate() {
            let Some(shown) = model.clusters.shown(number, &timeline, &transition) else { continue };
            assert_eq!((shown.share, shown.step.fract()), (1.0, 0.0));
            of_leaf[card.leaf as usize] += 1;
            let texels = &model.clusters.texels()[model.clusters.texel_range(number)];
            let covered = texels.iter().filter(|&&texel| texel != EMPTY && f32::from(texel) <= shown.step).count();
            assert!(covered >= shown_before[number], "card {number} at {n}");
            shown_before[number] = covered;
        }
        for leaf in 0..n {
            let scale = timeline.scale_at(leaf, &transition);
            assert_eq!(of_leaf[leaf as usize], u32::from(scale == 0.0), "leaf {leaf} at {n}");
        }
        assert!(of_leaf[n as usize..].iter().all(|&count| count == 0));
    }
    let swap = Swap::new(model);
    assert!(swap.scales().iter().all(|&scale| scale == 1.0), "a host that knows no cards enlarges leaves");
}

#[test]
fn cards_are_kept_in_the_file() {
    let model = model();
    assert_eq!(FoliageModel::from_bytes(&model.to_bytes().unwrap()).unwrap(), *model);
    let mut packed = model.clone();
    packed.quantize();
    let bytes = packed.to_bytes().unwrap();
    assert_eq!(FoliageModel::from_bytes(&bytes).unwrap(), packed);
    let without = FoliageModel { clusters: Clusters::default(), ..packed.clone() }.to_bytes().unwrap();
    let per_leaf = (bytes.len() - without.len()) as f64 / f64::from(LEAVES);
    println!("{per_leaf:.1} bytes a leaf");
    assert!(per_leaf < 45.0, "{per_leaf}");
    for (now, exact) in packed.clusters.cards().iter().zip(model.clusters.cards()) {
        let miss = glam::Vec3::from(now.center).distance(exact.center.into());
        assert!(miss <= 2.0 * packed.precision.position, "{miss}");
    }
}

#[test]
fn exported_levels_have_the_cards_as_leaves_with_a_texture() {
    let (model, plain) = (model(), plain());
    let options = DrawOptions { tone: Some(Toning::NONE), ..DrawOptions::default() };
    let camera = frame(model).camera;
    for leaves in [200, 70, 20] {
        let drawn = draw_model(model, leaves, &camera, SIZE, &options).unwrap();
        let [with, without] = [model, &plain].map(|model| {
            let level = Level::of_leaves(model, leaves as u32, 1e6).unwrap();
            level.plant.validate().unwrap();
            assert_eq!(level.cards > 0, !model.clusters.cards().is_empty());
            assert!(level.plant.leaves.len() == leaves);
            let exported = draw_plant(&level.plant, &camera, SIZE, &options).unwrap();
            if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
                let path = std::path::Path::new(&folder).join(format!("level-{leaves}-{}.png", level.cards));
                Image::side_by_side(&[drawn.clone(), exported.clone()], 4).write_png(path).unwrap();
            }
            difference(&exported, &drawn).0
        });
        // The crown of fewer leaves is lit a little differently.
        println!("{leaves}: {with:.2} off, without cards {without:.2}");
        assert!(with < 0.6 * without, "{leaves}: {with} {without}");
    }
    assert_eq!(Level::new(model, 1.0).unwrap().cards, 0);
}

#[test]
fn a_damaged_card_is_refused() {
    let model = model();
    let broken = |change: fn(&mut ClusterCard)| {
        let mut cards = model.clusters.cards().to_vec();
        change(&mut cards[0]);
        let clusters = Clusters::new(cards, model.clusters.texels().to_vec());
        FoliageModel { clusters, ..model.clone() }.validate().unwrap_err().to_string()
    };
    let changes: [fn(&mut ClusterCard); 7] = [
        |card| card.leaf = u32::MAX,
        |card| card.first = LEAVES,
        |card| card.size[0] = 12,
        |card| card.size[1] += 1,
        |card| card.center[0] = f32::NAN,
        |card| card.kept = 1.5,
        |card| card.color[2] = -1.0,
    ];
    for change in changes {
        let told = broken(change);
        assert!(told.contains("18"), "{told}");
    }
}

#[test]
fn the_gpu_shows_cards_as_the_cpu_does() {
    let (model, plain) = (model(), plain());
    let Some(mut cards) = stage(model, Effects::default()) else { return };
    let mut scaled = stage(&plain, Effects::default()).unwrap();
    let every = [&mut cards, &mut scaled].map(|stage| stage.draw(LEAVES as f32));
    assert!(difference(&every[0], &every[1]) < (0.3, 1), "every leaf");
    let [with, without] = [model, &plain].map(|model| painted(model, Effects::default(), LEAVES as f32));
    assert!(with == without, "every leaf");
    for active in [200.0, 70.0, 20.5] {
        let (with, without) = (cards.draw(active), scaled.draw(active));
        let [by_cpu, plain_by_cpu] = [model, &plain].map(|model| painted(model, Effects::default(), active));
        if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
            let path = std::path::Path::new(&folder).join(format!("clusters-{active}.png"));
            Image::side_by_side(&[without.clone(), with.clone(), by_cpu.clone()], 4).write_png(path).unwrap();
        }
        let shown = difference(&with, &without).0;
        let (mean, percentile) = difference(&with, &by_cpu);
        let (as_usual, _) = difference(&without, &plain_by_cpu);
        println!("{active}: cards change {shown:.2}; CPU differs by {mean:.2}, without them by {as_usual:.2}");
        assert!(shown > 0.5 && mean < 1.2 * as_usual && percentile < 48, "{shown} {mean} {percentile}");
    }
}

#[test]
fn cards_go_with_wind_fades_and_shadows() {
    let model = model();
    let effects = Effects {
        fade: Some(Fade { by: FadeBy::Alpha, half_width: 0.05, ..Fade::default() }),
        wind: Some(Wind::default()),
        ..Effects::default()
    };
    let Some(mut moving) = stage(model, effects) else { return };
    let (mean, percentile) = difference(&moving.draw(70.5), &painted(model, effects, 70.5));
    let plain = plain();
    let by_scale = stage(&plain, effects).unwrap().draw(70.5);
    let (mean_by_scale, _) = difference(&by_scale, &painted(&plain, effects, 70.5));
    println!("in the wind: CPU differs by {mean:.2}, by scale by {mean_by_scale:.2}");
    assert!(mean < 1.2 * mean_by_scale && percentile < 48, "{mean} {percentile}");
    let still = Effects { wind: None, ..effects };
    assert!(difference(&moving.draw(70.5), &stage(model, still).unwrap().draw(70.5)).0 > 0.3, "cards stand still");
    let shadow = |model: &FoliageModel| {
        let effects = Effects { shadow: Some(Shadow { lod: 1.0, ..Shadow::default() }), ..Effects::default() };
        let lit = stage(model, Effects::default()).unwrap().draw(70.0);
        difference(&stage(model, effects).unwrap().draw(70.0), &lit).0
    };
    // Leaves alone, without the cards, cast far less.
    let dark = shadow(model);
    let bare = FoliageModel { clusters: no_texels(&model.clusters), ..model.clone() };
    println!("shadows: {dark:.2}, without cards {:.2}", shadow(&bare));
    assert!(dark > 1.2 * shadow(&bare));
}

/// The same cards, showing nothing.
fn no_texels(clusters: &Clusters) -> Clusters {
    Clusters::new(clusters.cards().to_vec(), vec![EMPTY; clusters.texels().len()])
}

#[test]
fn nothing_flips_while_leaves_go_one_by_one() {
    let (model, plain) = (model(), plain());
    let largest = |model: &FoliageModel| {
        let pictures: Vec<Image> =
            (0..160).map(|step| painted(model, Effects::default(), 100.0 - 0.5 * step as f32)).collect();
        pictures.windows(2).map(|pair| difference(&pair[0], &pair[1]).0).fold(0.0, f64::max)
    };
    let [cards, scale] = [largest(model), largest(&plain)];
    println!("largest change of half a leaf, from 100 to 20 leaves: {cards:.3} with cards, {scale:.3} by scale");
    assert!(cards < 1.5 * scale, "{cards} {scale}");
}
