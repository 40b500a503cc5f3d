//! Budgets of groves and of scene files.

use super::forest;
use foliage_lod::{
    Camera, FoliageModel, Grove, LookAt,
    bounds::Sphere,
    extract::{Blend, Far},
    scene::{
        Active, Amount, BudgetEntry, Kind, Placement, Portions, SceneFile, SharedBudget,
        budget::{Exponent, Rule},
    },
};
use glam::{DAffine3, DVec3};
use std::path::Path;

fn models() -> Vec<FoliageModel> {
    forest::curves().into_iter().map(|curve| FoliageModel { curve: Some(curve), ..FoliageModel::default() }).collect()
}

/// Plants of three kinds, 8 m apart, and a camera at their edge.
fn grove() -> (Grove, Camera) {
    let kind = |curve: foliage_lod::model::ErrorCurve| {
        let sphere = Sphere { center: [0.0, 5.0, 0.0], radius: 5.0 };
        let (leaves, policy) = (curve.leaves(), Box::new(Blend::default()));
        Kind { leaves, min_leaves: 300, sphere, reach: sphere, policy }
    };
    let place = |i: u32| DVec3::new(f64::from(i % 20) * 8.0 - 80.0, 0.0, -8.0 * f64::from(i / 20));
    let placement = |i: u32| Placement { kind: i % 3, world_from_plant: DAffine3::from_translation(place(i)) };
    let grove =
        Grove::new(forest::curves().into_iter().map(kind).collect(), &(0..400).map(placement).collect::<Vec<_>>());
    let look = LookAt::framing(&Sphere { center: [0.0, 5.0, -20.0], radius: 20.0 }, DVec3::Z, 1.0, 1.0);
    (grove.unwrap(), look.camera(1080))
}

fn sum(active: &[Active]) -> f64 {
    active.iter().map(|active| f64::from(active.count)).sum()
}

#[test]
fn plants_of_a_grove_share_a_budget_and_cast_the_shadows_of_their_leaves() {
    let (mut grove, camera) = grove();
    let mut budget = SharedBudget::new(&models(), Rule::default(), 200_000.0);
    let (mut seen, mut all) = (Vec::new(), Vec::new());
    grove.select(&camera, &mut seen);
    let numbers: Vec<u32> = seen.iter().map(|active| active.instance).collect();
    assert!(sum(&seen) > 250_000.0, "{}", sum(&seen));
    let spent = grove.select_within(&camera, &mut budget, None, &mut seen);
    assert!(sum(&seen) <= 200_000.0 && (sum(&seen) - spent.used).abs() < 1.0 && spent.used > 199_999.0, "{spent:?}");
    assert_eq!(seen.iter().map(|active| active.instance).collect::<Vec<_>>(), numbers);
    grove.select_all_within(&camera, &mut budget, &mut all);
    assert!(all.len() == 400 && seen.len() < 400);
    assert!(seen.iter().all(|active| all[active.instance as usize] == *active));
    // Nearest of its kind first.
    let first = seen.iter().find(|active| active.instance % 3 == 0).unwrap();
    assert!(seen.iter().filter(|active| active.instance % 3 == 0).all(|active| active.count <= 4.0 * first.count));
}

#[test]
fn plants_that_are_all_impostor_take_nothing_of_the_budget_and_keep_the_leaves_of_their_policy() {
    let (mut grove, camera) = grove();
    let mut budget = SharedBudget::new(&models(), Rule::default(), 1e5);
    budget.far = Some(Far { at_px: 150.0, ..Far::default() });
    let (mut seen, mut by_policy) = (Vec::new(), Vec::new());
    grove.select(&camera, &mut by_policy);
    let spent = grove.select_within(&camera, &mut budget, Some(0.016), &mut seen);
    let (kept, shared): (Vec<Active>, Vec<Active>) = seen.iter().partition(|active| by_policy.contains(active));
    assert!(kept.len() > 50 && shared.len() > 20, "{} of {}", kept.len(), seen.len());
    assert!(kept.iter().all(|active| active.count >= 300.0), "no plant is bare while its impostor is made");
    assert!((sum(&shared) - spent.used).abs() < 1.0 && spent.used > 99_999.0, "{spent:?}");
}

#[test]
fn scene_files_have_budgets_and_wrong_ones_are_refused() {
    let read = |budget: &str| {
        let text =
            format!("[[models]]\nname = \"oak\"\nspecies = \"english-oak\"\n[[plants]]\nmodel = \"oak\"\n{budget}");
        SceneFile::from_toml(&text, Path::new("a.toml")).map_err(|error| error.to_string())
    };
    assert_eq!(read("").unwrap().budget, None);
    let entry = |text: &str| read(text).unwrap().budget.unwrap();
    assert_eq!(entry("[budget]\nleaves = 5e5"), BudgetEntry::of(Amount::Leaves(5e5)));
    assert_eq!(entry("[budget]\ntriangles = 9"), BudgetEntry::of(Amount::Triangles(9.0)));
    assert_eq!(entry("[budget]\nms = 16.7").amount, Amount::Ms(16.7));
    assert_eq!(entry("[budget]\nleaves = 9\nexponent = 1").rule(1080.0, 1.0), Rule::LeastError(Exponent::SUM));
    for (name, rule) in [("equal", Portions::Equal), ("cook", Portions::Cook), ("gomez", Portions::Gomez)] {
        assert_eq!(entry(&format!("[budget]\nleaves = 9\nrule = {name:?}")).rule, rule);
    }
    assert!(entry("[budget]\nleaves = 9\nvisibility = true").visibility);
    for (wrong, named) in [
        ("leaves = -1", "budget.leaves is -1"),
        ("leaves = 9\nrule = \"cook\"\nvisibility = true", "only the rules error and equal"),
        ("leaves = nan", "budget.leaves is NaN"),
        ("rule = \"cook\"", "one of the keys `leaves`, `triangles` and `ms`"),
        ("leaves = 9\nms = 5", "one of the keys `leaves`, `triangles` and `ms`"),
        ("triangles = -1", "budget.triangles is -1"),
        ("ms = 0", "budget.ms is 0"),
        ("seconds = 1", "seconds"),
        ("leaves = 9\nexponent = 0.5", "budget.exponent is 0.5"),
        ("leaves = 9\nrule = \"cook\"\nexponent = 2", "only the rule error"),
        ("leaves = 9\nrule = \"best\"", "best"),
    ] {
        let message = read(&format!("[budget]\n{wrong}")).unwrap_err();
        assert!(message.contains(named) && !message.contains('\n'), "{message}");
    }
}
