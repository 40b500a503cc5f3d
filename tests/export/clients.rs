//! Files in three.js: what its loader makes of them.

use super::{grown, lods::cards, node};
use foliage_lod::{
    Plant,
    bounds::Aabb,
    export::{GlbOptions, Level, resized, write_continuous, write_level, write_lods},
    glam::Vec3,
};
use serde_json::Value;
use std::path::{Path, PathBuf};

#[test]
fn three_shows_every_kind_with_all_triangles_in_place_and_the_materials() {
    let mut model = grown("english-oak", 2500);
    model.plant.textures = resized(&model.plant, 64).unwrap();
    let full = Level::new(&model, 1.0).unwrap().plant;
    let level = Level::new(&model, 0.2).unwrap().plant;
    let cards = cards(&model);
    let options = GlbOptions::default();
    let written = [
        (write_level(&full, &options), &full),
        (write_continuous(&model, &options), &full),
        (write_lods(&[&full, &level, &cards], &[0.2, 0.1, 0.0], &options), &full),
        (write_level(&level, &options), &level),
        (write_level(&cards, &options), &cards),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = |number: usize| folder.path().join(format!("{number}.glb"));
    let mut plants: Vec<&Plant> = Vec::new();
    for (bytes, plant) in written {
        std::fs::write(path(plants.len()), bytes.unwrap()).unwrap();
        plants.push(plant);
    }
    let paths: Vec<PathBuf> = (0..plants.len()).map(path).collect();
    let Some(said) = node::run("levels.mjs", &paths.iter().map(PathBuf::as_path).collect::<Vec<&Path>>()) else {
        return;
    };
    let told: Vec<Value> = said.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(told.len(), plants.len());
    for (told, plant) in told.iter().zip(&plants) {
        assert_eq!(told["triangles"], plant.indices.len() / 3 + plant.wood.triangles());
        let corners = plant.vertices.iter().chain(&plant.wood.vertices);
        let own = Aabb::of_points(corners.map(|vertex| vertex.position));
        for (end, own) in [own.min, own.max].into_iter().enumerate() {
            let found: [f64; 3] = serde_json::from_value(told["bounds"][end].clone()).unwrap();
            let off = Vec3::from(found.map(|at| at as f32)).distance(own.into());
            assert!(off < 1e-3, "{found:?} {own:?}");
        }
        let materials = told["materials"].as_array().unwrap();
        assert_eq!(materials.len(), plant.materials.len());
        for material in materials {
            let own = plant.materials.iter().find(|own| material["name"] == own.name).unwrap();
            assert_eq!(material["alphaTest"], own.cutoff().map_or(0.0, f64::from));
            assert_eq!(material["side"], if own.double_sided { 2 } else { 0 });
            assert_eq!(material["texture"].is_null(), own.texture.is_none());
        }
    }
    // Under plain light, cards cover as much and are as bright as the tree.
    let seen = |told: &Value| -> (f64, [f64; 3]) {
        (told["covered"].as_f64().unwrap(), serde_json::from_value(told["color"].clone()).unwrap())
    };
    let [(covered, color), (of_cards, color_of_cards)] = [seen(&told[0]), seen(&told[4])];
    assert!((of_cards / covered - 1.0).abs() < 0.2, "{covered} {of_cards}");
    assert!(color.iter().zip(color_of_cards).all(|(a, b)| (a - b).abs() < 12.0), "{color:?} {color_of_cards:?}");
}
