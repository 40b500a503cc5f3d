//! Exported files: what comes back from them, what they show, and what Khronos' validator says.
//!
//! Without Node and the packages of `web` the validator's test prints a note and passes; with
//! `FOLIAGE_REQUIRE_WEB=1` it fails.
#![cfg(feature = "simplify")]

#[path = "export/clients.rs"]
mod clients;
#[path = "common/glb.rs"]
mod glb;
#[path = "export/lods.rs"]
mod lods;
#[path = "common/node.rs"]
mod node;

use foliage_lod::{
    FoliageModel, LookAt, Plant,
    bounds::Aabb,
    export::{GlbOptions, Level, write_continuous, write_level, write_lods},
    glam::{DVec3, Vec3},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    leaf::Vertex,
    plant::WoodPart,
    simplify::{CpuFragments, GrowBy, Quiet, SimplifyOptions, simplify},
    software::{Background, DrawOptions, draw_model, draw_plant},
};
use glb::Gltf;
use std::path::{Path, PathBuf};

const EXACT: GlbOptions = GlbOptions { exact: true, z_up: false, scale: 1.0 };

fn simplified(plant: &Plant) -> FoliageModel {
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    let mut model = simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.order_wood();
    model
}

fn grown(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    simplified(&grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap())
}

/// A glTF's attribute as rows of floats, with the fractions that integers stand for.
fn rows(gltf: &Gltf, primitive: usize, name: &str) -> Vec<Vec<f32>> {
    let number = &gltf.json["meshes"][0]["primitives"][primitive]["attributes"][name];
    let accessor = &gltf.json["accessors"][number.as_u64().unwrap() as usize];
    let view = &gltf.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let size = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        shape => shape[3..].parse().unwrap(),
    };
    let bytes = if accessor["componentType"] == 5126 { 4 } else { 2 };
    let stride = view["byteStride"].as_u64().unwrap_or(size as u64 * bytes) as usize;
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    let count = accessor["count"].as_u64().unwrap() as usize;
    let value = |row: usize, part: usize| {
        let at = &gltf.buffer[start + row * stride + part * bytes as usize..];
        match bytes {
            4 => f32::from_le_bytes(at[..4].try_into().unwrap()),
            _ => f32::from(u16::from_le_bytes(at[..2].try_into().unwrap())) / 65535.0,
        }
    };
    (0..count).map(|row| (0..size).map(|part| value(row, part)).collect()).collect()
}

/// Leaves of all primitives by number: target, scale and pivot in the node's space.
fn leaves(gltf: &Gltf) -> Vec<Option<(f32, f32, Vec3)>> {
    let primitives = gltf.json["meshes"][0]["primitives"].as_array().unwrap();
    let count = gltf.json["nodes"][0]["extras"]["foliageLod"]["leaves"].as_u64().unwrap() as usize;
    let mut leaves = vec![None; count];
    for at in (0..primitives.len()).filter(|&at| !primitives[at]["attributes"]["_LEAF"].is_null()) {
        let [numbers, targets, scales, pivots] =
            ["_LEAF", "_TARGET", "_SCALE", "_PIVOT"].map(|name| rows(gltf, at, name));
        let mut last = 0.0;
        for (i, number) in numbers.iter().enumerate() {
            assert!(number[0] >= last, "leaves are in drawing order");
            last = number[0];
            let leaf = (targets[i][0], scales[i][0], Vec3::from_slice(&pivots[i]));
            let known = leaves[number[0] as usize].replace(leaf);
            assert!(known.is_none_or(|known| known == leaf), "all corners of a leaf agree");
        }
    }
    leaves
}

#[test]
fn a_continuous_file_holds_the_model_and_is_the_full_tree_to_an_importer() {
    let model = grown("betula-populifolia", 700);
    let folder = tempfile::tempdir().unwrap();
    for options in [EXACT, GlbOptions::default()] {
        let bytes = write_continuous(&model, &options).unwrap();
        assert_eq!(bytes, write_continuous(&model, &options).unwrap());
        let gltf = Gltf::of(&bytes);
        let node = &gltf.json["nodes"][0];
        let side = node["scale"][0].as_f64().unwrap_or(1.0) as f32;
        let low = [0, 1, 2].map(|i| node["translation"][i].as_f64().unwrap_or(0.0) as f32);
        let within = if options.exact { 0.0 } else { 2.0 * side / 65535.0 };
        let found = leaves(&gltf);
        assert_eq!(found.len(), model.leaves.len());
        for (leaf, found) in model.leaves.iter().zip(&found) {
            let (target, scale, pivot) = found.unwrap();
            assert_eq!((target, scale), (leaf.target().map_or(-1.0, |target| target as f32), leaf.scale));
            let pivot = pivot * side + Vec3::from(low);
            assert!(pivot.distance(leaf.pivot.into()) <= within, "{pivot} {:?}", leaf.pivot);
        }
        let path = folder.path().join("birch.glb");
        std::fs::write(&path, &bytes).unwrap();
        let back = load(&path, &ImportOptions::default()).unwrap().plant;
        assert_eq!(back.leaves.len(), model.leaves.len());
        assert_eq!(back.wood.triangles(), model.wood.triangles());
        assert_eq!(back.materials.len(), model.materials.len());
        // Importers sort leaves by their own rules.
        let corner = |vertex: &Vertex| Vec3::from(vertex.position);
        for own in model.vertices.iter().step_by(17).map(corner) {
            let nearest = back.vertices.iter().map(|other| corner(other).distance(own)).fold(f32::INFINITY, f32::min);
            assert!(nearest <= within.max(1e-6), "{own} is {nearest} off");
        }
    }
}

#[test]
fn levels_show_what_the_model_shows_at_their_counts() {
    let mut model = grown("carya-illinoinensis", 900);
    let sphere = model.sphere();
    let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
    let camera = LookAt::framing(&sphere, DVec3::new(0.3, 0.1, 1.0), 0.8, 1.0).camera(200);
    let mut sizes = Vec::new();
    for lod in [1.0, 0.4, 0.1, 0.0] {
        let level = Level::new(&model, lod).unwrap();
        assert_eq!(level.leaves, ((lod * 900.0) as u32).max(1));
        sizes.push((level.size_px, level.plant.wood.triangles()));
        let bare = |wood: Plant| Plant { wood: Default::default(), ..wood };
        let shown = draw_plant(&bare(level.plant.clone()), &camera, [200; 2], &options).unwrap();
        let wood = std::mem::take(&mut model.plant.wood);
        let own = draw_model(&model, level.leaves as usize, &camera, [200; 2], &options).unwrap();
        model.plant.wood = wood;
        // Minified cut-outs are dithered by the places of their corners.
        let alphas =
            || shown.rgba.iter().zip(&own.rgba).skip(3).step_by(4).map(|(a, b)| (f64::from(*a), f64::from(*b)));
        let [ours, theirs] = [alphas().map(|(a, _)| a).sum::<f64>(), alphas().map(|(_, b)| b).sum()];
        let differing = alphas().map(|(a, b)| (a - b).abs()).sum::<f64>() / theirs;
        println!("{lod}: {:.4} covered, {differing:.4} differing", ours / theirs);
        assert!((ours / theirs - 1.0).abs() < 0.01 && differing < 0.05, "{differing} at {lod}");
        let has_back = |part: &WoodPart| level.plant.materials[part.material as usize].double_sided;
        assert!(lod == 1.0 || level.plant.wood.parts.iter().all(has_back), "thin stems are flat");
        level.plant.validate().unwrap();
    }
    assert_eq!(sizes[0], (f32::INFINITY, model.wood.triangles()));
    assert!(sizes.windows(2).all(|pair| pair[1].0 < pair[0].0 && pair[1].1 < pair[0].1), "{sizes:?}");
}

#[test]
fn wrong_scales_are_refused_and_the_axes_turn() {
    let model = grown("betula-populifolia", 60);
    for scale in [0.0, -1.0, 1e-46, 1e300, f64::NAN, f64::INFINITY] {
        assert!(write_continuous(&model, &GlbOptions { scale, ..EXACT }).is_err(), "{scale}");
    }
    // A plant that a scale within the range makes smaller than `f32` holds.
    let mut tiny = model.clone();
    tiny.plant.vertices.iter_mut().for_each(|vertex| vertex.position = vertex.position.map(|part| 1e-30 * part));
    tiny.plant.leaves.iter_mut().for_each(|leaf| leaf.pivot = leaf.pivot.map(|part| 1e-30 * part));
    tiny.plant.wood = Default::default();
    assert!(write_continuous(&tiny, &GlbOptions::default()).is_ok());
    assert!(write_continuous(&tiny, &GlbOptions { scale: 1e-11, ..EXACT }).is_err());
    let folder = tempfile::tempdir().unwrap();
    for exact in [true, false] {
        let path = folder.path().join("turned.glb");
        std::fs::write(&path, write_continuous(&model, &GlbOptions { exact, z_up: true, scale: 100.0 }).unwrap())
            .unwrap();
        let back = load(&path, &ImportOptions::default()).unwrap().plant;
        let around = |vertices: &[Vertex]| Aabb::of_points(vertices.iter().map(|vertex| vertex.position));
        let (own, back) = (around(&model.vertices), around(&back.vertices));
        let [low, high] = [own.min, own.max];
        let expected = [[low[0], -high[2], low[1]], [high[0], -low[2], high[1]]];
        for (expected, found) in expected.into_iter().zip([back.min, back.max]) {
            let off = (Vec3::from(expected) * 100.0).distance(found.into());
            assert!(off < 0.1, "{expected:?} {found:?}");
        }
    }
}

/// Species and files of other programs, as continuous glTF and as a level.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut models: Vec<FoliageModel> =
        ["english-oak", "betula-populifolia", "carya-illinoinensis"].map(|species| grown(species, 400)).to_vec();
    if let Some(trees) = std::env::var_os("FOLIAGE_TREES") {
        let trees = Path::new(&trees);
        for name in [
            "eztree_oak_medium.glb",
            "CommonTree_1.glb",
            "proctree_l7.glb",
            "sapling_birch_8k_rect.glb",
            "ftlab_keyaki.glb",
        ] {
            let plant = load(&trees.join(name), &ImportOptions::default()).unwrap().plant;
            let options = SimplifyOptions { resolution: 32, grow_by: GrowBy::Scale, ..SimplifyOptions::fast() };
            models.push(simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model);
        }
    } else {
        println!("skipped: FOLIAGE_TREES is not set");
    }
    models.push(lods::hostile());
    let mut files = Vec::new();
    for (number, model) in models.iter().enumerate() {
        let level = Level::new(model, 0.2).unwrap().plant;
        let cards = lods::cards(model);
        let written = [
            write_continuous(model, &EXACT),
            write_continuous(model, &GlbOptions::default()),
            write_level(&level, &GlbOptions::default()),
            write_level(&cards, &GlbOptions::default()),
            write_lods(&[&level, &cards], &[0.1, 0.0], &GlbOptions::default()),
        ];
        for (kind, bytes) in written.into_iter().enumerate() {
            let path = folder.join(format!("{number}-{kind}.glb"));
            std::fs::write(&path, bytes.unwrap()).unwrap();
            files.push(path);
        }
    }
    files
}

#[test]
fn khronos_validator_has_nothing_to_say() {
    let folder = tempfile::tempdir().unwrap();
    let files = files(folder.path());
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    node::run("validate.mjs", &files);
}
