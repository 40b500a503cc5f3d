//! The GPU captures the same fragments as the CPU rasteriser: none missing, none extra, none twice.
//!
//! Without an adapter the tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    gpu::{GpuDevice, GpuFragments, GpuOptions},
    internals::capture::MAX_FRAGMENTS_PER_JOB,
    material::Wrap,
    simplify::{AlphaMask, AlphaTest, Coverage, CpuFragments, FragmentSource, ViewTriangles},
};

/// Pseudorandom numbers, the same on every machine (a linear congruential generator with Knuth's
/// multiplier and increment).
struct Random(u64);

impl Random {
    fn below(&mut self, end: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % end as u64) as i32
    }

    fn between(&mut self, start: i32, end: i32) -> i32 {
        start + self.below(end - start)
    }

    fn unit(&mut self) -> f32 {
        self.below(1 << 20) as f32 / (1 << 20) as f32
    }
}

#[derive(Default)]
struct View {
    resolution: u32,
    screen: Vec<[[i32; 2]; 3]>,
    alpha: Vec<AlphaTest>,
}

impl View {
    fn triangles(&self) -> ViewTriangles<'_> {
        ViewTriangles { resolution: self.resolution, screen: &self.screen, alpha: &self.alpha, tiling: &[] }
    }

    fn push(&mut self, corners: [[i32; 2]; 3], alpha: AlphaTest) {
        self.screen.push(corners);
        self.alpha.push(alpha);
    }

    /// Adds `count` quads of two triangles that share the diagonal. Corners are up to `size_px`
    /// from the middle along each axis. The quads cycle through the first `masks` masks; 0 means no
    /// alpha test.
    fn quads(mut self, random: &mut Random, count: usize, size_px: i32, masks: u32) -> Self {
        let last = self.resolution as i32 * 256 - 128;
        let size = size_px * 256;
        for i in 0..count {
            let middle = [random.between(-128, last), random.between(-128, last)];
            let mut corner = || middle.map(|m| (m + random.between(-size, size)).clamp(-128, last));
            let [a, b, c, d] = [corner(), corner(), corner(), corner()];
            // Snaps every third quad to the pixel grid, so that edges and corners hit samples.
            let snap = |p: [i32; 2]| {
                if i % 3 == 0 { p.map(|v| (v + 128).div_euclid(256) * 256 - 128 * (i as i32 % 2)) } else { p }
            };
            let [a, b, c, d] = [a, b, c, d].map(snap);
            let alpha = if masks == 0 { AlphaTest::NONE } else { test_for(random, middle, i as u32 % masks) };
            self.push([a, b, c], alpha);
            self.push([c, b, d], alpha);
        }
        self
    }
}

/// An alpha test with perspective whose texture coordinates are randomly scaled and rotated across
/// the triangle and extend well beyond 0..1.
fn test_for(random: &mut Random, middle: [i32; 2], mask: u32) -> AlphaTest {
    let mut slope = |scale: f32| (random.unit() - 0.5) * scale;
    AlphaTest {
        u: [slope(0.3), slope(0.3), slope(4.0)],
        v: [slope(0.3), slope(0.3), slope(4.0)],
        q: [slope(0.004), slope(0.004), 0.3],
        anchor: middle.map(|m| (m / 256) as f32),
        mask,
    }
}

fn masks(random: &mut Random) -> Vec<AlphaMask> {
    let sizes = [[16, 16], [7, 13], [64, 3], [1, 1], [256, 256]];
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let pairs = wraps.iter().flat_map(|&u| wraps.iter().map(move |&v| [u, v]));
    let mut mask = |[width, height]: [u32; 2], wrap| AlphaMask {
        width,
        height,
        wrap,
        bits: (0..(width * height).div_ceil(32)).map(|_| random.below(i32::MAX) as u32 ^ 0x9e37_79b9).collect(),
    };
    pairs.zip(sizes.iter().cycle()).map(|(wrap, &size)| mask(size, wrap)).collect()
}

fn sorted(source: &mut dyn FragmentSource, views: &[View]) -> Vec<Vec<Coverage>> {
    let triangles: Vec<_> = views.iter().map(View::triangles).collect();
    let mut out = vec![Vec::new(); views.len()];
    source.capture_batch(&triangles, &mut out).unwrap();
    out.iter_mut().for_each(|fragments| fragments.sort_unstable());
    out
}

/// Compares all views and returns the number of fragments compared.
fn assert_same(gpu: &GpuDevice, masks: &[AlphaMask], views: &[View]) -> usize {
    let mut on_gpu = GpuFragments::new(gpu).unwrap();
    let mut on_cpu = CpuFragments::new();
    on_gpu.prepare(masks).unwrap();
    on_cpu.prepare(masks).unwrap();
    let expected = sorted(&mut on_cpu, views);
    let found = sorted(&mut on_gpu, views);
    for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
        let differing = || expected.iter().filter(|fragment| found.binary_search(fragment).is_err()).count();
        assert!(
            found == expected,
            "view {i}: {} fragments instead of {}, {} missing",
            found.len(),
            expected.len(),
            differing()
        );
    }
    expected.iter().map(Vec::len).sum()
}

fn view(resolution: u32) -> View {
    View { resolution, ..Default::default() }
}

#[test]
fn leaves_needles_and_shared_edges_cover_the_same_pixels() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(1);
    let mut views: Vec<View> = [1, 2, 64, 128, 256, 512].map(|side| view(side).quads(&mut random, 4000, 6, 0)).into();
    views.push(view(256).quads(&mut random, 300, 200, 0));
    let mut needles = view(256);
    for _ in 0..4000 {
        let [x, y, dx, dy] = [(); 4].map(|()| random.between(0, 200 * 256));
        needles.push([[x, y], [dx, dy], [dx + random.below(3), dy + random.below(3)]], AlphaTest::NONE);
    }
    views.push(needles);
    println!("{} fragments equal", assert_same(&gpu, &[], &views));
}

#[test]
fn resolutions_that_are_no_power_of_two_cover_the_same_pixels() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(2);
    let views = [3, 100, 333, 720].map(|side| view(side).quads(&mut random, 4000, 9, 0));
    println!("{} fragments equal", assert_same(&gpu, &[], &views));
}

#[test]
fn alpha_tested_leaves_cover_the_same_pixels_in_every_wrap_mode() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    let masks = masks(&mut random);
    let views = [128, 256, 300].map(|side| view(side).quads(&mut random, 6000, 12, masks.len() as u32));
    println!("{} fragments equal", assert_same(&gpu, &masks, &views));
}

#[test]
fn texture_coordinates_exactly_between_texels_fall_where_the_cpu_puts_them() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(4);
    let masks = masks(&mut random);
    let mut between = view(64);
    for mask in 0..masks.len() as u32 {
        let [width, height] = [masks[mask as usize].width as f32, masks[mask as usize].height as f32];
        // One texel per pixel, with pixel centres on texel borders; q is not a power of two.
        let alpha = AlphaTest {
            u: [0.7 / width, 0.0, -14.0 / width],
            v: [0.0, 0.7 / height, -14.0 / height],
            q: [0.0, 0.0, 0.7],
            anchor: [0.0; 2],
            mask,
        };
        between.push([[-128, -128], [64 * 256 - 128, -128], [-128, 64 * 256 - 128]], alpha);
        between.push([[0, 0], [9000, 3000], [300, 8000]], AlphaTest { q: [0.0, 0.0, f32::NAN], ..alpha });
        between.push([[0, 0], [9000, 3000], [300, 8000]], AlphaTest { q: [0.0; 3], ..alpha });
    }
    assert_same(&gpu, &masks, &[between]);
}

#[test]
fn triangles_beyond_the_view_or_larger_than_it_are_complete() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    let masks = masks(&mut random);
    let mut around = view(128);
    for i in 0..600 {
        let far = [40_000, 1 << 20, 1 << 28][i % 3];
        let mut corner = || [random.between(-far, far), random.between(-far, far)];
        let corners = [corner(), corner(), corner()];
        around.push(corners, test_for(&mut random, [64 * 256; 2], i as u32 % masks.len() as u32));
        around.push([corners[0]; 3], AlphaTest::NONE);
    }
    assert!(assert_same(&gpu, &masks, &[around]) > 100_000);
}

#[test]
fn more_fragments_than_a_job_may_have_are_complete() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(6);
    let whole = 256 * 256 - 128;
    let mut deep = view(256).quads(&mut random, 500, 10, 0);
    for _ in 0..66 {
        deep.push([[-128, -128], [whole, -128], [-128, whole]], AlphaTest::NONE);
        deep.push([[whole, -128], [whole, whole], [-128, whole]], AlphaTest::NONE);
    }
    // Tiny triangles with a corner on a pixel centre cover more pixels than their area suggests.
    let mut dense = view(64);
    for _ in 0..20_000 {
        dense.push([[256, 256], [257, 256], [256, 257]], AlphaTest::NONE);
    }
    let compared = assert_same(&gpu, &[], &[deep, dense]);
    assert!(compared > MAX_FRAGMENTS_PER_JOB as usize, "{compared}");
}

#[test]
fn buffers_kept_between_calls_leave_nothing_behind() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(7);
    let masks = masks(&mut random);
    let mut source = GpuFragments::new(&gpu).unwrap();
    let mut oracle = CpuFragments::new();
    for (count, with_masks) in [(2000, 9), (0, 0), (10, 4), (5000, 0), (3, 1)] {
        let views = [view(64).quads(&mut random, count, 8, with_masks), view(32).quads(&mut random, count, 3, 0)];
        let masks = &masks[..with_masks as usize];
        source.prepare(masks).unwrap();
        oracle.prepare(masks).unwrap();
        assert!(sorted(&mut source, &views) == sorted(&mut oracle, &views), "{count} quads");
    }
}

#[test]
fn nothing_in_gives_nothing_out_and_output_is_appended() {
    let Some(gpu) = gpu() else { return };
    let mut source = GpuFragments::new(&gpu).unwrap();
    let before = Coverage { pixel: 7, triangle: 9 };
    let mut out = vec![before];
    source.capture(view(0).triangles(), &mut out).unwrap();
    source.capture(view(16).triangles(), &mut out).unwrap();
    assert_eq!(out, [before]);
    let mut one = view(16);
    one.push([[0, 0], [300, 0], [0, 200]], AlphaTest::NONE);
    source.capture(one.triangles(), &mut out).unwrap();
    assert_eq!(out[0], before);
    assert_eq!(out.len(), 3);
    assert_eq!(source.adapter(), Some(gpu.adapter_name()));
}

#[test]
fn a_view_beyond_the_adapters_textures_is_refused_by_name_and_the_source_stays_usable() {
    let Some(gpu) = gpu() else { return };
    let mut source = GpuFragments::new(&gpu).unwrap();
    let refused = source.capture(view(1 << 20).triangles(), &mut Vec::new()).unwrap_err().to_string();
    assert!(refused.contains("view resolution is 1048576") && refused.contains("CpuFragments"), "{refused}");
    source.capture(view(16).triangles(), &mut Vec::new()).unwrap();
}

#[test]
fn an_adapter_that_is_not_there_is_refused_by_name() {
    let wanted = GpuOptions { adapter: Some("no such adapter".into()) };
    let refused = GpuDevice::new(&wanted).unwrap_err().to_string();
    assert!(refused.contains("no such adapter") && refused.contains("CpuFragments"), "{refused}");
}

#[test]
fn a_device_that_goes_away_is_an_error_and_stays_one() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(8);
    let lost = view(64).quads(&mut random, 100, 8, 0);
    let mut source = GpuFragments::new(&gpu).unwrap();
    gpu.device().destroy();
    for _ in 0..2 {
        let refused = source.capture(lost.triangles(), &mut Vec::new()).unwrap_err().to_string();
        assert!(refused.starts_with("GPU: ") && refused.ends_with("`CpuFragments`"), "{refused}");
        assert!(!refused.contains('\n'));
    }
}

#[test]
fn opening_a_device_never_panics() {
    if let Err(error) = GpuDevice::new(&GpuOptions::default()) {
        println!("{error}");
    }
}

/// Reruns the test above in an environment where the Vulkan loader finds no driver.
#[cfg(target_os = "linux")]
#[test]
fn without_any_driver_the_refusal_names_the_way_out() {
    let this = std::env::current_exe().unwrap();
    let output = std::process::Command::new(this)
        .args(["--exact", "opening_a_device_never_panics", "--nocapture"])
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("no adapter found") && text.contains("CpuFragments"), "{text}");
}
