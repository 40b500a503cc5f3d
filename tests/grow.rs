//! Grown trees: exact leaf counts, valid plants, reproducible bytes, and GLB files that follow the
//! glTF specification.
#![cfg(feature = "simplify")]

use foliage_lod::{
    Plant,
    export::write_glb,
    grow::{GrowOptions, MAX_GROWN_LEAVES, Species, grow},
    import::{ImportOptions, load_gltf_bytes},
    leaf::LeafGeometry,
};
use glam::Vec3;
use std::{collections::HashSet, path::Path, sync::LazyLock};

/// Leaf counts from Gasch et al., "Multiresolution Foliage Rendering".
const PAPER_COUNTS: [(&str, usize); 3] =
    [("english-oak", 20_146), ("carya-illinoinensis", 8_059), ("betula-populifolia", 12_140)];
/// CRC-32 of the leaf and wood vertices of each embedded tree, recorded on x86-64.
const VERTEX_SUMS: [(u32, u32); 3] =
    [(0x03E2_1132, 0xD0AC_B546), (0x8D01_4500, 0x5B24_8C26), (0xA183_93BB, 0xDCB6_BA2F)];
/// A species file for the tests to corrupt.
const OAK: &str = include_str!("../data/species/english-oak.toml");

/// Name, leaf count in the paper, and the tree grown with default options.
static TREES: LazyLock<Vec<(&str, usize, Plant)>> =
    LazyLock::new(|| PAPER_COUNTS.iter().map(|&(name, count)| (name, count, grown(name, None))).collect());

fn grown(name: &str, leaves: Option<u32>) -> Plant {
    grow(&Species::embedded(name).unwrap(), &GrowOptions { leaves, seed: None }).unwrap()
}

#[test]
fn embedded_trees_have_the_papers_leaf_counts_and_are_sound() {
    for (name, count, plant) in &*TREES {
        plant.validate().unwrap();
        assert_eq!(plant.leaves.len(), *count, "{name}");
        assert!(plant.leaves.iter().all(|leaf| leaf.triangles() == 2 && leaf.vertex_range().len() == 4));
    }
}

#[test]
fn any_leaf_count_is_exact_and_leaves_the_stems_alone() {
    let full = &TREES[0].2;
    for leaves in [1, 2, 200, 20_145, 30_000] {
        let plant = grown("english-oak", Some(leaves));
        plant.validate().unwrap();
        assert_eq!(plant.leaves.len(), leaves as usize);
        assert_eq!(plant.wood, full.wood);
    }
}

#[test]
fn nothing_but_a_leaning_trunks_rim_reaches_below_the_ground() {
    for (name, _, plant) in &*TREES {
        let lowest = plant.aabb().min[1];
        assert!(lowest > -0.05, "{name} reaches down to {lowest} m");
    }
}

#[test]
fn leaf_counts_out_of_range_are_refused_with_the_range() {
    let oak = Species::embedded("english-oak").unwrap();
    for leaves in [0, MAX_GROWN_LEAVES + 1] {
        let error = grow(&oak, &GrowOptions { leaves: Some(leaves), seed: None }).unwrap_err();
        assert_eq!(error.to_string(), format!("leaves is {leaves}; it must be from 1 to 1000000"));
    }
}

#[test]
fn leaves_hang_on_twigs_and_share_no_edge() {
    for (name, _, plant) in &*TREES {
        let mut edges = HashSet::new();
        for leaf in &plant.leaves {
            let [a, b] = [0, 1].map(|i| Vec3::from(plant.vertices[leaf.vertex_range()][i].position));
            assert!(((a + b) * 0.5).distance(leaf.pivot.into()) < 1e-5, "{name}: the foot is the pivot");
            for triangle in plant.indices[leaf.index_range()].chunks(3) {
                for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                    let end = |i: usize| plant.vertices[triangle[i] as usize].position.map(f32::to_bits);
                    edges.insert([end(i).min(end(j)), end(i).max(end(j))]);
                }
            }
        }
        assert_eq!(edges.len(), 5 * plant.leaves.len(), "{name}: four edges and a diagonal each");
        assert_pivots_touch_wood(name, plant);
    }
}

/// Checks that every 997th pivot is within two centimetres of an edge of a wood triangle.
fn assert_pivots_touch_wood(name: &str, plant: &Plant) {
    let wood: Vec<[Vec3; 3]> = plant
        .wood
        .indices
        .chunks(3)
        .map(|corners| [0, 1, 2].map(|i| Vec3::from(plant.wood.vertices[corners[i] as usize].position)))
        .collect();
    for leaf in plant.leaves.iter().step_by(997) {
        let pivot = Vec3::from(leaf.pivot);
        let nearest = wood.iter().map(|triangle| distance_to_long_edges(pivot, triangle)).fold(f32::MAX, f32::min);
        assert!(nearest < 0.02, "{name}: a leaf floats {nearest} m from the wood");
    }
}

/// Distance to the nearest edge of `triangle`: twigs are thin, so one of their edges is close.
fn distance_to_long_edges(point: Vec3, triangle: &[Vec3; 3]) -> f32 {
    let edge = |a: Vec3, b: Vec3| {
        let share = ((point - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
        point.distance(a.lerp(b, share))
    };
    edge(triangle[0], triangle[1]).min(edge(triangle[1], triangle[2])).min(edge(triangle[2], triangle[0]))
}

#[test]
fn normals_are_unit_and_those_of_the_cards() {
    let plant = &TREES[2].2;
    for vertex in plant.vertices.iter().chain(&plant.wood.vertices) {
        assert!((Vec3::from(vertex.normal).length() - 1.0).abs() < 1e-4);
    }
    for triangle in plant.indices.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(plant.vertices[triangle[i] as usize].position));
        let normal = Vec3::from(plant.vertices[triangle[0] as usize].normal);
        assert!((b - a).cross(c - a).normalize().dot(normal) > 0.999);
    }
}

#[test]
fn the_same_seed_grows_the_same_bytes_and_another_seed_another_tree() {
    let oak = Species::embedded("english-oak").unwrap();
    let bytes = |seed| write_glb(&grow(&oak, &GrowOptions { leaves: Some(500), seed }).unwrap()).unwrap();
    assert_eq!(bytes(None), bytes(None));
    assert_eq!(bytes(None), bytes(Some(oak.seed)));
    assert_ne!(bytes(None), bytes(Some(oak.seed + 1)));
}

#[test]
fn leaf_textures_have_transparent_and_opaque_texels_and_no_dark_fringe() {
    for (name, _, plant) in &*TREES {
        let pixels = plant.textures[0].decode().unwrap();
        let covered = pixels.rgba.chunks(4).filter(|texel| texel[3] >= 128).count();
        let share = covered as f32 / (pixels.width * pixels.height) as f32;
        assert!((0.25..0.8).contains(&share), "{name}: {share} of the card is covered");
        assert!(pixels.rgba.chunks(4).all(|texel| texel[1] > 40), "{name}: black under transparent texels");
    }
}

#[test]
fn unknown_species_and_keys_and_values_out_of_range_are_named() {
    let refusal = |text: &str| Species::from_toml(text, Path::new("my.toml")).unwrap_err().to_string();
    assert_eq!(
        Species::embedded("elm").unwrap_err().to_string(),
        "species is \"elm\"; it must be english-oak, carya-illinoinensis, betula-populifolia, hazel, male-fern, meadow-grass, or a species .toml file"
    );
    let unknown = refusal(&OAK.replace("lobe_depth", "lobe_deepness"));
    assert!(unknown.starts_with("my.toml: line ") && unknown.contains("unknown field `lobe_deepness`"), "{unknown}");
    assert!(refusal(&OAK.replace("leaves = 20146", "")).contains("missing field `leaves`"));
    let steep = OAK.replace("flare = ", "flare = 1");
    assert!(
        refusal(&steep).starts_with("my.toml: crown.flare is 1") && refusal(&steep).ends_with("it must be from 0 to 5")
    );
    assert!(refusal(&OAK.replace("light = ", "light = nan#")).contains("leaf.light is NaN; it must be from 0 to 1"));
    for text in ["", "=", "levels = 3", "\u{0}"] {
        assert!(!refusal(text).contains('\n'));
    }
}

#[test]
fn a_species_with_too_many_stems_is_refused_before_it_grows() {
    let bushy = OAK.replace("branches = ", "branches = 2#");
    let mut species = Species::from_toml(&bushy, Path::new("bushy.toml")).unwrap();
    species.levels.iter_mut().for_each(|level| level.branches = 500);
    let error = grow(&species, &GrowOptions::default()).unwrap_err().to_string();
    assert!(error.contains("number of stems is") && error.contains("limit of 100000"), "{error}");
}

#[test]
fn species_at_the_ends_of_their_ranges_grow_sound_plants() {
    use foliage_lod::grow::Shape::*;
    let oak = Species::embedded("english-oak").unwrap();
    let shapes = [Conical, Spherical, Hemispherical, Cylindrical, TaperedCylindrical, Flame, InverseConical, TendFlame];
    for (i, shape) in shapes.into_iter().enumerate() {
        let mut species = oak.clone();
        species.crown.shape = shape;
        species.crown.trunks = 1 + i as u32;
        species.leaf.levels = 1 + i as u32 % 4;
        species.levels.truncate(2 + i % 3);
        species.leaf.levels = species.leaf.levels.min(species.levels.len() as u32);
        species.levels.iter_mut().for_each(|level| {
            level.branches = i as u32 / 2;
            level.segments = 1 + i as u32;
            level.lift = -360.0 + 90.0 * i as f32;
        });
        let plant = grow(&species, &GrowOptions { leaves: Some(50), seed: None }).unwrap();
        plant.validate().unwrap();
        assert_eq!(plant.leaves.len(), 50);
    }
}

#[test]
fn a_species_changed_out_of_range_is_refused_not_grown() {
    let mut oak = Species::embedded("english-oak").unwrap();
    oak.levels.clear();
    let error = grow(&oak, &GrowOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "English oak: levels is 0; it must be from 2 to 4");
}

/// The sums are the same on every machine: vertex positions use only basic arithmetic and `libm`.
/// Changing a species file changes the sums.
#[test]
fn every_machine_grows_the_same_vertices() {
    let sums = TREES.iter().map(|(_, _, plant)| {
        let leaves = crc32fast::hash(bytemuck::cast_slice(&plant.vertices));
        (leaves, crc32fast::hash(bytemuck::cast_slice(&plant.wood.vertices)))
    });
    assert_eq!(sums.collect::<Vec<_>>(), VERTEX_SUMS);
}

#[test]
fn glb_passes_full_validation_and_its_accessors_match_their_data() {
    for (_, count, plant) in &*TREES {
        let bytes = write_glb(plant).unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = document.blob.as_deref().unwrap();
        let meshes: Vec<_> = document.meshes().collect();
        assert_eq!(meshes.iter().map(|mesh| mesh.name().unwrap()).collect::<Vec<_>>(), ["wood", "leaves"]);
        for mesh in &meshes {
            for primitive in mesh.primitives() {
                assert_accessors(&primitive, blob);
            }
        }
        let leaves = meshes[1].primitives().next().unwrap();
        assert_eq!(leaves.indices().unwrap().count(), 6 * count);
        assert_eq!(leaves.material().alpha_mode(), gltf::material::AlphaMode::Mask);
        assert!(leaves.material().double_sided());
        assert_eq!(leaves.material().alpha_cutoff(), Some(0.5));
        for view in document.views() {
            assert_eq!(view.offset() % 4, 0);
        }
    }
}

fn assert_accessors(primitive: &gltf::Primitive, blob: &[u8]) {
    let reader = primitive.reader(|_| Some(blob));
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let bounds = foliage_lod::bounds::Aabb::of_points(positions.iter().copied());
    let written = primitive.bounding_box();
    assert_eq!((bounds.min, bounds.max), (written.min, written.max));
    assert!(reader.read_normals().unwrap().all(|normal| (Vec3::from(normal).length() - 1.0).abs() < 1e-4));
    assert_eq!(reader.read_tex_coords(0).unwrap().into_f32().count(), positions.len());
    let indices: HashSet<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices.len(), positions.len(), "every vertex is used");
    assert_eq!(indices.iter().max().map(|&index| index as usize + 1), Some(positions.len()));
}

#[test]
fn glb_of_an_empty_plant_is_still_read() {
    let bytes = write_glb(&Plant::default()).unwrap();
    assert_eq!(gltf::Gltf::from_slice(&bytes).unwrap().meshes().count(), 0);
}

#[test]
fn a_grown_glb_is_imported_leaf_by_leaf() {
    for (name, count, plant) in &*TREES {
        let bytes = write_glb(plant).unwrap();
        let imported = load_gltf_bytes(&bytes, Path::new("tree.glb"), &ImportOptions::default()).unwrap().plant;
        assert_eq!(imported.leaves.len(), *count, "{name}");
        assert_eq!(imported.wood.triangles(), plant.wood.triangles(), "{name}");
        for (leaf, (read, grown)) in imported.leaves.iter().zip(&plant.leaves).enumerate() {
            assert_eq!(corners(&imported, read), corners(plant, grown), "{name}, leaf {leaf}");
        }
    }
}

/// Bits of a leaf's positions, in ascending order.
fn corners(plant: &Plant, leaf: &LeafGeometry) -> Vec<[u32; 3]> {
    let mut corners: Vec<_> =
        plant.vertices[leaf.vertex_range()].iter().map(|vertex| vertex.position.map(f32::to_bits)).collect();
    corners.sort_unstable();
    corners
}
