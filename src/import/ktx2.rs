//! KTX2 images in Basis Universal's codings (`KHR_texture_basisu`): the header is checked here, the
//! texels are decoded by the `basisu` crate.
//!
//! The decoder trusts the offsets and sizes of the header and allocates what it declares, so each
//! of them is held against the bytes of the file first.

use crate::material::{MAX_TEXTURE_SIDE, Pixels};
use basisu::{DecodeFlags, TargetFormat, Transcoder};

/// First bytes of a KTX2 file.
pub(super) const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";
/// Maximum number of mip levels: 8192 texels on a side have 14.
const MAX_LEVELS: u32 = 14;
/// Byte at which the list of levels begins, and bytes of an entry: offset, length, length once it
/// is decompressed.
const LEVELS: usize = 80;
const LEVEL_BYTES: usize = 24;
/// Bytes that place the key/value data.
const KEY_VALUES: std::ops::Range<usize> = 56..64;
/// Colour models of the data format descriptor: ETC1S and UASTC.
const MODELS: [u8; 2] = [163, 166];

/// Decodes the largest level of a flat image.
pub(super) fn decode(bytes: &[u8], most_bytes: u64) -> Result<Pixels, String> {
    let [width, height] = checked(bytes, most_bytes)?;
    let broken = |error: basisu::Error| format!("its KTX2 data cannot be decoded: {error:?}");
    let mut bytes = bytes.to_vec();
    // Remarks by key, which no picture needs and whose ends the decoder does not check.
    bytes[KEY_VALUES].fill(0);
    let image = Transcoder::new(&bytes).map_err(broken)?;
    let rgba = image.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(broken)?;
    let expected = width as usize * height as usize * 4;
    if rgba.len() != expected {
        return Err(format!("its KTX2 data has {} bytes instead of {expected}", rgba.len()));
    }
    Ok(Pixels { width, height, rgba })
}

/// Width and height, once everything that the header declares is known to be in the file.
fn checked(bytes: &[u8], most_bytes: u64) -> Result<[u32; 2], String> {
    let truncated = || "its KTX2 header is damaged".to_owned();
    let word = |at: usize| bytes.get(at..at + 4).and_then(|at| at.first_chunk()).map(|word| u32::from_le_bytes(*word));
    let long = |at: usize| bytes.get(at..at + 8).and_then(|at| at.first_chunk()).map(|long| u64::from_le_bytes(*long));
    let header = [12, 20, 24, 28, 32, 36, 40].map(word);
    let [Some(format), Some(width), Some(height), Some(depth), Some(layers), Some(faces), Some(levels)] = header else {
        return Err(truncated());
    };
    let is_within = |range: Option<(u64, u64)>| {
        range.and_then(|(offset, length)| offset.checked_add(length)).is_some_and(|end| end <= bytes.len() as u64)
    };
    let words = |at: usize| Some((word(at)?.into(), word(at + 4)?.into()));
    if format != 0 {
        return Err(format!("it is KTX2 in Vulkan format {format}, not in a coding of Basis Universal"));
    }
    if [width, height].iter().any(|side| !(1..=MAX_TEXTURE_SIDE).contains(side)) {
        return Err(format!("it is KTX2 of {width} x {height} texels, from 1 to {MAX_TEXTURE_SIDE} are supported"));
    }
    if depth > 0 || layers > 1 || faces != 1 || levels > MAX_LEVELS {
        return Err("it is KTX2 with several layers, faces or depths".to_owned());
    }
    if !is_within(words(48)) || !is_within(words(56)) || !is_within(long(64).zip(long(72))) {
        return Err(truncated());
    }
    let model = word(48).and_then(|descriptor| bytes.get((descriptor as usize).checked_add(12)?));
    if !model.is_some_and(|model| MODELS.contains(model)) {
        return Err("it is KTX2 in a coding other than ETC1S and UASTC".to_owned());
    }
    // Basis Universal takes a byte per texel, in blocks of 4 x 4.
    let most_decompressed = u64::from(width.next_multiple_of(4)) * u64::from(height.next_multiple_of(4));
    for level in (0..levels.max(1) as usize).map(|level| LEVELS + level * LEVEL_BYTES) {
        let decompressed = long(level + 16).filter(|&size| size <= most_decompressed);
        if !is_within(long(level).zip(long(level + 8))) || decompressed.is_none() {
            return Err(truncated());
        }
    }
    // The texels, and the coded blocks beside them.
    let held = most_decompressed * 6;
    if held > most_bytes {
        return Err(format!("decoding {width} x {height} texels needs {held} bytes, more than its size accounts for"));
    }
    Ok([width, height])
}
