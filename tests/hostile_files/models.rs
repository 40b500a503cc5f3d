//! Models: `.vds` files of both versions.

use super::survive_reading;
use crate::{
    common::{plants, version1, version2},
    mutate::{Random, damage, write_notable},
};
use foliage_lod::{
    Error, FoliageModel, Result, Swap, Timeline,
    internals::clusters,
    model::ModelFile,
    plant::Outline,
    simplify::{CpuFragments, CurveOptions, Quiet, SimplifyOptions, error_curve, simplify},
    software::{BakeOptions, bake},
};

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
    assert!(again.wood_order == model.wood_order, "the order of the wood is lost");
    assert!(again.curve == model.curve, "the error curve is lost");
    assert!(again.clusters == model.clusters, "the cards of clusters are lost");
    Timeline::with_cards(&model);
    assert!(again.to_bytes().unwrap() == written, "the model is not written as it was read");
    let (timeline, mut swap) = (Timeline::new(&model), Swap::new(&model));
    for n in (0..=swap.leaves()).rev() {
        swap.set_active(n);
        let looked_up: Vec<u32> = (0..swap.leaves()).map(|leaf| timeline.scale(leaf, n).to_bits()).collect();
        assert_eq!(swap.scales().iter().map(|scale| scale.to_bits()).collect::<Vec<_>>(), looked_up);
    }
    Ok(())
}

/// Small models with and without wood and texture, down to one leaf, and one of leaves that repeat
/// two shapes.
fn models() -> [FoliageModel; 4] {
    let options = SimplifyOptions { resolution: 16, threads: 1, ..SimplifyOptions::paper() };
    let plants = [plants::masked(12, 1), plants::with_wood(9, 2), plants::quads(1, 1.0, 3), plants::repeated(40, 4)];
    plants.map(|plant| simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model)
}

/// Their files, exact and quantized.
fn model_files() -> Vec<Vec<u8>> {
    let quantized = models().map(|mut model| {
        model.quantize();
        assert_eq!(model.copies.len(), if model.leaves.len() == 40 { 38 } else { 0 });
        model.plant.outlines = vec![outline(); 2];
        model.clusters = clusters::all(&model).unwrap();
        assert_eq!(model.clusters.cards().is_empty(), model.leaves.len() == 1);
        let sizes = BakeOptions { across: 3, frame_px: 8, is_whole_sphere: true };
        model.order_wood();
        assert_eq!(model.wood_order.is_some(), model.leaves.len() == 9);
        model.curve =
            Some(error_curve(&model, &CurveOptions { side_px: 8, samples: 1, steps: 1 }, &mut |_| true).unwrap());
        model.impostor = (model.leaves.len() == 9).then(|| bake(&model, &sizes, &mut |_| true).unwrap());
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
    for model in [&model_files()[0], &model_files()[4], &old_files()[0]] {
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
    for new in [&model_files()[2], &model_files()[6]] {
        let sections = version2::Sections::of(new);
        assert_eq!(&sections.file(), new);
        let length: usize = sections.0.iter().map(|section| section.bytes.len()).sum();
        flip_every_bit(new, new.len() - length, |flipped| {
            let resealed = version2::Sections::of(flipped).file();
            flipped.copy_from_slice(&resealed);
        });
    }
}
