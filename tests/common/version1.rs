//! Writes `.vds` files of version 1, as the program did before version 2, and takes them apart.

use foliage_lod::{
    FoliageModel,
    model::{MAGIC, Recipe},
};
use serde::Serialize;

/// First byte that the checksum covers, and first byte of the sections.
pub const CHECKED_FROM: usize = 16;
pub const HEAD_BYTES: usize = 56;

/// The file of a model.
pub fn bytes(model: &FoliageModel) -> Vec<u8> {
    let about: (&str, &Recipe, f32, _) = (&model.name, &model.recipe, model.max_scale, &model.materials);
    Sections(vec![
        record(&about),
        record(&model.leaves),
        record(&(&model.vertices, &model.indices)),
        record(&model.wood),
        record(&model.textures),
    ])
    .file()
}

fn record(value: &impl Serialize) -> Vec<u8> {
    bincode::serde::encode_to_vec(value, bincode::config::legacy()).unwrap()
}

/// The sections of a file: about, leaves, foliage, wood, textures. They are written with matching
/// lengths and checksum.
pub struct Sections(pub Vec<Vec<u8>>);

impl Sections {
    pub fn of(file: &[u8]) -> Self {
        let lengths =
            file[CHECKED_FROM..HEAD_BYTES].chunks(8).map(|length| u64::from_le_bytes(length.try_into().unwrap()));
        let ends = lengths.scan(HEAD_BYTES, |end, length| {
            *end += length as usize;
            Some((*end - length as usize, *end))
        });
        Self(ends.map(|(start, end)| file[start..end].to_vec()).collect())
    }

    pub fn file(&self) -> Vec<u8> {
        let lengths = self.0.iter().flat_map(|section| (section.len() as u64).to_le_bytes());
        let checked: Vec<u8> = lengths.chain(self.0.iter().flatten().copied()).collect();
        let crc = crc32fast::hash(&checked).to_le_bytes();
        [&MAGIC[..], &1_u32.to_le_bytes(), &crc, &checked].concat()
    }
}
