//! Writes plants as plain GLB of one mesh each: levels of a model, in files of their own or in one.

use super::{
    document::{position_or_push, push},
    writer::{GlbOptions, Writer, corners},
};
use crate::{Plant, Result, material::Material};
use serde_json::{Value, json};

/// Extension that tells of coarser nodes.
const LOD: &str = "MSFT_lod";

/// Encodes a valid plant as a GLB of one mesh, such as one of the [levels](super::Level) of a
/// model. Leaves keep their order within each material.
///
/// # Errors
/// Those of [`write_continuous`](super::write_continuous).
pub fn write_level(plant: &Plant, options: &GlbOptions) -> Result<Vec<u8>> {
    let mut writer = Writer::new(&plant.materials, &plant.textures, corners(plant), options)?;
    let primitives = primitives(&mut writer, plant, |material| material);
    writer.node(json!({ "name": plant.name }), primitives);
    writer.finish()
}

/// Encodes levels, from fine to coarse and each valid, as one GLB with the extension `MSFT_lod`:
/// the first is in the scene, and the others are nodes that it names. Equal materials and textures
/// are written once.
///
/// `coverages` has for each level the least height on screen that it is shown at, as a fraction of
/// the screen's; it is written as `MSFT_screencoverage`.
///
/// # Errors
/// Those of [`write_continuous`](super::write_continuous).
pub fn write_lods(levels: &[&Plant], coverages: &[f32], options: &GlbOptions) -> Result<Vec<u8>> {
    let (mut materials, mut textures) = (Vec::new(), Vec::new());
    let numbers: Vec<Vec<u32>> = levels
        .iter()
        .map(|level| {
            let own = |texture: &u32| level.textures.get(*texture as usize).cloned();
            let merged = |material: &Material| {
                let texture = material.texture.as_ref().and_then(own);
                let texture = texture.map(|texture| position_or_push(&mut textures, texture) as u32);
                position_or_push(&mut materials, Material { texture, ..material.clone() }) as u32
            };
            level.materials.iter().map(merged).collect()
        })
        .collect();
    let points = levels.iter().flat_map(|level| corners(level));
    let mut writer = Writer::new(&materials, &textures, points, options)?;
    for (level, (plant, numbers)) in levels.iter().zip(&numbers).enumerate() {
        let primitives = primitives(&mut writer, plant, |material| numbers[material as usize]);
        let mut node = json!({ "name": format!("{}_LOD{level}", plant.name) });
        if level == 0 {
            node["extensions"] = json!({ LOD: { "ids": (1..levels.len()).collect::<Vec<_>>() } });
            node["extras"] = json!({ "MSFT_screencoverage": coverages });
        }
        writer.node(node, primitives);
    }
    push(&mut writer.document.json["extensionsUsed"], json!(LOD));
    writer.finish()
}

/// A primitive for the leaves of each material, and those of the wood; `number` has the number in
/// the file of each material.
fn primitives(writer: &mut Writer<'_>, plant: &Plant, number: impl Fn(u32) -> u32) -> Vec<Value> {
    let leaves = |material: u32| {
        let leaves = plant.leaves.iter().filter(|leaf| leaf.material == material);
        leaves.flat_map(|leaf| &plant.indices[leaf.index_range()]).copied().collect::<Vec<u32>>()
    };
    let of_leaves = (0..plant.materials.len() as u32).map(|material| (material, leaves(material)));
    let mut primitives: Vec<Value> = of_leaves
        .filter(|(_, indices)| !indices.is_empty())
        .map(|(material, indices)| writer.primitive(&plant.vertices, &indices, number(material)))
        .collect();
    primitives.extend(writer.wood(&plant.wood, number));
    primitives
}
