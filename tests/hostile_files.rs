//! Randomly damaged files of every format that is read: each produces a one-line error or a valid
//! result, within a second and within memory bounded by its size.
//!
//! `FOLIAGE_FUZZ_CASES` is the number of files of each kind. Case `k` is the same on every run.
//! With `--nocapture` each test prints the number of cases per outcome, the total time and the peak
//! memory of any case.
#![cfg(feature = "simplify")]

mod common;
#[path = "common/glb.rs"]
mod glb;
#[path = "common/memory.rs"]
mod memory;
#[path = "common/mutate.rs"]
mod mutate;

use common::{plants, version1, version2};
use foliage_lod::{
    Error, FoliageModel, Result, Swap, Timeline,
    grow::Species,
    import::{ImportOptions, Imported, load_gltf_bytes, load_obj_bytes},
    material::Material,
    model::ModelFile,
    plant::Outline,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use glb::{Gltf, cards};
use memory::within_bounds;
use mutate::{Random, damage, damage_json, damage_text, survive, write_notable};
use serde_json::{Value, json};
use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

/// Creates a file with `make` for each case and reads it with `read`.
fn survive_reading(
    kind: &str,
    expected: &[&str],
    make: impl Fn(&mut Random) -> Vec<u8> + Send + 'static,
    read: impl Fn(&[u8]) -> Result<()> + Send + 'static,
) {
    let most = Arc::new(AtomicU64::new(0));
    let of_all = most.clone();
    survive(kind, expected, move |random| {
        let file = make(random);
        let (read, bytes) = within_bounds(file.len() as u64, || read(&file));
        of_all.fetch_max(bytes, Ordering::Relaxed);
        outcome(read)
    });
    println!("{kind}: at most {:.2} MB held", most.load(Ordering::Relaxed) as f64 / 1e6);
}

/// The outcome of reading a file, as a short name.
fn outcome(read: Result<()>) -> &'static str {
    let Err(error) = read else { return "accepted" };
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "not a plain line: {message:?}");
    match error {
        Error::Unreadable { .. } => "unreadable",
        Error::Unsupported { .. } => "unsupported",
        Error::InvalidModel { .. } => "unsound",
        Error::NoLeaves { .. } => "leafless",
        Error::InvalidOption { field, .. } if field == "leaves" => "unknown name",
        Error::TooLarge { .. } => "too large",
        Error::Io { .. } => "missing file",
        other => panic!("a reader must not return this error: {other:?}"),
    }
}

/// Reads a `.vds` file. An accepted model must be valid, keep every bit when it is written and read
/// again, and have equal scales from [`Swap`] and [`Timeline`] at every active count.
fn read_model(bytes: &[u8]) -> Result<()> {
    let ModelFile { model, version, .. } = ModelFile::from_bytes(bytes)?;
    model.validate().expect("an accepted model is valid");
    let bits = version1::bytes(&model);
    assert!(version != 1 || bits == bytes, "the model is not written as it was read");
    let written = model.to_bytes().unwrap();
    let again = FoliageModel::from_bytes(&written).expect("what is written can be read");
    assert!(version1::bytes(&again) == bits && again.precision == model.precision, "bits are lost");
    assert!(again.to_bytes().unwrap() == written, "the model is not written as it was read");
    let (timeline, mut swap) = (Timeline::new(&model), Swap::new(&model));
    for n in (0..=swap.leaves()).rev() {
        swap.set_active(n);
        let looked_up: Vec<u32> = (0..swap.leaves()).map(|leaf| timeline.scale(leaf, n).to_bits()).collect();
        assert_eq!(swap.scales().iter().map(|scale| scale.to_bits()).collect::<Vec<_>>(), looked_up);
    }
    Ok(())
}

/// Small models with and without wood and texture, down to one leaf.
fn models() -> [FoliageModel; 3] {
    let options = SimplifyOptions { resolution: 16, threads: 1, ..SimplifyOptions::paper() };
    let plants = [plants::masked(12, 1), plants::with_wood(9, 2), plants::quads(1, 1.0, 3)];
    plants.map(|plant| simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model)
}

/// Their files, exact and quantized.
fn model_files() -> Vec<Vec<u8>> {
    let quantized = models().map(|mut model| {
        model.quantize();
        model.plant.outlines = vec![outline(); 2];
        model
    });
    models().iter().chain(&quantized).map(|model| model.to_bytes().unwrap()).collect()
}

/// An outline of half of the texture of the first material.
fn outline() -> Outline {
    let corners = vec![[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]];
    Outline { material: 0, rect: [[0.0; 2], [1.0; 2]], corners, level: 2 }
}

/// Their files of version 1.
fn old_files() -> Vec<Vec<u8>> {
    models().iter().map(version1::bytes).collect()
}

/// The leaf section of version 1 starts with the number of leaves, followed by 12 words per leaf.
const COUNT_BYTES: usize = 8;
const LEAF_BYTES: usize = 48;
/// Indices of words in the record of a leaf.
const LEAF_TO_SPLIT: usize = 8;
const LEAF_TO_COLLAPSE: usize = 9;
const SCALE: usize = 10;

impl version1::Sections {
    fn damage(&mut self, random: &mut Random) {
        match random.below(8) {
            0 => damage(&mut self.0[random.below(5)], random),
            1 => self.0.swap(random.below(5), random.below(5)),
            2 | 3 => {
                let section = &mut self.0[random.below(5)];
                let word = random.below(section.len() / 4);
                write_notable(section, word * 4, 4, random);
            }
            _ => self.damage_leaf(random),
        }
    }

    /// Changes a word, the target or the scale of one leaf, duplicates it or swaps it with another.
    fn damage_leaf(&mut self, random: &mut Random) {
        let leaves = &mut self.0[1];
        let count = leaves.len().saturating_sub(COUNT_BYTES) / LEAF_BYTES;
        let at = |leaf: usize| COUNT_BYTES + leaf * LEAF_BYTES;
        let leaf = random.below(count);
        let Some(record) = leaves.get(at(leaf)..at(leaf + 1)).map(<[u8]>::to_vec) else { return };
        let mut write = |word: usize, bytes: [u8; 4]| leaves[at(leaf) + 4 * word..][..4].copy_from_slice(&bytes);
        match random.below(5) {
            0 => write_notable(leaves, at(leaf) + 4 * random.below(LEAF_BYTES / 4), 4, random),
            1 => {
                let target = random.pick(&[0, leaf / 2, leaf.wrapping_sub(1), leaf, leaf + 1, count]) as u32;
                [LEAF_TO_SPLIT, LEAF_TO_COLLAPSE].iter().for_each(|&word| write(word, target.to_le_bytes()));
            }
            2 => write(SCALE, random.pick(&[f32::MIN_POSITIVE, 0.5, 1.0, 1.000_000_1]).to_le_bytes()),
            3 => {
                leaves.splice(at(leaf)..at(leaf + random.below(2)), record);
                let now = (leaves.len() - COUNT_BYTES) / LEAF_BYTES;
                leaves[..COUNT_BYTES].copy_from_slice(&(now as u64).to_le_bytes());
            }
            _ => {
                let other = at(random.below(count));
                leaves.copy_within(other..other + LEAF_BYTES, at(leaf));
                leaves[other..other + LEAF_BYTES].copy_from_slice(&record);
            }
        }
    }
}

impl version2::Sections {
    /// Changes bytes or a number of one section, or swaps, removes, doubles or renames sections.
    fn damage(&mut self, random: &mut Random) {
        let [one, other] = [0; 2].map(|_: u32| random.below(self.0.len()));
        match random.below(16) {
            0 => self.0.swap(one, other),
            1 => (self.0[one].tag, self.0[other].tag) = (self.0[other].tag, self.0[one].tag),
            2 => self.0[one].tag = *b"NEW!",
            3 => self.0[one].flags = random.below(4) as u32,
            4 => self.0.insert(one, version2::Section { flags: 0, tag: *b"MORE", bytes: vec![7; random.below(9)] }),
            5..9 => damage(&mut self.0[one].bytes, random),
            _ => {
                let section = &mut self.0[one].bytes;
                let at = random.below(section.len());
                write_notable(section, at, random.pick(&[1, 4, 8]), random);
            }
        }
    }
}

#[test]
fn damaged_models_are_refused_or_sound() {
    for (kind, models) in [(".vds", model_files()), (".vds of version 1", old_files())] {
        let make = move |random: &mut Random| {
            let mut bytes = random.pick(&models);
            damage(&mut bytes, random);
            bytes
        };
        survive_reading(kind, &["unreadable"], make, read_model);
    }
}

#[test]
fn damaged_sections_under_a_fitting_head_are_refused_or_sound() {
    let models = model_files();
    let make = move |random: &mut Random| {
        let mut sections = version2::Sections::of(&random.pick(&models));
        (0..=random.below(3)).for_each(|_| sections.damage(random));
        sections.file()
    };
    survive_reading(".vds sections", &["accepted", "unreadable", "unsound", "unsupported"], make, read_model);
}

#[test]
fn damaged_sections_of_version_1_under_a_fitting_head_are_refused_or_sound() {
    let models = old_files();
    let make = move |random: &mut Random| {
        let mut sections = version1::Sections::of(&random.pick(&models));
        (0..=random.below(3)).for_each(|_| sections.damage(random));
        sections.file()
    };
    survive_reading(".vds sections of version 1", &["accepted", "unreadable", "unsound"], make, read_model);
}

#[test]
fn every_prefix_of_a_models_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("prefix.vds");
    for model in [&model_files()[0], &model_files()[3], &old_files()[0]] {
        std::fs::write(&path, model).unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        assert!(FoliageModel::read(&path).is_ok());
        for length in (0..model.len()).rev() {
            file.set_len(length as u64).unwrap();
            assert!(matches!(FoliageModel::read(&path), Err(Error::Unreadable { .. })), "{length} bytes");
        }
    }
}

/// Flips every bit of `model`, as it is and, from `checked_from` on, resealed by `reseal`.
fn flip_every_bit(model: &[u8], checked_from: usize, reseal: impl Fn(&mut [u8])) {
    let mut sound = 0;
    for bit in 0..model.len() * 8 {
        let mut flipped = model.to_vec();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(FoliageModel::from_bytes(&flipped).is_err(), "bit {bit}");
        if bit >= checked_from * 8 {
            reseal(&mut flipped);
            sound += usize::from(read_model(&flipped).is_ok());
        }
    }
    assert!((1..model.len() * 8).contains(&sound), "{sound} flips yield a valid model");
}

#[test]
fn every_flipped_bit_of_a_model_is_refused_or_sound_with_and_without_a_fitting_checksum() {
    let old = &old_files()[1];
    assert_eq!(&version1::Sections::of(old).file(), old);
    flip_every_bit(old, version1::CHECKED_FROM, |flipped| {
        let crc = crc32fast::hash(&flipped[version1::CHECKED_FROM..]);
        flipped[12..version1::CHECKED_FROM].copy_from_slice(&crc.to_le_bytes());
    });
    for new in [&model_files()[2], &model_files()[5]] {
        let sections = version2::Sections::of(new);
        assert_eq!(&sections.file(), new);
        let length: usize = sections.0.iter().map(|section| section.bytes.len()).sum();
        flip_every_bit(new, new.len() - length, |flipped| {
            let resealed = version2::Sections::of(flipped).file();
            flipped.copy_from_slice(&resealed);
        });
    }
}

/// The five cards of [`cards`] as the Draco and meshopt encoders write them.
const DRACO: &str = "445241434f02020101000000140a000a000004dff77d1fff02554001ff0000010009030000020101010103ec09a92affffffffdf350389\
    0835032502ffffffffffffffffffffffffffffb745040f35c2ce172100a1d2b123e8c60ebe8000000000ff070000000000000000000000000000\
    000050410b";
const MESHOPT_POSITIONS: &str = "a000000533f3f3f3ffff80807fff403fa0201ff300000060201f0133c000807e7d800000050cccccccffffffffffffffcc0000\
    00ffff050ccccccc7e7d7e7d7e7d7ecc0000007d7e000000000000000000000000000000000000000000000000000000000000000000000000";
const MESHOPT_INDICES: &str = "e1f000f000f000f000f000007687566778a9866589689801690000";

fn bytes_of(hex: &str) -> Vec<u8> {
    hex.as_bytes().chunks(2).map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap()).collect()
}

/// Appends `bytes` to the buffer and returns the index of their buffer view.
fn push_bytes(file: &mut Gltf, bytes: &[u8]) -> usize {
    let accessor = file.push(bytes, json!({ "componentType": 5121, "type": "SCALAR", "count": bytes.len() }));
    file.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize
}

/// Five textured cards with two instances, under a rotated and scaled node, with one texture
/// coordinate replaced by a sparse accessor.
fn rich() -> Gltf {
    let mut file = cards(5);
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let vectors = json!({ "componentType": 5126, "type": "VEC3", "count": 2 });
    let places = file.push(&floats(&[0.0, 0.0, 0.0, 0.0, 4.0, 0.0]), vectors);
    let image = push_bytes(&mut file, &plants::masked(1, 1).textures[0].bytes);
    let [replaced, values] = [vec![7], floats(&[0.5, 0.25])].map(|bytes| push_bytes(&mut file, &bytes));
    file.json["accessors"][1]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": replaced, "componentType": 5121 }, "values": { "bufferView": values }
    });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    file.json["nodes"] = json!([
        { "children": [1], "rotation": [0.0, 0.6, 0.0, 0.8], "scale": [1.0, 2.0, 1.0] },
        { "mesh": 0, "name": "crown", "translation": [1.0, 2.0, 3.0], "extensions": instancing }
    ]);
    file.json["images"] = json!([{ "bufferView": image, "mimeType": "image/png" }]);
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    let transform = json!({ "KHR_texture_transform": { "offset": [0.1, 0.2], "rotation": 0.3, "scale": [2.0, 1.0] } });
    let texture = json!({ "index": 0, "extensions": transform });
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": texture });
    file.json["materials"][0]["alphaCutoff"] = json!(0.3);
    file
}

fn draco() -> Gltf {
    let mut file = cards(5);
    let view = push_bytes(&mut file, &bytes_of(DRACO));
    let extension = json!({ "bufferView": view, "attributes": { "POSITION": 0 } });
    file.json["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_draco_mesh_compression": extension });
    file
}

fn meshopt() -> Gltf {
    let mut file = cards(5);
    for (view, hex, count, stride, mode) in
        [(0, MESHOPT_POSITIONS, 20, 12, "ATTRIBUTES"), (2, MESHOPT_INDICES, 30, 2, "TRIANGLES")]
    {
        let encoded = push_bytes(&mut file, &bytes_of(hex));
        let mut extension = file.json["bufferViews"][encoded].clone();
        (extension["count"], extension["byteStride"]) = (json!(count), json!(stride));
        extension["mode"] = json!(mode);
        file.json["bufferViews"][view]["extensions"] = json!({ "EXT_meshopt_compression": extension });
    }
    file
}

/// Two levels of five cards, coloured, skinned and bent by a morph target, beside a hidden node and
/// an animation.
fn posed() -> Gltf {
    let mut file = cards(5);
    let floats = |values: Vec<f32>| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let of =
        |component: u32, kind: &str, count: usize| json!({ "componentType": component, "type": kind, "count": count });
    let joints = file.push(&[0, 1, 1, 0].repeat(20), of(5121, "VEC4", 20));
    let weights = file.push(&floats([0.5, 0.25, 0.25, 0.0].repeat(20)), of(5126, "VEC4", 20));
    let binds =
        [[1.0f32, 0.0, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 0.0, 1.0]].concat().repeat(2);
    let binds = file.push(&floats(binds), of(5126, "MAT4", 2));
    let bend = file.push(&floats([0.1, 0.2, 0.3].repeat(20)), of(5126, "VEC3", 20));
    let color = file.push(
        &[200, 0, 250, 240].repeat(20),
        json!({ "componentType": 5121, "type": "VEC4", "count": 20, "normalized": true }),
    );
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": bend, "NORMAL": bend }]);
    for (name, accessor) in [("JOINTS_0", joints), ("WEIGHTS_0", weights), ("COLOR_0", color)] {
        primitive["attributes"][name] = json!(accessor);
    }
    file.json["meshes"][0]["weights"] = json!([0.5]);
    file.json["skins"] = json!([{ "joints": [2, 3], "inverseBindMatrices": binds }]);
    file.json["nodes"] = json!([
        { "mesh": 0, "name": "Oak_LOD0", "skin": 0, "weights": [2.0] },
        { "mesh": 0, "name": "Oak_LOD1" },
        { "children": [3], "rotation": [0.0, 0.6, 0.0, 0.8] },
        { "translation": [0.0, 1.0, 0.0] },
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } }
    ]);
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 4]);
    let channel = json!({ "sampler": 0, "target": { "node": 3, "path": "translation" } });
    file.json["animations"] = json!([{ "channels": [channel], "samplers": [{ "input": 0, "output": bend }] }]);
    file
}

/// Checks that an imported plant is valid and its warnings are plain lines.
fn check(imported: Result<Imported>) -> Result<()> {
    let Imported { plant, warnings, .. } = imported?;
    plant.validate().expect("an imported plant is valid");
    assert!(!warnings.iter().any(|warning| warning.to_string().contains(char::is_control)), "{warnings:?}");
    Ok(())
}

fn read_gltf(bytes: &[u8]) -> Result<()> {
    check(load_gltf_bytes(bytes, Path::new("hostile.glb"), &ImportOptions::default()))
}

/// Keys and values with a meaning in glTF.
const GLTF_WORDS: &str = " MASK BLEND SCALAR VEC2 VEC3 VEC4 MAT4 matrix children skin mode min normalized COLOR_0 NORMAL TEXCOORD_1 \
    ROTATION EXPONENTIAL OCTAHEDRAL INDICES image/webp uri data:;base64,AAAA no\nsuch.png \u{1b}[31m extensionsRequired \
    skins joints weights targets JOINTS_0 WEIGHTS_1 Oak_LOD0 Oak_Billboard UCX_Oak KHR_node_visibility visible MSFT_lod ids";

#[test]
fn damaged_gltf_is_refused_or_sound() {
    let files = [cards(5), rich(), draco(), meshopt(), posed()];
    files.iter().for_each(|file| read_gltf(&file.glb()).expect("the undamaged file is valid"));
    let make = move |random: &mut Random| {
        let mut file = random.pick(&files);
        let kind = random.below(4);
        if kind < 2 {
            damage_json(&mut file.json, GLTF_WORDS, random);
        }
        if kind == 2 {
            damage(&mut file.buffer, random);
        }
        let mut bytes = file.glb();
        if kind == 3 {
            damage(&mut bytes, random);
        }
        bytes
    };
    survive_reading("glTF", &["accepted", "unreadable", "leafless"], make, read_gltf);
}

/// Writes a name into a file's JSON.
type Naming = fn(&mut Value, Value);

#[test]
fn names_in_a_file_leave_messages_and_warnings_plain_lines() {
    let name = || json!("a\n\u{1b}[31m%0Ab");
    let places: [(&str, Naming); 4] = [
        ("unreadable", |file, name| file["buffers"][0]["uri"] = name),
        ("unsupported", |file, name| file["extensionsRequired"] = json!([name])),
        ("unknown name", |file, name| file["materials"][0]["name"] = name),
        ("unknown name", |file, name| file["images"][0] = json!({ "uri": name, "name": name })),
    ];
    for (expected, place) in places {
        let mut file = rich();
        place(&mut file.json, name());
        let options = ImportOptions { leaves: vec!["none".into()], ..ImportOptions::default() };
        assert_eq!(outcome(check(load_gltf_bytes(&file.glb(), Path::new("names.glb"), &options))), expected);
        outcome(read_gltf(&file.glb()));
    }
    let species = SPECIES[0].replace("leaves =", "\"lea\\nves\" =");
    assert_eq!(outcome(Species::from_toml(&species, Path::new("names.toml")).map(drop)), "unreadable");
}

#[test]
fn an_alpha_cutoff_beyond_all_numbers_counts_as_one_half() {
    let mut file = rich();
    for (cutoff, expected) in [(json!(0.3), 0.3), (json!(1e39), 0.5)] {
        file.json["materials"][0]["alphaCutoff"] = cutoff;
        let imported = load_gltf_bytes(&file.glb(), Path::new("cutoff.glb"), &ImportOptions::default()).unwrap();
        assert_eq!(imported.plant.materials[0].alpha_cutoff, expected);
    }
}

const OBJ: &str = "mtllib tree.mtl\no tree\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\ng crown\nusemtl leaf\n\
    f 1/1/1 2/2/1 3/2/1 4/1/1\nv 5 0 0\nv 6 0 0\nv 6 1 0\nv 5 1 0\nf -4//1 -3//1 -2//1 -1//1\nv 9 0 0\nv 9 1 0\nv 9 1 1\n\
    v 9 0 1\nv 9 0 2\nf 9/1 10/2 11/2 12/1 13/1\nusemtl bark\nf 1 2 3\nl 1 2\np 1\n";
const MTL: &str =
    "newmtl leaf\nKd 0.1 0.8 0.2\nd 0.5\nmap_Kd ring.png\nmap_d ring.png\nnewmtl bark\nNs 10.0\nillum 2\n";
// 4294967296/1 \
const OBJ_WORDS: &str = "f v vt vn l p g o usemtl mtllib tree.mtl newmtl map_Kd ring.png Kd d 0/0/0 -1/-1/-1 1//
    -9223372036854775808 # \\";

#[test]
fn damaged_obj_and_its_materials_are_refused_or_sound() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ring.png"), &plants::masked(1, 1).textures[0].bytes).unwrap();
    std::fs::write(folder.path().join("tree.mtl"), MTL).unwrap();
    let (tree, damaged) = (folder.path().join("tree.obj"), folder.path().join("damaged.mtl"));
    let make = move |random: &mut Random| {
        if random.below(3) > 0 {
            return damage_text(OBJ, OBJ_WORDS, random);
        }
        std::fs::write(&damaged, damage_text(MTL, OBJ_WORDS, random)).unwrap();
        OBJ.replace("tree.mtl", "damaged.mtl").into_bytes()
    };
    survive_reading("OBJ", &["accepted", "unreadable", "leafless"], make, move |obj| {
        let leaves = (obj.len() % 2 == 0).then(|| "leaf".to_owned()).into_iter().collect();
        check(load_obj_bytes(obj, &tree, &ImportOptions { leaves, ..ImportOptions::default() }))
    });
}

#[test]
fn faces_that_count_back_beyond_the_first_vertex_are_refused() {
    for (faces, reason) in [
        ("f -4//1 -13 -2//1 -1//1", "refers to v -13 of 8"),
        ("f -4 -3//-2 -2 -1", "refers to vn -2 of 1"),
        ("f 1/-9223372036854775808 2 3", "refers to vt -9223372036854775808 of 2"),
        ("f 1//6148914691236517206 2 3", "refers to vn 6148914691236517206 of 1"),
    ] {
        let obj = OBJ.replace("f -4//1 -3//1 -2//1 -1//1", faces);
        let read = load_obj_bytes(obj.as_bytes(), Path::new("back.obj"), &ImportOptions::default());
        let line = read.unwrap_err().to_string();
        assert!(line.contains(reason), "{line}");
    }
}

/// Imports [`OBJ`] with the material library `library`; returns its first material and the
/// warnings.
fn read_material(library: &str) -> (Material, Vec<foliage_lod::import::Warning>) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tree.mtl"), format!("{library}\nnewmtl bark\n")).unwrap();
    let options = ImportOptions { leaves: vec!["crown".into()], ..ImportOptions::default() };
    let Imported { plant, warnings, .. } =
        load_obj_bytes(OBJ.as_bytes(), &folder.path().join("tree.obj"), &options).unwrap();
    (plant.materials[0].clone(), warnings)
}

#[test]
fn an_obj_colour_of_one_number_is_a_grey_and_one_of_none_or_two_is_left_out() {
    for (color, expected) in [("Kd 0.25", 0.25), ("Kd", 1.0), ("Kd 0.25 0.5", 1.0), ("Ka 1\nKs\nKe 1 1", 1.0)] {
        let (material, warnings) = read_material(&format!("newmtl leaf\n{color}\n"));
        assert_eq!(material.base_color, [expected, expected, expected, 1.0], "{color:?}");
        assert!(warnings.is_empty(), "{warnings:?}");
    }
    let (_, warnings) = read_material("newmtl leaf\nKd red\n");
    assert!(warnings[0].message.starts_with("material \"leaf\": its colour \"red\" is not"), "{warnings:?}");
}

const SPECIES: [&str; 3] = [
    include_str!("../data/species/english-oak.toml"),
    include_str!("../data/species/carya-illinoinensis.toml"),
    include_str!("../data/species/betula-populifolia.toml"),
];
const SPECIES_WORDS: &str = "= [leaf] [[levels]] # \" ''' \"🌳\nä\" ä true [0,300,-1] { 0x7fffffffffffffff 180.0 \"flame\" \
    1979-05-27T07:32:00Z levels";

#[test]
fn damaged_species_are_refused_or_sound() {
    let make = |random: &mut Random| damage_text(random.pick(&SPECIES), SPECIES_WORDS, random);
    survive_reading("species", &["accepted", "unreadable"], make, |text| {
        let species = Species::from_toml(&String::from_utf8_lossy(text), Path::new("hostile.toml"))?;
        species.validate().expect("an accepted species is valid");
        Ok(())
    });
}

#[cfg(feature = "scene")]
const SCENES: [&str; 3] = [
    include_str!("../data/scenes/turntable.toml"),
    include_str!("../data/scenes/nine-trees.toml"),
    include_str!("../data/scenes/forest.toml"),
];
#[cfg(feature = "scene")]
const SCENE_WORDS: &str = "= [lod] [effects.wind] [[plants]] [[scatter]] # \" ''' \"oak\\n\" ä true false [0,1e300,-1] nan inf \
    99999999999 policy = \"sizes\" shares = [[1,1]] [camera] path eye = [0,0,0]";

#[cfg(feature = "scene")]
#[test]
fn damaged_scenes_are_refused_or_place_their_plants() {
    use foliage_lod::scene::SceneFile;
    let make = |random: &mut Random| damage_text(random.pick(&SCENES), SCENE_WORDS, random);
    survive_reading("scenes", &["accepted", "unreadable"], make, |text| {
        let scene = SceneFile::from_toml(&String::from_utf8_lossy(text), Path::new("hostile.toml"))?;
        scene.effects.check().expect("accepted effects are in range");
        for seconds in [-1e300, 0.0, 7.5, 1e300] {
            let is_finite =
                scene.look_at(seconds, 1.0, 0.1).is_none_or(|view| view.eye.is_finite() && view.target.is_finite());
            assert!(is_finite, "{seconds}: {:?}", scene.look_at(seconds, 1.0, 0.1));
        }
        for scatter in scene.scatter.iter().filter(|scatter| scatter.count <= 2000) {
            // Too many plants for the area is an error; placed plants have a finite transform.
            let spots = scatter.spots().unwrap_or_default();
            assert!(spots.iter().all(|spot| spot.at.is_finite() && spot.scale > 0.0 && spot.turn.is_finite()));
        }
        Ok(())
    });
}
