//! Splitting a budget among plants, and what shows of them: `cargo bench --bench budget`.
//!
//! Ten thousand plants, exactly, and a million, by histogram, of three kinds, on one thread; the
//! plants are those of a wide wood, so there are more of them the smaller they are. After each case
//! the median is printed as a cost per plant, with how near the sum is to the budget.

mod common;

use criterion::Criterion;
use foliage_lod::{
    LookAt,
    model::ErrorCurve,
    scene::{
        budget::{Exponent, Item, Rule, Splitter},
        visibility::{Crown, Parts, Visibility},
    },
};
use glam::DVec3;
use std::{hint::black_box, time::Instant};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let many = if common::as_test() { 20_000 } else { 1_000_000 };
    for (plants, name) in [(10_000, "exact"), (many, "histogram")] {
        for (exponent, of) in [(Exponent::SUM, "sum"), (Exponent::default(), "squares")] {
            split(&mut criterion, plants, &format!("{name}, {of}"), exponent);
        }
    }
    look(&mut criterion, if common::as_test() { 2_000 } else { 100_000 });
    criterion.final_summary();
}

/// A curve of so many leaves that falls as those of trees do.
fn curve(leaves: u32) -> ErrorCurve {
    let corner = |octave: u32| {
        let count = (f64::from(leaves) * (-0.5 * f64::from(octave)).exp2()) as u32;
        (count, 700.0 * (-0.01 * f64::from(count).sqrt() * 10.0).exp() as f32)
    };
    let mut corners: Vec<(u32, f32)> = (0..24).rev().map(corner).chain([(leaves, 0.0)]).collect();
    corners.insert(0, (0, 900.0));
    corners.dedup_by_key(|corner| corner.0);
    ErrorCurve::hull(64.0, 2.6, corners)
}

fn split(criterion: &mut Criterion, plants: u32, name: &str, exponent: Exponent) {
    let curves = [20_146, 12_140, 8_059].map(curve);
    let items: Vec<Item> = (1..=plants)
        .map(|i| Item::new(i % 3, 3000.0 / (f64::from(i).sqrt() as f32 + (i.wrapping_mul(2_654_435_769) >> 30) as f32)))
        .collect();
    let budget = f64::from(plants) * 100.0;
    let mut splitter = Splitter::new(&curves, Rule::LeastError(exponent));
    let mut counts = Vec::new();
    let mut times = Vec::new();
    let mut group = criterion.benchmark_group("budget");
    group.sample_size(20);
    group.bench_function(format!("{name}, {plants} plants"), |bencher| {
        bencher.iter_custom(|iterations| {
            let first = times.len();
            times.extend((0..iterations).map(|_| {
                let started = Instant::now();
                black_box(splitter.split(black_box(&items), budget, &mut counts));
                started.elapsed()
            }));
            times[first..].iter().sum()
        });
    });
    group.finish();
    let spent = splitter.split(&items, budget, &mut counts);
    assert!(spent.used <= budget && spent.used > 0.999 * budget, "{spent:?}");
    if let Some(milliseconds) = common::median_ms(times) {
        let missing = 100.0 * (1.0 - spent.used / budget);
        let each = milliseconds * 1e6 / f64::from(plants);
        println!("{name}: {milliseconds:.2} ms, {each:.1} ns per plant in view, {missing:.4} % of the budget left");
    }
}

/// One frame of a walker's estimate of what shows of so many crowns in view, 7 m apart.
fn look(criterion: &mut Criterion, crowns: u32) {
    let side = f64::from(crowns).sqrt().ceil() as u32;
    let place =
        |i: u32| DVec3::new(7.0 * (f64::from(i % side) - 0.5 * f64::from(side)), 5.0, -7.0 * f64::from(i / side));
    let crown =
        |i: u32| Crown { instance: i, center: place(i), half: [3.0, 4.0], opacity: 0.8, parts: Parts::default() };
    let all: Vec<Crown> = (0..crowns).map(crown).collect();
    for (height, name) in [(1.7, "walker"), (120.0, "from 120 m")] {
        let eye = DVec3::new(0.0, height, 12.0);
        let camera = LookAt {
            eye,
            target: DVec3::new(0.0, 0.0, -250.0),
            up: DVec3::Y,
            fov_y_radians: 1.0,
            aspect: 16.0 / 9.0,
            near: 0.1,
        };
        let camera = camera.camera(1080);
        let mut visibility = Visibility::new();
        visibility.update(&camera, all.iter().copied(), Some(0.016));
        let mut group = criterion.benchmark_group("visibility");
        group.sample_size(20);
        group.bench_function(format!("{name}, {crowns} crowns"), |bencher| {
            bencher.iter(|| visibility.update(&camera, black_box(&all).iter().copied(), Some(0.016)));
        });
        group.finish();
        println!("{name}: {:?}", visibility.estimate());
    }
}
