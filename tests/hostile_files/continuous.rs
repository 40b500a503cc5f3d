//! Continuous glTF, exact and quantised.

use super::survive_reading;
use crate::{
    common::plants,
    glb::Gltf,
    mutate::{Random, damage, damage_json, write_notable},
};
use foliage_lod::{
    FoliageModel, Result, Swap, Timeline,
    continuous::read,
    export::{GlbOptions, write_continuous},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use serde_json::json;

/// Reads a continuous glTF. An accepted model must be valid and stay what it is in a `.vds`, and
/// have equal scales from [`Swap`] and [`Timeline`] at every active count.
fn read_continuous(bytes: &[u8]) -> Result<()> {
    let model = read(bytes)?;
    model.validate().expect("an accepted model is valid");
    let written = model.to_bytes().unwrap();
    assert!(FoliageModel::from_bytes(&written).unwrap().to_bytes().unwrap() == written, "bits are lost");
    let (timeline, mut swap) = (Timeline::new(&model), Swap::new(&model));
    for n in (0..=swap.leaves()).rev() {
        swap.set_active(n);
        let looked_up: Vec<u32> = (0..swap.leaves()).map(|leaf| timeline.scale(leaf, n).to_bits()).collect();
        assert_eq!(swap.scales().iter().map(|scale| scale.to_bits()).collect::<Vec<_>>(), looked_up);
    }
    Ok(())
}

/// Small files with and without wood and texture, down to one leaf, one with all kinds of nodes.
fn files() -> Vec<Gltf> {
    let options = SimplifyOptions { resolution: 16, threads: 1, ..SimplifyOptions::paper() };
    let plants = [plants::masked(12, 1), plants::with_wood(9, 2), plants::quads(1, 1.0, 3), plants::repeated(40, 4)];
    let models = plants.map(|plant| simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model);
    let written = |(number, model): (usize, &FoliageModel)| {
        let exact = number % 2 == 0;
        Gltf::of(&write_continuous(model, &GlbOptions { exact, z_up: !exact, scale: 2.0 }).unwrap())
    };
    let mut files: Vec<Gltf> = models.iter().chain(models.iter().rev()).enumerate().map(written).collect();
    let node = files[0].json["nodes"][0].take();
    let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 2.0, 1.0, 1.0];
    files[0].json["nodes"] = json!([{ "children": [1], "matrix": matrix }, { "children": [2] }, node]);
    files
}

/// Keys and values with a meaning in the format.
const WORDS: &str = " MASK BLEND SCALAR VEC2 VEC3 VEC4 matrix children mode normalized COLOR_0 NORMAL _LEAF _TARGET _SCALE \
    _PIVOT foliageLod leaves version curve errorsPx sizePx sparse uri byteStride EXT_texture_webp KHR_texture_transform a\nb \
    \u{1b}[31m extensionsRequired 5121 5123 5125 5126";

#[test]
fn damaged_continuous_gltf_is_refused_or_sound() {
    let files = files();
    files.iter().for_each(|file| read_continuous(&file.glb()).expect("the undamaged file is valid"));
    let make = move |random: &mut Random| {
        let mut file = random.pick(&files);
        let kind = random.below(4);
        if kind < 2 {
            damage_json(&mut file.json, WORDS, random);
        }
        if kind == 2 {
            for _ in 0..=random.below(3) {
                let at = random.below(file.buffer.len() / 4) * 4;
                write_notable(&mut file.buffer, at, random.pick(&[1, 2, 4]), random);
            }
        }
        let mut bytes = file.glb();
        if kind == 3 {
            damage(&mut bytes, random);
        }
        bytes
    };
    survive_reading("continuous glTF", &["accepted", "unreadable", "unsupported", "unsound"], make, read_continuous);
}
