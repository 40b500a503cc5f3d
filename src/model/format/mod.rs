//! The `.vds` file format.
//!
//! All numbers are little-endian. The head is parsed by hand, and every length in it is checked
//! against the actual length of the file before any memory is allocated for it:
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | magic `VDSFOLI\0` |
//! | 8..12 | format version, 2 |
//! | 12.. | a table of sections, each with its tag and CRC-32, and the sections |
//!
//! Later versions of this program add sections, not versions of the format: a section that is not
//! known is skipped, or the file is refused if the section is marked as required.
//!
//! A file keeps every bit of its model. It is small if the model is
//! [quantized](FoliageModel::quantize): numbers on grids are stored as integers, columns of
//! integers as differences, what compresses is deflated, and leaves of the same shape are stored as
//! copies of one. Every stream states its length, which must be the one that the numbers of leaves
//! and vertices call for; these are held against the length of the file, which is filled up with
//! zeros if reading it would take too much memory for its size.
//!
//! Limits: files of up to [`MAX_FILE_BYTES`]. Version 1 is still read. Any other version is
//! rejected, and the error names it.

mod clusters;
mod fault;
mod foliage;
mod impostor;
mod ints;
mod leaves;
mod numbers;
mod records;
mod shapes;
mod stream;
mod table;
mod version1;
mod version2;
mod vertices;
mod wood;
mod wood_order;

pub use fault::MAX_FILE_BYTES;
pub use table::{MAGIC, VERSION};
pub(in crate::model) use version2::leaf_bytes;

use super::FoliageModel;
use crate::{Error, Result, file};
use std::{io::Read, path::Path};

/// A `.vds` file that was read: its model, and how it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The model.
    pub model: FoliageModel,
    /// Version of the format.
    pub version: u32,
    /// Parts of the file: `table`, `about`, `leaf_records`, `leaf_vertices`, `wood`, `textures`,
    /// `shapes`, `outlines`, `growth`, `intrinsic`, `impostor`, `wood_order`, `ribbons`, `curve`,
    /// `clusters`, `fill`.
    pub parts: Vec<Part>,
    /// Sections that were skipped because this version of the program does not know them, by their
    /// tags. Worth a warning: the model was made by a newer one.
    pub skipped: Vec<Part>,
}

/// A part of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its length.
    pub bytes: u64,
}

impl ModelFile {
    /// Reads and validates the model at `path`.
    ///
    /// # Errors
    /// As [`FoliageModel::read`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let failed = |source| Error::io(path, source);
        let mut file = file::open(path)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut bytes = Vec::new();
        let head = table::MAX_HEAD_BYTES as u64;
        Read::by_ref(&mut file).take(head).read_to_end(&mut bytes).map_err(failed)?;
        Head::parse(path, &bytes, length)?;
        bytes.reserve_exact(length.saturating_sub(bytes.len() as u64) as usize);
        file.take(length).read_to_end(&mut bytes).map_err(failed)?;
        decode(path, &bytes)
    }

    /// Decodes and validates a model from the contents of a `.vds` file.
    ///
    /// # Errors
    /// As [`read`](Self::read), except for [`Error::Io`]; the path in the error is `model`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        decode(Path::new("model"), bytes)
    }
}

impl FoliageModel {
    /// Reads and validates the model at `path`. [`ModelFile::read`] also tells which sections of
    /// the file were skipped.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Unreadable`] if it is damaged or not a
    /// model, [`Error::Unsupported`] if it has a required section that is not known,
    /// [`Error::TooLarge`] if it exceeds [`MAX_FILE_BYTES`], [`Error::InvalidModel`] if the model
    /// breaks an invariant.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Ok(ModelFile::read(path)?.model)
    }

    /// Writes the model to `path`. The file is either replaced completely or left untouched.
    ///
    /// # Errors
    /// As [`to_bytes`](Self::to_bytes), and [`Error::Io`] if writing fails.
    #[cfg(feature = "write")]
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        file::write_whole(path, &self.to_bytes()?)
    }

    /// Encodes the model as the contents of a `.vds` file. Every bit of the model is kept, and
    /// equal models give equal bytes. [`quantize`](Self::quantize) it first for a small file.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for a model that [`from_bytes`](Self::from_bytes) would reject,
    /// [`Error::TooLarge`] if the result exceeds [`MAX_FILE_BYTES`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        version2::encode_model(self)
    }

    /// Decodes and validates a model from the contents of a `.vds` file.
    ///
    /// # Errors
    /// As [`read`](Self::read), except for [`Error::Io`]; the path in the error is `model`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Ok(ModelFile::from_bytes(bytes)?.model)
    }
}

/// The parsed head of a file, checked against its length.
enum Head {
    One(version1::Head),
    Two(Vec<table::Section>),
}

impl Head {
    /// Parses the head of a file of `length` bytes.
    fn parse(path: &Path, head: &[u8], length: u64) -> Result<Self> {
        match table::version(path, head, length)? {
            1 => Ok(Self::One(version1::Head::parse(path, head, length)?)),
            2 => Ok(Self::Two(table::parse(path, head, length)?)),
            version => {
                let reason = format!("format version {version}, this program reads 1 and {VERSION}");
                let fix = "read it with a newer version of this program or simplify the plant again";
                Err(Error::unreadable(path, reason, fix))
            }
        }
    }

    /// Parts of the file and skipped sections.
    fn parts(&self, length: usize) -> [Vec<Part>; 2] {
        let part = |name: &str, bytes: usize| Part { name: name.into(), bytes: bytes as u64 };
        let known = version2::SECTIONS;
        let (parts, skipped) = match self {
            Self::One(head) => {
                let parts = head.sections.iter().zip(known);
                (parts.map(|(range, (_, name))| part(name, range.len())).collect(), Vec::new())
            }
            Self::Two(sections) => {
                let find = |tag| sections.iter().find(move |section| section.tag == tag);
                let parts = known.iter().filter_map(|(tag, name)| Some(part(name, find(*tag)?.range.len())));
                let skipped = sections.iter().filter(|section| !version2::is_known(section));
                (parts.collect::<Vec<_>>(), skipped.map(|section| part(&section.name(), section.range.len())).collect())
            }
        };
        let told: u64 = parts.iter().chain(&skipped).map(|part: &Part| part.bytes).sum();
        [[vec![part("table", length - told as usize)], parts].concat(), skipped]
    }
}

fn decode(path: &Path, bytes: &[u8]) -> Result<ModelFile> {
    let head = Head::parse(path, bytes, bytes.len() as u64)?;
    let (version, model) = match &head {
        Head::One(head) => (1, version1::decode_model(path, head, bytes)?),
        Head::Two(sections) => (2, version2::decode_model(path, sections, bytes)?),
    };
    model.validate()?;
    let [parts, skipped] = head.parts(bytes.len());
    Ok(ModelFile { model, version, parts, skipped })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Precision, validate::samples};

    /// Sample models, exact and quantized.
    fn models(leaves: u32) -> [FoliageModel; 2] {
        let exact = samples::model(leaves);
        let mut quantized = exact.clone();
        quantized.quantize();
        assert_ne!(quantized.precision, Precision::EXACT);
        [exact, quantized]
    }

    #[cfg(feature = "write")]
    #[test]
    fn reading_gives_back_what_was_written_and_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vds");
        for mut model in models(40) {
            model.recipe.adapter = Some("an adapter".into());
            model.recipe.intrinsic = 0.01;
            model.wood_order = Some(crate::wood::WoodOrder {
                boosts: Some([40; crate::wood::BOOSTS]),
                stems: vec![crate::wood::StemLink { parent: None, level: 0 }],
                triangle_stems: vec![0],
                parents: vec![0, 0, 1],
                thresholds: vec![f32::INFINITY, 2.0, 0.5],
                swells: vec![std::array::from_fn(|i| i as u8)],
            });
            model.curve = Some(crate::model::ErrorCurve::hull(64.0, 1.5, [(0, 9.0), (3, 2.5), (40, 0.0)]));
            model.write(&path).unwrap();
            let file = ModelFile::read(&path).unwrap();
            assert_eq!((&file.model, file.version, file.skipped.len()), (&model, 2, 0));
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(file.model.to_bytes().unwrap(), bytes);
            assert_eq!(file.parts.iter().map(|part| part.bytes).sum::<u64>(), bytes.len() as u64);
        }
    }

    #[test]
    fn every_truncation_every_extension_and_every_flipped_bit_is_refused() {
        for bytes in models(3).map(|model| model.to_bytes().unwrap()) {
            for length in 0..bytes.len() {
                assert!(FoliageModel::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
            }
            assert!(FoliageModel::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
            for bit in 0..bytes.len() * 8 {
                let mut flipped = bytes.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                assert!(FoliageModel::from_bytes(&flipped).is_err(), "bit {bit}");
            }
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

    /// So many equal leaves pack into so few bytes that reading them would take far more memory
    /// than the file accounts for.
    #[test]
    fn files_of_models_that_pack_too_well_are_filled_up() {
        let mut model = samples::model(1);
        let (leaf, quad) = (model.leaves[0].clone(), model.vertices.clone());
        for i in 1..300_000_u32 {
            model.vertices.extend(&quad);
            model.plant.indices.extend([0, 1, 2, 0, 2, 3].map(|index| 4 * i + index));
            let [vertices, indices] = [[4 * i, 4 * i + 4], [6 * i, 6 * i + 6]];
            model.leaves.push(crate::model::Leaf {
                vertices,
                indices,
                leaf_to_split: 0,
                leaf_to_collapse: 0,
                ..leaf.clone()
            });
        }
        let bytes = model.to_bytes().unwrap();
        // 520 bytes of memory a leaf.
        assert!((3_000_000..3_200_000).contains(&bytes.len()), "{} bytes", bytes.len());
        let file = ModelFile::from_bytes(&bytes).unwrap();
        assert!(file.model == model && file.parts.last().unwrap().name == "fill");
        let mut sections = table::parse(Path::new("model"), &bytes, bytes.len() as u64).unwrap();
        let fill = sections.pop().unwrap();
        let sections: Vec<_> = sections
            .iter()
            .map(|section| (section.tag, section.flags, bytes[section.range.clone()].to_vec()))
            .collect();
        assert!(fill.flags & table::REQUIRED == 0);
        assert!(FoliageModel::from_bytes(&table::join("bare", &sections).unwrap()).is_err());
    }
}
