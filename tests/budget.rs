//! Budgets against slow oracles: all ways to split a small budget, and a sorted list of every
//! segment of every curve for a large one.
#![cfg(feature = "scene")]

#[path = "budget/forest.rs"]
mod forest;
#[path = "budget/grove.rs"]
mod grove;
#[path = "budget/hard.rs"]
mod hard;
#[cfg(all(feature = "simplify", feature = "software"))]
#[path = "budget/hills.rs"]
mod hills;
#[path = "budget/oracle.rs"]
mod oracle;
#[path = "budget/pace.rs"]
mod pace;
#[path = "budget/steady.rs"]
mod steady;
#[cfg(feature = "simplify")]
#[path = "budget/triangles.rs"]
mod triangles;
#[cfg(all(feature = "simplify", feature = "software"))]
#[path = "budget/visibility.rs"]
mod visibility;

use foliage_lod::{
    model::ErrorCurve,
    scene::budget::{Exponent, Item, Rule, Spent, Splitter},
};
use oracle::{Random, error_px, greedy, least_error};

/// A random convex curve of up to so many leaves.
fn curve(random: &mut Random, most: u32) -> ErrorCurve {
    let leaves = 1 + random.below(u64::from(most)) as u32;
    let mut left = 100.0 * random.unit() + 0.01;
    let fall = 0.3 + 0.7 * random.unit();
    let (size_px, power) = ([16.0, 64.0][random.below(2) as usize], 1.5 + random.unit());
    let points = (0..=leaves).map(|n| {
        let error = left;
        // Some leaves take off nothing.
        left *= if random.below(4) == 0 { 1.0 } else { fall + (1.0 - fall) * random.unit() };
        (n, error)
    });
    ErrorCurve::hull(size_px, power, points)
}

fn split(splitter: &mut Splitter, items: &[Item], budget: f64) -> (Vec<f32>, Spent) {
    let mut counts = Vec::new();
    let spent = splitter.split(items, budget, &mut counts);
    (counts, spent)
}

fn cost(items: &[Item], counts: &[f32]) -> f64 {
    let of = |(item, &count): (&Item, &f32)| f64::from(item.unit_cost) * f64::from(count) + f64::from(item.fixed_cost);
    items.iter().zip(counts).map(of).sum()
}

/// A few plants of a few curves, some with floors and ceilings.
fn scene(random: &mut Random) -> (Vec<ErrorCurve>, Vec<Item>) {
    let curves: Vec<ErrorCurve> = (0..1 + random.below(3)).map(|_| curve(random, 40)).collect();
    let items = (0..1 + random.below(12)).map(|_| {
        let kind = random.below(curves.len() as u64) as usize;
        let mut item = Item::new(kind as u32, 4.0 + 200.0 * random.unit());
        if random.below(2) == 0 {
            item.floor = random.below(4) as f32;
            item.ceiling = (item.floor as u64 + random.below(40)) as f32;
        }
        item
    });
    let items = items.collect();
    (curves, items)
}

#[test]
fn no_way_to_split_a_small_budget_has_a_smaller_error() {
    let mut random = Random(1);
    for case in 0..10_000 {
        let (curves, items) = scene(&mut random);
        let most = |item: &Item| item.ceiling.min(curves[item.curve as usize].leaves() as f32);
        let all: f32 = items.iter().map(most).sum();
        let floors: f32 = items.iter().map(|item| item.floor.min(most(item))).sum();
        let budget = floors as u64 + random.below(all as u64 - floors as u64 + 4);
        let mut splitter = Splitter::sharp(&curves, Rule::LeastError(Exponent::SUM));
        let (counts, spent) = split(&mut splitter, &items, budget as f64);
        let sum = cost(&items, &counts);
        assert!(sum <= budget as f64 && (sum - spent.used).abs() < 1e-4, "case {case}: {sum} of {budget}");
        assert!(sum > (budget as f64).min(f64::from(all)) - 1e-3, "case {case}: {sum} of {budget} of {all}");
        for (item, &count) in items.iter().zip(&counts) {
            assert!((item.floor.min(most(item)) - 1e-4..=most(item)).contains(&count), "case {case}: {count} {item:?}");
        }
        let (error, least) = (error_px(&curves, &items, &counts), least_error(&curves, &items, budget as usize));
        let near = 1e-5 * (1.0 + least) + 1e-4 * curves.iter().map(|c| c.error_px(0.0)).fold(0.0, f64::max);
        assert!((error - least).abs() < near, "case {case}: {error}, not {least}, of {budget}");
    }
}

#[test]
fn powers_of_errors_are_least_and_the_worst_plant_is_as_good_as_can_be() {
    let mut random = Random(2);
    for case in 0..600 {
        let curves: Vec<ErrorCurve> = (0..2).map(|_| curve(&mut random, 12)).collect();
        let items: Vec<Item> =
            (0..3).map(|_| Item::new(random.below(2) as u32, 20.0 + 100.0 * random.unit())).collect();
        let budget = random.below(20) as f64;
        for exponent in [2.0, 3.0, 8.0, f32::INFINITY] {
            let mut splitter = Splitter::sharp(&curves, Rule::LeastError(Exponent::new(exponent)));
            let (counts, _) = split(&mut splitter, &items, budget);
            let found = oracle::norm(&curves, &items, &counts, exponent);
            let least = oracle::least_norm(&curves, &items, budget, exponent);
            // Counts of the oracle are whole quarters.
            assert!(found <= 1.004 * least + 1e-4, "case {case}, exponent {exponent}: {found}, not {least}");
        }
    }
}

#[test]
fn larger_exponents_lower_the_worst_error_and_raise_the_sum() {
    let (curves, items) = forest::woods(800, [1920, 1080]);
    let budget = 0.1 * forest::all_leaves(&curves, &items);
    let mut last = [0.0, f64::INFINITY];
    for exponent in [1.0, 1.5, 2.0, 4.0, 16.0, f32::INFINITY] {
        let mut splitter = Splitter::new(&curves, Rule::LeastError(Exponent::new(exponent)));
        let (counts, _) = split(&mut splitter, &items, budget);
        let sum = error_px(&curves, &items, &counts);
        let worst = oracle::norm(&curves, &items, &counts, f32::INFINITY);
        assert!(sum > last[0] * 0.999 && worst < last[1] * 1.001, "exponent {exponent}: {sum} {worst}, after {last:?}");
        last = [sum, worst];
    }
    assert!(Exponent::new(f32::NAN) == Exponent::default() && Exponent::new(-3.0) == Exponent::SUM);
}

#[test]
fn round_corners_cost_little() {
    let (curves, items) = forest::woods(800, [1920, 1080]);
    let dense = forest::dense_curves();
    for share in [0.5, 0.3, 0.1, 0.03, 0.01] {
        let budget = share * forest::all_leaves(&curves, &items);
        let rule = Rule::LeastError(Exponent::SUM);
        let (round, _) = split(&mut Splitter::new(&curves, rule), &items, budget);
        let (sharp, _) = split(&mut Splitter::sharp(&curves, rule), &items, budget);
        let on = |curves: &[ErrorCurve]| error_px(curves, &items, &round) / error_px(curves, &items, &sharp);
        println!("{share}: {:.4} on the curves, {:.4} on dense ones", on(&curves), on(&dense));
        assert!((1.0 - 1e-6..1.1).contains(&on(&curves)), "{share}: {}", on(&curves));
        assert!((0.5..1.03).contains(&on(&dense)), "{share}: {}", on(&dense));
    }
}

#[test]
fn a_histogram_spends_the_budget_as_well_as_a_sorted_list_of_all_segments() {
    let (curves, items) = forest::woods(60_000, [1920, 1080]);
    assert!(items.len() > 20_000, "{}", items.len());
    for share in [0.3, 0.03] {
        let budget = share * forest::all_leaves(&curves, &items);
        let mut splitter = Splitter::sharp(&curves, Rule::LeastError(Exponent::SUM));
        let (counts, spent) = split(&mut splitter, &items, budget);
        let sum = cost(&items, &counts);
        assert!(sum <= budget && sum > 0.999 * budget && (spent.used - sum).abs() < 1.0, "{sum} of {budget}");
        let (error, least) = (error_px(&curves, &items, &counts), greedy(&curves, &items, budget));
        assert!((1.0 - 1e-6..1.001).contains(&(error / least)), "{share}: {error} against {least}");
    }
}

/// With more than 10,000 plants, any 9,000 of them must get the same if they split among
/// themselves, exactly, what they were given.
#[test]
fn a_histogram_gives_each_plant_what_an_exact_split_does() {
    let (curves, items) = forest::woods(60_000, [1920, 1080]);
    for exponent in [1.0, 2.0, f32::INFINITY] {
        let mut splitter = Splitter::new(&curves, Rule::LeastError(Exponent::new(exponent)));
        let (counts, spent) = split(&mut splitter, &items, 0.05 * forest::all_leaves(&curves, &items));
        assert!(spent.used <= spent.asked && spent.used > 0.999 * spent.asked, "{spent:?}");
        let [some, given]: [Vec<usize>; 2] = [0, 1].map(|_| (0..9_000).map(|i| i * 2 + i % 2).collect());
        let part: Vec<Item> = some.iter().map(|&i| items[i]).collect();
        let given: f64 = given.iter().map(|&i| f64::from(counts[i])).sum();
        let (exact, _) = split(&mut splitter, &part, given);
        let of_part: Vec<f32> = some.iter().map(|&i| counts[i]).collect();
        let [by_histogram, exactly] = [&of_part, &exact].map(|counts| error_px(&curves, &part, counts));
        assert!((by_histogram / exactly - 1.0).abs() < 1e-3, "{exponent}: {by_histogram}, exactly {exactly}");
        let apart = of_part.iter().zip(&exact).map(|(a, b)| (a - b).abs() / (1.0 + b)).fold(0.0, f32::max);
        assert!(apart < 1e-3, "{exponent}: counts {apart} apart");
    }
}

#[test]
fn the_order_of_the_plants_changes_no_bit() {
    let mut random = Random(3);
    for plants in [900, 15_000] {
        let (curves, mut items) = forest::woods(plants * 3, [1920, 1080]);
        items.truncate(plants);
        let budget = 0.1 * forest::all_leaves(&curves, &items);
        let mut splitter = Splitter::new(&curves, Rule::default());
        let (counts, spent) = split(&mut splitter, &items, budget);
        let mut order: Vec<usize> = (0..items.len()).collect();
        (1..order.len()).rev().for_each(|i| order.swap(i, random.below(i as u64 + 1) as usize));
        let shuffled: Vec<Item> = order.iter().map(|&i| items[i]).collect();
        let (again, spent_again) = split(&mut splitter, &shuffled, budget);
        assert!(order.iter().zip(&again).all(|(&i, count)| counts[i].to_bits() == count.to_bits()));
        assert_eq!(spent, spent_again);
    }
}

#[test]
fn triangles_wood_and_impostors_are_paid_for_and_dear_leaves_are_fewer() {
    let (curves, mut items) = forest::woods(800, [1920, 1080]);
    for (i, item) in items.iter_mut().enumerate() {
        item.unit_cost = [2.0, 24.0][i % 2];
        item.fixed_cost = 300.0;
    }
    let fixed = 300.0 * items.len() as f64;
    let rule = Rule::LeastError(Exponent::SUM);
    let (counts, spent) = split(&mut Splitter::sharp(&curves, rule), &items, fixed + 1e6);
    assert!((spent.fixed - fixed).abs() < 1e-3 && cost(&items, &counts) <= fixed + 1e6);
    assert!(spent.used > fixed + 1e6 - 1.0);
    let (error, least) = (error_px(&curves, &items, &counts), greedy(&curves, &items, 1e6));
    assert!((error / least - 1.0).abs() < 1e-4, "{error} against {least}");
    let kinds = [0, 1].map(|kind| counts.iter().skip(kind).step_by(2).sum::<f32>());
    assert!(kinds[0] > 2.0 * kinds[1], "{kinds:?}");
    let (counts, spent) = split(&mut Splitter::new(&curves, rule), &items, 0.5 * fixed);
    assert!(counts.iter().all(|&count| count == 0.0) && spent.used == spent.fixed);
}
