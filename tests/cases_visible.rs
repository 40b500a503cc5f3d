//! Files whose leaves could not be seen, or were not the leaves: alpha cutoffs, cards that touch,
//! marks on the bark, tiny plants.
//!
//! Files of others are in the folders named by `FOLIAGE_CASES` and `FOLIAGE_TREES`; without these
//! variables, what needs them is skipped.
#![cfg(feature = "simplify")]

#[path = "common/glb.rs"]
mod glb;
#[cfg(feature = "render")]
#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/shape.rs"]
mod shape;

use foliage_lod::{
    Error, FoliageModel, LookAt, Plant,
    extract::{active_count, fewest_leaves},
    import::{self, ImportOptions, Imported, Verdict, Warning, WarningKind, load_gltf_bytes},
    simplify::{CpuFragments, Quiet, Simplified, SimplifyOptions, simplify},
    software::{Background, DrawOptions, Image, draw_model, draw_plant},
};
use glam::{DVec3, Vec3};
use glb::{Gltf, cards};
use serde_json::{Value, json};
use shape::{Shape, WHOLE, empty, fan, folds, textured};
use std::path::{Path, PathBuf};

/// Width and height of the pictures.
const SIZE: [u32; 2] = [96, 96];

fn import_with(file: &Gltf, options: &ImportOptions) -> Imported {
    load_gltf_bytes(&file.glb(), Path::new("made.glb"), options).unwrap_or_else(|error| panic!("{error}"))
}

fn import(file: &Gltf) -> Imported {
    import_with(file, &ImportOptions::default())
}

fn named(leaves: &str) -> ImportOptions {
    ImportOptions { leaves: vec![leaves.into()], ..ImportOptions::default() }
}

fn cut_at(alpha: f32) -> ImportOptions {
    ImportOptions { alpha_cutoff: Some(alpha), ..ImportOptions::default() }
}

/// A file of those that show faults, or `None` without `FOLIAGE_CASES`.
fn case(name: &str) -> Option<PathBuf> {
    std::env::var_os("FOLIAGE_CASES").map(|folder| PathBuf::from(folder).join(name))
}

/// The warnings of a kind.
fn warnings(imported: &Imported, kind: WarningKind) -> Vec<&Warning> {
    imported.warnings.iter().filter(|warning| warning.kind == kind).collect()
}

/// A PNG of 16 x 16 texels: a disc of `inside`, around it `outside`.
fn disc(inside: u8, outside: u8) -> Vec<u8> {
    let is_inside = |i: i32| (2 * (i % 16) - 15).pow(2) + (2 * (i / 16) - 15).pow(2) < 150;
    let texels = (0..256).flat_map(|i| [60, 140, 50, if is_inside(i) { inside } else { outside }]).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(16, 16, texels).unwrap().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Twenty cards in five columns.
fn twenty() -> Gltf {
    let mut file = cards(20);
    for (i, corner) in (0..80).zip(file.buffer.chunks_exact_mut(12)) {
        let card = i / 4;
        let coordinate = |axis: usize| f32::from_le_bytes(corner[axis * 4..][..4].try_into().unwrap());
        let x = coordinate(0) - (3 * card) as f32 + (card % 5) as f32 * 1.25;
        let y = coordinate(1) + (card / 5) as f32 * 1.25;
        corner[..4].copy_from_slice(&x.to_le_bytes());
        corner[4..8].copy_from_slice(&y.to_le_bytes());
    }
    file
}

/// Twenty cards of a material with these properties, textured if `png` is set.
fn cut(alpha_mode: &str, cutoff: Option<f32>, factor: f32, png: Option<&[u8]>) -> Gltf {
    let mut file = twenty();
    let material = &mut file.json["materials"][0];
    material["alphaMode"] = json!(alpha_mode);
    material["pbrMetallicRoughness"] = json!({ "baseColorFactor": [1.0, 1.0, 1.0, factor] });
    if let Some(cutoff) = cutoff {
        material["alphaCutoff"] = json!(cutoff);
    }
    match png {
        Some(png) => textured(file, png),
        None => file,
    }
}

fn camera(plant: &Plant) -> LookAt {
    LookAt::framing(&plant.sphere(), DVec3::Z, 0.8, 1.0)
}

/// Number of covered pixels; partly covered pixels count as fractions.
fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum()
}

fn clear() -> DrawOptions {
    DrawOptions { background: Background::Transparent, ..DrawOptions::default() }
}

/// Pixels that a plant covers in a picture by the CPU.
fn seen_px(plant: &Plant) -> f64 {
    seen_by(&camera(plant), plant)
}

fn seen_by(camera: &LookAt, plant: &Plant) -> f64 {
    covered_px(&draw_plant(plant, &camera.camera(SIZE[1]), SIZE, &clear()).unwrap())
}

fn simplified(plant: &Plant) -> Simplified {
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap()
}

fn model(plant: &Plant) -> FoliageModel {
    simplified(plant).model
}

#[test]
fn a_blended_part_is_cut_at_half_of_the_largest_alpha_that_it_reaches() {
    let full = import(&cut("BLEND", None, 1.0, Some(&disc(255, 0)))).plant;
    assert_eq!(full.materials[0].alpha_cutoff, 0.5);
    let seen = seen_px(&full);
    assert!(seen > 50.0, "{seen}");
    for (factor, inside, cutoff) in [(0.43, 255, 0.215), (1.0, 102, 0.2), (0.5, 51, 0.05), (0.01, 255, 0.005)] {
        let imported = import(&cut("BLEND", None, factor, Some(&disc(inside, 0))));
        let plant = &imported.plant;
        assert!((plant.materials[0].alpha_cutoff - cutoff).abs() < 1e-6, "{:?}", plant.materials[0]);
        // Alpha has 256 steps: the outline moves a little where few of them are in use.
        assert!((seen_px(plant) / seen - 1.0).abs() < 0.03, "{} of {seen} at {factor}", seen_px(plant));
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        assert_eq!(model(plant).leaves.len(), 20);
    }
    // What the file says of a blended material's cutoff has no meaning.
    assert_eq!(import(&cut("BLEND", Some(0.9), 1.0, None)).plant.materials[0].alpha_cutoff, 0.5);
}

#[test]
fn a_cut_that_no_texel_passes_is_named_and_its_fix_works() {
    let files = [
        (cut("MASK", Some(1.1), 1.0, Some(&disc(255, 0))), ["1.1", "is 1:"]),
        (cut("MASK", None, 1.0, Some(&disc(100, 0))), ["0.5", "is 0.392:"]),
        (cut("MASK", Some(0.6), 0.5, Some(&disc(255, 0))), ["0.6", "is 0.5:"]),
        (cut("MASK", None, 0.2, None), ["0.5", "is 0.2:"]),
        (cut("BLEND", None, 0.0, None), ["0.5", "is 0:"]),
        (cut("BLEND", None, 1.0, Some(&disc(0, 0))), ["0.5", "is 0:"]),
    ];
    for (file, numbers) in files {
        let imported = import(&file);
        let [warning] = warnings(&imported, WarningKind::Invisible)[..] else { panic!("{:?}", imported.warnings) };
        assert!(["\"leaf\""].iter().chain(&numbers).all(|part| warning.message.contains(part)), "{warning}");
        assert_eq!(seen_px(&imported.plant), 0.0, "{warning}");
        let asked = warning.fix.split("`alpha_cutoff` to ").nth(1).unwrap().split(' ').next().unwrap();
        let mended = import_with(&file, &cut_at(asked.parse().unwrap()));
        assert!(mended.warnings.is_empty(), "{:?}", mended.warnings);
        assert!(seen_px(&mended.plant) > 50.0, "{warning}");
    }
    let whole = cut("MASK", Some(1.0), 1.0, Some(&disc(255, 0)));
    assert!(import(&whole).warnings.is_empty());
    assert!(import(&cut("OPAQUE", Some(2.0), 0.0, None)).warnings.is_empty());
}

#[test]
fn leaves_without_texture_coordinates_over_a_hole_are_named_and_the_fix_works() {
    let mut file = cut("MASK", None, 1.0, Some(&disc(255, 0)));
    file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let imported = import(&file);
    let [warning] = warnings(&imported, WarningKind::Invisible)[..] else { panic!("{:?}", imported.warnings) };
    assert!(["\"leaf\"", "[0.0, 0.0]"].iter().all(|part| warning.message.contains(part)), "{warning}");
    assert_eq!(seen_px(&imported.plant), 0.0);
    let mended = import_with(&file, &cut_at(0.0));
    assert!(mended.warnings.is_empty() && seen_px(&mended.plant) > 50.0);
    // No hole, no warning.
    let mut whole = cut("MASK", None, 1.0, Some(&disc(0, 255)));
    whole.json["meshes"] = file.json["meshes"].clone();
    assert!(import(&whole).warnings.is_empty());
}

#[test]
fn an_alpha_cutoff_out_of_range_is_refused() {
    for value in [-0.1, 1.1, f32::NAN] {
        let error = load_gltf_bytes(&cards(5).glb(), Path::new("made.glb"), &cut_at(value)).unwrap_err();
        assert!(matches!(&error, Error::InvalidOption { field, .. } if field == "alpha_cutoff"), "{error}");
    }
}

/// Twenty cards and, in front of them, a wall of wood with `material`.
fn behind_a_wall(material: Value) -> Gltf {
    let mut file = textured(twenty(), &disc(255, 0));
    let wall = Shape::default().with_card([[-1.0, -1.0, 2.0], [7.0, -1.0, 2.0], [7.0, 6.0, 2.0], [-1.0, 6.0, 2.0]]);
    wall.push(&mut file, material);
    file
}

#[test]
fn wood_that_is_not_drawn_gives_a_warning_and_hides_nothing() {
    let bare = json!({ "name": "bark", "doubleSided": true });
    let mut clear = bare.clone();
    clear["alphaMode"] = json!("MASK");
    clear["pbrMetallicRoughness"] = json!({ "baseColorFactor": [1.0, 1.0, 1.0, 0.25] });
    let [solid, clear] = [bare, clear].map(|material| import(&behind_a_wall(material)));
    assert!(warnings(&solid, WarningKind::Invisible).is_empty());
    let [warning] = warnings(&clear, WarningKind::Invisible)[..] else { panic!("{:?}", clear.warnings) };
    assert!(warning.message.contains("\"bark\""), "{warning}");
    let mut alone = clear.plant.clone();
    alone.wood.parts.clear();
    alone.wood.indices.clear();
    // The wall's vertices still count for the bounds, so that the views are the same.
    assert_eq!(seen_px(&clear.plant), seen_px(&alone));
    assert!(seen_px(&solid.plant) > 2.0 * seen_px(&alone));
    let [clear, alone, solid] = [&clear.plant, &alone, &solid.plant].map(simplified);
    assert_eq!(clear.model.leaves, alone.model.leaves);
    assert_eq!(clear.fragments, alone.fragments);
    assert!(solid.fragments > clear.fragments);
}

#[test]
fn leaves_of_which_no_texel_passes_cover_nothing_for_the_simplification_either() {
    for file in [cut("MASK", Some(1.1), 1.0, Some(&disc(255, 0))), cut("MASK", None, 0.2, None)] {
        let plant = import(&file).plant;
        let Simplified { model, fragments, .. } = simplified(&plant);
        assert_eq!((model.leaves.len(), fragments), (20, 0));
    }
}

#[test]
fn files_with_faded_leaves_show_them_or_say_why_not() {
    let (Some(blended), Some(cut)) = (case("12-blend-factor-043.glb"), case("12c-cutoff-above-1.glb")) else { return };
    let imported = import::load(&blended, &ImportOptions::default()).unwrap();
    assert_eq!((imported.plant.materials[1].alpha_cutoff, imported.warnings.len()), (0.215, 0));
    let trunk = Plant { vertices: vec![], indices: vec![], leaves: vec![], ..imported.plant.clone() };
    let trunk_px = seen_by(&camera(&imported.plant), &trunk);
    assert!(seen_px(&imported.plant) > 4.0 * trunk_px);
    let imported = import::load(&cut, &ImportOptions::default()).unwrap();
    let [warning] = &imported.warnings[..] else { panic!("{:?}", imported.warnings) };
    assert!(["\"leaves\"", "1.1", "is 1:"].iter().all(|part| warning.message.contains(part)), "{warning}");
    let mended = import::load(&cut, &cut_at(0.5)).unwrap();
    assert!(mended.warnings.is_empty() && seen_px(&mended.plant) > 4.0 * trunk_px);
}

#[cfg(feature = "render")]
#[test]
fn the_gpu_shows_and_hides_the_same_leaves_as_the_cpu() {
    use foliage_lod::{
        FoliageRenderer, Instance, Look,
        gpu::{Offscreen, TARGET},
    };
    let Some(gpu) = gpu::gpu() else { return };
    let files = [
        cut("BLEND", None, 0.43, Some(&disc(255, 0))),
        cut("BLEND", None, 0.3, None),
        cut("MASK", Some(1.1), 1.0, Some(&disc(255, 0))),
        cut("MASK", None, 0.2, None),
    ];
    for (file, is_seen) in files.iter().zip([true, true, false, false]) {
        let plant = import(file).plant;
        let model = model(&plant);
        let target = Offscreen::new(&gpu, SIZE).unwrap();
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
        let camera = camera(&plant).camera(SIZE[1]);
        let mut by_gpu = |leaves: f32| {
            let tree = Instance::new(id, glam::DAffine3::IDENTITY, leaves);
            foliage.prepare(gpu.device(), gpu.queue(), camera, &[tree]).unwrap();
            target.picture(&foliage).unwrap()
        };
        let by_cpu = |leaves| draw_model(&model, leaves, &camera, SIZE, &DrawOptions::default()).unwrap();
        let changed_px = |[a, b]: [Image; 2]| {
            a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).filter(|(a, b)| a != b).count() as f64
        };
        let [gpu_px, cpu_px] = [changed_px([by_gpu(20.0), by_gpu(0.0)]), changed_px([by_cpu(20), by_cpu(0)])];
        assert!(
            if is_seen { (gpu_px / cpu_px - 1.0).abs() < 0.15 } else { gpu_px + cpu_px == 0.0 },
            "{gpu_px} {cpu_px}"
        );
    }
}

#[test]
fn cards_that_touch_are_separated_where_their_texture_repeats() {
    let disc = disc(255, 0);
    let turned = |i: f32| if i % 2.0 == 0.0 { WHOLE } else { [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [1.0, 1.0]] };
    let mut joined_vertices = folds(4, |i| WHOLE.map(|[u, v]| [u + i, v]));
    joined_vertices = Shape {
        indices: vec![0, 1, 2, 0, 2, 3, 1, 5, 6, 1, 6, 2, 5, 9, 10, 5, 10, 6, 9, 13, 14, 9, 14, 10],
        ..joined_vertices
    };
    let shapes = [
        ("a fan", fan(6)),
        ("folds", folds(4, |_| WHOLE)),
        ("folds on a texture that goes on", folds(4, |i| WHOLE.map(|[u, v]| [u + i, v]))),
        ("the same with shared vertices", joined_vertices),
        ("folds on a texture that turns back", folds(4, turned)),
        ("a part of the texture that turns back", folds(4, |i| turned(i).map(|[u, v]| [0.25 + u / 4.0, v / 2.0]))),
        ("a ring with holes", Shape::tube()),
    ];
    for (name, shape) in shapes {
        let per_piece = if name == "a fan" { 6 } else { 4 };
        for png in [None, Some(&disc[..])] {
            if png.is_none() && name == "a ring with holes" {
                continue;
            }
            let imported = import(&shape.six().cut_out(png));
            let plant = &imported.plant;
            assert_eq!(
                (plant.leaves.len(), plant.wood.triangles()),
                (6 * per_piece, 0),
                "{name} {:?}",
                imported.findings
            );
            let by_name = import_with(&shape.six().cut_out(png), &named("leaf")).plant;
            assert_eq!(by_name.leaves.len(), 6 * per_piece, "{name}");
        }
    }
    // More triangles in one piece than a leaf has.
    let long = import(&folds(700, |_| WHOLE).cut_out(None));
    assert_eq!(long.plant.leaves.len(), 700);
}

#[test]
fn cards_that_touch_below_a_named_node_are_separated_beside_plain_ones() {
    let mut file = Gltf { json: empty(), buffer: Vec::new() };
    fan(6).six().push(&mut file, json!({ "name": "cards", "alphaMode": "MASK" }));
    Shape::default().with_card(WHOLE.map(|[x, y]| [x, y, 4.0])).push(&mut file, json!({ "name": "sheet" }));
    Shape::tube().push(&mut file, json!({ "name": "bark" }));
    file.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "tree", "children": [0, 1, 2] }));
    file.json["scenes"][0]["nodes"] = json!([3]);
    let imported = import_with(&file, &named("tree"));
    let plant = &imported.plant;
    assert_eq!((plant.leaves.len(), plant.wood.triangles()), (6 * 6 + 1, 8), "{:?}", imported.findings);
    let bark_stays = import_with(&file, &named("sheet")).plant;
    assert_eq!((bark_stays.leaves.len(), bark_stays.wood.triangles()), (1, 6 * 6 * 2 + 8));
}

#[test]
fn branches_in_a_cut_out_material_stay_wood() {
    let solid = disc(255, 255);
    for png in [None, Some(&solid[..])] {
        let file = Shape::tube().six().cut_out(png);
        let error = load_gltf_bytes(&file.glb(), Path::new("made.glb"), &ImportOptions::default()).unwrap_err();
        assert!(matches!(error, Error::NoLeaves { .. }), "{error}");
    }
}

#[test]
fn cards_that_touch_without_a_repeating_texture_are_refused_with_the_reason_and_a_fix_that_works() {
    // Each card has a part of the texture of its own.
    let places = |i: f32| WHOLE.map(|[u, v]| [(u + i) / 8.0, (v + i) / 9.0]);
    let unlike = (0..6)
        .fold(Shape::default(), |all, i| all.with(&folds(4, |j| places(j + 1.5 * i as f32)), Vec3::X * 9.0 * i as f32));
    let file = unlike.cut_out(None);
    let error = load_gltf_bytes(&file.glb(), Path::new("made.glb"), &ImportOptions::default()).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, Error::NoLeaves { .. }) && text.contains("0 of 6 pieces"), "{text}");
    assert!(text.contains("joined at their edges") && text.contains("`leaves`"), "{text}");
    assert_eq!(import_with(&file, &named("leaf")).plant.leaves.len(), 6);
}

#[test]
fn what_is_read_as_leaves_stays_as_it_is() {
    // A bent frond of four quads, each with the whole texture.
    let frond = (0..4).fold(Shape::default(), |frond, i| {
        let y = |i: u8| [f32::from(i), f32::from(i * i) * 0.1];
        let [[y0, z0], [y1, z1]] = [y(i), y(i + 1)];
        frond.with_card([[0.0, y0, z0], [1.0, y0, z0], [1.0, y1, z1], [0.0, y1, z1]])
    });
    assert_eq!(import(&frond.six().cut_out(None)).plant.leaves.len(), 6);
}

/// Flat marks on the trunk.
fn marks() -> Shape {
    let mark = [[-0.1, 0.0, 1.01], [0.1, 0.0, 1.01], [0.1, 0.2, 1.01], [-0.1, 0.2, 1.01]];
    (0..28).fold(Shape::default(), |marks, i| {
        let at = Vec3::new((i % 4) as f32 * 0.4 - 0.6, (i / 4) as f32 * 0.6 + 0.3, 0.0);
        marks.with(&Shape::default().with_card(mark), at)
    })
}

/// A trunk and a crown of one ball, with 28 flat marks on the trunk.
fn marked_tree() -> Gltf {
    let mut file = Gltf { json: empty(), buffer: Vec::new() };
    Shape::tube().push(&mut file, json!({ "name": "trunk" }));
    Shape::ball(Vec3::Y * 10.0, 6.0).push(&mut file, json!({ "name": "crown" }));
    marks().push(&mut file, json!({ "name": "marks" }));
    file
}

#[test]
fn marks_on_the_bark_of_a_tree_with_a_solid_crown_give_a_warning() {
    let imported = import(&marked_tree());
    assert_eq!(imported.plant.leaves.len(), 28);
    let [warning] = warnings(&imported, WarningKind::Foliage)[..] else { panic!("{:?}", imported.warnings) };
    assert!(warning.message.contains("0.2 %") && warning.message.contains("\"crown\""), "{warning}");
    assert!(warning.fix.contains("`leaves`"), "{warning}");
    // So too if they stand on a large ground, as nodes of their own or in one mesh with the tree.
    let mut ground = marked_tree();
    let far = [[-99.0, 0.0, 99.0], [99.0, 0.0, 99.0], [99.0, 0.0, -99.0], [-99.0, 0.0, -99.0]];
    Shape::default().with_card(far).push(&mut ground, json!({ "name": "ground" }));
    assert_eq!(warnings(&import(&ground), WarningKind::Foliage), [warning]);
    let mut joined = Gltf { json: empty(), buffer: Vec::new() };
    let tree = Shape::tube().with(&Shape::ball(Vec3::Y * 10.0, 6.0), Vec3::ZERO).with(&marks(), Vec3::ZERO);
    tree.push(&mut joined, json!({ "name": "tree" }));
    assert_eq!(warnings(&import(&joined), WarningKind::Foliage).len(), 1);
    // Both halves of the fix: to name them, or a crown of leaves.
    assert!(import_with(&marked_tree(), &named("marks")).warnings.is_empty());
    let mut file = marked_tree();
    let leaf = Shape::default().with_card([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let crown = (0..60)
        .fold(Shape::default(), |all, i| all.with(&leaf, Vec3::new((i % 8) as f32, 8.0 + (i / 8) as f32, 0.0) * 1.25));
    crown.push(&mut file, json!({ "name": "real" }));
    assert!(warnings(&import(&file), WarningKind::Foliage).is_empty());
}

#[test]
fn a_bare_tree_with_a_few_last_leaves_gives_no_warning() {
    let mut file = Gltf { json: empty(), buffer: Vec::new() };
    let mut tube = Shape::tube();
    tube.positions.iter_mut().for_each(|position| *position *= Vec3::new(0.1, 2.0, 0.1));
    let spread = |shape: &Shape, step: f32| {
        (0..40).fold(Shape::default(), |all, i| all.with(shape, Vec3::new((i % 7) as f32, 0.0, (i / 7) as f32) * step))
    };
    spread(&tube, 2.0).push(&mut file, json!({ "name": "twigs" }));
    let leaf = Shape::default().with_card([[0.0, 9.0, 0.2], [0.1, 9.0, 0.2], [0.1, 9.1, 0.2], [0.0, 9.1, 0.2]]);
    spread(&leaf, 2.0).push(&mut file, json!({ "name": "leaves" }));
    let imported = import(&file);
    assert_eq!((imported.plant.leaves.len(), imported.warnings.len()), (40, 0), "{:?}", imported.warnings);
}

#[test]
fn no_tree_of_others_is_said_to_be_invisible_or_to_have_no_foliage() {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else { return };
    let is_tree = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "glb" || extension == "obj");
    let trees: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(is_tree).collect();
    assert!(!trees.is_empty());
    for tree in trees {
        let imported = import::inspect(&tree, &ImportOptions::default()).unwrap();
        for kind in [WarningKind::Invisible, WarningKind::Foliage] {
            assert!(warnings(&imported, kind).is_empty(), "{} {:?}", tree.display(), imported.warnings);
        }
        let is_foliage = |part: &import::Finding| part.verdict == Verdict::Leaf;
        assert_eq!(imported.findings.iter().any(is_foliage), !imported.plant.leaves.is_empty());
    }
}

#[test]
fn a_plant_without_wood_keeps_a_leaf_at_any_level_of_detail_above_0() {
    let three = import_with(&cards(3), &named("leaf")).plant;
    let model = model(&three);
    assert_eq!([0.0, f32::NAN, 1e-9, 0.15, 0.5, 1.0].map(|lod| active_count(&model, lod)), [0, 0, 1, 1, 2, 3]);
    let n = active_count(&model, 0.15) as usize;
    let image = draw_model(&model, n, &camera(&three).camera(SIZE[1]), SIZE, &clear()).unwrap();
    assert!(covered_px(&image) > 0.0);
    assert_eq!(fewest_leaves(3), 1);
    let mut with_wood = model.clone();
    with_wood.wood.indices = vec![0; 3];
    assert_eq!([0.0, 0.15, 0.5].map(|lod| active_count(&with_wood, lod)), [0, 0, 2]);
}
