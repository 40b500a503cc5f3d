//! Files of version 1: read, no longer written.
//!
//! | bytes | content |
//! |---|---|
//! | 12..16 | CRC-32 of everything that follows |
//! | 16..56 | lengths of the five sections in bytes, 64 bits each |
//! | 56.. | the sections, back to back |
//!
//! Sections: about (name, recipe, max_scale, materials), leaves, foliage (vertices, indices), wood,
//! textures. Each is a record with fixed-width integers, so the length of a section bounds the
//! memory that decoding it may allocate.

use super::{
    super::{Clusters, FoliageModel, Growth, Precision},
    fault::{damaged, damaged_in, u32_at, u64_at},
    records::decode,
};
use crate::{Result, plant::PlantOf};
use serde::Deserialize;
use std::{ops::Range, path::Path};

const SECTIONS: [&str; 5] = ["about", "leaves", "foliage", "wood", "textures"];
/// The checksum covers the file from this offset to the end.
const CHECKED_FROM: usize = 16;
const HEAD_BYTES: usize = CHECKED_FROM + SECTIONS.len() * 8;

/// The parsed header, checked against the length of the file.
pub(super) struct Head {
    crc: u32,
    /// The sections: about, leaves, foliage, wood, textures.
    pub(super) sections: [Range<usize>; SECTIONS.len()],
}

impl Head {
    /// Parses the header of a file of `length` bytes that starts with `head`.
    pub(super) fn parse(path: &Path, head: &[u8], length: u64) -> Result<Self> {
        if head.len() < HEAD_BYTES {
            return Err(damaged(path, format!("only {length} bytes long")));
        }
        let mut at = HEAD_BYTES as u64;
        let mut sections = SECTIONS.map(|_| 0..0);
        for (i, section) in sections.iter_mut().enumerate() {
            let section_length = u64_at(head, CHECKED_FROM + 8 * i);
            let Some(end) = at.checked_add(section_length).filter(|&end| end <= length) else {
                let reason = format!("section {} is {section_length} bytes of a file of {length}", SECTIONS[i]);
                return Err(damaged(path, reason));
            };
            *section = at as usize..end as usize;
            at = end;
        }
        if at != length {
            return Err(damaged(path, format!("{} bytes follow the last section", length - at)));
        }
        Ok(Self { crc: u32_at(head, 12), sections })
    }
}

/// Decodes a file whose header is `head`.
pub(super) fn decode_model(path: &Path, head: &Head, file: &[u8]) -> Result<FoliageModel> {
    let crc = crc32fast::hash(&file[CHECKED_FROM..]);
    if crc != head.crc {
        return Err(damaged(path, format!("checksum {crc:08x} instead of {:08x}", head.crc)));
    }
    let [about, leaves, foliage, wood, textures] = head.sections.clone().map(|range| &file[range]);
    let (name, recipe, max_scale, materials) = section(path, 0, about)?;
    let (vertices, indices) = section(path, 2, foliage)?;
    let plant = PlantOf {
        name,
        vertices,
        indices,
        leaves: section(path, 1, leaves)?,
        wood: section(path, 3, wood)?,
        materials,
        textures: section(path, 4, textures)?,
        outlines: Vec::new(),
    };
    Ok(FoliageModel {
        plant,
        recipe,
        max_scale,
        precision: Precision::EXACT,
        growth: Growth::default(),
        copies: Vec::new(),
        impostor: None,
        wood_order: None,
        curve: None,
        clusters: Clusters::default(),
    })
}

fn section<'a, T: Deserialize<'a>>(path: &Path, section: usize, bytes: &'a [u8]) -> Result<T> {
    damaged_in(path, SECTIONS[section], decode(bytes))
}
