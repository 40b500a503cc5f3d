//! The `.vds` file format.
//!
//! All numbers are little-endian. The header is parsed by hand, and every length in it is checked
//! against the actual length of the file before any memory is allocated for it:
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | magic `VDSFOLI\0` |
//! | 8..12 | format version, 1 |
//! | 12..16 | CRC-32 of everything that follows |
//! | 16..56 | lengths of the five sections in bytes, 64 bits each |
//! | 56.. | the sections, back to back |
//!
//! Sections: about (name, recipe, max_scale, materials), leaves, foliage (vertices, indices), wood,
//! textures. Each is encoded by bincode with fixed-width integers, so the length of a section
//! bounds the memory that decoding it may allocate. Floats keep their bits: equal models give equal
//! bytes.
//!
//! Limits: files of up to [`MAX_FILE_BYTES`]. Any other version of the format is rejected, and the
//! error names it.

use super::FoliageModel;
use crate::{Error, Result, file, plant::PlantOf};
use serde::{Serialize, de::DeserializeOwned};
use std::{io::Read, ops::Range, path::Path};

/// First bytes of the file.
pub const MAGIC: [u8; 8] = *b"VDSFOLI\0";
/// Format version.
pub const VERSION: u32 = 1;
/// Maximum file size. A plant of 4 million leaves with 4 vertices each, the most allowed, takes
/// 1.1 GB. Below 4 GiB, so that every length fits in a 32-bit `usize`.
pub const MAX_FILE_BYTES: u64 = 3 << 30;

const SECTIONS: [&str; 5] = ["about", "leaves", "foliage", "wood", "textures"];
/// The checksum covers the file from this offset to the end.
const CHECKED_FROM: usize = 16;
const HEAD_BYTES: usize = CHECKED_FROM + SECTIONS.len() * 8;

impl FoliageModel {
    /// Reads and validates the model at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Unreadable`] if it is damaged or not a
    /// model, [`Error::TooLarge`] if it exceeds [`MAX_FILE_BYTES`], [`Error::InvalidModel`] if the
    /// model breaks an invariant.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let failed = |source| Error::io(path, source);
        let mut file = file::open(path)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut bytes = Vec::with_capacity(HEAD_BYTES);
        Read::by_ref(&mut file).take(HEAD_BYTES as u64).read_to_end(&mut bytes).map_err(failed)?;
        Head::parse(path, &bytes, length)?;
        file.take(length).read_to_end(&mut bytes).map_err(failed)?;
        decode(path, &bytes)
    }

    /// Writes the model to `path`. The file is either replaced completely or left untouched.
    ///
    /// # Errors
    /// As [`to_bytes`](Self::to_bytes), and [`Error::Io`] if writing fails.
    #[cfg(feature = "write")]
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        file::write_whole(path, &self.to_bytes()?)
    }

    /// Encodes the model as the contents of a `.vds` file. Equal models give equal bytes.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for a model that [`from_bytes`](Self::from_bytes) would reject,
    /// [`Error::TooLarge`] if the result exceeds [`MAX_FILE_BYTES`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let sections = [
            encode(&(&self.name, &self.recipe, self.max_scale, &self.materials))?,
            encode(&self.leaves)?,
            encode(&(&self.vertices, &self.indices))?,
            encode(&self.wood)?,
            encode(&self.textures)?,
        ];
        let lengths = sections.each_ref().map(|section| section.len() as u64);
        check_length(Path::new(&self.name), HEAD_BYTES as u64 + lengths.iter().sum::<u64>())?;
        let mut bytes = [&MAGIC[..], &VERSION.to_le_bytes(), &[0; 4]].concat();
        lengths.iter().for_each(|length| bytes.extend(length.to_le_bytes()));
        sections.iter().for_each(|section| bytes.extend(section));
        let crc = crc32fast::hash(&bytes[CHECKED_FROM..]);
        bytes[12..CHECKED_FROM].copy_from_slice(&crc.to_le_bytes());
        Ok(bytes)
    }

    /// Decodes and validates a model from the contents of a `.vds` file.
    ///
    /// # Errors
    /// As [`read`](Self::read), except for [`Error::Io`]; the path in the error is `model`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        decode(Path::new("model"), bytes)
    }
}

/// The parsed header, checked against the length of the file.
struct Head {
    crc: u32,
    sections: [Range<usize>; SECTIONS.len()],
}

impl Head {
    /// Parses the header of a file of `length` bytes.
    fn parse(path: &Path, bytes: &[u8], length: u64) -> Result<Self> {
        if !bytes.starts_with(&MAGIC) {
            return Err(Error::unreadable(path, "not a .vds model", "make one with `foliage-lod simplify`"));
        }
        if bytes.len() < HEAD_BYTES {
            return Err(damaged(path, format!("only {length} bytes long")));
        }
        let version = u32_at(bytes, 8);
        if version != VERSION {
            let reason = format!("format version {version}, this program reads {VERSION}");
            return Err(Error::unreadable(path, reason, "simplify the plant again"));
        }
        check_length(path, length)?;
        let mut at = HEAD_BYTES as u64;
        let mut sections = SECTIONS.map(|_| 0..0);
        for (i, section) in sections.iter_mut().enumerate() {
            let section_length = u64_at(bytes, CHECKED_FROM + 8 * i);
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
        Ok(Self { crc: u32_at(bytes, 12), sections })
    }
}

fn decode(path: &Path, bytes: &[u8]) -> Result<FoliageModel> {
    let head = Head::parse(path, bytes, bytes.len() as u64)?;
    let crc = crc32fast::hash(&bytes[CHECKED_FROM..]);
    if crc != head.crc {
        return Err(damaged(path, format!("checksum {crc:08x} instead of {:08x}", head.crc)));
    }
    let [about, leaves, foliage, wood, textures] = head.sections.map(|range| &bytes[range]);
    let (name, recipe, max_scale, materials) = decode_section(path, 0, about)?;
    let (vertices, indices) = decode_section(path, 2, foliage)?;
    let plant = PlantOf {
        name,
        vertices,
        indices,
        leaves: decode_section(path, 1, leaves)?,
        wood: decode_section(path, 3, wood)?,
        materials,
        textures: decode_section(path, 4, textures)?,
    };
    let model = FoliageModel { plant, recipe, max_scale };
    model.validate()?;
    Ok(model)
}

fn encode(value: &impl Serialize) -> Result<Vec<u8>> {
    bincode::serde::encode_to_vec(value, bincode::config::legacy())
        .map_err(|error| Error::unreadable("model", error.to_string(), "report this model"))
}

/// Decodes one section, which must be consumed to its last byte. Allocation while decoding is
/// bounded by the smallest of the limits below that fits the section; there are only a few because
/// bincode takes its limit at compile time.
fn decode_section<T: DeserializeOwned>(path: &Path, section: usize, bytes: &[u8]) -> Result<T> {
    const KIB: usize = 1 << 10;
    const MIB: usize = 1 << 20;
    let decoded = match bytes.len() {
        length if length <= KIB => decode_limited::<T, KIB>(bytes),
        length if length <= MIB => decode_limited::<T, MIB>(bytes),
        length if length <= 32 * MIB => decode_limited::<T, { 32 * MIB }>(bytes),
        _ => decode_limited::<T, { MAX_FILE_BYTES as usize }>(bytes),
    };
    let name = SECTIONS[section];
    match decoded {
        Ok((value, used)) if used == bytes.len() => Ok(value),
        Ok((_, used)) => Err(damaged(path, format!("section {name} ends after {used} of {} bytes", bytes.len()))),
        Err(error) => Err(damaged(path, format!("section {name}: {}", error.to_string().replace('\n', " ")))),
    }
}

fn decode_limited<T: DeserializeOwned, const LIMIT: usize>(
    bytes: &[u8],
) -> std::result::Result<(T, usize), bincode::error::DecodeError> {
    bincode::serde::decode_from_slice(bytes, bincode::config::legacy().with_limit::<LIMIT>())
}

fn check_length(path: &Path, length: u64) -> Result<()> {
    if length <= MAX_FILE_BYTES {
        return Ok(());
    }
    Err(Error::TooLarge {
        what: format!("the length of {}", path.display()),
        value: length,
        limit: MAX_FILE_BYTES,
        fix: "cut the plant into smaller ones".into(),
    })
}

fn damaged(path: &Path, reason: String) -> Error {
    Error::unreadable(path, format!("damaged: {reason}"), "copy the file again or simplify the plant again")
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::validate::samples;

    /// Returns `bytes` with its checksum recomputed.
    fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
        let crc = crc32fast::hash(&bytes[CHECKED_FROM..]);
        bytes[12..CHECKED_FROM].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    #[cfg(feature = "write")]
    #[test]
    fn reading_gives_back_what_was_written_and_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vds");
        let mut model = samples::model(40);
        model.recipe.adapter = Some("an adapter".into());
        model.write(&path).unwrap();
        let read = FoliageModel::read(&path).unwrap();
        assert_eq!(read, model);
        assert_eq!(read.to_bytes().unwrap(), std::fs::read(&path).unwrap());
    }

    #[test]
    fn every_truncation_and_every_extension_is_refused() {
        let bytes = samples::model(3).to_bytes().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vds");
        for length in 0..bytes.len() {
            assert!(FoliageModel::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
        }
        for length in [0, 7, 8, 55, 56, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(matches!(FoliageModel::read(&path), Err(Error::Unreadable { .. })), "{length} bytes");
        }
        assert!(FoliageModel::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
    }

    #[test]
    fn every_single_flipped_bit_is_refused() {
        let bytes = samples::model(3).to_bytes().unwrap();
        for bit in 0..bytes.len() * 8 {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(FoliageModel::from_bytes(&flipped).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn every_flipped_bit_under_a_fitting_checksum_gives_an_error_or_a_sound_model() {
        let bytes = samples::model(3).to_bytes().unwrap();
        for bit in CHECKED_FROM * 8..bytes.len() * 8 {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            if let Ok(model) = FoliageModel::from_bytes(&resealed(flipped)) {
                model.validate().unwrap();
            }
        }
    }

    #[test]
    fn huge_lengths_are_refused_before_anything_is_allocated() {
        let bytes = samples::model(3).to_bytes().unwrap();
        for section in 0..SECTIONS.len() {
            for length in [u64::MAX, u64::MAX - 55, 1 << 62, bytes.len() as u64] {
                let mut hostile = bytes.clone();
                hostile[CHECKED_FROM + 8 * section..][..8].copy_from_slice(&length.to_le_bytes());
                assert!(FoliageModel::from_bytes(&resealed(hostile)).is_err(), "section {section}, {length}");
            }
        }
        let name_length = HEAD_BYTES;
        for length in [u64::MAX, 1 << 62, 1 << 40, 2000, 1] {
            let mut hostile = bytes.clone();
            hostile[name_length..][..8].copy_from_slice(&length.to_le_bytes());
            assert!(FoliageModel::from_bytes(&resealed(hostile)).is_err(), "a name of {length} bytes");
        }
    }

    #[test]
    fn another_version_and_another_kind_of_file_are_named() {
        let mut bytes = samples::model(1).to_bytes().unwrap();
        bytes[8] = 9;
        let message = FoliageModel::from_bytes(&bytes).unwrap_err().to_string();
        assert!(message.contains("format version 9"), "{message}");
        let message = FoliageModel::from_bytes(b"glTF").unwrap_err().to_string();
        assert!(message.contains("not a .vds model"), "{message}");
    }

    #[cfg(feature = "write")]
    #[test]
    fn a_broken_model_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vds");
        let broken = FoliageModel { max_scale: f32::NAN, ..samples::model(2) };
        assert!(matches!(broken.write(&path), Err(Error::InvalidModel { invariant: 10, .. })));
        assert!(!path.exists());
    }
}
