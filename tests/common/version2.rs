//! Takes `.vds` files of version 2 apart and puts them together again.

use foliage_lod::model::{MAGIC, VERSION};

const TABLE_AT: usize = 20;
const ENTRY_BYTES: usize = 28;

/// One section.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    pub tag: [u8; 4],
    pub flags: u32,
    pub bytes: Vec<u8>,
}

/// The sections of a file. They are written with a matching table and checksums.
#[derive(Clone, Debug, PartialEq)]
pub struct Sections(pub Vec<Section>);

impl Sections {
    pub fn of(file: &[u8]) -> Self {
        let number = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize;
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
        let entries = (0..word(12) as usize).map(|entry| TABLE_AT + entry * ENTRY_BYTES);
        let section = |at: usize| {
            let [start, length] = [number(at + 8), number(at + 16)];
            let bytes = file[start..start + length].to_vec();
            Section { tag: file[at..at + 4].try_into().unwrap(), flags: word(at + 4), bytes }
        };
        Self(entries.map(section).collect())
    }

    pub fn file(&self) -> Vec<u8> {
        let mut at = TABLE_AT + self.0.len() * ENTRY_BYTES;
        let mut entries = Vec::new();
        for Section { tag, flags, bytes } in &self.0 {
            entries.extend(tag);
            entries.extend(flags.to_le_bytes());
            entries.extend((at as u64).to_le_bytes());
            entries.extend((bytes.len() as u64).to_le_bytes());
            entries.extend(crc32fast::hash(bytes).to_le_bytes());
            at += bytes.len();
        }
        let checked = [&VERSION.to_le_bytes()[..], &(self.0.len() as u32).to_le_bytes()].concat();
        let crc = crc32fast::hash(&[&checked[..], &entries].concat()).to_le_bytes();
        let sections = self.0.iter().flat_map(|section| &section.bytes).copied();
        [&MAGIC[..], &checked, &crc, &entries].concat().into_iter().chain(sections).collect()
    }
}
