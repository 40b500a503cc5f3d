//! Crowns seen from within: six points in the crown, each with six square pictures, the faces of a
//! cube. No simplification uses these views.
#![cfg(all(feature = "measure", feature = "simplify"))]

use foliage_lod::{
    FoliageModel, LookAt, Plant,
    bounds::Aabb,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    measure::{Comparison, Reference, measured, pictures},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{DrawList, Image, Painter},
};
use glam::DVec3;
use std::path::Path;

/// Side of the pictures from within, and from outside.
const SIDES: [u32; 2] = [96, 128];
/// Distance of the points from the crown's centre, relative to half its size.
const OUTWARDS: f64 = 0.45;
const SHARES: [f64; 5] = [0.5, 0.3, 0.15, 0.05, 0.01];
const COSTS: [f32; 4] = [0.0, 0.002, 0.005, 0.01];
/// Most loss from outside, as a ratio of errors, with which a cost could be a preset's default.
const MOST_LOSS: f64 = 1.02;

const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

fn cameras(plant: &Plant) -> Vec<LookAt> {
    let crown = Aabb::of_points(plant.vertices.iter().map(|vertex| vertex.position));
    let (center, half_size) = (crown.center(), crown.size().as_dvec3() * 0.5);
    let faces = |point: DVec3| {
        let eye = center + point * half_size * OUTWARDS;
        let up = |face: DVec3| if face.y == 0.0 { DVec3::Y } else { DVec3::Z };
        let near = 1e-3 * plant.sphere().radius;
        let fov_y_radians = std::f64::consts::FRAC_PI_2;
        AXES.map(|face| LookAt { eye, target: eye + face, up: up(face), fov_y_radians, aspect: 1.0, near })
    };
    AXES.into_iter().flat_map(faces).collect()
}

/// Root of the mean squared difference from the full plant's pictures, from within.
struct Inside {
    cameras: Vec<LookAt>,
    full: Vec<Image>,
    crown: Aabb,
}

impl Inside {
    fn new(plant: &Plant) -> Self {
        let cameras = cameras(plant);
        let painter = Painter::new(&plant.materials, &plant.textures).unwrap();
        let list = DrawList::of_plant(plant);
        let full = pictures(&painter, &list, &cameras, SIDES[0], measured(None)).unwrap();
        Self { cameras, full, crown: list.crown }
    }

    fn rmse(&self, model: &FoliageModel, share: f64) -> f64 {
        let painter = Painter::new(&model.materials, &model.textures).unwrap();
        let list = DrawList { crown: self.crown, ..DrawList::of_model(model, count(model, share)) };
        let drawn = pictures(&painter, &list, &self.cameras, SIDES[0], measured(None)).unwrap();
        let pairs = self.full.iter().zip(&drawn).map(|(full, drawn)| Comparison::of(full, drawn).unwrap());
        pairs.fold(Comparison::default(), Comparison::plus).quality().rmse
    }
}

fn count(model: &FoliageModel, share: f64) -> usize {
    ((share * model.leaves.len() as f64).round() as usize).max(1)
}

fn outside_rmse(reference: &Reference, model: &FoliageModel, share: f64) -> f64 {
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    reference.quality(&painter, DrawList::of_model(model, count(model, share)), None).unwrap().rmse
}

fn model(plant: &Plant, options: &SimplifyOptions) -> FoliageModel {
    simplify(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn grown(species: &str, leaves: u32) -> Plant {
    let options = GrowOptions { leaves: Some(leaves), ..GrowOptions::default() };
    grow(&Species::embedded(species).unwrap(), &options).unwrap()
}

#[test]
fn a_high_intrinsic_cost_brings_an_oak_with_30_percent_of_its_leaves_closer_to_all_from_within() {
    let plant = grown("english-oak", 1500);
    let options = |intrinsic| SimplifyOptions { resolution: 64, intrinsic, ..SimplifyOptions::fast() };
    let inside = Inside::new(&plant);
    let rmse = [0.0, 0.02].map(|cost| inside.rmse(&model(&plant, &options(cost)), 0.3));
    assert!(rmse[1] < 0.95 * rmse[0], "{rmse:?}");
}

/// Three grown plants and five of `FOLIAGE_TREES`.
fn plants() -> Vec<Plant> {
    let mut plants =
        vec![grown("english-oak", 4000), grown("carya-illinoinensis", 3000), grown("betula-populifolia", 3000)];
    let folder = std::env::var_os("FOLIAGE_TREES").expect("FOLIAGE_TREES names the folder of trees");
    let names = [
        "eztree_oak_medium",
        "sapling_birch_8k_rect",
        "CommonTree_1",
        "ftlab_keyaki",
        "seedthree_whiteoak_LOD1_merged",
    ];
    plants.extend(names.map(|name| {
        let path = Path::new(&folder).join(format!("{name}.glb"));
        Plant { name: name.into(), ..load(&path, &ImportOptions::default()).unwrap().plant }
    }));
    plants
}

/// Prints RMSE from outside and from within for several intrinsic costs, relative to no cost.
#[test]
#[ignore = "takes five minutes; FOLIAGE_TREES=... cargo test --test inside -- --ignored --nocapture"]
fn intrinsic_costs_compared_from_outside_and_from_within() {
    println!("RMSE from outside | from within, with {SHARES:?} of the leaves; below, ratios to no cost");
    let mut could_be_default = COSTS.map(|_| true);
    for plant in plants() {
        let (inside, reference) = (Inside::new(&plant), Reference::new(&plant, SIDES[1]).unwrap());
        let mut free = None;
        for (cost, could_be_default) in COSTS.into_iter().zip(&mut could_be_default) {
            let model = model(&plant, &SimplifyOptions { intrinsic: cost, ..SimplifyOptions::fast() });
            let rmse = [
                SHARES.map(|share| outside_rmse(&reference, &model, share)),
                SHARES.map(|share| inside.rmse(&model, share)),
            ];
            let free = free.get_or_insert(rmse);
            let told = |place: usize| {
                let shown = |share: usize| match cost {
                    0.0 => format!("{:7.2}", rmse[place][share]),
                    _ => format!("{:7.3}", rmse[place][share] / free[place][share]),
                };
                (0..SHARES.len()).map(shown).collect::<String>()
            };
            println!("{:32} {cost:5} {} |{}", plant.name, told(0), told(1));
            *could_be_default &= (0..SHARES.len()).all(|share| rmse[0][share] <= MOST_LOSS * free[0][share]);
        }
    }
    let fit: Vec<f32> =
        COSTS.into_iter().zip(could_be_default).filter_map(|(cost, fits)| fits.then_some(cost)).collect();
    println!("costs that lose at most 2 % from outside at every level: {fit:?}");
    assert_eq!(fit, [0.0]);
}
