//! Buffers and buffer views of a glTF file: loaded, decompressed and checked once, then sliced.

use super::{fault::Fault, meshopt, uri};
use ::gltf::json::{Index, Root, Value, buffer::View};
use std::{borrow::Cow, collections::BTreeSet, path::Path};

/// Maximum expansion of a valid compressed view: a block of 256 elements of four zero deltas each
/// takes a byte.
const MAX_VIEW_EXPANSION: u64 = 1024;
/// Maximum expansion of all compressed views together, over the bytes of the file.
const MAX_EXPANSION: u64 = 64;
/// Names of the extensions that compress views: the same, but for the newest streams.
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// The bytes behind a file's buffer views.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
    /// Decompressed content of each view, `None` for a view that is not compressed.
    decompressed: Vec<Option<Vec<u8>>>,
}

/// The bytes of one view.
#[derive(Clone, Copy)]
pub(super) struct ViewBytes<'a> {
    pub(super) bytes: &'a [u8],
    /// Bytes from one element to the next, if the view specifies it; at most 255 in a valid file.
    pub(super) stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Loads every buffer and decompresses the compressed views.
    pub(super) fn load(root: &'a Root, binary: Option<&'a [u8]>, path: &Path) -> Result<Self, Fault> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        let mut files = BTreeSet::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let bytes: Cow<'a, [u8]> = match (&buffer.uri, binary) {
                (Some(uri), _) if !uri::is_data(uri) && !files.insert(uri::file_of(uri, path)) => {
                    return Err(Fault::broken(format!("buffer {i} refers to the same file as another buffer")));
                }
                (Some(uri), _) => uri::read(uri, path)?.into(),
                (None, Some(binary)) if i == 0 => binary.into(),
                // A buffer without bytes is the fallback of compressed views; any other use fails
                // as out of range.
                (None, _) => Cow::Borrowed(&[]),
            };
            buffers.push(bytes);
        }
        let mut loaded = Self { root, buffers, decompressed: Vec::with_capacity(root.buffer_views.len()) };
        loaded.decompress()?;
        Ok(loaded)
    }

    /// Total size in bytes of all buffers as stored in the file.
    pub(super) fn total_bytes(&self) -> u64 {
        self.buffers.iter().map(|buffer| buffer.len() as u64).sum()
    }

    /// The bytes of view `index`.
    pub(super) fn view(&self, index: Index<View>) -> Result<ViewBytes<'_>, Fault> {
        let i = index.value();
        let view = self.root.buffer_views.get(i).ok_or_else(|| {
            Fault::broken(format!("buffer view {i} is referenced and {} exist", self.root.buffer_views.len()))
        })?;
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride != 0);
        if let Some(bytes) = &self.decompressed[i] {
            return Ok(ViewBytes { bytes, stride });
        }
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        let bytes = self.slice(view.buffer.value() as u64, offset, view.byte_length.0, i)?;
        Ok(ViewBytes { bytes, stride })
    }

    fn slice(&self, buffer: u64, offset: u64, length: u64, view: usize) -> Result<&[u8], Fault> {
        let bytes = usize::try_from(buffer).ok().and_then(|buffer| self.buffers.get(buffer));
        let end = offset.checked_add(length);
        let range = end.and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
        bytes.zip(range).and_then(|(bytes, range)| bytes.get(range)).ok_or_else(|| {
            let there = bytes.map_or(0, |bytes| bytes.len());
            Fault::broken(format!(
                "buffer view {view} covers {length} bytes from byte {offset} of buffer {buffer}, which has {there}"
            ))
        })
    }

    fn decompress(&mut self) -> Result<(), Fault> {
        let mut budget = self.total_bytes().saturating_mul(MAX_EXPANSION);
        for (i, view) in self.root.buffer_views.iter().enumerate() {
            let extension = |name| Some((name, view.extensions.as_ref()?.others.get(name)?));
            let extension = MESHOPT.into_iter().find_map(extension);
            let bytes = extension.map(|extension| self.decompress_view(i, extension, &mut budget)).transpose()?;
            self.decompressed.push(bytes);
        }
        Ok(())
    }

    fn decompress_view(
        &self,
        view: usize,
        (name, extension): (&str, &Value),
        budget: &mut u64,
    ) -> Result<Vec<u8>, Fault> {
        let broken = |what: &str| Fault::broken(format!("buffer view {view}: {name}: {what}"));
        let number = |key: &str| extension.get(key).and_then(Value::as_u64);
        let required =
            |key: &str| number(key).ok_or_else(|| broken(&format!("{key} is missing or not a whole number")));
        let [buffer, length, count, stride] =
            [required("buffer")?, required("byteLength")?, required("count")?, required("byteStride")?];
        let encoded = self.slice(buffer, number("byteOffset").unwrap_or(0), length, view)?;
        let size = count.checked_mul(stride).filter(|&size| size <= length.saturating_mul(MAX_VIEW_EXPANSION));
        let size = size
            .filter(|size| size <= budget)
            .ok_or_else(|| broken(&format!("{count} elements of {stride} bytes cannot come from {length} bytes")))?;
        *budget -= size;
        let text = |key: &str| extension.get(key).and_then(Value::as_str);
        let mode = meshopt::Mode::parse(text("mode"), text("filter")).map_err(|what| broken(&what))?;
        meshopt::decode(encoded, count as usize, stride as usize, mode).map_err(|what| broken(&what))
    }
}
