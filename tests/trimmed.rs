//! Cards that are trimmed to their outlines cover what whole cards do.
//!
//! Trees made by others are drawn where `FOLIAGE_TREES` names their folder.
#![cfg(feature = "simplify")]

mod common;

use common::plants;
use foliage_lod::{
    FoliageModel, LookAt, Plant,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    model::ModelFile,
    plant::TRIM_CORNERS,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{DrawOptions, Image, draw_plant},
};
use glam::DVec3;
use std::path::PathBuf;

fn grown(species: &str, leaves: u32) -> Plant {
    grow(&Species::embedded(species).unwrap(), &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap()
}

fn trimmed(plant: &Plant, corners: u32) -> Plant {
    let mut trimmed = plant.clone();
    trimmed.trim(corners).unwrap();
    trimmed.validate().unwrap();
    trimmed
}

/// The plant in a picture of `side` pixels that shows one part in `zoom` of its height.
fn picture(plant: &Plant, side: u32, zoom: f64) -> Image {
    let mut camera = LookAt::framing(&plant.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0);
    camera.fov_y_radians /= zoom;
    draw_plant(plant, &camera.camera(side), [side; 2], &DrawOptions::default()).unwrap()
}

/// Whether the plant has outlines; they must not change a byte of its pictures.
fn check(plant: &Plant, corners: u32) -> bool {
    let trimmed = trimmed(plant, corners);
    let share = trimmed.trimmed_share();
    println!("{}, {corners} corners: {} outlines, {:.1} % left", plant.name, trimmed.outlines.len(), 100.0 * share);
    for (side, zoom) in [(32, 1.0), (160, 1.0), (256, 5.0), (256, 40.0)] {
        let same = picture(plant, side, zoom).rgba == picture(&trimmed, side, zoom).rgba;
        assert!(same, "{} at {side} pixels, {zoom} times as large", plant.name);
    }
    assert_eq!(trimmed.outlines.is_empty(), share == 1.0);
    share < 1.0
}

#[test]
fn pictures_of_the_three_species_keep_every_byte() {
    for species in ["english-oak", "carya-illinoinensis", "betula-populifolia"] {
        let plant = grown(species, 400);
        for corners in [TRIM_CORNERS - 2, TRIM_CORNERS] {
            assert!(check(&plant, corners), "{species}");
        }
    }
}

/// Trees whose cards are rectangles, trapezia in threes, and bent.
const OTHERS: [&str; 4] =
    ["eztree_oak_medium.glb", "seedthree_whiteoak_LOD1_merged.glb", "CommonTree_1.glb", "ftlab_keyaki.glb"];

/// A tree in the folder that `FOLIAGE_TREES` names.
fn other(name: &str) -> Option<Plant> {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES").map(PathBuf::from) else {
        eprintln!("skipped: FOLIAGE_TREES is not set");
        return None;
    };
    Some(load(&folder.join(name), &ImportOptions::default()).unwrap().plant)
}

#[test]
fn pictures_of_trees_made_by_others_keep_every_byte() {
    for (name, plant) in OTHERS.iter().filter_map(|name| Some((name, other(name)?))) {
        assert!(check(&plant, TRIM_CORNERS), "{name}");
    }
}

#[test]
fn leaves_without_alpha_have_no_outline_and_slanted_cards_have_one() {
    assert!(!check(&plants::quads(50, 3.0, 1), TRIM_CORNERS));
    let mut oak = grown("english-oak", 50);
    oak.vertices.iter_mut().step_by(4).for_each(|vertex| vertex.uv[0] += 0.01);
    assert!(check(&oak, TRIM_CORNERS));
}

fn model(plant: &Plant) -> FoliageModel {
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

#[test]
fn outlines_change_neither_the_order_nor_the_scales_and_are_kept_in_files() {
    let plant = grown("betula-populifolia", 300);
    let (whole, mut trimmed) = (model(&plant), model(&trimmed(&plant, TRIM_CORNERS)));
    assert_eq!(trimmed.leaves, whole.leaves);
    for _ in 0..2 {
        let bytes = trimmed.to_bytes().unwrap();
        let file = ModelFile::from_bytes(&bytes).unwrap();
        assert!(file.model == trimmed && file.skipped.is_empty() && !file.model.outlines.is_empty());
        assert!(file.parts.iter().any(|part| part.name == "outlines"));
        assert!(file.model.to_plant().trimmed_share() < 0.95);
        trimmed.quantize();
    }
    trimmed.outlines.clear();
    let mut quantized = whole;
    quantized.quantize();
    assert!(trimmed.to_bytes().unwrap() == quantized.to_bytes().unwrap());
}

#[test]
fn too_few_and_too_many_corners_are_refused() {
    for corners in [0, 3, 9, u32::MAX] {
        let refused = grown("english-oak", 20).trim(corners).unwrap_err().to_string();
        assert!(refused.contains("4 to 8"), "{refused}");
    }
}

#[cfg(feature = "render")]
mod on_the_gpu {
    use super::*;
    use common::gpu::{difference, gpu};
    use foliage_lod::{
        FoliageRenderer, Instance, Look,
        gpu::{GpuDevice, Offscreen, TARGET},
        stochastic::shuffled,
    };
    use glam::DAffine3;

    /// Draws a model on the GPU.
    struct Drawer {
        target: Offscreen,
        foliage: FoliageRenderer,
        sphere: foliage_lod::bounds::Sphere,
        active: f32,
        id: foliage_lod::draw::ModelId,
    }

    impl Drawer {
        fn new(gpu: &GpuDevice, plant: &Plant, side: u32) -> Self {
            let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
            let model = shuffled(plant, 1).unwrap();
            let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
            let target = Offscreen::new(gpu, [side; 2]).unwrap();
            Self { target, foliage, sphere: plant.sphere(), active: model.leaves.len() as f32, id }
        }

        /// A picture in which the plant is `zoom` times as large as its `side` pixels.
        fn picture(&mut self, gpu: &GpuDevice, side: u32, zoom: f64, share: f32) -> Image {
            let mut camera = LookAt::framing(&self.sphere, DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0);
            camera.fov_y_radians /= zoom;
            let instance = Instance::new(self.id, DAffine3::IDENTITY, share * self.active);
            self.foliage.prepare(gpu.device(), gpu.queue(), camera.camera(side), &[instance]).unwrap();
            self.target.picture(&self.foliage).unwrap()
        }
    }

    /// Number of pixels that differ by more than a trace.
    fn differing(a: &Image, b: &Image) -> usize {
        let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
        pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 24)).count()
    }

    /// Largest mean difference of bytes, and of the number of covered pixels as a share.
    fn differences(plant: &Plant, sides: &[u32], zooms: &[f64]) -> [f64; 2] {
        let Some(gpu) = gpu() else { return [0.0; 2] };
        let mut most = [0.0_f64; 2];
        let trimmed = trimmed(plant, TRIM_CORNERS);
        let mut is_drawn_trimmed = false;
        for &side in sides {
            let mut drawers = [plant, &trimmed].map(|plant| Drawer::new(&gpu, plant, side));
            for &zoom in zooms {
                let bare = drawers[0].picture(&gpu, side, zoom, 0.0);
                let [whole, trimmed] = drawers.each_mut().map(|drawer| drawer.picture(&gpu, side, zoom, 1.0));
                let (mean, _) = difference(&whole, &trimmed);
                let [before, after] = [&whole, &trimmed].map(|picture| differing(&bare, picture));
                let changed = differing(&whole, &trimmed);
                println!(
                    "{} {side} x {zoom}: bytes differ by {mean:.4}, {changed} pixels by much, {after} covered instead of {before}",
                    plant.name
                );
                is_drawn_trimmed |= whole != trimmed;
                let covered = after.abs_diff(before).saturating_sub(10) as f64 / before.max(1) as f64;
                most = [most[0].max(mean), most[1].max(covered)];
            }
        }
        assert!(is_drawn_trimmed, "{}", plant.name);
        most
    }

    /// Bytes differ by far less than between drawers, and nearly as many pixels are covered.
    fn check(plant: &Plant) {
        let [mean, covered] = differences(plant, &[192], &[4.0, 16.0, 64.0]);
        assert!(mean < 0.3 && covered < 0.005, "{}: {mean}, {covered}", plant.name);
    }

    #[test]
    fn the_gpu_covers_as_many_pixels_within_outlines() {
        check(&grown("english-oak", 400));
        check(&grown("betula-populifolia", 400));
        OTHERS.iter().filter_map(|name| other(name)).for_each(|plant| check(&plant));
    }

    /// The five trees by which trimming is measured, and two more.
    fn measured() -> impl Iterator<Item = Plant> {
        let grown = ["english-oak", "carya-illinoinensis", "betula-populifolia"]
            .map(|species| grow(&Species::embedded(species).unwrap(), &GrowOptions::default()).unwrap());
        grown.into_iter().chain(
            ["eztree_oak_medium.glb", "CommonTree_1.glb", "seedthree_whiteoak_LOD1_merged.glb", "ftlab_keyaki.glb"]
                .into_iter()
                .filter_map(other),
        )
    }

    /// `FOLIAGE_TREES=... cargo test --test trimmed differences -- --ignored --nocapture`
    #[test]
    #[ignore = "a measurement"]
    fn differences_by_size() {
        for plant in measured() {
            println!("{:?}", differences(&plant, &[32, 64, 128, 256, 512], &[1.0, 4.0, 16.0]));
        }
    }
}
