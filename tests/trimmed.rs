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

#[test]
fn pictures_of_trees_made_by_others_keep_every_byte() {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES").map(PathBuf::from) else {
        return eprintln!("skipped: FOLIAGE_TREES is not set");
    };
    for name in ["eztree_oak_medium.glb", "seedthree_whiteoak_LOD1_merged.glb"] {
        let plant = load(&folder.join(name), &ImportOptions::default()).unwrap().plant;
        assert!(check(&plant, TRIM_CORNERS), "{name}");
    }
}

#[test]
fn leaves_without_alpha_or_with_unlike_texture_coordinates_have_no_outline() {
    assert!(!check(&plants::quads(50, 3.0, 1), TRIM_CORNERS));
    let mut oak = grown("english-oak", 50);
    oak.vertices.iter_mut().step_by(4).for_each(|vertex| vertex.uv[0] += 0.01);
    assert!(!check(&oak, TRIM_CORNERS));
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
        gpu::{Offscreen, TARGET},
        stochastic::shuffled,
    };
    use glam::DAffine3;

    const SIDE: u32 = 192;

    /// Pictures of a model at several sizes, each without and with leaves.
    fn pictures(plant: &Plant) -> Option<Vec<[Image; 2]>> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, [SIDE; 2]).unwrap();
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
        let model = shuffled(plant, 1).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
        let pictures = [0.25, 1.0, 4.0, 16.0, 64.0].map(|zoom| {
            let mut camera = LookAt::framing(&plant.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0);
            camera.fov_y_radians /= zoom;
            [0.0, model.leaves.len() as f32].map(|active| {
                let instance = Instance::new(id, DAffine3::IDENTITY, active);
                foliage.prepare(gpu.device(), gpu.queue(), camera.camera(SIDE), &[instance]).unwrap();
                target.picture(&foliage).unwrap()
            })
        });
        Some(pictures.into())
    }

    /// Number of pixels that differ by more than a trace.
    fn differing(a: &Image, b: &Image) -> usize {
        let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
        pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 24)).count()
    }

    /// Cards seen at a slant show coarse mip levels, whose faint borders are cut off: bytes differ
    /// no more than between drawers, and as many pixels are covered within 0.5 %.
    fn check(plant: &Plant) {
        let Some((whole, trimmed)) = pictures(plant).zip(pictures(&trimmed(plant, TRIM_CORNERS))) else { return };
        let mut is_drawn_trimmed = false;
        for ([bare, whole], [_, trimmed]) in whole.iter().zip(&trimmed) {
            let (mean, _) = difference(whole, trimmed);
            let [before, after] = [whole, trimmed].map(|picture| differing(bare, picture));
            println!("{}: bytes differ by {mean:.3}, {after} pixels covered instead of {before}", plant.name);
            is_drawn_trimmed |= whole != trimmed;
            assert!(mean < 1.0, "{}: bytes differ by {mean}", plant.name);
            assert!(after.abs_diff(before) <= 20 + before / 200, "{}: {after} instead of {before}", plant.name);
        }
        assert!(is_drawn_trimmed, "{}", plant.name);
    }

    #[test]
    fn the_gpu_covers_as_many_pixels_within_outlines() {
        check(&grown("english-oak", 400));
        check(&grown("betula-populifolia", 400));
        if let Some(folder) = std::env::var_os("FOLIAGE_TREES").map(PathBuf::from) {
            for name in ["eztree_oak_medium.glb", "seedthree_whiteoak_LOD1_merged.glb"] {
                check(&load(&folder.join(name), &ImportOptions::default()).unwrap().plant);
            }
        }
    }
}
