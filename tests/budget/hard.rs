//! Hard cases: whatever the numbers, counts are within their bounds and the budget is kept.

use super::{cost, curve, forest, oracle::Random, split};
use foliage_lod::{
    extract::Sight,
    model::{CurveCorner, ErrorCurve},
    scene::budget::{CookShare, Exponent, GomezShare, Item, Rule, Splitter},
};

fn rules() -> [Rule; 7] {
    [
        Rule::LeastError(Exponent::SUM),
        Rule::default(),
        Rule::LeastError(Exponent::new(f32::MAX)),
        Rule::LeastError(Exponent::WORST),
        Rule::Cook(CookShare::of_height(1080.0)),
        Rule::Gomez(GomezShare::published(1080.0, 1000.0)),
        Rule::Uniform,
    ]
}

fn both(curves: &[ErrorCurve], rule: Rule) -> [Splitter; 2] {
    [Splitter::new(curves, rule), Splitter::sharp(curves, rule)]
}

/// A model of a thousand leaves.
fn thousand() -> ErrorCurve {
    ErrorCurve::hull(64.0, 2.0, [(0, 400.0), (100, 90.0), (500, 5.0), (1000, 0.0)])
}

#[test]
fn any_numbers_give_counts_within_bounds_and_within_the_budget() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, 1e-45, 1e-10, 1.0, 7.5, 1e30, f32::MAX];
    let mut random = Random(11);
    for case in 0..3000 {
        let mut pick = |usual: f32| if random.below(3) == 0 { odd[random.below(11) as usize] } else { usual };
        let curves: Vec<ErrorCurve> = (0..3)
            .map(|kind| {
                let corner = |leaves: u32| CurveCorner { leaves, error_px: pick(100.0 / (1 + leaves) as f32) };
                let corners = [0, 1, 5, 5, 3, 40 * kind].map(corner).to_vec();
                ErrorCurve { size_px: pick(64.0), size_power: pick(2.0), corners }
            })
            .collect();
        let items: Vec<Item> = (0..9)
            .map(|i| Item {
                curve: i % 4,
                diameter_px: pick(100.0),
                weight: pick(1.0),
                floor: pick(1.0),
                ceiling: pick(30.0),
                unit_cost: pick(1.0),
                fixed_cost: pick(0.0),
                distance: pick(10.0),
            })
            .collect();
        let budget = f64::from(pick(60.0));
        for rule in rules() {
            for (splitter, rounded) in both(&curves, rule).iter_mut().zip([true, false]) {
                let (counts, spent) = split(splitter, &items, budget);
                let about = format!("case {case}, {rule:?}, {rounded}: {counts:?} {spent:?}");
                for (item, &count) in items.iter().zip(&counts) {
                    let leaves = curves
                        .get(item.curve as usize)
                        .map_or(0, |curve| curve.corners.iter().map(|corner| corner.leaves).max().unwrap_or(0));
                    assert!(count >= 0.0 && count <= leaves as f32, "{about}");
                    assert!(!(item.ceiling >= 0.0 && count > item.ceiling), "{about}");
                }
                let most = if budget.is_nan() { 0.0 } else { budget.max(0.0) };
                let clamp = |cost: f32| if cost > 0.0 { f64::from(cost.min(1e9)) } else { 0.0 };
                let sum: f64 = items.iter().zip(&counts).map(|(item, &n)| clamp(item.unit_cost) * f64::from(n)).sum();
                let fixed: f64 = items.iter().map(|item| clamp(item.fixed_cost)).sum();
                assert!(sum <= (most - fixed).max(0.0) * (1.0 + 1e-12), "{about}");
                assert!(!spent.used.is_nan() && !spent.mu.is_nan() && (0.0..=1.0).contains(&spent.floors), "{about}");
            }
        }
    }
}

#[test]
fn no_budget_draws_nothing_and_more_than_there_is_draws_everything() {
    let mut random = Random(12);
    let curves: Vec<ErrorCurve> = (0..3).map(|_| curve(&mut random, 500)).collect();
    let items: Vec<Item> = (0..40).map(|i| Item::new(i % 3, 10.0 + 300.0 * random.unit())).collect();
    let all = forest::all_leaves(&curves, &items);
    for rule in rules() {
        for splitter in &mut both(&curves, rule) {
            for nothing in [0.0, -5.0, f64::NAN, f64::NEG_INFINITY] {
                let (counts, spent) = split(splitter, &items, nothing);
                assert!(counts.iter().all(|&count| count == 0.0) && spent.used == 0.0, "{rule:?} {nothing}");
            }
            for more in [all, all + 1.0, 1e12, f64::MAX, f64::INFINITY] {
                let (counts, spent) = split(splitter, &items, more);
                assert_eq!((cost(&items, &counts), spent.used, spent.mu), (all, all, 0.0), "{rule:?} {more}");
            }
            let (counts, _) = split(splitter, &[], 100.0);
            assert!(counts.is_empty());
        }
    }
}

#[test]
fn one_plant_takes_the_budget_and_a_model_of_one_leaf_takes_part_of_it() {
    let curves = [thousand(), ErrorCurve::hull(64.0, 2.0, [(0, 30.0), (1, 0.0)])];
    for rule in rules() {
        for (splitter, step) in both(&curves, rule).iter_mut().zip([0.01, 1.0]) {
            for budget in [0.5, 1.0, 99.0, 100.0, 777.25] {
                let (counts, _) = split(splitter, &[Item::new(0, 50.0)], budget);
                assert!((f64::from(counts[0]) - budget).abs() < 1e-3, "{rule:?}: {counts:?} of {budget}");
                let (counts, _) = split(splitter, &[Item::new(1, 50.0)], budget);
                assert!((f64::from(counts[0]) - budget.min(1.0)).abs() < 1e-3, "{rule:?}: {counts:?} of {budget}");
            }
            assert!(step > 0.0);
        }
    }
}

#[test]
fn plants_that_are_seen_alike_have_equal_counts_however_many() {
    for plants in [7, 9_000, 1_000_000] {
        let items = vec![Item::new(0, 40.0); plants];
        for (budget, rule) in [(0.3, Rule::LeastError(Exponent::SUM)), (33.3, Rule::default()), (650.0, Rule::Uniform)]
        {
            for splitter in &mut both(&[thousand()], rule) {
                let (counts, spent) = split(splitter, &items, budget * plants as f64);
                assert!(counts.iter().all(|&count| count == counts[0]), "{plants}");
                assert!((f64::from(counts[0]) / budget - 1.0).abs() < 1e-3, "{} of {budget}, {rule:?}", counts[0]);
                assert!(spent.used <= budget * plants as f64);
            }
        }
    }
}

#[test]
fn floors_that_do_not_fit_give_way_by_one_factor() {
    let items = [10.0, 30.0, 60.0].map(|floor| Item { floor, ..Item::new(0, 40.0) });
    for rule in rules() {
        for splitter in &mut both(&[thousand()], rule) {
            let (counts, spent) = split(splitter, &items, 50.0);
            assert!((spent.floors - 0.5).abs() < 1e-6 && spent.used <= 50.0, "{spent:?}");
            let near = |count: f32, floor: f32| (count - floor).abs() < 1e-4;
            assert!(near(counts[0], 5.0) && near(counts[1], 15.0) && near(counts[2], 30.0), "{counts:?}");
            let (counts, spent) = split(splitter, &items, 100.5);
            assert!(counts.iter().sum::<f32>() > 100.4 && spent.floors == 1.0, "{counts:?}");
        }
    }
}

#[test]
fn from_within_a_crown_at_least_half_is_drawn_and_at_any_field_of_view_the_budget_is_kept() {
    let curves = [thousand()];
    for fov_y in [1.0_f32, 60.0, 170.0].map(f32::to_radians) {
        let sight = |distance: f32| Sight { distance, radius: 5.0, fov_y, height_px: 1080.0 };
        let distances = [0.0, 3.0, f32::NAN, 20.0, 100.0, 1e4, f32::INFINITY];
        let items: Vec<Item> = distances.iter().map(|&at| Item::seen(0, &curves[0], &sight(at))).collect();
        for rule in rules() {
            for splitter in &mut both(&curves, rule) {
                let (counts, spent) = split(splitter, &items, 2500.0);
                assert!(counts[..3].iter().all(|&count| count >= 500.0), "{rule:?}: {counts:?}");
                assert!(spent.used <= 2500.0 && spent.used > 2490.0, "{rule:?}: {spent:?} {counts:?}");
                assert!(counts.windows(2).skip(3).all(|pair| pair[0] >= pair[1]), "{rule:?}: {counts:?}");
            }
        }
    }
    let size = |distance: f32| {
        let sight = Sight { distance, radius: 5.0, fov_y: 1.0, height_px: 100.0 };
        Item::seen(0, &curves[0], &sight).diameter_px
    };
    assert!(size(1.0) == 200.0 && (size(5.01) / 200.0 - 1.0).abs() < 0.01 && size(500.0) < 2.0);
}

#[test]
fn hidden_plants_have_their_floors_and_the_rest_goes_to_the_others() {
    let curves = [thousand()];
    let hidden = Item { weight: 0.0, floor: 3.0, ..Item::new(0, 80.0) };
    let rule = Rule::LeastError(Exponent::SUM);
    for plants in [10, 20_000] {
        for splitter in &mut both(&curves, rule) {
            let (counts, spent) = split(splitter, &vec![hidden; plants], 1e9);
            assert!(counts.iter().all(|&count| count == 3.0) && spent.mu == 0.0);
            let mut items = vec![hidden; plants];
            items[4].weight = 1.0;
            let (counts, _) = split(splitter, &items, 3.0 * plants as f64 + 100.0);
            assert!((counts[4] - 103.0).abs() < 0.05, "{}", counts[4]);
            items[4].weight = f32::NAN;
            let (counts, _) = split(splitter, &items, 1e9);
            assert_eq!(counts[4], 3.0);
        }
    }
}
