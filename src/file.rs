//! Output files: refused before the work starts, replaced whole or not at all. Input files: regular ones.
//!
//! Limits: a process that is killed outright while it writes leaves its temporary file, `.foliage-lod-*.part`.

use crate::{Error, Result};
use std::{
    fs::{self, File},
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// Replaces the file at `path` by `bytes`, or creates it. A reader never sees half of it, and when anything fails what was
/// there stays: the bytes go to a temporary file in the same folder, to the disk, and are then renamed.
///
/// # Errors
/// [`Error::Io`] when the folder does not exist or cannot be written to, when `path` is read-only or no regular file, or when
/// the disk is full.
pub fn write_whole(path: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
    let path = path.as_ref();
    let failed = |source| Error::io(path, source);
    let (mut file, target) = temporary_beside(path)?;
    file.as_file_mut().write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(target).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Fails as [`write_whole`] to the same path would, so that a long computation is not started for nothing. Leaves nothing
/// behind.
///
/// # Errors
/// [`Error::Io`] as for [`write_whole`].
pub fn check_writable(path: impl AsRef<Path>) -> Result<()> {
    temporary_beside(path.as_ref()).map(drop)
}

/// Fails when `output` is one of `inputs`, by whatever name: what is read would be lost. Files that those refer to are for the
/// caller to name.
///
/// # Errors
/// [`Error::Io`] that names the output.
pub fn check_apart(output: impl AsRef<Path>, inputs: impl IntoIterator<Item: AsRef<Path>>) -> Result<()> {
    let output = output.as_ref();
    let Ok(target) = fs::canonicalize(output) else { return Ok(()) };
    if inputs.into_iter().any(|input| fs::canonicalize(input).is_ok_and(|input| input == target)) {
        let why = "is what is read and would be lost; name another file to write to";
        return Err(Error::io(output, io::Error::new(ErrorKind::InvalidInput, why)));
    }
    Ok(())
}

/// Opens a regular file. Anything else is refused before it is opened: a pipe that nobody writes to would never answer.
///
/// # Errors
/// [`Error::Io`] when the file does not exist, is no regular file or may not be read.
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

/// A temporary file in the folder of `path`, deleted when dropped, and the path with a symbolic link at its end resolved.
fn temporary_beside(path: &Path) -> Result<(NamedTempFile, PathBuf)> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let refused = |kind, why: &str| Err(Error::io(path, io::Error::new(kind, why)));
    if target.is_dir() || target.file_name().is_none() {
        return refused(ErrorKind::IsADirectory, "is a folder; name a file in it");
    }
    if target.exists() && !target.is_file() {
        return refused(ErrorKind::InvalidInput, "is not a regular file; name one that can be replaced");
    }
    if fs::metadata(&target).is_ok_and(|target| target.permissions().readonly()) {
        return refused(ErrorKind::PermissionDenied, "is read-only; make it writable or name another file");
    }
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return refused(ErrorKind::NotFound, "its folder does not exist; create it first");
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".foliage-lod-").suffix(".part");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).map_err(|error| {
        let why = format!("no file can be made in it ({}); name another folder", error.kind());
        Error::io(folder, io::Error::new(error.kind(), why))
    })?;
    Ok((file, target))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vds");
        for bytes in [&b"first"[..], b"second, longer"] {
            write_whole(&path, bytes).unwrap();
            assert_eq!(fs::read(&path).unwrap(), bytes);
        }
        check_writable(&path).unwrap();
        assert_eq!(names(folder.path()), ["a.vds"]);
    }

    #[test]
    fn folders_and_missing_folders_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_path_buf(), folder.path().join("none/a.vds"), folder.path().join("..")] {
            assert!(matches!(check_writable(&path), Err(Error::Io { .. })), "{}", path.display());
            assert!(matches!(write_whole(&path, b"x"), Err(Error::Io { .. })), "{}", path.display());
        }
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_keeps_pointing_at_the_replaced_file() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
