//! What the ground hides of plants, against small steps along rays.

use super::{oracle::Random, visibility::looking};
use foliage_lod::{
    Camera,
    scene::visibility::{Crown, FRAMES, Parts, ROWS, Visibility},
    terrain::{HeightMap, Map},
};
use glam::DVec3;

/// Rolling ground, 400 m on a side, with a ridge across it 60 m before the origin.
fn ground(ridge: f64) -> HeightMap {
    const SIDE: u32 = 129;
    let of = |i: u32| {
        let [x, z] = [i % SIDE, i / SIDE].map(|at| f64::from(at) / f64::from(SIDE) * 400.0 - 200.0);
        let across = (z + 60.0) / 12.0;
        let rolling = 2.0 * (0.05 * x).sin() + 2.0 * (0.04 * z + 0.02 * x).cos();
        ((4.0 + rolling + ridge * (-across * across).exp()) / 40.0 * 65535.0) as u16
    };
    let map = Map::new([SIDE; 2], (0..SIDE * SIDE).map(of).collect()).unwrap();
    HeightMap::new(map, [-200.0; 2], [400.0; 2], [0.0, 40.0]).unwrap()
}

/// Crowns on the ground, that let all light through so that only the ground hides them.
fn crowns(ground: &HeightMap) -> Vec<Crown<'static>> {
    let mut random = Random(11);
    let mut unit = || f64::from(random.unit());
    (0..600)
        .map(|instance| {
            let [x, z] = [240.0 * unit() - 120.0, -4.0 - 180.0 * unit()];
            let half = [1.0 + 2.0 * unit(), 1.0 + 3.0 * unit()];
            let center = DVec3::new(x, ground.height([x, z]) + half[1] + unit(), z);
            Crown { instance, center, half, opacity: 0.0, parts: Parts::default() }
        })
        .collect()
}

/// Share of a crown's outline, facing the eye, that the ground does not hide.
fn along_steps(ground: &HeightMap, eye: DVec3, crown: &Crown<'_>) -> f64 {
    let to = crown.center - eye;
    let right = to.cross(DVec3::Y).normalize();
    let up = right.cross(to).normalize();
    let shows = |at: DVec3| {
        let way = at - eye;
        let steps = (way.length() / 0.25) as u32;
        (0..steps).all(|step| {
            let on_way = eye + way * (f64::from(step) / f64::from(steps));
            on_way.y > ground.height([on_way.x, on_way.z])
        })
    };
    let places = (0..256).map(|i| [i % 16, i / 16].map(|i| (f64::from(i) + 0.5) / 8.0 - 1.0));
    let inside = places.filter(|[x, y]| x * x + y * y <= 1.0);
    let (mut shown, mut all) = (0, 0);
    for [x, y] in inside {
        all += 1;
        shown += u32::from(shows(crown.center + right * (x * crown.half[0]) + up * (y * crown.half[1])));
    }
    f64::from(shown) / f64::from(all)
}

fn weights(camera: &Camera, crowns: &[Crown<'_>], ground: Option<&HeightMap>) -> Vec<f32> {
    let mut visibility = Visibility::new();
    visibility.set_ground(ground);
    visibility.update(camera, crowns.iter().copied(), None);
    crowns.iter().map(|crown| visibility.weight(crown.instance)).collect()
}

fn is_large_and_in_view(camera: &Camera, crown: &Crown<'_>) -> bool {
    let clip = camera.clip_from_world * crown.center.extend(1.0);
    let rows = crown.half[0].min(crown.half[1]) * camera.clip_from_world.row(1).truncate().length() / clip.w;
    let is_inside = clip.truncate().truncate().abs().max_element() < 0.9 * clip.w;
    clip.w > 0.0 && is_inside && rows * f64::from(ROWS) > 6.0
}

#[test]
fn plants_behind_a_hill_lose_weight_and_those_before_it_do_not() {
    let ground = ground(14.0);
    let crowns = crowns(&ground);
    let [mut hidden, mut shown] = [0; 2];
    for (x, up) in [(0.0, 1.7), (-60.0, 1.7), (30.0, 6.0), (0.0, 30.0)] {
        let eye = DVec3::new(x, ground.height([x, 0.0]) + up, 0.0);
        let camera = looking(eye, eye + DVec3::new(0.2, -0.01 * up, -1.0), 60.0);
        let weights = weights(&camera, &crowns, Some(&ground));
        for (crown, weight) in crowns.iter().zip(weights) {
            if !is_large_and_in_view(&camera, crown) {
                continue;
            }
            let exact = along_steps(&ground, eye, crown);
            // The nearest part of a crown counts, and edges of hills are two pixels wide.
            assert!(f64::from(weight) > 0.85 * exact - 0.1, "{weight}, not {exact}, from {eye} of {crown:?}");
            if exact == 0.0 {
                hidden += 1;
                assert!(weight < 0.5, "{weight} from {eye} of {crown:?}");
            } else if exact == 1.0 {
                shown += 1;
                assert!(weight > 0.9, "{weight} from {eye} of {crown:?}");
            }
        }
    }
    assert!(hidden > 50 && shown > 100, "{hidden} hidden, {shown} shown");
}

#[test]
fn level_ground_an_eye_below_the_ground_and_no_ground_hide_nothing() {
    let ground = ground(14.0);
    let crowns = crowns(&ground);
    let eye = DVec3::new(0.0, ground.height([0.0; 2]) + 1.7, 0.0);
    let camera = looking(eye, eye - DVec3::Z, 60.0);
    let bare = weights(&camera, &crowns, None);
    assert_ne!(weights(&camera, &crowns, Some(&ground)), bare);
    let below = looking(eye - 5.0 * DVec3::Y, eye - DVec3::Z, 60.0);
    assert_eq!(weights(&below, &crowns, Some(&ground)), weights(&below, &crowns, None));
    let level = HeightMap::level(3.0).unwrap();
    assert_eq!(weights(&camera, &crowns, Some(&level)), bare);
    // Ground that is nearly level, seen from any height.
    let level = self::ground(0.0);
    let map = Map::new(level.map().size(), level.map().texels().to_vec()).unwrap();
    let level = HeightMap::new(map, [-200.0; 2], [400.0; 2], [0.0, 1e-3]).unwrap();
    let crowns = self::crowns(&level);
    for height in [0.5, 1.7, 30.0, 120.0] {
        let eye = DVec3::new(0.0, height, 40.0);
        let camera = looking(eye, DVec3::new(0.0, 0.0, -60.0), 60.0);
        let [with, without] = [Some(&level), None].map(|ground| weights(&camera, &crowns, ground));
        let least = with.iter().zip(without).map(|(with, without)| with / without).fold(1.0, f32::min);
        println!("from {height} m: at least {least} of the weight");
        assert!(least > 0.9, "from {height} m: {least} of the weight");
    }
    let broken = Camera { clip_from_world: glam::DMat4::from_cols_array(&[f64::NAN; 16]), ..camera };
    assert!(weights(&broken, &crowns, Some(&ground)).iter().all(|weight| *weight == 1.0));
}

#[test]
fn what_comes_over_a_hill_shows_within_eight_frames() {
    let ground = ground(14.0);
    let crowns = crowns(&ground);
    let mut visibility = Visibility::new();
    visibility.set_ground(Some(&ground));
    let [low, high] = [1.7, 60.0].map(|up| {
        let eye = DVec3::new(0.0, ground.height([0.0; 2]) + up, 0.0);
        looking(eye, DVec3::new(0.0, 8.0, -100.0), 60.0)
    });
    visibility.update(&low, crowns.iter().copied(), Some(1.0 / 60.0));
    let is_hidden = |crown: &&Crown| visibility.weight(crown.instance) < 0.05 && is_large_and_in_view(&high, crown);
    let hidden: Vec<u32> = crowns.iter().filter(is_hidden).map(|crown| crown.instance).collect();
    assert!(hidden.len() > 5, "{}", hidden.len());
    for _ in 0..2 * FRAMES {
        visibility.update(&high, crowns.iter().copied(), Some(1.0 / 60.0));
    }
    for instance in hidden {
        let weight = visibility.weight(instance);
        assert!(weight > 0.8, "{weight} of {instance}");
    }
}

/// Time of the rays of one estimate; of several frames only one begins an estimate.
#[test]
#[ignore = "measures time"]
fn rays_cost() {
    let of = |i: u32| {
        let [x, z] = [i % 1024, i / 1024].map(f64::from);
        (9000.0 * (3.0 + (0.013 * x).sin() + (0.02 * z + 0.01 * x).sin() + 0.3 * (0.11 * x - 0.07 * z).sin())) as u16
    };
    let map = Map::new([1024; 2], (0..1024 * 1024).map(of).collect()).unwrap();
    let ground = HeightMap::new(map, [-1000.0; 2], [2000.0; 2], [0.0, 200.0]).unwrap();
    for up in [1.7, 30.0, 120.0] {
        let mut times: Vec<f64> = (0..32)
            .map(|i| {
                let at = [f64::from(i % 8) * 220.0 - 800.0, f64::from(i / 8) * 400.0 - 700.0];
                let eye = DVec3::new(at[0], ground.height(at) + up, at[1]);
                let camera = looking(eye, eye + DVec3::new(0.3, -0.003 * up, -1.0), 60.0);
                let mut visibility = Visibility::new();
                visibility.set_ground(Some(&ground));
                let started = std::time::Instant::now();
                visibility.update(&camera, std::iter::empty(), None);
                started.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_unstable_by(f64::total_cmp);
        println!("{up} m over the ground: median {:.2} ms, most {:.2} ms", times[16], times[31]);
    }
}
