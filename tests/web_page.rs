//! The page of a continuous glTF in headless Chromium, with software WebGL: which leaf covers which
//! pixel as in our own renderer, also from files that other tools have changed.
//!
//! Without Node, Chromium and the packages of `web` the tests print a note and pass; with
//! `FOLIAGE_REQUIRE_WEB=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/node.rs"]
mod node;

use foliage_lod::{
    Camera, FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    draw::Coloring,
    export::{GlbOptions, page, write_continuous},
    glam::{DAffine3, DMat4, DVec3},
    gpu::{Offscreen, TARGET, TargetFormat},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    material::{AlphaMode, TextureFormat},
    simplify::{CpuFragments, GrowBy, Quiet, SimplifyOptions, simplify},
    software::Image,
};
use serde_json::{Value, json};
use std::{collections::HashSet, fs, path::Path};

const SIZE: [u32; 2] = [480, 360];
/// Numbers that the page gives to wood and to nothing; leaf i has the number i + 1.
const WOOD: u32 = 0xff_ffff;
const NOTHING: u32 = 0;
/// Least share of the pixels that must show the same leaf: of all, and of those that show the
/// plant.
const LEAST_EQUAL: [f64; 2] = [0.99, 0.98];

fn grown(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    let model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    assert!(!model.growth.tiles);
    model
}

/// The model with whole cards for leaves.
fn opaque(mut model: FoliageModel) -> FoliageModel {
    model.plant.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Opaque);
    model.plant.outlines.clear();
    model
}

/// The model with leaves cut out by a disc of few texels: where textures are minified, our renderer
/// dithers their edges.
fn cut_out(mut model: FoliageModel) -> FoliageModel {
    const SIDE: u32 = 8;
    let middle = 0.5 * (SIDE - 1) as f32;
    let disc = image::RgbaImage::from_fn(SIDE, SIDE, |x, y| {
        let away = (x as f32 - middle).hypot(y as f32 - middle);
        image::Rgba([255, 255, 255, ((middle - away).clamp(0.0, 1.0) * 255.0) as u8])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    disc.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    for texture in &mut model.plant.textures {
        (texture.format, texture.bytes) = (TextureFormat::Png, bytes.get_ref().clone());
    }
    model.plant.outlines.clear();
    model
}

/// A camera around the plant, from one of several sides. Its near plane is far enough out for depth
/// in 24 bits.
fn camera(model: &FoliageModel, side: usize) -> Camera {
    let direction = [DVec3::new(0.45, 0.25, 1.0), DVec3::new(-1.0, 0.9, 0.2), DVec3::new(0.3, 0.05, -1.0)][side % 3];
    let sphere = model.sphere();
    let framing = LookAt::framing(&sphere, direction, 0.8, 0.7).with_aspect(f64::from(SIZE[0]) / f64::from(SIZE[1]));
    LookAt { near: 0.4 * sphere.radius, ..framing }.camera(SIZE[1])
}

/// The matrix for OpenGL, whose depth runs from -1 at the near plane to 1, column by column.
fn for_opengl(camera: &Camera) -> Vec<f64> {
    let rows = camera.clip_from_world.transpose();
    let rows = DMat4::from_cols(rows.x_axis, rows.y_axis, rows.w_axis - 2.0 * rows.z_axis, rows.w_axis);
    rows.transpose().to_cols_array().to_vec()
}

/// Five counts, and one between two.
fn counts(model: &FoliageModel) -> Vec<f32> {
    let all = model.leaves.len() as f32;
    [1.0, 0.6, 0.3, 0.1, 0.03]
        .map(|share| (all * share).floor())
        .into_iter()
        .chain([(all * 0.2).floor() + 0.4])
        .collect()
}

/// Pictures of our renderer in the flat colours of leaves, one sample a pixel.
fn pictures(model: &FoliageModel) -> Option<Vec<Image>> {
    let gpu = gpu::gpu()?;
    let target = Offscreen::with_samples(&gpu, SIZE, 1).unwrap();
    let look = Look { coloring: Coloring::Flat, wood_error_px: 0.0, ..Look::default() };
    let mut foliage = FoliageRenderer::new(gpu.device(), TargetFormat { samples: 1, ..TARGET }, look).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
    let picture = |(side, &count): (usize, &f32)| {
        let instance = Instance::new(id, DAffine3::IDENTITY, count);
        foliage.prepare(gpu.device(), gpu.queue(), camera(model, side), &[instance]).unwrap();
        target.cutout(&foliage).unwrap()
    };
    Some(counts(model).iter().enumerate().map(picture).collect())
}

/// Numbers of the leaves that a page shows, in the same pictures, rows from the top.
fn numbers(page: &Path, model: &FoliageModel) -> Option<Vec<Vec<u32>>> {
    let folder = page.parent().unwrap();
    let jobs: Vec<Value> = counts(model)
        .iter()
        .enumerate()
        .map(|(side, count)| {
            json!({
                "clipFromWorld": for_opengl(&camera(model, side)), "count": count, "width": SIZE[0], "height": SIZE[1],
                "out": folder.join(format!("{side}.ids")),
            })
        })
        .collect();
    let file = folder.join("jobs.json");
    fs::write(&file, serde_json::to_vec(&jobs).unwrap()).unwrap();
    node::run("ids.mjs", &[page, &file])?;
    let read = |side| {
        let bytes = fs::read(folder.join(format!("{side}.ids"))).unwrap();
        let rows = bytes.chunks_exact(4 * SIZE[0] as usize).rev().flat_map(|row| row.chunks_exact(4));
        rows.map(|number| u32::from_le_bytes(number.try_into().unwrap())).collect()
    };
    Some((0..jobs.len()).map(read).collect())
}

/// Colour that our renderer gives to a leaf, as stored in an sRGB target.
fn flat(leaf: u32) -> [u8; 3] {
    let mixed = leaf.wrapping_mul(2_654_435_761);
    let encoded = |byte: u32| {
        let linear = f64::from(byte) / 255.0;
        let srgb = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (srgb * 255.0).round() as u8
    };
    [encoded(mixed >> 24), encoded((mixed >> 16) & 255), encoded((mixed >> 8) & 255)]
}

/// Share of the pixels that show the same leaf, wood or nothing: of all, and of those that either
/// covers. Wood has its own colours.
fn equal(numbers: &[u32], picture: &Image, leaves: u32) -> [f64; 2] {
    let pairs = numbers.iter().zip(picture.rgba.chunks_exact(4));
    let of_leaves: HashSet<[u8; 3]> = (0..leaves).map(flat).collect();
    let is_equal = |number: u32, pixel: &[u8]| match number {
        NOTHING => pixel[3] == 0,
        WOOD => pixel[3] == 255 && !of_leaves.contains(&pixel[..3]),
        number => pixel[3] == 255 && flat(number - 1).iter().zip(pixel).all(|(a, b)| a.abs_diff(*b) <= 1),
    };
    let of_all = pairs.clone().filter(|(number, pixel)| is_equal(**number, pixel)).count();
    let is_covered = |(number, pixel): &(&u32, &[u8])| **number != NOTHING || pixel[3] > 0;
    let (covered, same) = pairs
        .filter(is_covered)
        .fold((0, 0), |(covered, same), (number, pixel)| (covered + 1, same + usize::from(is_equal(*number, pixel))));
    assert!(covered > numbers.len() / 10, "{covered} pixels are covered");
    [of_all as f64 / numbers.len() as f64, f64::from(same as u32) / f64::from(covered as u32)]
}

fn assert_equal(page: &Path, model: &FoliageModel, pictures: &[Image]) {
    let Some(numbers) = numbers(page, model) else { return };
    let mut least = [1.0_f64; 2];
    for ((numbers, picture), count) in numbers.iter().zip(pictures).zip(counts(model)) {
        let [of_all, of_covered] = equal(numbers, picture, model.leaves.len() as u32);
        println!("{count} leaves: {:.2} % of all pixels, {:.2} % of covered ones", of_all * 100.0, of_covered * 100.0);
        least = [least[0].min(of_all), least[1].min(of_covered)];
    }
    assert!(least[0] >= LEAST_EQUAL[0] && least[1] >= LEAST_EQUAL[1], "{least:?}");
}

fn quantised(model: &FoliageModel) -> Vec<u8> {
    write_continuous(model, &GlbOptions::default()).unwrap()
}

fn write_page(folder: &Path, glb: &[u8]) -> std::path::PathBuf {
    let path = folder.join("page.html");
    fs::write(&path, page(glb, "oak")).unwrap();
    path
}

#[test]
fn the_page_shows_the_same_leaf_as_our_renderer_at_each_pixel() {
    for change in [opaque, cut_out] {
        let model = change(grown("english-oak", 3000));
        let Some(pictures) = pictures(&model) else { return };
        let folder = tempfile::tempdir().unwrap();
        assert_equal(&write_page(folder.path(), &quantised(&model)), &model, &pictures);
    }
}

/// Trees of others, whose leaves are cut out by pictures that are minified. Positions are exact, as
/// the seeds of partial coverage go by the order of leaves' places.
///
/// Fewer pixels are the same where leaves and twigs are a few pixels wide: WebGL in software has 4
/// bits of subpixels (95 % of those that `sapling_birch_8k_rect` covers; with few leaves three
/// quarters of the others are at edges of twigs), and where our renderer stretches pictures to one
/// size (92 %, `ftlab_keyaki`).
#[test]
fn minified_textures_of_real_trees_cover_the_same_pixels() {
    let Some(trees) = std::env::var_os("FOLIAGE_TREES") else {
        println!("skipped: FOLIAGE_TREES is not set");
        return;
    };
    for name in ["eztree_oak_medium", "seedthree_whiteoak_LOD1_merged", "CommonTree_1", "proctree_l7"] {
        let path = Path::new(&trees).join(name).with_extension("glb");
        let plant = load(&path, &ImportOptions::default()).unwrap().plant;
        let options = SimplifyOptions { resolution: 32, grow_by: GrowBy::Scale, ..SimplifyOptions::fast() };
        let model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        println!("{name}");
        let Some(pictures) = pictures(&model) else { return };
        let glb = write_continuous(&model, &GlbOptions { exact: true, ..GlbOptions::default() }).unwrap();
        let folder = tempfile::tempdir().unwrap();
        assert_equal(&write_page(folder.path(), &glb), &model, &pictures);
    }
}

#[test]
fn files_that_tools_have_reordered_and_quantised_show_the_same_and_stale_pivots_are_refused() {
    let model = opaque(grown("english-oak", 1500));
    let Some(pictures) = pictures(&model) else { return };
    let folder = tempfile::tempdir().unwrap();
    let [file, reordered, stale] = ["oak.glb", "reordered.glb", "stale.glb"].map(|name| folder.path().join(name));
    fs::write(&file, write_continuous(&model, &GlbOptions { exact: true, ..GlbOptions::default() }).unwrap()).unwrap();
    let Some(said) = node::run("tools.mjs", &[&file, &reordered, &stale]) else { return };
    assert!(said.contains("leaf triangles out of order"), "{said}");
    assert_equal(&write_page(folder.path(), &fs::read(&reordered).unwrap()), &model, &pictures);
    let page = write_page(folder.path(), &fs::read(&stale).unwrap());
    let said = node::run("refused.mjs", &[&page]).unwrap();
    assert!(said.contains("left _PIVOT behind; quantise all but POSITION"), "{said}");
}

#[test]
fn every_control_of_the_page_works_without_a_word_in_the_console() {
    let mut model = grown("hazel", 600);
    model.plant.name = "</script><img src=x onerror=\"document.title='broken out'\">".into();
    let folder = tempfile::tempdir().unwrap();
    let page = write_page(folder.path(), &quantised(&model));
    node::run("page.mjs", &[&page]);
}

#[test]
fn the_reader_takes_any_types_and_names_what_is_wrong() {
    node::run("reader.mjs", &[]);
}

#[test]
fn three_js_draws_the_leaves_with_shadows() {
    let model = grown("hazel", 600);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("oak.glb");
    fs::write(&file, quantised(&model)).unwrap();
    node::run("three.mjs", &[&file]);
}
