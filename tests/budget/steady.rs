//! Budgets from frame to frame.

use super::forest::{self, seen, trees};
use foliage_lod::scene::budget::{Exponent, Item, Rule, Splitter};
use std::collections::HashMap;

const FRAME_SECONDS: f64 = 1.0 / 60.0;
const SIZE: [u32; 2] = [1920, 1080];

#[test]
fn no_plant_changes_suddenly_on_a_walk_and_the_budget_is_kept() {
    let (curves, trees) = (forest::curves(), trees(900));
    for rule in [Rule::LeastError(Exponent::SUM), Rule::default()] {
        let mut splitter = Splitter::new(&curves, rule);
        let (mut counts, mut last, mut over) = (Vec::new(), HashMap::<usize, f32>::new(), 0.0);
        let (mut bounds, mut changes): (Vec<f64>, Vec<f32>) = (Vec::new(), Vec::new());
        let mut entered = 0;
        for frame in 0..2000 {
            // 1.5 m/s through the wood, looking about.
            let way = 1.5 * FRAME_SECONDS as f32 * frame as f32;
            let turn = 0.8 * (0.004 * frame as f32).sin();
            let (numbers, items): (Vec<usize>, Vec<Item>) =
                seen(&curves, &trees, [1.0, 5.0 - way], turn, SIZE).into_iter().unzip();
            let budget = 300_000.0;
            let spent = splitter.follow(&items, budget, FRAME_SECONDS, &mut counts);
            assert!(spent.used <= 1.05 * budget + 1.0, "frame {frame}: {spent:?}");
            over = if spent.used > budget { over + FRAME_SECONDS } else { 0.0 };
            assert!(over <= 0.5 + FRAME_SECONDS, "frame {frame}: over for {over} s");
            bounds.push(spent.mu.log2());
            let now: HashMap<usize, f32> = numbers.iter().copied().zip(counts.iter().copied()).collect();
            for (number, count) in &now {
                let leaves = curves[trees[*number].kind as usize % curves.len()].leaves() as f32;
                match last.get(number) {
                    Some(before) => changes.push(((*count - *before).abs() - 1.0) / leaves),
                    None => entered += 1,
                }
            }
            last = now;
        }
        assert!(entered > 500, "{entered}");
        let mut steps: Vec<f64> = bounds.windows(2).map(|pair| (pair[1] - pair[0]).abs().exp2() - 1.0).collect();
        steps.sort_by(f64::total_cmp);
        let p99 = steps[steps.len() * 99 / 100];
        let most = changes.iter().copied().fold(0.0, f32::max);
        println!("{rule:?}: mu changes by {:.2} % (p99), a plant by at most {:.2} %", 100.0 * p99, 100.0 * most);
        assert!(p99 <= 0.02, "mu changes by {p99}");
        assert!(most <= 0.02, "a plant changes by {most}");
    }
}

#[test]
fn after_a_step_the_budget_is_kept_within_half_a_second_and_the_bound_is_right_soon() {
    let (curves, items) = forest::woods(800, SIZE);
    let all = forest::all_leaves(&curves, &items);
    let rule = Rule::LeastError(Exponent::SUM);
    for [before, after] in [[0.4, 0.1], [0.1, 0.4], [0.1, 0.1]] {
        let mut splitter = Splitter::new(&curves, rule);
        let mut counts = Vec::new();
        let first = splitter.follow(&items, before * all, FRAME_SECONDS, &mut counts);
        let alone = Splitter::new(&curves, rule).split(&items, before * all, &mut counts);
        assert_eq!(first, alone);
        let right = Splitter::new(&curves, rule).split(&items, after * all, &mut counts);
        let mut last = first.mu;
        for frame in 1..=120 {
            let spent = splitter.follow(&items, after * all, FRAME_SECONDS, &mut counts);
            let most = if frame > 30 { 1.0 } else { 1.05 };
            assert!(spent.used <= most * after * all * (1.0 + 1e-9), "frame {frame}: {spent:?}");
            let rises = right.mu >= first.mu;
            assert!(if rises { spent.mu >= last * 0.999_999 } else { spent.mu <= last * 1.000_001 }, "frame {frame}");
            last = spent.mu;
        }
        assert!((last / right.mu - 1.0).abs() < 0.01, "{last}, not {}", right.mu);
        splitter.reset();
        assert_eq!(splitter.follow(&items, before * all, FRAME_SECONDS, &mut counts), alone);
    }
}

#[test]
fn a_cut_floors_and_odd_times_leave_the_budget_kept() {
    let (curves, items) = forest::woods(300, SIZE);
    let mut splitter = Splitter::new(&curves, Rule::default());
    let mut counts = Vec::new();
    let floored: Vec<Item> = items.iter().map(|item| Item { floor: 500.0, ..*item }).collect();
    let floors = 500.0 * floored.len() as f64;
    for seconds in [0.0, f64::NAN, -1.0, 1e-9, 0.016, 1e9, f64::INFINITY, 0.016] {
        for (items, budget) in [(&items, 1e5), (&floored, 0.5 * floors), (&floored, 2.0 * floors), (&items, 1e12)] {
            let spent = splitter.follow(items, budget, seconds, &mut counts);
            assert!(spent.used <= 1.05 * budget + 1.0 && !spent.mu.is_nan(), "{seconds}: {spent:?}");
            assert!(counts.len() == items.len() && counts.iter().all(|count| *count >= 0.0));
        }
    }
}
