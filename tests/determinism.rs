//! The same plant and options produce the same bytes.
#![cfg(feature = "simplify")]

mod common;

use common::{
    plants::{self, Random},
    version1,
};
use foliage_lod::{
    FoliageModel, Plant,
    grow::{GrowOptions, Species, grow},
    simplify::{Compensate, CpuFragments, Quiet, SimplifyOptions, simplify},
};

fn model_by(plant: &Plant, threads: usize, options: &SimplifyOptions) -> FoliageModel {
    let options = SimplifyOptions { resolution: 64, threads, ..options.clone() };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn model(plant: &Plant, threads: usize) -> FoliageModel {
    model_by(plant, threads, &SimplifyOptions::paper())
}

fn bytes(plant: &Plant, threads: usize) -> Vec<u8> {
    model(plant, threads).to_bytes().unwrap()
}

/// One plant for each kind of leaf.
fn all_plants() -> [Plant; 6] {
    [
        plants::quads(400, 3.0, 11),
        plants::bent(300, 12),
        plants::crossed(300, 13),
        plants::twins(300, 14),
        plants::with_wood(300, 15),
        plants::masked(300, 16),
    ]
}

#[test]
fn models_are_equal_for_any_number_of_threads_and_every_run() {
    for plant in all_plants() {
        let expected = bytes(&plant, 1);
        for threads in [1, 2, 3, 7, 20, 0] {
            assert!(bytes(&plant, threads) == expected, "{} with {threads} threads", plant.name);
        }
    }
}

#[test]
fn models_judged_by_pictures_are_equal_for_any_number_of_threads() {
    let by_silhouette = SimplifyOptions { compensate: Compensate::Silhouette, ..SimplifyOptions::paper() };
    for options in [SimplifyOptions::balanced(), SimplifyOptions::best(), by_silhouette] {
        for plant in all_plants() {
            let expected = model_by(&plant, 1, &options);
            for threads in [2, 7] {
                let found = model_by(&plant, threads, &options);
                assert!(found == expected, "{} by {} with {threads} threads", plant.name, options.preset);
            }
        }
    }
}

#[test]
fn the_order_of_triangles_and_vertices_within_a_leaf_has_no_influence() {
    let mut random = Random(5);
    for plant in all_plants() {
        let mut shuffled = Plant { vertices: Vec::new(), indices: Vec::new(), leaves: Vec::new(), ..plant.clone() };
        for leaf in &plant.leaves {
            let vertices = &plant.vertices[leaf.vertex_range()];
            let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
            order.sort_by_key(|_| random.next());
            let moved: Vec<_> = order.iter().map(|&vertex| vertices[vertex as usize]).collect();
            let place = |index: u32| order.iter().position(|&v| v == index - leaf.vertices[0]).unwrap() as u32;
            let mut triangles: Vec<[u32; 3]> = plant.indices[leaf.index_range()]
                .chunks_exact(3)
                .map(|corners| [place(corners[0]), place(corners[1]), place(corners[2])])
                .collect();
            triangles.sort_by_key(|_| random.next());
            triangles.iter_mut().for_each(|corners| corners.rotate_left((random.next() % 3) as usize));
            shuffled.push_leaf(&moved, triangles.as_flattened(), leaf.pivot, leaf.material);
        }
        assert!(bytes(&shuffled, 2) == bytes(&plant, 2), "{}", plant.name);
    }
}

#[test]
fn hidden_leaves_go_first_and_add_nothing() {
    // A small cloud inside a closed shell of large cards.
    let mut plant = plants::quads(100, 0.5, 21);
    plant.vertices.iter_mut().for_each(|v| v.position = v.position.map(|x| x * 0.2));
    plant.leaves.iter_mut().for_each(|leaf| leaf.pivot = leaf.pivot.map(|x| x * 0.2));
    let shell = plants::bare("shell");
    assert!(shell.leaves.is_empty());
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            let direction = |a: usize, length: f32| {
                let mut v = glam::Vec3::ZERO;
                v[a % 3] = length;
                v
            };
            let base = direction(axis, side) - direction(axis + 1, 1.01);
            plants::push_card(&mut plant, base, direction(axis + 1, 2.02), direction(axis + 2, 2.02), base);
        }
    }
    let model = model(&plant, 2);
    let last_inner = model.leaves.iter().position(|leaf| leaf.error == 0.0 && leaf.leaf_to_split != u32::MAX);
    assert_eq!(last_inner, Some(6), "the six walls are the first six leaves");
    assert!(model.leaves[6..].iter().all(|leaf| leaf.error == 0.0 && leaf.scale == 1.0));
}

#[test]
fn one_leaf_and_two_leaves_make_models() {
    for count in [1, 2] {
        let model = model(&plants::quads(count, 1.0, 3), 2);
        assert_eq!(model.leaves.len(), count);
        model.validate().unwrap();
    }
}

/// CRC-32 of each embedded species' 300-leaf model with the presets `paper` and `balanced`, as a
/// file of version 1: all bits of the model, whatever the present format makes of them.
const MODELS: [(&str, [u32; 2]); 3] = [
    ("english-oak", [0xe657_2c36, 0xd607_5cb5]),
    ("carya-illinoinensis", [0xa936_ce43, 0x6575_81b5]),
    ("betula-populifolia", [0x9a92_9994, 0x2dee_013f]),
];

/// Fails if another machine, number of threads or build produces different bytes.
///
/// If a species, the method or the encoder of the leaf textures changes on purpose:
/// look at pictures of the new models, copy the numbers that this test prints into [`MODELS`], and
/// note in the changelog that models change.
#[test]
fn models_of_the_embedded_species_are_the_same_on_every_machine() {
    let found = MODELS.map(|(name, _)| {
        let options = GrowOptions { leaves: Some(300), ..GrowOptions::default() };
        let plant = grow(&Species::embedded(name).unwrap(), &options).unwrap();
        let presets = [SimplifyOptions::paper(), SimplifyOptions::balanced()];
        (name, presets.map(|options| crc32fast::hash(&version1::bytes(&model_by(&plant, 0, &options)))))
    });
    assert!(found == MODELS, "found {found:#010x?}");
}
