//! Impostors: what is baked, what is drawn of it on both processors, and the hand-over to them.
//!
//! Without an adapter the GPU tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they
//! fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    Camera, Error, FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt,
    draw::{FarCounts, Ground, Lighting},
    effects::{Effects, Shadow, Wind},
    extract::Far,
    gpu::{MOTION, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    model::ModelFile,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{BakeOptions, Image, SoftwareRenderer, bake},
};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use std::sync::LazyLock;

const OPTIONS: BakeOptions = BakeOptions { across: 8, frame_px: 32, is_whole_sphere: false };
/// Every size is far.
const FAR: Far = Far { at_px: 1024.0, band: [0.8, 1.25] };

/// A birch of 600 leaves with an impostor.
static BIRCH: LazyLock<FoliageModel> = LazyLock::new(|| {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(600), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() };
    let mut model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.impostor = Some(bake(&model, &OPTIONS, &mut |_| true).unwrap());
    model
});

fn look(far: Option<Far>, effects: Effects) -> Look {
    Look { far, effects, ..Look::default() }
}

/// A camera that shows the plant with so many pixels across.
fn camera(direction: DVec3, side: u32) -> Camera {
    look_at(direction).camera(side)
}

fn look_at(direction: DVec3) -> LookAt {
    LookAt::framing(&BIRCH.sphere(), direction, 0.3, 1.0)
}

fn directions() -> impl Iterator<Item = DVec3> {
    (0..6).map(|i| {
        let turn = 0.3 + f64::from(i) * 1.047;
        DVec3::new(turn.sin(), 0.1 + 0.1 * f64::from(i), turn.cos())
    })
}

/// Cut-outs on the CPU.
fn cutouts(look: Look, frames: impl Iterator<Item = Frame>, side: u32) -> Vec<Image> {
    cutouts_of(look, frames.map(|frame| (0, frame)), side)
}

/// Cut-outs of plants with these seeds.
fn cutouts_of(look: Look, frames: impl Iterator<Item = (u32, Frame)>, side: u32) -> Vec<Image> {
    let mut renderer = SoftwareRenderer::new(look).unwrap();
    let id = renderer.add_model(&BIRCH).unwrap();
    let plant = |seed| Instance { seed, ..Instance::new(id, DAffine3::IDENTITY, 600.0) };
    frames.map(|(seed, frame)| renderer.cutout(frame, &[plant(seed)], [side; 2]).unwrap().image).collect()
}

fn covered(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum()
}

/// Mean luminance of what is covered, with a gamma of 2.2.
fn brightness(image: &Image) -> f64 {
    light(image) / covered(image)
}

/// Sum of green light, weighted by coverage.
fn light(image: &Image) -> f64 {
    let linear = |byte: u8| (f64::from(byte) / 255.0).powf(2.2);
    image.rgba.chunks_exact(4).map(|pixel| linear(pixel[1]) * f64::from(pixel[3]) / 255.0).sum()
}

#[test]
fn the_same_model_gives_the_same_bytes_on_any_number_of_threads_and_the_file_keeps_them() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let options = BakeOptions { across: 3, frame_px: 16, is_whole_sphere: true };
    let baked = [1, 3].map(|threads| pool(threads).install(|| bake(&BIRCH, &options, &mut |_| true).unwrap()));
    assert!(baked[0] == baked[1]);
    let file = ModelFile::from_bytes(&BIRCH.to_bytes().unwrap()).unwrap();
    assert!(file.model.impostor == BIRCH.impostor && file.skipped.is_empty());
    let plain = FoliageModel { impostor: None, ..BIRCH.clone() };
    let own = file.parts.iter().find(|part| part.name == "impostor").unwrap().bytes;
    let spare = 28; // The section's entry in the table.
    assert_eq!(plain.to_bytes().unwrap().len() as u64 + own + spare, BIRCH.to_bytes().unwrap().len() as u64);
}

#[test]
fn options_out_of_range_and_a_wish_to_stop_are_errors() {
    for options in [
        BakeOptions { across: 1, ..OPTIONS },
        BakeOptions { across: 2, is_whole_sphere: true, ..OPTIONS },
        BakeOptions { across: 17, ..OPTIONS },
        BakeOptions { frame_px: 30, ..OPTIONS },
        BakeOptions { frame_px: 260, ..OPTIONS },
    ] {
        assert!(matches!(bake(&BIRCH, &options, &mut |_| true), Err(Error::InvalidOption { .. })), "{options:?}");
    }
    let mut told = Vec::new();
    let stopped = bake(&BIRCH, &OPTIONS, &mut |done| {
        told.push(done);
        done < 16
    });
    assert!(matches!(stopped, Err(Error::Interrupted)));
    assert!(told.windows(2).all(|pair| pair[0] < pair[1]) && told.len() == 3, "{told:?}");
}

#[test]
fn a_sprite_covers_and_shines_as_the_plant_does() {
    for side in [24, 48] {
        let frames = || directions().map(|direction| Frame::from(camera(direction, side)));
        let [far, near] = [Some(FAR), None].map(|far| cutouts(look(far, Effects::default()), frames(), side));
        let sums = |of: fn(&Image) -> f64| [&far, &near].map(|images| images.iter().map(of).sum::<f64>());
        let [[a, b], [c, d]] = [sums(covered), sums(brightness)];
        // Frames of 32 pixels are half as fine as the default.
        assert!((a / b - 1.0).abs() < 0.03, "{side} px: covers {a:.1} instead of {b:.1}");
        assert!((c / d - 1.0).abs() < 0.05, "{side} px: shines {c:.2} instead of {d:.2}");
    }
}

#[test]
fn a_sprite_is_lit_as_the_plant_from_any_side() {
    let frame = || std::iter::once(Frame::from(camera(DVec3::new(0.2, 0.3, 1.0), 64)));
    for towards_sun in [Vec3::new(0.3, 0.5, 1.0), Vec3::new(-0.3, 0.5, -1.0), Vec3::new(1.0, 0.2, 0.0)] {
        let lighting = Lighting { towards_sun, ..Lighting::default() };
        let [far, near] = [Some(FAR), None].map(|far| {
            let look = Look { lighting, ..look(far, Effects::default()) };
            brightness(&cutouts(look, frame(), 64)[0])
        });
        assert!((far / near - 1.0).abs() < 0.05, "sun at {towards_sun}: {far:.2} instead of {near:.2}");
    }
}

#[test]
fn coverage_stays_through_the_band() {
    let side = 40;
    let frame = || std::iter::once(Frame::from(camera(DVec3::new(0.4, 0.2, 1.0), side)));
    let covers = |far| covered(&cutouts(look(far, Effects::default()), frame(), side)[0]);
    let whole = covers(None);
    // The band moves over the plant's own diameter.
    for step in 0..=10 {
        let at_px = f64::from(side) * 0.7 * 2_f64.powf(f64::from(step) * 0.1);
        let both = covers(Some(Far { at_px: at_px as f32, ..FAR }));
        assert!((both / whole - 1.0).abs() < 0.05, "at {at_px:.1} px: {both:.1} instead of {whole:.1}");
    }
}

#[test]
fn small_plants_fade_by_coverage() {
    let shown = |diameter: f64| {
        let sphere = BIRCH.sphere();
        let look_at = LookAt::framing(&sphere, DVec3::new(0.3, 0.2, 1.0), 0.3, 32.0 / diameter);
        // Samples are right on average over plants.
        let seeds = (0..64).map(|seed| (seed, Frame::from(look_at.camera(32))));
        cutouts_of(look(Some(FAR), Effects::default()), seeds, 32).iter().map(covered).sum::<f64>() / 64.0
    };
    let whole = shown(16.0) / 256.0;
    for diameter in [0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0] {
        let share = shown(diameter) / (diameter * diameter) / whole;
        assert!((0.7..1.5).contains(&share), "{diameter} px: {share}");
    }
}

/// Means of squares of 4 x 4 pixels: what is left once the samples of a pixel are averaged out.
fn squares(image: &Image) -> Vec<f64> {
    let [width, height] = [image.width, image.height].map(|side| side as usize);
    let mut sums = vec![0.0; width / 4 * (height / 4) * 4];
    for (at, &byte) in image.rgba.iter().enumerate() {
        let (pixel, channel) = (at / 4, at % 4);
        let square = pixel / width / 4 * (width / 4) + pixel % width / 4;
        sums[4 * square + channel] += f64::from(byte) / 16.0;
    }
    sums
}

#[test]
fn both_processors_show_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    let side = 64;
    for effects in [Effects::default(), Effects { wind: Some(Wind::default()), ..Effects::default() }] {
        let target = Offscreen::new(&gpu, [side; 2]).unwrap();
        let look = look(Some(FAR), effects);
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), &BIRCH).unwrap();
        let mut software = SoftwareRenderer::new(look).unwrap();
        let own = software.add_model(&BIRCH).unwrap();
        for distance in [0.9, 2.0, 5.0] {
            for direction in directions() {
                let camera = LookAt::framing(&BIRCH.sphere(), direction, 0.3, distance).camera(side);
                let frame = Frame::from(camera).at(3.7);
                let plant = Instance::new(id, DAffine3::IDENTITY, 600.0);
                foliage.prepare(gpu.device(), gpu.queue(), frame, &[plant]).unwrap();
                let on_gpu = target.picture(&foliage).unwrap();
                let on_cpu = software.draw(frame, &[Instance { model: own, ..plant }], [side; 2]).unwrap().image;
                let differences = squares(&on_gpu).into_iter().zip(squares(&on_cpu)).map(|(a, b)| (a - b).abs());
                let differences: Vec<f64> = differences.collect();
                let mean = differences.iter().sum::<f64>() / differences.len() as f64;
                let largest = differences.into_iter().fold(0.0, f64::max);
                assert!(
                    mean < 1.5 && largest < 40.0,
                    "{direction} at {distance}: mean {mean:.2}, largest {largest:.1}"
                );
            }
        }
    }
}

#[test]
fn nothing_exists_that_is_not_called_for_and_each_plant_is_counted_once() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    let plants = |id| {
        [3.0, 40.0, 41.0, 400.0, 401.0, 402.0].map(|away| {
            let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, -away * BIRCH.sphere().radius));
            Instance::new(id, place, 100.0)
        })
    };
    let camera = camera(DVec3::Z, 512);
    let plain = FoliageModel { impostor: None, ..BIRCH.clone() };
    for (model, far) in [(&*BIRCH, None), (&plain, Some(Far::default()))] {
        let mut foliage = FoliageRenderer::new(device, TARGET, look(far, Effects::default())).unwrap();
        let id = foliage.add_model(device, queue, model).unwrap();
        let prepared = foliage.prepare(device, queue, camera, &plants(id)).unwrap();
        assert_eq!(prepared.far, FarCounts { leaves: 6, ..FarCounts::default() });
        let about = foliage.diagnostics();
        assert_eq!((about.impostor_bytes, about.impostor_pipelines), (0, 0));
    }
    let diameter = 512.0 / 0.15_f64.tan() / (40.5 + 1.0 / 0.15_f64.sin());
    let far = Far { at_px: diameter as f32, ..Far::default() };
    let mut foliage = FoliageRenderer::new(device, TARGET, look(Some(far), Effects::default())).unwrap();
    let id = foliage.add_model(device, queue, &BIRCH).unwrap();
    let bytes = foliage.diagnostics().impostor_bytes;
    assert_eq!(bytes, BIRCH.impostor.as_ref().unwrap().gpu_bytes());
    let near = foliage.prepare(device, queue, camera, &plants(id)[..1]).unwrap();
    assert_eq!((near.far.leaves, foliage.diagnostics().impostor_pipelines), (1, 0));
    let all = foliage.prepare(device, queue, camera, &plants(id)).unwrap();
    assert_eq!(all.far.leaves + all.far.both + all.far.impostors, 6);
    assert_eq!((all.far.leaves, all.far.both, all.far.impostors), (1, 2, 3));
    let only = foliage.prepare(device, queue, camera, &plants(id)[3..]).unwrap();
    assert_eq!((only.far.impostors, only.draws, only.leaves, only.wood_triangles), (3, 1, 0, 0));
    let beside = [Instance { far: Some(1.0), ..Instance::new(id, DAffine3::IDENTITY, 100.0) }];
    let inside = LookAt { eye: BIRCH.sphere().center() + DVec3::Z * BIRCH.sphere().radius, ..look_at(DVec3::Z) };
    let near = foliage.prepare(device, queue, inside.camera(64), &beside).unwrap();
    assert_eq!(near.far.leaves, 1, "no sprite stands for a plant that the eye is in");
    let never = plants(id).map(|plant| Instance { far: None, ..plant });
    assert_eq!(foliage.prepare(device, queue, camera, &never).unwrap().far.leaves, 6);
    let always = plants(id).map(|plant| Instance { far: Some(1.0), ..plant });
    assert_eq!(foliage.prepare(device, queue, camera, &always).unwrap().far.impostors, 6);
}

#[test]
fn the_shadow_of_a_sprite_is_as_large_as_that_of_the_leaves() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    let sphere = BIRCH.sphere();
    let down = sphere.center() - DVec3::Y * sphere.radius * 1.1;
    let eye = sphere.center() + DVec3::new(0.0, 6.0, 3.0) * sphere.radius;
    let camera = LookAt { eye, target: down, up: DVec3::Y, fov_y_radians: 0.7, aspect: 1.0, near: 0.1 }.camera(128);
    let darkness = |far, casts: bool| {
        let shadow = Shadow { distance: (20.0 * sphere.radius) as f32, lod: 1.0, ..Shadow::default() };
        let effects = Effects { shadow: Some(shadow), ..Effects::default() };
        let ground = Some(Ground { color: [0.3; 3], height: down.y, haze: 1e6 });
        let lighting = Lighting { towards_sun: Vec3::new(0.4, 0.9, 0.3), ..Lighting::default() };
        let look = Look { ground, lighting, ..look(far, effects) };
        let mut foliage = FoliageRenderer::new(device, TARGET, look).unwrap();
        let id = foliage.add_model(device, queue, &BIRCH).unwrap();
        let plant = [Instance::new(id, DAffine3::IDENTITY, 600.0)];
        let casters = if casts { &plant[..] } else { &[] };
        foliage.prepare_with_casters(device, queue, camera, &[], casters).unwrap();
        let image = Offscreen::new(&gpu, [128; 2]).unwrap().picture(&foliage).unwrap();
        -light(&image)
    };
    let open = darkness(None, false);
    let [far, near] = [Some(FAR), None].map(|far| darkness(far, true) - open);
    assert!(near > 100.0 && (far / near - 1.0).abs() < 0.05, "{far:.1} instead of {near:.1}");
}

/// Middle of what a cut-out covers, in pixels.
fn middle(image: &Image) -> DVec2 {
    let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
    for (at, pixel) in (0..).zip(image.rgba.chunks_exact(4)) {
        let alpha = f64::from(pixel[3]);
        sum += DVec2::new(f64::from(at % image.width), f64::from(at / image.width)) * alpha;
        weight += alpha;
    }
    sum / weight
}

#[test]
fn a_sprite_sways_as_the_leaves_do() {
    let wind = Wind { strength: 0.1, direction: 0.0, ..Wind::default() };
    let effects = Effects { wind: Some(wind), ..Effects::default() };
    let frames = || (0..6).map(|i| Frame::from(camera(DVec3::Z, 96)).at(1.3 * f64::from(i)));
    let [far, near] = [Some(FAR), None].map(|far| cutouts(look(far, effects), frames(), 96));
    let still = cutouts(look(None, Effects::default()), frames().take(1), 96);
    for (far, near) in far.iter().zip(&near) {
        let [far, near] = [far, near].map(|image| middle(image) - middle(&still[0]));
        assert!(near.length() > 1.0, "the wind moves the leaves by {near}");
        assert!((far - near).length() < 0.25 * near.length(), "{far} instead of {near}");
    }
}

#[test]
fn motion_of_a_sprite_is_that_of_its_plant() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    // Leaves flutter on top of what the twigs do.
    let wind = Wind { strength: 0.08, flutter: 0.0, ..Wind::default() };
    let effects = Effects { wind: Some(wind), ..Effects::default() };
    let side = 64;
    let first = Frame::from(camera(DVec3::new(0.3, 0.2, 1.0), side)).at(4.0);
    let moved = DAffine3::from_translation(DVec3::new(0.3, 0.1, 0.2));
    let vectors = |far| {
        let foliage = FoliageRenderer::new(device, TARGET, look(far, effects)).unwrap();
        let mut foliage = foliage.with_motion(device, MOTION);
        let id = foliage.add_model(device, queue, &BIRCH).unwrap();
        let plant = Instance { before: Some(DAffine3::IDENTITY), ..Instance::new(id, moved, 600.0) };
        let frame = Frame::from(camera(DVec3::new(0.32, 0.21, 1.0), side)).at(4.3).after(&first);
        foliage.prepare(device, queue, frame, &[plant]).unwrap();
        Offscreen::new(&gpu, [side; 2]).unwrap().motion(&foliage).unwrap()
    };
    let [far, near] = [Some(FAR), None].map(vectors);
    let both = far.iter().zip(&near).filter(|(a, b)| **a != [0.0; 2] && **b != [0.0; 2]);
    let errors: Vec<f64> = both.map(|(a, b)| f64::from((a[0] - b[0]).hypot(a[1] - b[1])) * f64::from(side)).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let length = near.iter().filter(|v| **v != [0.0; 2]).map(|v| f64::from(v[0].hypot(v[1]))).sum::<f64>()
        / errors.len() as f64
        * f64::from(side);
    assert!(errors.len() > 300 && mean < 0.1 * length, "{} pixels, {mean:.3} of {length:.3} px", errors.len());
}

/// Root of the mean squared difference of two cut-outs, each before the same grey.
fn change(a: &Image, b: &Image) -> f64 {
    let before = |pixel: &[u8]| {
        let share = f64::from(pixel[3]) / 255.0;
        [0, 1, 2].map(|i| f64::from(pixel[i]) * share + 128.0 * (1.0 - share))
    };
    let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
    let squares = pixels.map(|(a, b)| {
        let [a, b] = [a, b].map(before);
        (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>()
    });
    (squares.sum::<f64>() / f64::from(3 * a.width * a.height)).sqrt()
}

/// Largest, middle and mean change from picture to picture.
fn changes(images: &[Image]) -> [f64; 3] {
    let mut changes: Vec<f64> = images.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
    changes.sort_by(f64::total_cmp);
    let mean = changes.iter().sum::<f64>() / changes.len() as f64;
    [changes[changes.len() - 1], changes[changes.len() / 2], mean]
}

#[test]
fn turning_about_a_sprite_changes_it_evenly_and_no_more_than_the_plant() {
    let step = 0.1_f64.to_radians();
    let frames = || {
        (0..240).map(move |i| {
            let turn = f64::from(i) * step;
            Frame::from(camera(DVec3::new(turn.sin(), 0.3, turn.cos()), 32))
        })
    };
    let far = cutouts(look(Some(FAR), Effects::default()), frames(), 32);
    let [largest, middle, _] = changes(&far);
    assert!(largest < 2.0 * middle, "a step of {largest:.2}, of {middle:.2} in the middle");
    // Over a degree, what is below a pixel does not count.
    let near = cutouts(look(None, Effects::default()), frames().step_by(10), 32);
    let far: Vec<Image> = far.into_iter().step_by(10).collect();
    let [[.., far], [.., near]] = [changes(&far), changes(&near)];
    // Leaves twinkle, their pictures less.
    assert!((0.2..1.1).contains(&(far / near)), "{far:.2} a degree instead of {near:.2}");
}

#[test]
fn a_dolly_through_the_band_changes_no_more_at_once_than_the_plant_does() {
    let frames = || {
        (0..120).map(|i| {
            let distance = 0.55 * 1.015_f64.powi(i);
            let look_at = LookAt::framing(&BIRCH.sphere(), DVec3::new(0.5, 0.2, 1.0), 0.3, distance);
            Frame::from(look_at.camera(64))
        })
    };
    // The plant's diameter goes from 116 pixels to 20.
    let [far, near] =
        [Some(Far::default()), None].map(|far| changes(&cutouts(look(far, Effects::default()), frames(), 64))[0]);
    assert!(far < 1.25 * near, "a change of {far:.2}, the plant's is {near:.2}");
}
