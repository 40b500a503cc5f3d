//! Live impostors: frames are made when plants need them, and are those of a baked impostor.
//!
//! Without an adapter the GPU tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they
//! fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt,
    draw::{Ground, LiveCounts},
    effects::{Effects, Shadow},
    extract::Far,
    gpu::{Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{BakeOptions, Image, LiveImpostors, SoftwareRenderer, bake},
};
use glam::{DAffine3, DQuat, DVec3};
use std::{sync::LazyLock, time::Duration};

const SIZES: BakeOptions = BakeOptions { across: 10, frame_px: 16, is_whole_sphere: false };
const LIVE: LiveImpostors = LiveImpostors { bake: SIZES, frames_at_once: 2, ahead: false };
/// Every size is far.
const FAR: Far = Far { at_px: 1024.0, band: [0.8, 1.25] };
const SIDE: u32 = 48;

/// A birch of 300 leaves without an impostor, and with one.
static BIRCHES: LazyLock<[FoliageModel; 2]> = LazyLock::new(|| {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(300), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() };
    let plain = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    let impostor = Some(bake(&plain, &SIZES, &mut |_| true).unwrap());
    [plain.clone(), FoliageModel { impostor, ..plain }]
});

fn look(far: Option<Far>) -> Look {
    Look { far, ..Look::default() }
}

fn frame(turn: f64) -> Frame {
    let direction = DVec3::new(turn.sin(), 0.25, turn.cos());
    LookAt::framing(&BIRCHES[0].sphere(), direction, 0.3, 1.0).camera(SIDE).into()
}

fn covered(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum()
}

/// Plants in a row, each turned by another angle.
fn row(id: foliage_lod::draw::ModelId) -> Vec<Instance> {
    let place = |i: u32| {
        let at = DVec3::new(2.5 * (f64::from(i) - 1.0), 0.0, 0.0) * BIRCHES[0].sphere().radius;
        DAffine3::from_rotation_translation(DQuat::from_rotation_y(f64::from(i)), at)
    };
    (0..3).map(|i| Instance { seed: i, ..Instance::new(id, place(i), 300.0) }).collect()
}

#[test]
fn frames_made_while_drawing_show_the_picture_of_baked_ones_on_the_gpu() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    let target = Offscreen::new(&gpu, [3 * SIDE, SIDE]).unwrap();
    let down = BIRCHES[0].sphere().center() - DVec3::Y * BIRCHES[0].sphere().radius;
    let ground = Some(Ground { color: [0.3; 3], height: down.y, haze: 1e6 });
    let shadow = Shadow { distance: (20.0 * BIRCHES[0].sphere().radius) as f32, ..Shadow::default() };
    let shadowed = Look { ground, effects: Effects { shadow: Some(shadow), ..Effects::default() }, ..look(Some(FAR)) };
    for look in [look(Some(FAR)), shadowed] {
        let mut renderers = [0, 1].map(|i| {
            let plain = FoliageRenderer::new(device, TARGET, look).unwrap();
            let mut foliage = plain.with_live_impostors(LIVE).unwrap();
            let id = foliage.add_model(device, queue, &BIRCHES[i]).unwrap();
            (foliage, id)
        });
        let mut made = Vec::new();
        for turn in [0.4, 0.5, 2.0] {
            let frame =
                LookAt::framing(&BIRCHES[0].sphere(), DVec3::new(f64::sin(turn), 0.3, f64::cos(turn)), 0.3, 2.0);
            let frame = Frame::from(frame.with_aspect(3.0).camera(SIDE));
            let [live, baked] = renderers.each_mut().map(|(foliage, id)| {
                let plants = row(*id);
                made.push(foliage.warm(device, queue, frame, &plants, &plants).unwrap());
                let prepared = foliage.prepare(device, queue, frame, &plants).unwrap();
                assert_eq!(prepared.live, LiveCounts::default());
                assert_eq!(prepared.far.impostors, 3);
                target.picture(foliage).unwrap()
            });
            assert!(live == baked, "at {turn}");
        }
        assert!(made[0] >= 7 && made[4] > 0 && made[0] + made[2] + made[4] < 40, "{made:?}");
        assert_eq!([made[1], made[3], made[5]], [0; 3], "baked impostors have all frames");
        assert_eq!(renderers[0].0.diagnostics().impostor_bytes, renderers[1].0.diagnostics().impostor_bytes);
    }
}

#[test]
fn frames_made_while_drawing_show_the_picture_of_baked_ones_on_the_cpu() {
    let mut renderers = [0, 1].map(|i| {
        let mut software = SoftwareRenderer::new(look(Some(FAR))).unwrap().with_live_impostors(LIVE).unwrap();
        let id = software.add_model(&BIRCHES[i]).unwrap();
        (software, id)
    });
    for (turn, most) in [(0.4, 3), (0.4, 0), (1.3, 3)] {
        let [live, baked] = renderers.each_mut().map(|(software, id)| {
            software.cutout(frame(turn), &[Instance::new(*id, DAffine3::IDENTITY, 300.0)], [SIDE; 2]).unwrap()
        });
        assert!(live.image == baked.image);
        assert!((live.prepared.live.made <= most) && (most == 0 || live.prepared.live.made > 0));
        assert_eq!((live.prepared.live.pending, baked.prepared.live.made), (0, 0));
    }
}

#[test]
fn plants_keep_their_leaves_until_their_frames_are_made_few_at_a_time() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    let target = Offscreen::new(&gpu, [SIDE; 2]).unwrap();
    let plain = FoliageRenderer::new(device, TARGET, look(Some(FAR))).unwrap();
    let mut foliage = plain.with_live_impostors(LIVE).unwrap();
    let id = foliage.add_model(device, queue, &BIRCHES[0]).unwrap();
    let plant = [Instance::new(id, DAffine3::IDENTITY, 300.0)];
    let first = foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
    assert_eq!((first.far.leaves, first.live), (1, LiveCounts { made: 0, pending: 3, appearing: 0 }));
    let whole = covered(&target.cutout(&foliage).unwrap());
    let (mut made, mut both) = (0, 0);
    for _ in 0..6000 {
        let prepared = foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
        made += prepared.live.made;
        both += prepared.far.both;
        assert!(prepared.live.made <= 2 && prepared.live.pending == 3 - made);
        assert!(made == 3 || prepared.far.leaves == 1, "a sprite with {made} frames");
        if prepared.far.both == 1 || prepared.far.impostors == 1 {
            let share = covered(&target.cutout(&foliage).unwrap()) / whole;
            assert!((share - 1.0).abs() < 0.1, "covers {share:.3} of the leaves");
        }
        if prepared.live.pending + prepared.live.appearing == 0 {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let last = foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
    assert_eq!((made, last.far.impostors, last.live), (3, 1, LiveCounts::default()));
    assert!(both >= 8, "the sprite appeared over {both} pictures");
    assert_eq!(foliage.diagnostics().live_frames, 3);
}

#[test]
fn nothing_is_made_for_plants_that_are_near_and_a_removed_model_frees_its_frames() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (gpu.device(), gpu.queue());
    for far in [None, Some(Far { at_px: 4.0, ..FAR })] {
        let plain = FoliageRenderer::new(device, TARGET, look(far)).unwrap();
        let mut foliage = plain.with_live_impostors(LIVE).unwrap();
        let id = foliage.add_model(device, queue, &BIRCHES[0]).unwrap();
        let plant = [Instance::new(id, DAffine3::IDENTITY, 300.0)];
        assert_eq!(foliage.warm(device, queue, frame(0.4), &plant, &plant).unwrap(), 0);
        let near = foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
        assert_eq!((near.far.leaves, near.live), (1, LiveCounts::default()));
        assert_eq!((foliage.diagnostics().live_frames, foliage.diagnostics().impostor_bytes), (0, 0));
    }
    let plain = FoliageRenderer::new(device, TARGET, look(Some(FAR))).unwrap();
    let mut foliage = plain.with_live_impostors(LiveImpostors { ahead: true, ..LIVE }).unwrap();
    let id = foliage.add_model(device, queue, &BIRCHES[0]).unwrap();
    let plant = [Instance::new(id, DAffine3::IDENTITY, 300.0)];
    foliage.warm(device, queue, frame(0.4), &plant, &plant).unwrap();
    let before = foliage.diagnostics().live_frames;
    let beside = (0..6000).find(|_| {
        std::thread::sleep(Duration::from_millis(10));
        foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
        foliage.diagnostics().live_frames >= before + 3
    });
    assert!(before >= 3 && beside.is_some(), "frames beside those in use are made ahead");
    assert!(foliage.diagnostics().impostor_bytes > 0);
    foliage.remove_model(id);
    assert_eq!((foliage.diagnostics().live_frames, foliage.diagnostics().impostor_bytes), (0, 0));
    let gone = foliage.prepare(device, queue, frame(0.4), &plant).unwrap();
    assert_eq!((gone.instances, gone.live), (0, LiveCounts::default()));
}

#[test]
fn sizes_out_of_range_are_errors() {
    let bad = [
        LiveImpostors { frames_at_once: 0, ..LIVE },
        LiveImpostors { bake: BakeOptions { across: 40, ..SIZES }, ..LIVE },
    ];
    for live in bad {
        assert!(SoftwareRenderer::new(look(Some(FAR))).unwrap().with_live_impostors(live).is_err(), "{live:?}");
    }
}
