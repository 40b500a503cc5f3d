//! Leaves for a time, on a simulated GPU.

use super::oracle::Random;
use foliage_lod::scene::budget::{Load, Pace, Times};

/// A GPU that is late with its times.
struct Gpu {
    random: Random,
    /// How much slower it is than at first.
    slower: f64,
    noise: f64,
    late: Vec<(u64, f64)>,
    frame: u64,
}

impl Gpu {
    fn new(noise: f64) -> Self {
        Self { random: Random(9), slower: 1.0, noise, late: Vec::new(), frame: 0 }
    }

    /// Time without noise.
    fn ms(&self, load: &Load) -> f64 {
        let of_parts = 0.7 + 1.6e-5 * load.leaves + 0.8e-5 * load.wood_triangles + 2e-4 * load.plants;
        self.slower * (of_parts + 1e-6 * load.impostor_px)
    }

    /// Draws a frame of so many plants and returns its time without noise; the pace is told three
    /// frames later.
    fn draw(&mut self, pace: &mut Pace, plants: f64, told: impl Fn(f64) -> Times) -> f64 {
        let leaves = pace.leaves();
        let load = Load { leaves, wood_triangles: 0.3 * leaves, impostor_px: 100.0 * plants, plants };
        let exact = self.ms(&load);
        // Twelve uniform numbers are nearly normal.
        let normal = (0..12).map(|_| f64::from(self.random.unit())).sum::<f64>() - 6.0;
        self.late.push((self.frame, exact * (1.0 + self.noise * normal).max(0.1)));
        pace.drew(self.frame, load);
        if self.late.len() > 3 {
            let (frame, ms) = self.late.remove(0);
            pace.took(frame, told(ms));
        }
        self.frame += 1;
        exact
    }
}

fn of_gpu(ms: f64) -> Times {
    Times { gpu_ms: Some(ms), ..Times::default() }
}

#[test]
fn the_time_settles_after_loads_rise_and_fall_and_does_not_swing() {
    for seed in 0..20 {
        let mut gpu = Gpu { random: Random(seed), ..Gpu::new(0.1) };
        let mut pace = Pace::new(8.0, 50_000.0);
        let times: Vec<f64> = (0..2000)
            .map(|frame| {
                gpu.slower = if (600..1300).contains(&frame) { 4.0 } else { 1.0 };
                gpu.draw(&mut pace, 1000.0, of_gpu) / 8.0
            })
            .collect();
        // Of five frames at a time.
        let settled = |from: usize| {
            let near = |at: usize| times[at..at + 5].iter().all(|ms| (ms - 1.0).abs() < 0.05);
            (from..).find(|&at| near(at)).unwrap() - from
        };
        let [start, rise, fall] = [0, 600, 1300].map(settled);
        let over = times[1300..].iter().chain(&times[660..1300]).copied().fold(0.0, f64::max);
        let within = times.iter().filter(|ms| (**ms - 1.0).abs() < 0.1).count();
        let turns = times[1500..].windows(3).filter(|of| (of[1] - of[0]) * (of[2] - of[1]) < 0.0).count();
        if seed == 0 {
            println!(
                "settled after {start}, {rise}, {fall} frames, at most {over:.3}, {turns} turns; {within} of 2000"
            );
        }
        assert!(rise <= 30 && fall <= 120, "{seed}: settled after {rise} and {fall}");
        assert!(over < 1.1 && turns < 60, "{seed}: {over}, {turns} turns");
    }
}

#[test]
fn a_rise_of_the_load_is_settled_within_thirty_frames_and_with_noise_nearly_always() {
    for (noise, most_late) in [(0.02, 0), (0.05, 0), (0.1, 2)] {
        let settled = (100..200).map(|seed| {
            let mut gpu = Gpu { random: Random(seed), ..Gpu::new(noise) };
            let mut pace = Pace::new(8.0, 50_000.0);
            let draw = |frame| {
                gpu.slower = if frame < 600 { 1.0 } else { 4.0 };
                gpu.draw(&mut pace, 1000.0, of_gpu) / 8.0
            };
            let times: Vec<f64> = (0..1300).map(draw).collect();
            times[600..].windows(5).position(|of| of.iter().all(|ms| (ms - 1.0).abs() < 0.05)).unwrap()
        });
        let mut settled: Vec<usize> = settled.collect();
        settled.sort_unstable();
        let late = settled.iter().filter(|frames| **frames > 30).count();
        println!("noise {noise}: {late} of 100 late, median {}, at most {}", settled[50], settled[99]);
        assert!(late <= most_late && settled[99] <= 80, "noise {noise}: {settled:?}");
    }
}

#[test]
fn more_plants_are_made_up_for_before_they_are_measured() {
    let mut gpu = Gpu::new(0.02);
    let mut pace = Pace::new(8.0, 50_000.0);
    // Plants come and go, so that their part is known.
    for frame in 0..600 {
        gpu.draw(&mut pace, 3000.0 + 2500.0 * f64::from((frame as f32 * 0.05).sin()), of_gpu);
    }
    let mut worst = 0.0_f64;
    for frame in 600..1200 {
        let ms = gpu.draw(&mut pace, 3000.0 + 2500.0 * f64::from((frame as f32 * 0.05).sin()), of_gpu);
        worst = worst.max((ms / 8.0 - 1.0).abs());
    }
    println!("{worst:.3} off at most");
    assert!(worst < 0.1, "{worst}");
    // After a cut, the budget is right at once.
    for _ in 0..100 {
        gpu.draw(&mut pace, 1000.0, of_gpu);
    }
    pace.cut();
    gpu.draw(&mut pace, 10_000.0, of_gpu);
    let ms = gpu.draw(&mut pace, 10_000.0, of_gpu);
    assert!((ms / 8.0 - 1.0).abs() < 0.1, "{ms}");
}

#[test]
fn odd_readings_and_frames_that_wait_for_the_cpu_change_nothing() {
    let mut gpu = Gpu::new(0.02);
    let mut pace = Pace::new(8.0, 300_000.0);
    for _ in 0..300 {
        gpu.draw(&mut pace, 500.0, of_gpu);
    }
    let settled = pace.leaves();
    for (at, odd) in [f64::NAN, f64::INFINITY, 0.0, -3.0, 1e9].into_iter().cycle().take(50).enumerate() {
        gpu.draw(&mut pace, 500.0, |ms| of_gpu(if at % 2 == 0 { odd } else { ms }));
    }
    pace.took(123_456_789, of_gpu(500.0));
    assert!((pace.leaves() / settled - 1.0).abs() < 0.06, "{} after {settled}", pace.leaves());
    // Hitches of single frames.
    for at in 0..100 {
        gpu.draw(&mut pace, 500.0, |ms| of_gpu(if at % 20 == 0 { 30.0 * ms } else { ms }));
    }
    assert!((pace.leaves() / settled - 1.0).abs() < 0.1, "{} after {settled}", pace.leaves());
    let before = pace.leaves();
    for _ in 0..200 {
        gpu.draw(&mut pace, 500.0, |_| Times { frame_ms: 25.0, gpu_ms: None, cpu_ms: Some(24.0) });
    }
    assert!((pace.leaves() / before - 1.0).abs() < 0.06, "{} after {before}", pace.leaves());
    for target in [0.0, f64::NAN, -1.0] {
        let mut pace = Pace::new(target, 1e4);
        (0..20).for_each(|_| {
            Gpu::new(0.1).draw(&mut pace, 5.0, of_gpu);
        });
        assert_eq!(pace.leaves(), 1e4);
    }
}

#[test]
fn lost_readings_and_odd_ranges_still_lead_there() {
    let mut gpu = Gpu::new(0.05);
    let mut pace = Pace::new(14.0, f64::NAN);
    pace.range = [f64::NAN; 2];
    assert_eq!(pace.leaves(), 1.0);
    pace.range = [0.0, 1e9];
    let mut last = 0.0;
    for at in 0..1500 {
        // Every fourth reading is lost.
        last = gpu.draw(&mut pace, 500.0, |ms| of_gpu(if at % 4 == 0 { f64::NAN } else { ms }));
        if at == 700 {
            // A cut to where nothing is left for leaves, and back.
            gpu.slower = 20.0;
            pace.cut();
        }
        if at == 800 {
            gpu.slower = 1.0;
        }
    }
    assert!((last / 14.0 - 1.0).abs() < 0.1, "{last}");
}

#[test]
fn a_budget_stays_in_its_range() {
    let mut gpu = Gpu::new(0.0);
    let mut pace = Pace::new(1000.0, 5000.0);
    pace.range = [1000.0, 90_000.0];
    for _ in 0..600 {
        gpu.draw(&mut pace, 10.0, of_gpu);
    }
    assert_eq!(pace.leaves(), 90_000.0);
    pace.target_ms = 0.01;
    for _ in 0..100 {
        gpu.draw(&mut pace, 10.0, of_gpu);
    }
    assert_eq!(pace.leaves(), 1000.0);
}
