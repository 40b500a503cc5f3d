//! The table of sections of a file of version 2.
//!
//! | bytes | content |
//! |---|---|
//! | 12..16 | number of sections |
//! | 16..20 | CRC-32 of the 8 bytes before this number and of the entries |
//! | 20.. | one entry of 28 bytes for each section |
//!
//! An entry holds the section's tag (4 bytes), flags, offset and length (64 bits each), and CRC-32.
//! Flag 1 means that a reader that does not know the tag must refuse the file; without it the
//! section is skipped. Other flags are 0 when written and ignored when read. The sections follow
//! the table in the order of their entries, back to back, up to the end of the file.

use super::fault::{MAX_FILE_BYTES, check_length, damaged, u32_at, u64_at};
use crate::{Error, Result};
use std::{ops::Range, path::Path};

/// Four letters that name the content of a section.
pub(super) type Tag = [u8; 4];

/// First bytes of the file.
pub const MAGIC: [u8; 8] = *b"VDSFOLI\0";
/// Format version that is written. Version 1 is read too.
pub const VERSION: u32 = 2;

/// Flag of a section that a reader must know.
pub(super) const REQUIRED: u32 = 1;
/// Most sections of a file.
const MAX_SECTIONS: usize = 64;
const TABLE_AT: usize = 20;
const ENTRY_BYTES: usize = 28;
/// Longest possible head of a file: enough of it to check all lengths.
pub(super) const MAX_HEAD_BYTES: usize = TABLE_AT + MAX_SECTIONS * ENTRY_BYTES;

/// One entry, checked against the length of the file.
pub(super) struct Section {
    pub(super) tag: Tag,
    pub(super) flags: u32,
    pub(super) range: Range<usize>,
    crc: u32,
}

impl Section {
    /// The tag as text.
    pub(super) fn name(&self) -> String {
        self.tag.escape_ascii().to_string()
    }

    /// The section's bytes in the file.
    pub(super) fn bytes<'a>(&self, path: &Path, file: &'a [u8]) -> Result<&'a [u8]> {
        let bytes = file.get(self.range.clone()).unwrap_or_default();
        let crc = crc32fast::hash(bytes);
        if crc != self.crc || bytes.len() != self.range.len() {
            let name = self.name();
            return Err(damaged(path, format!("section {name}: checksum {crc:08x} instead of {:08x}", self.crc)));
        }
        Ok(bytes)
    }
}

/// Parses the table of a file of `length` bytes that starts with `head`.
pub(super) fn parse(path: &Path, head: &[u8], length: u64) -> Result<Vec<Section>> {
    if head.len() < TABLE_AT {
        return Err(damaged(path, format!("only {length} bytes long")));
    }
    let count = u32_at(head, 12) as usize;
    if count > MAX_SECTIONS {
        return Err(damaged(path, format!("{count} sections, more than {MAX_SECTIONS}")));
    }
    let table_end = TABLE_AT + count * ENTRY_BYTES;
    let Some(entries) = head.get(TABLE_AT..table_end) else {
        return Err(damaged(path, format!("{count} sections in a file of {length} bytes")));
    };
    let (stored, crc) = (u32_at(head, 16), table_crc(head, entries));
    if crc != stored {
        return Err(damaged(path, format!("checksum {crc:08x} of the table instead of {stored:08x}")));
    }
    let mut at = table_end as u64;
    let mut sections: Vec<Section> = Vec::with_capacity(count);
    for entry in entries.chunks_exact(ENTRY_BYTES) {
        let tag = [entry[0], entry[1], entry[2], entry[3]];
        let [start, section_length] = [8, 16].map(|offset| u64_at(entry, offset));
        let end = start.checked_add(section_length).filter(|&end| start == at && end <= length);
        let Some(end) = end else {
            let name = tag.escape_ascii();
            let reason = format!("section {name} is {section_length} bytes at {start} in a file of {length}");
            return Err(damaged(path, reason));
        };
        if sections.iter().any(|section| section.tag == tag) {
            return Err(damaged(path, format!("section {} occurs twice", tag.escape_ascii())));
        }
        sections.push(Section {
            tag,
            flags: u32_at(entry, 4),
            range: start as usize..end as usize,
            crc: u32_at(entry, 24),
        });
        at = end;
    }
    if at != length {
        return Err(damaged(path, format!("{} bytes follow the last section", length - at)));
    }
    Ok(sections)
}

/// Joins sections, each with its tag and flags, to a file.
///
/// # Errors
/// [`Error::TooLarge`] if it exceeds [`MAX_FILE_BYTES`].
pub(super) fn join(name: &str, sections: &[(Tag, u32, Vec<u8>)]) -> Result<Vec<u8>> {
    let table_end = TABLE_AT + sections.len() * ENTRY_BYTES;
    let length = joined_bytes(sections);
    check_length(Path::new(name), length)?;
    let mut file = Vec::with_capacity(length as usize);
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend((sections.len() as u32).to_le_bytes());
    file.extend([0; 4]);
    let mut at = table_end as u64;
    for (tag, flags, bytes) in sections {
        file.extend(tag);
        file.extend(flags.to_le_bytes());
        file.extend(at.to_le_bytes());
        file.extend((bytes.len() as u64).to_le_bytes());
        file.extend(crc32fast::hash(bytes).to_le_bytes());
        at += bytes.len() as u64;
    }
    let crc = table_crc(&file, &file[TABLE_AT..]);
    file[16..20].copy_from_slice(&crc.to_le_bytes());
    sections.iter().for_each(|(.., bytes)| file.extend(bytes));
    Ok(file)
}

/// Length of the file of these sections.
pub(super) fn joined_bytes(sections: &[(Tag, u32, Vec<u8>)]) -> u64 {
    let bytes = sections.iter().map(|(.., bytes)| bytes.len() as u64);
    (TABLE_AT + sections.len() * ENTRY_BYTES) as u64 + bytes.sum::<u64>()
}

fn table_crc(head: &[u8], entries: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&head[8..16]);
    hasher.update(entries);
    hasher.finalize()
}

/// The version of a file of `length` bytes that starts with `head`.
///
/// # Errors
/// [`Error::Unreadable`] if it is not a model, [`Error::TooLarge`] if it exceeds
/// [`MAX_FILE_BYTES`].
pub(super) fn version(path: &Path, head: &[u8], length: u64) -> Result<u32> {
    if !head.starts_with(&MAGIC) {
        return Err(Error::unreadable(path, "not a .vds model", "make one with `foliage-lod simplify`"));
    }
    if head.len() < 16 {
        return Err(damaged(path, format!("only {length} bytes long")));
    }
    check_length(path, length)?;
    Ok(u32_at(head, 8))
}

const _: () = assert!(MAX_FILE_BYTES <= u32::MAX as u64);
