//! Budgets that count triangles.

use foliage_lod::{
    FoliageModel, Grove, LookAt,
    bounds::Sphere,
    extract::Far,
    grow::{GrowOptions, Species, grow},
    scene::{Active, Kind, Placement, SharedBudget, budget::Rule},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    wood::WoodLevels,
};
use glam::{DAffine3, DVec3};

fn model() -> FoliageModel {
    let options = GrowOptions { leaves: Some(800), ..GrowOptions::default() };
    let plant = grow(&Species::embedded("betula-populifolia").unwrap(), &options).unwrap();
    let mut model = simplify(&plant, &SimplifyOptions::fast(), &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.order_wood();
    model
}

#[test]
fn triangles_of_leaves_wood_and_impostors_add_up_to_the_budget() {
    let models = [model()];
    let own = models[0].sphere();
    let place = |i: u32| DVec3::new(f64::from(i % 10) - 5.0, 0.0, -f64::from(i / 10)) * 2.0 * own.radius;
    let placement = |i: u32| Placement { kind: 0, world_from_plant: DAffine3::from_translation(place(i)) };
    let kind = Kind::new(&models[0]);
    let mut grove = Grove::new(vec![kind], &(0..100).map(placement).collect::<Vec<_>>()).unwrap();
    let around = Sphere { center: [0.0, 0.0, -10.0 * own.radius], radius: 8.0 * own.radius };
    let camera = LookAt::framing(&around, DVec3::new(0.0, 0.2, 1.0), 1.0, 1.0).camera(1080);
    let mut seen: Vec<Active> = Vec::new();
    let leaf = models[0].indices.len() as f64 / 3.0 / models[0].leaves.len() as f64;
    let sum = |seen: &[Active]| seen.iter().map(|active| f64::from(active.count)).sum::<f64>();

    let [fine, coarse] = [0.5, 4.0].map(|error_px| {
        let mut budget = SharedBudget::new(&models, Rule::default(), 1.0).with_triangles(&models, error_px);
        let spent = grove.select_within(&camera, &mut budget, None, &mut seen);
        assert_eq!((sum(&seen), spent.used), (0.0, spent.fixed), "wood alone is more than the budget");
        spent.fixed
    });
    let all = WoodLevels::with_ribbons(&models[0].wood, models[0].wood_order.as_ref().unwrap()).drawn.at(0.0).len();
    assert!(coarse > 0.0 && fine > 1.5 * coarse && fine < 0.5 * (all * seen.len()) as f64, "{fine} and {coarse}");

    let mut budget = SharedBudget::new(&models, Rule::default(), fine + 20_000.0).with_triangles(&models, 0.5);
    let spent = grove.select_within(&camera, &mut budget, None, &mut seen);
    assert_eq!(spent.fixed, fine);
    assert!((spent.fixed + leaf * sum(&seen) - spent.used).abs() < 1.0, "{spent:?} {}", sum(&seen));
    assert!(spent.used <= spent.asked && spent.used > spent.asked - 10.0, "{spent:?}");
    let load = budget.load(7);
    assert!((load.leaves - sum(&seen)).abs() < 1.0 && load.plants == seen.len() as f64 && load.wood_triangles == 7.0);
    assert_eq!(load.impostor_px, 0.0);

    // Impostors have two triangles and no wood.
    budget.far = Some(Far { at_px: 1024.0, ..Far::default() });
    let spent = grove.select_within(&camera, &mut budget, None, &mut seen);
    assert_eq!(spent.used, 2.0 * seen.len() as f64);
    let px = seen.len() as f64 * 1024.0 * 1024.0;
    assert!((1.0..px).contains(&budget.load(0).impostor_px), "{:?}", budget.load(0));
}
