//! Trees made by others are imported with the leaf counts that their authors state, or refused as
//! expected.
//!
//! The files are in the folder named by the environment variable `FOLIAGE_TREES`. If it is not set,
//! these tests print a note and pass; if it is, a missing file is a failure.
#![cfg(feature = "simplify")]

use foliage_lod::{Error, Plant, import};
use import::{Group, ImportOptions, Imported, Verdict};
use std::path::PathBuf;

/// Expected contents of a file.
struct Expected {
    file: &'static str,
    pieces: usize,
    crossed: usize,
    /// Minimum and maximum number of triangles per piece.
    triangles: [usize; 2],
    wood: bool,
}

const fn tree(file: &'static str, pieces: usize, crossed: usize, triangles: [usize; 2]) -> Expected {
    Expected { file, pieces, crossed, triangles, wood: true }
}

const fn fern(file: &'static str, leaves: usize, triangles: [usize; 2]) -> Expected {
    Expected { file, pieces: leaves, crossed: leaves, triangles, wood: false }
}

const TREES: &[Expected] = &[
    tree("eztree_oak_medium.glb", 5320, 2660, [2, 2]),
    tree("eztree_oak_medium_draco.glb", 5320, 2660, [2, 2]),
    tree("eztree_oak_medium_meshopt.glb", 5320, 2660, [2, 2]),
    tree("eztree_oak_medium_quantize.glb", 5320, 2660, [2, 2]),
    tree("sapling_birch_8k_rect.glb", 7769, 7769, [2, 2]),
    tree("sapling_maple_12k_hex.glb", 12_246, 12_246, [4, 4]),
    // 300 triples and 30 pairs of cards, so close together that some of them merge into one leaf.
    tree("CommonTree_1.glb", 960, 322, [2, 2]),
    tree("CommonTree_1.obj", 960, 322, [2, 2]),
    tree("Pine_1.glb", 35, 35, [22, 22]),
    fern("Fern_1.glb", 9, [32, 32]),
    tree("ftlab_keyaki.glb", 630, 630, [8, 8]),
    fern("fern_02.glb", 53, [88, 176]),
    fern("fern_02_meshopt_webp.glb", 53, [88, 176]),
    tree("proctree_l7.glb", 896, 896, [4, 4]),
    tree("seedthree_whiteoak_LOD0_merged.glb", 11_648, 5824, [2, 2]),
    tree("seedthree_whiteoak_LOD1_merged.glb", 5824, 2912, [2, 2]),
    tree("seedthree_whiteoak_LOD2_merged.glb", 1626, 813, [2, 2]),
    tree("seedthree_whiteoak_LOD0_instanced.glb", 11_648, 5824, [2, 2]),
    tree("realistic_palm_10.glb", 29, 29, [88, 176]),
    fern("grass_1_geo.obj", 26, [16, 16]),
];

const WITHOUT_LEAVES: &[&str] = &["tree_default_fall.glb", "tree-spruce-0-0.glb"];

/// The path of `file`; `None`, with a note printed, if `FOLIAGE_TREES` is not set.
fn path(file: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else {
        eprintln!("skipped: FOLIAGE_TREES is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(file);
    assert!(path.is_file(), "{} is missing", path.display());
    Some(path)
}

fn load(file: &str, group: Group) -> Option<Imported> {
    let options = ImportOptions { group, ..ImportOptions::default() };
    path(file).map(|path| import::load(&path, &options).unwrap_or_else(|error| panic!("{error}")))
}

fn triangles_of_leaves(plant: &Plant) -> Option<[usize; 2]> {
    let counts = plant.leaves.iter().map(|leaf| leaf.triangles());
    Some([counts.clone().min()?, counts.max()?])
}

#[test]
fn every_piece_is_a_leaf_of_the_stated_size() {
    for expected in TREES {
        let Some(imported) = load(expected.file, Group::Piece) else { return };
        let plant = &imported.plant;
        assert_eq!(plant.leaves.len(), expected.pieces, "{}", expected.file);
        assert_eq!(triangles_of_leaves(plant), Some(expected.triangles), "{}", expected.file);
        assert_eq!(!plant.wood.parts.is_empty(), expected.wood, "{}", expected.file);
    }
}

#[test]
fn crossed_cards_are_one_leaf() {
    for expected in TREES {
        let Some(imported) = load(expected.file, Group::Crossed) else { return };
        assert_eq!(imported.plant.leaves.len(), expected.crossed, "{}", expected.file);
        let triangles = if expected.pieces == expected.crossed { expected.triangles[1] } else { 4 };
        let [_, most] = triangles_of_leaves(&imported.plant).unwrap();
        assert!(most >= triangles, "{}", expected.file);
    }
}

#[test]
fn trees_without_separable_leaves_are_refused_with_the_fix() {
    for file in WITHOUT_LEAVES {
        let Some(path) = path(file) else { return };
        let error = import::load(&path, &ImportOptions::default()).unwrap_err();
        assert!(matches!(error, Error::NoLeaves { .. }), "{error}");
        assert!(error.to_string().contains("`leaves`"), "{error}");
        let inspected = import::inspect(&path, &ImportOptions::default()).unwrap();
        assert!(inspected.findings.iter().all(|finding| finding.verdict == Verdict::Wood));
    }
}

#[test]
fn obj_and_glb_of_one_tree_agree() {
    for group in [Group::Piece, Group::Crossed] {
        let (Some(glb), Some(obj)) = (load("CommonTree_1.glb", group), load("CommonTree_1.obj", group)) else { return };
        let [glb, obj] = [glb.plant, obj.plant];
        assert_eq!(glb.leaf_triangles(), obj.leaf_triangles());
        assert_eq!(glb.wood.triangles(), obj.wood.triangles());
        // The OBJ file has six decimals.
        let [glb, obj] = [glb.sphere(), obj.sphere()];
        assert!((glb.radius - obj.radius).abs() < 1e-5, "{glb:?} {obj:?}");
        assert!(glb.center().distance(obj.center()) < 1e-5, "{glb:?} {obj:?}");
    }
}

#[test]
fn instances_give_the_leaves_of_the_merged_tree() {
    let file = |name| load(name, Group::Crossed);
    let (Some(merged), Some(instanced)) =
        (file("seedthree_whiteoak_LOD0_merged.glb"), file("seedthree_whiteoak_LOD0_instanced.glb"))
    else {
        return;
    };
    let [merged, instanced] = [merged.plant.sphere(), instanced.plant.sphere()];
    assert!((merged.radius - instanced.radius).abs() < 1e-3, "{merged:?} {instanced:?}");
    assert!(merged.center().distance(instanced.center()) < 1e-3, "{merged:?} {instanced:?}");
}

#[test]
fn compressed_trees_stand_where_the_plain_one_stands() {
    let Some(plain) = load("eztree_oak_medium.glb", Group::Crossed) else { return };
    let plain = plain.plant;
    for file in ["eztree_oak_medium_draco.glb", "eztree_oak_medium_meshopt.glb", "eztree_oak_medium_quantize.glb"] {
        let Some(compressed) = load(file, Group::Crossed) else { return };
        let compressed = compressed.plant;
        // The positions are quantised to 14 bits or more.
        let tolerance = plain.sphere().radius / f64::from(1 << 13);
        assert!((plain.sphere().radius - compressed.sphere().radius).abs() < tolerance, "{file}");
        assert!(plain.sphere().center().distance(compressed.sphere().center()) < tolerance, "{file}");
        assert_eq!(plain.textures.len(), compressed.textures.len(), "{file}");
    }
}

#[test]
fn colours_beyond_one_and_cutoffs_are_kept() {
    let Some(tree) = load("CommonTree_1.glb", Group::Crossed) else { return };
    assert!(tree.plant.vertices.iter().any(|vertex| vertex.color[0] > 1.0));
    let leaf = &tree.plant.materials[tree.plant.leaves[0].material as usize];
    assert_eq!((leaf.name.as_str(), leaf.alpha_cutoff), ("Leaves_NormalTree", 0.2));
}

#[test]
fn naming_the_material_or_the_node_overrides_the_guess() {
    let Some(path) = path("ftlab_keyaki.glb") else { return };
    let named =
        |name: &str| ImportOptions { leaves: vec![name.to_owned()], group: Group::Piece, ..ImportOptions::default() };
    assert_eq!(import::load(&path, &named("trunk")).unwrap().plant.leaves.len(), 241);
    assert_eq!(import::load(&path, &named("ground")).unwrap().plant.leaves.len(), 1);
    let error = import::load(&path, &named("petals")).unwrap_err().to_string();
    assert!(error.contains("leaves_keyaki"), "{error}");
}
