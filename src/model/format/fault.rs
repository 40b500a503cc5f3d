//! Errors of files that cannot be read.

use crate::{Error, Result};
use std::path::Path;

/// Maximum file size. A plant of 4 million leaves with 4 vertices each, the most allowed, takes
/// 1.1 GB without packing. Below 4 GiB, so that every length fits in a 32-bit `usize`.
pub const MAX_FILE_BYTES: u64 = 3 << 30;

/// Result of decoding a part of a file; the error says what is wrong with it.
pub(super) type Decoded<T> = std::result::Result<T, String>;

pub(super) fn damaged(path: &Path, reason: String) -> Error {
    Error::unreadable(path, format!("damaged: {reason}"), "copy the file again or simplify the plant again")
}

/// [`damaged`], naming the section.
pub(super) fn damaged_in<T>(path: &Path, section: &str, decoded: Decoded<T>) -> Result<T> {
    decoded.map_err(|reason| damaged(path, format!("section {section}: {reason}")))
}

pub(super) fn check_length(path: &Path, length: u64) -> Result<()> {
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

pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

pub(super) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}
