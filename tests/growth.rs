//! Enlarged leaves stay within the crown's outline: the silhouette of the full plant whose gaps of
//! up to 1/32 of its diameter are closed.
#![cfg(all(feature = "measure", feature = "simplify"))]

#[path = "common/naive_raster.rs"]
#[allow(dead_code)]
mod naive_raster;

use foliage_lod::{
    Plant,
    bounds::Sphere,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    measure::{self, Comparison, Quality, measured, pictures},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{DrawList, Image, Painter},
};
use std::path::PathBuf;

const SIDE: u32 = 256;
/// Distance of the cameras, as a multiple of that at which the plant fills the picture.
const AWAY: f64 = 1.2;
/// Shares of the leaves that are drawn.
const SHARES: [f64; 2] = [0.5, 0.15];
/// Largest area beyond the outline, as a share of the silhouette: of plants with more than
/// [`FEW`] leaves, and of others.
const MOST: [f64; 2] = [0.02, 0.06];
const FEW: usize = 300;

fn covers(image: &Image) -> Vec<f64> {
    image.rgba.chunks_exact(4).map(|pixel| f64::from(pixel[3]) / 255.0).collect()
}

/// Quality with a share of the leaves from the held-out views, and the area beyond the outline.
fn measures(plant: &Plant, options: &SimplifyOptions) -> Vec<(Quality, f64)> {
    let model = simplify(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    let sphere = plant.sphere();
    let cameras = measure::cameras(&Sphere { radius: sphere.radius * AWAY, ..sphere });
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    let draw = |list: &DrawList<'_>| pictures(&painter, list, &cameras, SIDE, measured(None)).unwrap();
    let all = DrawList::of_model(&model, model.leaves.len());
    let full = draw(&all);
    let outlines: Vec<Vec<bool>> = full
        .iter()
        .map(|image| naive_raster::outline(covers(image).into_iter().map(|share| share > 0.0).collect()))
        .collect();
    let area: f64 = full.iter().flat_map(covers).sum();
    let at = |share: f64| {
        let count = (share * model.leaves.len() as f64).round().max(1.0) as usize;
        let reduced = draw(&DrawList { crown: all.crown, ..DrawList::of_model(&model, count) });
        let pairs = full.iter().zip(&reduced).map(|(full, reduced)| Comparison::of(full, reduced).unwrap());
        let beyond: f64 = reduced
            .iter()
            .zip(&outlines)
            .flat_map(|(image, outline)| covers(image).into_iter().zip(outline))
            .filter_map(|(share, inside)| (!inside).then_some(share))
            .sum();
        (pairs.fold(Comparison::default(), Comparison::plus).quality(), beyond / area)
    };
    SHARES.map(at).to_vec()
}

fn check(plant: &Plant, options: &SimplifyOptions) {
    let most = MOST[usize::from(plant.leaves.len() <= FEW)];
    for ((quality, beyond), share) in measures(plant, options).into_iter().zip(SHARES) {
        let Quality { rmse, coverage, xor, .. } = quality;
        let [outside, missing] = [xor + coverage, xor - coverage].map(|twice| 50.0 * twice);
        println!(
            "{:36} {:6} {:8} {:3.0} % beyond {:5.2} outside {outside:5.1} missing {missing:5.1} rmse {rmse:5.1}",
            plant.name,
            plant.leaves.len(),
            options.preset,
            100.0 * share,
            100.0 * beyond
        );
        assert!(beyond <= most, "{}: {beyond:.3} beyond the outline with {share} of the leaves", plant.name);
    }
}

/// The plants of a folder of trees made by others; empty, with a note printed, if it is not set.
fn trees() -> Vec<Plant> {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES").map(PathBuf::from) else {
        eprintln!("skipped: FOLIAGE_TREES is not set");
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = folder.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let is_tree = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "glb" || extension == "obj");
    let plants = paths.into_iter().filter(is_tree).filter_map(|path| load(&path, &ImportOptions::default()).ok());
    plants.map(|imported| imported.plant).filter(|plant| plant.leaves.len() > 1).collect()
}

#[test]
fn the_leaves_of_a_grown_birch_stay_within_its_outline() {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(1500), ..GrowOptions::default() }).unwrap();
    check(&plant, &SimplifyOptions::fast());
}

#[test]
fn the_leaves_of_small_trees_stay_within_their_outlines() {
    for plant in trees().iter().filter(|plant| plant.leaves.len() < 400) {
        check(plant, &SimplifyOptions::fast());
    }
}

#[test]
#[ignore = "takes fifteen minutes"]
fn the_leaves_of_all_trees_stay_within_their_outlines_with_every_preset() {
    let presets = [SimplifyOptions::fast(), SimplifyOptions::balanced(), SimplifyOptions::best()];
    trees().iter().for_each(|plant| presets.iter().for_each(|options| check(plant, options)));
}
