//! Stems of wood, and the order in which it loses detail.
#![cfg(feature = "simplify")]

use foliage_lod::{
    Camera, LookAt, Plant,
    bounds::Sphere,
    grow::{GrowOptions, Species, grow},
    leaf::Vertex,
    plant::{Wood, WoodPart},
    software::{Background, DrawOptions, draw_plant},
    wood::{Slides, WoodLevels, WoodOrder, cut, levels, nearest_stems, stems, vanishing},
};
use glam::{DVec3, Vec3};
use std::f32::consts::TAU;

fn grown(species: &str) -> Wood {
    let options = GrowOptions { leaves: Some(10), ..GrowOptions::default() };
    grow(&Species::embedded(species).unwrap(), &options).unwrap().wood
}

/// Arms of a tube that fork again and again, all in one welded piece, with shared vertices.
fn welded(wood: &mut Wood, ring: &[u32], at: Vec3, heading: Vec3, radius: f32, forks: u32) {
    let sides = ring.len() as u32;
    let (side, up) = heading.any_orthonormal_pair();
    let mut below = ring.to_vec();
    let mut middle = at;
    for segment in 0..4 {
        middle += heading * radius * 5.0;
        let ring_radius = radius * (1.0 - 0.06 * segment as f32);
        let next: Vec<u32> = (0..sides)
            .map(|i| {
                let angle = TAU * i as f32 / sides as f32;
                let out = side * angle.cos() + up * angle.sin();
                let position = (middle + out * ring_radius).to_array();
                let uv = [i as f32 / sides as f32, middle.y];
                wood.vertices.push(Vertex { position, normal: out.to_array(), uv, color: [1.0; 4] });
                wood.vertices.len() as u32 - 1
            })
            .collect();
        for i in 0..ring.len() {
            let j = (i + 1) % ring.len();
            wood.indices.extend([below[i], below[j], next[j], below[i], next[j], next[i]]);
        }
        below = next;
    }
    if forks > 0 {
        for (sign, thinner) in [(1.0, 0.75), (-1.0, 0.65)] {
            let turned = (heading + (side * 0.4 + up * 0.3) * sign).normalize();
            welded(wood, &below, middle, turned, radius * thinner, forks - 1);
        }
    }
}

#[test]
fn wood_in_one_welded_piece_is_cut_into_its_arms() {
    let mut wood = Wood::default();
    let foot: Vec<u32> = (0..8).collect();
    for i in 0..8 {
        let angle = TAU * i as f32 / 8.0;
        let out = Vec3::new(angle.cos(), 0.0, angle.sin());
        let uv = [i as f32 / 8.0, 0.0];
        wood.vertices.push(Vertex { position: (out * 0.3).to_array(), normal: out.to_array(), uv, color: [1.0; 4] });
    }
    welded(&mut wood, &foot, Vec3::ZERO, Vec3::Y, 0.3, 7);
    // 2^8 - 1 arms, of which half go on from the one below.
    let (links, of_triangle) = cut(&wood);
    assert_eq!((links.len(), levels(&links).iter().sum::<u32>(), of_triangle.len()), (128, 128, wood.triangles()));
    let order = WoodOrder::new(&wood);
    let measured = stems(&wood, &order);
    assert!(measured[0].foot.length() < 0.1 && measured[0].level == 0 && measured[0].parent.is_none());
    assert!(measured.iter().all(|stem| stem.radius[0] > 0.0 && stem.width > 0.0));
    let tips = measured.iter().map(|stem| stem.tip.to_array());
    let found = nearest_stems(&wood, &order, tips);
    let own = (0..).zip(&found).filter(|(number, found)| **found == Some(*number)).count();
    assert!(own * 10 >= 9 * found.len(), "{own} of {} tips are on their own stem", found.len());
}

#[test]
fn the_order_does_not_depend_on_threads() {
    let wood = grown("carya-illinoinensis");
    let orders = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| WoodOrder::new(&wood))
    });
    assert!(orders[0] == orders[1]);
    orders[0].validate(&wood).unwrap();
}

#[test]
fn triangles_vanish_when_two_corners_have_met_and_few_are_left_at_large_errors() {
    let wood = grown("betula-populifolia");
    let order = WoodOrder::new(&wood);
    let slides = Slides::new(&wood.vertices, &order);
    let vanish = vanishing(&wood, &order);
    let mut before = usize::MAX;
    for step in 0..16 {
        let error = 0.001 * 1.6_f32.powi(step);
        let left = vanish.iter().filter(|&&at| at > error).count();
        assert!(left <= before, "{left} after {before} at {error}");
        before = left;
        for (corners, _) in wood.indices.chunks_exact(3).zip(&vanish).filter(|(_, at)| **at <= error) {
            let [a, b, c] = [0, 1, 2].map(|i| slides.at(corners[i], error).position);
            let apart = a.distance(b).min(b.distance(c)).min(c.distance(a));
            assert!(apart < 1e-5, "the corners of a triangle are {apart} apart at {error}");
        }
    }
    let left = |error: f32| vanish.iter().filter(|&&at| at > error).count();
    assert_eq!(left(0.0), vanish.len());
    assert!(left(0.04) * 12 < vanish.len(), "{} of {}", left(0.04), vanish.len());
}

/// What wood covers at an error of half a pixel over what it does in full, with or without ribbons,
/// and the share of its triangles, in pictures of a size.
fn covered(wood: &Wood, side_px: u32, levels: impl Fn(&Wood, &WoodOrder) -> WoodLevels) -> (f64, f64) {
    let order = WoodOrder::new(wood);
    let sphere = Sphere::of_points(wood.vertices.iter().map(|vertex| vertex.position));
    let error = (sphere.radius / f64::from(side_px)) as f32;
    let level = levels(wood, &order).at(error);
    let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
    let seen = |wood: Wood, camera: &Camera| {
        let plant = Plant { wood, materials: vec![Default::default()], ..Plant::default() };
        let image = draw_plant(&plant, camera, [side_px; 2], &options).unwrap();
        image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha)).sum::<f64>()
    };
    let [mut full, mut reduced] = [0.0; 2];
    for view in 0..4 {
        let turn = f64::from(view) + 0.3;
        let direction = DVec3::new(turn.sin(), 0.2 * f64::from(view), turn.cos());
        let camera = LookAt::framing(&sphere, direction, 0.1, 1.0).camera(side_px);
        let vertices = level.clone().facing(camera.eye.as_vec3()).vertices;
        let indices: Vec<u32> = level.triangles.iter().flat_map(|(corners, _)| *corners).collect();
        let parts = vec![WoodPart { indices: [0, indices.len() as u32], material: 0 }];
        full += seen(wood.clone(), &camera);
        reduced += seen(Wood { vertices, indices, parts }, &camera);
    }
    (reduced / full, level.triangles.len() as f64 / wood.triangles() as f64)
}

#[test]
fn wood_covers_as_much_at_half_a_pixel_as_in_full() {
    for species in ["english-oak", "betula-populifolia", "carya-illinoinensis"] {
        let wood = grown(species);
        for (within, levels) in [(0.03, WoodLevels::new as fn(&_, &_) -> _), (0.02, WoodLevels::with_ribbons)] {
            let of_sizes = [256, 128, 64].map(|side| covered(&wood, side, levels));
            println!("{species}: {of_sizes:?}");
            assert!(of_sizes.iter().all(|(covered, _)| (covered - 1.0).abs() < within), "{species}: {of_sizes:?}");
            assert!(of_sizes[2].1 < 0.06, "{species}: {of_sizes:?}");
        }
    }
}

/// Soup, needles, fans and nothing at all.
#[test]
fn any_wood_has_an_order() {
    let vertex = |position| Vertex { position, normal: [0.0, 1.0, 0.0], uv: [0.0; 2], color: [1.0; 4] };
    let mut state = 7_u32;
    let mut unit = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    for (vertices, triangles, steps) in [(0, 0, 1.0), (3, 1, 8.0), (300, 200, 1e6), (60, 400, 3.0), (12, 500, 1.0)] {
        let coordinate = |unit: f32| (unit * steps).floor() / steps;
        let wood = Wood {
            vertices: (0..vertices).map(|_| vertex([0; 3].map(|_: u32| coordinate(unit())))).collect(),
            indices: (0..3 * triangles).map(|_| (unit() * vertices as f32) as u32).collect(),
            parts: vec![WoodPart { indices: [0, 3 * triangles], material: 0 }],
        };
        let order = WoodOrder::new(&wood);
        order.validate(&wood).unwrap();
        assert!(WoodOrder { swells: vec![[0; 16]; 9], ..order }.validate(&wood).is_err());
    }
}
