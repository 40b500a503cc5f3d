//! Ten plants with and without tone and pictures of clusters, and with their leaves grown by scale
//! or by tiling: prints what held-out views show of each, as comma-separated values, and checks
//! what was promised of it.
//!
//! Takes minutes, so it runs only when asked for, with the folder of trees that others made:
//!
//! ```text
//! FOLIAGE_TREES=... cargo test --release --features flip,measure,simplify \
//!     --test ten_plants -- --ignored --nocapture
//! ```
//!
//! `FOLIAGE_PLANTS` names some of the plants, with commas. `FOLIAGE_BEFORE` is a folder of exact
//! models of the same plants, such as `birch.vds`, that another version made: they are measured
//! against the same pictures.
#![cfg(all(feature = "measure", feature = "simplify"))]

use foliage_lod::{
    FoliageModel, Plant,
    export::write_glb,
    extract::leaf_count,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load, load_gltf_bytes},
    measure::{Quality, Reference, matched_px},
    model::Growth,
    simplify::{CpuFragments, GrowBy, Quiet, Simplified, SimplifyOptions, simplify},
    software::{DrawList, Painter, model_toning},
};
use std::{collections::BTreeMap, path::PathBuf};

/// Name of each plant, and its species or its file.
const PLANTS: [(&str, &str); 10] = [
    ("oak", "english-oak"),
    ("birch", "betula-populifolia"),
    ("pecan", "carya-illinoinensis"),
    ("sapling-birch", "sapling_birch_8k_rect.glb"),
    ("sapling-maple", "sapling_maple_12k_hex.glb"),
    ("eztree-oak", "eztree_oak_medium.glb"),
    ("common-tree", "CommonTree_1.glb"),
    ("zelkova", "ftlab_keyaki.glb"),
    ("white-oak", "seedthree_whiteoak_LOD0_merged.glb"),
    ("proctree", "proctree_l7.glb"),
];
/// Those whose crowns are sparse: leaves hardly hide each other.
const SPARSE: [&str; 2] = ["sapling-birch", "sapling-maple"];
const LEVELS: [f64; 6] = [0.5, 0.3, 0.15, 0.05, 0.02, 0.01];
const SIDE_PX: u32 = 256;
/// Silhouette difference, as a share of the plant's area, that does not matter.
const LITTLE_AREA: f64 = 0.005;

/// Quality at a level: in pictures of 256 pixels, and at the matched size.
type Row = [Quality; 2];

/// The plant as it is read from its file; a species is grown and written to one first.
fn plant(source: &str, trees: &str) -> Plant {
    let options = ImportOptions::default();
    let path = PathBuf::from(trees).join(source);
    let imported = match Species::embedded(source) {
        Ok(species) => {
            let glb = write_glb(&grow(&species, &GrowOptions::default()).unwrap()).unwrap();
            load_gltf_bytes(&glb, &path, &options)
        }
        Err(_) => load(&path, &options),
    };
    imported.unwrap().plant
}

/// Pictures of the full plant that all variants are compared with, by their sides.
struct References<'a> {
    plant: &'a Plant,
    of_side: BTreeMap<u32, Reference>,
}

impl References<'_> {
    fn quality(&mut self, model: &FoliageModel, count: u32, side: u32) -> Quality {
        let reference = self.of_side.entry(side).or_insert_with(|| Reference::new(self.plant, side).unwrap());
        let painter = Painter::new(&model.materials, &model.textures).unwrap();
        let tone = model_toning(model, &Default::default()).unwrap();
        reference.quality(&painter, DrawList::of_model(model, count as usize), tone).unwrap()
    }

    /// Measures and prints every level of a model.
    fn rows(&mut self, name: &str, variant: &str, model: &FoliageModel) -> Vec<Row> {
        let row = |level: f64| {
            let count = leaf_count(level as f32, model.leaves.len() as u32, 1);
            let drawn = &model.leaves[..count as usize];
            let triangles: u32 = drawn.iter().map(|leaf| (leaf.indices[1] - leaf.indices[0]) / 3).sum();
            [SIDE_PX, matched_px(level)].map(|side| {
                let quality = self.quality(model, count, side);
                let Quality { rmse, ssim, flip, xor, grain, .. } = quality;
                println!(
                    "{name},{variant},{level},{triangles},{side},{rmse:.3},{xor:.4},{grain:.4},{ssim:.4},{flip:.4}"
                );
                quality
            })
        };
        LEVELS.map(row).to_vec()
    }
}

/// What was promised of enlarged leaves that are toned: no level has more than 2 % more error.
fn check_tone(name: &str, plain: &[Row], toned: &[Row]) {
    for ((plain, toned), level) in plain.iter().zip(toned).zip(LEVELS) {
        let [plain, toned] = [plain[0], toned[0]];
        assert!(toned.rmse <= 1.02 * plain.rmse && toned.xor == plain.xor, "{name} {level}: {toned:?} {plain:?}");
    }
}

/// What was promised of tiles: at most 5 % more error and 15 % more silhouette difference (and
/// [`LITTLE_AREA`]) than plainly scaled leaves, at the matched size about the structure and the
/// FLIP of these, and a grain nearer to 1 than that of scaled leaves with the same tone, unless
/// both are near.
fn check_tiles(name: &str, plain: &[Row], toned: &[Row], tiled: &[Row]) {
    for ((plain, tiled), level) in plain.iter().zip(tiled).zip(LEVELS) {
        let [[plain, plain_matched], [tiled, tiled_matched]] = [plain, tiled];
        assert!(tiled.rmse <= 1.05 * plain.rmse, "{name} {level}: {tiled:?} {plain:?}");
        assert!(tiled.xor <= 1.15 * plain.xor + LITTLE_AREA, "{name} {level}: {tiled:?} {plain:?}");
        assert!(tiled_matched.ssim >= plain_matched.ssim - 0.01, "{name} {level}: {tiled_matched:?} {plain_matched:?}");
        // Without the feature, FLIP is NaN.
        let is_like = tiled_matched.flip.is_nan() || tiled_matched.flip <= plain_matched.flip + 0.005;
        assert!(is_like, "{name} {level}: {tiled_matched:?}");
    }
    let at_5 = LEVELS.iter().position(|&level| level == 0.05).unwrap();
    let [toned, tiled] = [toned[at_5][0], tiled[at_5][0]].map(|quality| (quality.grain - 1.0).abs());
    assert!(tiled < toned.max(0.05), "{name}: grain is {tiled} off, {toned} by scale");
}

/// What was promised of pictures of clusters: from 15 % down at most 3 % more error and 2 % more
/// silhouette difference (and [`LITTLE_AREA`]) than without them, and at the matched size a
/// structure that is not worse; of sparse crowns, at the matched size 15 % less
/// silhouette difference from 5 % down.
fn check_cards(name: &str, is_sparse: bool, before: &[Row], cards: &[Row]) {
    for ((before, cards), level) in before.iter().zip(cards).zip(LEVELS).filter(|(_, level)| *level <= 0.15) {
        let [[before, before_matched], [cards, cards_matched]] = [before, cards];
        assert!(cards.rmse <= 1.03 * before.rmse, "{name} {level}: {cards:?} {before:?}");
        assert!(cards.xor <= 1.02 * before.xor + LITTLE_AREA, "{name} {level}: {cards:?} {before:?}");
        assert!(
            cards_matched.ssim >= before_matched.ssim - 0.01,
            "{name} {level}: {cards_matched:?} {before_matched:?}"
        );
        let most = if is_sparse && level <= 0.05 { 0.85 } else { 1.05 };
        assert!(cards_matched.xor <= most * before_matched.xor + LITTLE_AREA, "{name} {level}: {cards_matched:?}");
    }
}

#[test]
#[ignore = "takes minutes and needs FOLIAGE_TREES"]
fn tone_and_tiles_pay_where_they_are_used() {
    let trees = std::env::var("FOLIAGE_TREES").expect("FOLIAGE_TREES names the folder of the trees");
    let wanted = std::env::var("FOLIAGE_PLANTS").ok();
    let is_wanted = |name: &str| wanted.as_ref().is_none_or(|wanted| wanted.split(',').any(|wanted| wanted == name));
    let before = std::env::var_os("FOLIAGE_BEFORE").map(PathBuf::from);
    println!("plant,variant,level,triangles,px,rmse,xor,grain,ssim,flip");
    for (name, source) in PLANTS.into_iter().filter(|(name, _)| is_wanted(name)) {
        let plant = plant(source, &trees);
        let mut references = References { plant: &plant, of_side: BTreeMap::new() };
        if let Some(folder) = &before {
            let bytes = std::fs::read(folder.join(name).with_extension("vds")).unwrap();
            references.rows(name, "before", &FoliageModel::from_bytes(&bytes).unwrap());
        }
        let made = |grow_by| {
            let options = SimplifyOptions { grow_by, ..SimplifyOptions::balanced() };
            simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap()
        };
        let scaled = made(GrowBy::Scale).model;
        let Simplified { model: chosen, leaf_layers, trial, .. } = made(GrowBy::Auto);
        println!("# {name}: {} leaves, {leaf_layers:.2} layers, {:?}, {trial:?}", plant.leaves.len(), chosen.growth);
        let plain = FoliageModel { growth: Growth::default(), ..scaled.clone() };
        let plain = references.rows(name, "scale", &plain);
        let toned = references.rows(name, "scale with tone", &scaled);
        check_tone(name, &plain, &toned);
        let pictured = made(GrowBy::Picture).model;
        println!("# {name}: {} cards, {} texels", pictured.clusters.cards().len(), pictured.clusters.texels().len());
        assert!(FoliageModel { clusters: chosen.clusters.clone(), ..pictured.clone() } == chosen);
        let grown = references.rows(name, "chosen", &chosen);
        let cards = references.rows(name, "chosen with cards", &pictured);
        check_cards(name, SPARSE.contains(&name), &grown, &cards);
        if chosen.growth.tiles {
            let tiled = references.rows(name, "tiles with tone", &chosen);
            check_tiles(name, &plain, &toned, &tiled);
        } else {
            assert!(chosen == scaled, "{name}: growth by scale is the same, tried or not");
        }
    }
}
