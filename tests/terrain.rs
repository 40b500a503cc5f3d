//! Ground with heights: its triangles, and pictures of it on both processors.
//!
//! Without an adapter the GPU tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they
//! fail.
#![cfg(feature = "render")]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    Camera, Error, FoliageRenderer, Frame, Look, LookAt,
    draw::{Ground, Lighting},
    effects::{Effects, Shadow},
    gpu::{MOTION, Offscreen, TARGET},
    material::Pixels,
    software::{Image, SoftwareRenderer},
    terrain::{ERROR_PX, GroundMesh, GroundPoint, HeightMap, MOST_TRIANGLES, Map, Terrain},
};
use glam::{DVec2, DVec3, Vec3};
use std::{collections::HashMap, sync::Arc};

const SIDE: f64 = 200.0;

/// Hills 30 high over 200 x 200.
fn hills() -> HeightMap {
    let size = 65;
    let texel = |x: u32, z: u32| {
        let [x, z] = [x, z].map(|at| f64::from(at) / f64::from(size));
        let height =
            0.5 + 0.2 * (9.0 * x).sin() * (7.0 * z).cos() + 0.15 * (23.0 * x + 3.0 * z).sin() + 0.1 * (31.0 * z).cos();
        (height.clamp(0.0, 1.0) * 65535.0) as u16
    };
    let texels = (0..size).flat_map(|z| (0..size).map(move |x| texel(x, z))).collect();
    HeightMap::new(Map::new([size; 2], texels).unwrap(), [-0.5 * SIDE; 2], [SIDE; 2], [0.0, 30.0]).unwrap()
}

/// Stripes of two colours.
fn stripes() -> Pixels {
    let texel = |i: u32| if (i / 8).is_multiple_of(2) { [90, 120, 50, 255] } else { [150, 130, 90, 255] };
    Pixels { width: 64, height: 64, rgba: (0..64 * 64).flat_map(|i| texel(i % 64)).collect() }
}

fn look_at(eye: DVec3, target: DVec3) -> LookAt {
    LookAt { eye, target, up: DVec3::Y, fov_y_radians: 0.9, aspect: 1.5, near: 0.05 }
}

fn above(x: f64, z: f64, by: f64) -> DVec3 {
    DVec3::new(x, hills().height([x, z]) + by, z)
}

fn mesh(terrain: &Terrain, camera: &Camera) -> GroundMesh {
    let mut mesh = GroundMesh::default();
    assert!(mesh.update(terrain, camera, 1000.0));
    assert!(!mesh.update(terrain, camera, 1000.0), "the same camera again");
    mesh
}

/// Height of the triangles at a place.
fn drawn_height(mesh: &GroundMesh, eye: DVec3, at: [f64; 2]) -> f64 {
    let place = DVec2::from(at);
    for triangle in mesh.points.chunks_exact(3) {
        let corners = [0, 1, 2].map(|i| Vec3::from(triangle[i].from_eye).as_dvec3() + eye);
        let [a, b, c] = corners.map(|corner| DVec2::new(corner.x, corner.z));
        let area = (b - a).perp_dot(c - a);
        let weights =
            [(b - place).perp_dot(c - place), (c - place).perp_dot(a - place), (a - place).perp_dot(b - place)];
        if area != 0.0 && weights.iter().all(|weight| weight / area >= -1e-9) {
            return (0..3).map(|i| corners[i].y * weights[i] / area).sum();
        }
    }
    panic!("no triangle at {at:?}")
}

fn places(count: u32) -> impl Iterator<Item = [f64; 2]> {
    (0..count).map(|i| [0.754_877, 0.569_840].map(|step| ((0.5 + f64::from(i) * step).fract() - 0.5) * 0.98 * SIDE))
}

#[test]
fn triangles_are_within_half_a_pixel_of_the_ground() {
    let terrain = Terrain::new(hills()).unwrap();
    let (eye, target) = (above(10.0, 30.0, 2.0), above(-20.0, -40.0, 2.0));
    // All of the grid, which differs a little from heights that are bilinear between texels.
    let finest = mesh(&terrain, &look_at(eye, target).camera(100_000_000));
    let camera = look_at(eye, target).camera(400);
    let drawn = mesh(&terrain, &camera);
    let triangles = [&drawn, &finest].map(|mesh| mesh.points.len() / 3);
    assert!(2 * triangles[0] < triangles[1], "{triangles:?}");
    // Pixels that a length of 1 covers at a distance of 1.
    let per_unit = 200.0 / 0.45_f64.tan();
    for at in places(400) {
        let height = terrain.heights().height(at);
        let distance = DVec3::new(at[0], height, at[1]).distance(eye);
        let [error, least] = [&drawn, &finest].map(|mesh| (drawn_height(mesh, eye, at) - height).abs());
        let px = (error - least) * per_unit / distance;
        assert!(px <= ERROR_PX * 1.001 + 1e-3, "{px} pixels at {at:?}");
    }
}

#[test]
fn every_edge_has_two_triangles() {
    let terrain = Terrain::new(hills()).unwrap();
    for (eye, height_px) in
        [(above(10.0, 30.0, 2.0), 300), (above(-99.0, 99.0, 0.5), 1000), (DVec3::new(9.0, 900.0, 0.0), 80)]
    {
        let mesh = mesh(&terrain, &look_at(eye, DVec3::ZERO).camera(height_px));
        let mut edges: HashMap<[[u32; 3]; 2], u32> = HashMap::new();
        for triangle in mesh.points.chunks_exact(3) {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let inside = |point: &GroundPoint| point.uv.iter().all(|at| (0.0..=1.0).contains(at));
                if inside(&triangle[a]) && inside(&triangle[b]) {
                    let mut ends = [a, b].map(|i| triangle[i].from_eye.map(f32::to_bits));
                    ends.sort_unstable();
                    *edges.entry(ends).or_default() += 1;
                }
            }
        }
        let wrong = edges.values().filter(|&&count| count != 2).count();
        assert!(wrong == 0 && edges.len() > 30, "{wrong} of {} edges", edges.len());
    }
}

#[test]
fn nothing_pops_on_the_way() {
    let terrain = Terrain::new(hills()).unwrap();
    let per_unit = 200.0 / 0.45_f64.tan();
    let mut before: Option<Vec<f64>> = None;
    let (mut greatest, mut moved) = (0.0_f64, 0.0_f64);
    for step in 0..120 {
        let eye = DVec3::new(-30.0 + 0.02 * f64::from(step), 40.0, 20.0);
        let mesh = mesh(&terrain, &look_at(eye, DVec3::ZERO).camera(400));
        let heights: Vec<f64> = places(60).map(|at| drawn_height(&mesh, eye, at)).collect();
        for ((at, now), then) in places(60).zip(&heights).zip(before.iter().flatten()) {
            let change = (now - then).abs() * per_unit / DVec3::new(at[0], *now, at[1]).distance(eye);
            greatest = greatest.max(change);
            moved += change;
        }
        before = Some(heights);
    }
    assert!(greatest < 0.02 && moved > 0.0, "{greatest} pixels from one frame to the next, {moved} in all");
}

#[test]
fn too_much_ground_becomes_coarser_and_any_map_and_eye_will_do() {
    let noise = (0..1024 * 1024_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
    let noise = HeightMap::new(Map::new([1024; 2], noise).unwrap(), [0.0; 2], [500.0; 2], [0.0, 50.0]).unwrap();
    let noisy = Terrain::new(noise).unwrap();
    let camera = look_at(DVec3::new(250.0, 60.0, 250.0), DVec3::ZERO).camera(2000);
    let drawn = mesh(&noisy, &camera);
    assert!(drawn.coarser > 0 && drawn.points.len() / 3 <= MOST_TRIANGLES + 100_000, "{}", drawn.coarser);
    for (size, texel) in [([1, 1], 0), ([1, 1], 65535), ([3, 1], 9), ([1, 700], 65535)] {
        let map = Map::new(size, vec![texel; (size[0] * size[1]) as usize]).unwrap();
        let heights = HeightMap::new(map, [-5.0, 1e6], [10.0, 3e4], [-1.0, 1.0]).unwrap();
        for eye in [DVec3::ZERO, DVec3::new(1e7, 5.0, -1e7), DVec3::new(0.0, 1.0, 1e6)] {
            let drawn = mesh(&Terrain::new(heights.clone()).unwrap(), &look_at(eye, eye + DVec3::X).camera(300));
            assert!(drawn.points.iter().all(|point| Vec3::from(point.from_eye).is_finite()));
            assert!((6..200).contains(&drawn.points.len()), "{}", drawn.points.len());
        }
    }
    let large = HeightMap::new(Map::new([5000, 1], vec![0; 5000]).unwrap(), [0.0; 2], [1.0; 2], [0.0; 2]).unwrap();
    assert!(matches!(Terrain::new(large), Err(Error::TooLarge { value: 5000, .. })));
    let none = Pixels { width: 0, height: 3, rgba: Vec::new() };
    assert!(Terrain::new(hills()).unwrap().with_colors(none).is_err());
}

#[test]
fn a_mesh_allocates_nothing_once_it_has_grown() {
    let terrain = Terrain::new(hills()).unwrap();
    let mut mesh = GroundMesh::default();
    let eyes: Vec<DVec3> = (0..20).map(|i| above(f64::from(i) * 9.0 - 90.0, 20.0, 2.0)).collect();
    let made = |mesh: &mut GroundMesh| {
        for &eye in &eyes {
            mesh.update(&terrain, &look_at(eye, DVec3::ZERO).camera(400), 1000.0);
        }
        mesh.points.capacity()
    };
    assert_eq!(made(&mut mesh), made(&mut mesh));
}

fn look(sun: Vec3, effects: Effects) -> Look {
    let ground = Ground { color: [0.1, 0.15, 0.05], height: 0.0, haze: 2000.0 };
    let lighting = Lighting { towards_sun: sun.normalize(), ..Lighting::default() };
    Look { ground: Some(ground), lighting, effects, ..Look::default() }
}

fn colored() -> Arc<Terrain> {
    Arc::new(Terrain::new(hills()).unwrap().with_colors(stripes()).unwrap())
}

fn on_cpu(look: Look, terrain: &Arc<Terrain>, frame: Frame, size: [u32; 2]) -> Image {
    let mut foliage = SoftwareRenderer::new(look).unwrap();
    foliage.set_terrain(Some(terrain.clone())).unwrap();
    let drawing = foliage.draw(frame, &[], size).unwrap();
    assert!(drawing.prepared.ground.triangles > 0 && drawing.prepared.ground.coarser == 0);
    drawing.image
}

/// A GPU renderer with a terrain, prepared for a frame.
fn prepared(
    look: Look,
    terrain: &Arc<Terrain>,
    frame: Frame,
) -> Option<(foliage_lod::gpu::GpuDevice, FoliageRenderer)> {
    let gpu = gpu()?;
    let foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
    let mut foliage = foliage.with_motion(gpu.device(), MOTION);
    foliage.set_terrain(gpu.device(), gpu.queue(), Some(terrain.clone())).unwrap();
    foliage.prepare(gpu.device(), gpu.queue(), frame, &[]).unwrap();
    Some((gpu, foliage))
}

#[test]
fn both_processors_draw_the_same_ground() {
    let size = [300, 200];
    let views = [
        (above(10.0, 30.0, 2.0), above(-20.0, -40.0, 2.0)),
        (DVec3::new(-140.0, 60.0, 130.0), DVec3::ZERO),
        (DVec3::new(1.0, 300.0, 0.0), DVec3::ZERO),
    ];
    let plain = Arc::new(Terrain::new(hills()).unwrap());
    for (eye, target) in views {
        for terrain in [&colored(), &plain] {
            let frame = Frame::new(&look_at(eye, target).camera(size[1]));
            let look = look(Vec3::new(0.6, 0.3, 0.2), Effects::default());
            let Some((gpu, foliage)) = prepared(look, terrain, frame) else { return };
            let there = Offscreen::new(&gpu, size).unwrap().picture(&foliage).unwrap();
            let here = on_cpu(look, terrain, frame, size);
            let (mean, most) = difference(&there, &here);
            assert!(mean < 0.5 && most <= 4, "{mean} {most} at {eye}");
        }
    }
}

/// Where a ray from the eye meets the hills, by small steps.
fn met(heights: &HeightMap, eye: DVec3, ray: DVec3, length: f64) -> Option<DVec3> {
    let ray = ray.normalize();
    let below = |t: f64| (eye + ray * t).y < heights.height([(eye + ray * t).x, (eye + ray * t).z]);
    let step = 0.05;
    let at = (1..(length / step) as u32).map(|i| f64::from(i) * step).find(|&t| below(t))?;
    let (mut low, mut high) = (at - step, at);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        *if below(middle) { &mut high } else { &mut low } = middle;
    }
    Some(eye + ray * high)
}

#[test]
fn hills_cast_shadows_on_hills() {
    let (heights, size) = (hills(), [200, 140]);
    let terrain = Arc::new(Terrain::new(heights.clone()).unwrap());
    let sun = Vec3::new(1.0, 0.25, 0.1);
    let (eye, target) = (DVec3::new(-60.0, 60.0, 70.0), DVec3::new(0.0, 10.0, 0.0));
    let frame = Frame::new(&look_at(eye, target).camera(size[1]));
    let shadow = Shadow { distance: 250.0, resolution: 2048, ..Shadow::default() };
    let shadows = Effects { shadow: Some(shadow), ..Effects::default() };
    let pictures = [Effects::default(), shadows].map(|effects| {
        let (gpu, foliage) = prepared(look(sun, effects), &terrain, frame)?;
        Some(Offscreen::new(&gpu, size).unwrap().picture(&foliage).unwrap())
    });
    let [Some(lit), Some(shadowed)] = pictures else { return };
    let world_from_clip = frame.camera.clip_from_world.inverse();
    let (mut counts, mut wrong) = ([0; 2], 0);
    for y in (3..size[1]).step_by(7) {
        for x in (3..size[0]).step_by(7) {
            let at = DVec2::new((f64::from(x) + 0.5) / 200.0 * 2.0 - 1.0, 1.0 - (f64::from(y) + 0.5) / 140.0 * 2.0);
            let through = world_from_clip.project_point3(at.extend(0.5)) - eye;
            let Some(point) = met(&heights, eye, through, 400.0).filter(|point| point.abs().max_element() < 95.0)
            else {
                continue;
            };
            let from = point + DVec3::Y * 0.05;
            let towards = sun.as_dvec3();
            let [along, across] = heights.gradient([point.x, point.z]);
            let faces = DVec3::new(-along, 1.0, -across).normalize().dot(towards.normalize());
            // Where the sun hardly reaches the slope, there is little shadow to see.
            if faces < 0.1 {
                continue;
            }
            let is_dark = met(&heights, from, towards, 250.0).is_some();
            let i = 4 * (y * size[0] + x) as usize;
            let is_darker = lit.rgba[i + 1] as i32 - shadowed.rgba[i + 1] as i32 > 6;
            counts[usize::from(is_dark)] += 1;
            wrong += u32::from(is_dark != is_darker);
        }
    }
    assert!(
        counts.iter().all(|&count| count > 30) && f64::from(wrong) < 0.06 * f64::from(counts[0] + counts[1]),
        "{wrong} of {counts:?}"
    );
}

#[test]
fn ground_moves_as_the_camera_does() {
    let (heights, size) = (hills(), [120, 80]);
    let terrain = Arc::new(Terrain::new(heights.clone()).unwrap());
    let [before, now] = [0.0, 1.5].map(|by| {
        let eye = DVec3::new(-60.0 + by, 50.0, 70.0);
        look_at(eye, DVec3::new(by, 10.0, 0.0)).camera(size[1])
    });
    let frame = Frame::new(&now).after(&Frame::new(&before));
    let Some((gpu, foliage)) = prepared(look(Vec3::Y, Effects::default()), &terrain, frame) else { return };
    let motion = Offscreen::new(&gpu, size).unwrap().motion(&foliage).unwrap();
    let world_from_clip = now.clip_from_world.inverse();
    let (mut seen, mut close) = (0, 0);
    for y in (2..size[1]).step_by(5) {
        for x in (2..size[0]).step_by(5) {
            let at = DVec2::new((f64::from(x) + 0.5) / 120.0 * 2.0 - 1.0, 1.0 - (f64::from(y) + 0.5) / 80.0 * 2.0);
            let through = world_from_clip.project_point3(at.extend(0.5)) - now.eye;
            let Some(point) = met(&heights, now.eye, through, 400.0).filter(|point| point.abs().max_element() < 95.0)
            else {
                continue;
            };
            let then = before.clip_from_world.project_point3(point);
            let expected = (at - DVec2::new(then.x, then.y)) * DVec2::new(0.5, -0.5);
            let found = motion[(y * size[0] + x) as usize];
            seen += 1;
            close += u32::from(expected.distance(DVec2::new(f64::from(found[0]), f64::from(found[1]))) < 0.002);
        }
    }
    assert!(seen > 150 && f64::from(close) > 0.97 * f64::from(seen), "{close} of {seen}");
}

#[test]
fn a_look_without_a_ground_draws_no_terrain() {
    let error = SoftwareRenderer::new(Look::default()).unwrap().set_terrain(Some(colored())).unwrap_err();
    assert!(error.to_string().contains("terrain"), "{error}");
    let Some(gpu) = gpu() else { return };
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
    assert!(foliage.set_terrain(gpu.device(), gpu.queue(), Some(colored())).is_err());
    assert!(foliage.set_terrain(gpu.device(), gpu.queue(), None).is_ok());
}
