//! Files: input that is a regular file, and output that is replaced whole or not at all (feature
//! `write`).

#[cfg(feature = "write")]
mod write;

use crate::{Error, Result};
use std::{
    fs::{self, File},
    io::{self, ErrorKind},
    path::Path,
};
#[cfg(feature = "write")]
pub use write::{check_apart, check_writable, write_all, write_whole};

/// Opens a regular file. Anything else is rejected before it is opened, because opening a pipe
/// without a writer would block forever.
///
/// # Errors
/// [`Error::Io`] when the file does not exist, is not a regular file or is not readable.
pub fn open(path: impl AsRef<Path>) -> Result<File> {
    let path = path.as_ref();
    let failed = |source| Error::io(path, source);
    let kind = fs::metadata(path).map_err(failed)?.file_type();
    match kind.is_file() {
        true => File::open(path).map_err(failed),
        false if kind.is_dir() => Err(failed(ErrorKind::IsADirectory.into())),
        false => Err(failed(io::Error::new(ErrorKind::InvalidInput, "is not a regular file; name one that is"))),
    }
}
