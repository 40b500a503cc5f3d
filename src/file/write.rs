//! Output files: checked before the work starts, replaced atomically.
//!
//! Limits: a process that is killed outright while writing leaves its temporary file behind
//! (`.foliage-lod-*.part`).

use crate::{Error, Result};
use std::{
    fs,
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};
use tempfile::{NamedTempFile, TempPath};

/// Creates the file at `path` with the content `bytes`, or replaces it atomically.
///
/// A reader never sees a partial file, and on failure the previous content is kept: the bytes are
/// written to a temporary file in the same folder and synced to disk, then the file is renamed.
///
/// # Errors
/// [`Error::Io`] when the folder does not exist or is not writable, when `path` is read-only or not
/// a regular file, or when the disk is full.
pub fn write_whole(path: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
    write_all(&[(path, bytes)])
}

/// Creates or replaces several files as [`write_whole`] does: all, or none of them. If one cannot
/// be replaced, those before it get back what they held, and those that are new are removed.
///
/// # Errors
/// As [`write_whole`], for the first file that fails.
pub fn write_all(files: &[(impl AsRef<Path>, impl AsRef<[u8]>)]) -> Result<()> {
    replace_all(written(files)?)
}

/// A file that is written under another name beside its own, and its own, as given and with links
/// resolved.
type Written<'a> = (&'a Path, NamedTempFile, PathBuf);

fn written(files: &[(impl AsRef<Path>, impl AsRef<[u8]>)]) -> Result<Vec<Written<'_>>> {
    let mut written = Vec::new();
    for (path, bytes) in files {
        let path = path.as_ref();
        let failed = |source| Error::io(path, source);
        let (mut file, target) = temporary_beside(path)?;
        file.as_file_mut().write_all(bytes.as_ref()).map_err(failed)?;
        file.as_file().sync_all().map_err(failed)?;
        written.push((path, file, target));
    }
    Ok(written)
}

/// Gives all files their names, or none.
fn replace_all(written: Vec<Written>) -> Result<()> {
    let mut replaced: Vec<(PathBuf, Option<TempPath>)> = Vec::new();
    let is_only = written.len() == 1;
    for (path, file, target) in written {
        // Of one file there is nothing to give back.
        let kept = if is_only { Ok(None) } else { kept(&target) };
        let done = kept.and_then(|kept| file.persist(&target).map(|_| kept).map_err(|error| error.error));
        match done {
            Ok(kept) => replaced.push((target, kept)),
            Err(error) => {
                replaced.into_iter().for_each(|(target, kept)| restore(&target, kept));
                return Err(Error::io(path, error));
            }
        }
    }
    Ok(())
}

/// What a file holds, under a name that is removed when dropped; `None` if there is no such file.
fn kept(target: &Path) -> io::Result<Option<TempPath>> {
    if !target.exists() {
        return Ok(None);
    }
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let kept = builder().make_in(folder, |name| {
        // Some file systems have no second names.
        fs::hard_link(target, name).or_else(|_| fs::copy(target, name).map(drop))
    })?;
    Ok(Some(kept.into_temp_path()))
}

/// Undoes a replacement, as far as that is possible.
fn restore(target: &Path, kept: Option<TempPath>) {
    let _ = match kept {
        Some(kept) => kept.persist(target).map_err(|error| error.error),
        None => fs::remove_file(target),
    };
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".foliage-lod-").suffix(".part");
    builder
}

/// Checks that [`write_whole`] can write to `path`, so that a long computation does not fail at the
/// end. Leaves nothing behind.
///
/// # Errors
/// [`Error::Io`] as for [`write_whole`].
pub fn check_writable(path: impl AsRef<Path>) -> Result<()> {
    temporary_beside(path.as_ref()).map(drop)
}

/// Checks that `output` is not one of `inputs` under any name, which would overwrite the input.
///
/// Files that the inputs refer to are not followed: the caller lists them in `inputs`.
///
/// # Errors
/// [`Error::Io`] naming the output.
pub fn check_apart(output: impl AsRef<Path>, inputs: impl IntoIterator<Item: AsRef<Path>>) -> Result<()> {
    let output = output.as_ref();
    let Ok(target) = fs::canonicalize(output) else { return Ok(()) };
    if inputs.into_iter().any(|input| fs::canonicalize(input).is_ok_and(|input| input == target)) {
        let why = "is also an input and would be overwritten; name another output file";
        return Err(Error::io(output, io::Error::new(ErrorKind::InvalidInput, why)));
    }
    Ok(())
}

/// Creates a temporary file next to `path`, deleted when dropped. Also returns `path` with symbolic
/// links resolved, if it exists.
fn temporary_beside(path: &Path) -> Result<(NamedTempFile, PathBuf)> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let refused = |kind, why: &str| Err(Error::io(path, io::Error::new(kind, why)));
    if target.is_dir() || target.file_name().is_none() {
        return refused(ErrorKind::IsADirectory, "is a folder; name a file inside it");
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
    let mut builder = builder();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).map_err(|error| {
        let why = format!("cannot create a file in this folder ({}); choose another", error.kind());
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
    fn of_several_files_all_are_written_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let [old, new, last] = ["old", "new", "last"].map(|name| folder.path().join(name));
        fs::write(&old, b"before").unwrap();
        let files = [(&old, &b"1"[..]), (&new, b"2"), (&last, b"3")];
        fs::create_dir(&last).unwrap();
        assert!(write_all(&files).is_err());
        assert_eq!((fs::read(&old).unwrap(), new.exists()), (b"before".to_vec(), false));
        fs::remove_dir(&last).unwrap();
        write_all(&files).unwrap();
        assert_eq!([&old, &new, &last].map(|path| fs::read(path).unwrap()), [b"1", b"2", b"3"]);
        assert_eq!(names(folder.path()).len(), 3);
    }

    #[test]
    fn files_whose_names_are_taken_while_others_are_replaced_leave_all_as_it_was() {
        for taken in 0..4 {
            let folder = tempfile::tempdir().unwrap();
            let paths = ["a", "b", "c", "d"].map(|name| folder.path().join(name));
            let is_new = |i: usize| i % 2 == 1 || i == taken;
            (0..4).filter(|&i| !is_new(i)).for_each(|i| fs::write(&paths[i], [b'0' + i as u8]).unwrap());
            let files: Vec<_> = paths.iter().map(|path| (path, b"after")).collect();
            let ready = written(&files).unwrap();
            // A folder of this name appears too late to be refused.
            fs::create_dir(&paths[taken]).unwrap();
            fs::write(paths[taken].join("inside"), b"kept").unwrap();
            let error = replace_all(ready).unwrap_err();
            assert!(matches!(&error, Error::Io { path, .. } if *path == paths[taken]), "{error}");
            for (i, path) in paths.iter().enumerate().filter(|(i, _)| *i != taken) {
                assert_eq!(fs::read(path).ok(), (!is_new(i)).then(|| vec![b'0' + i as u8]), "{i} of {taken}");
            }
            assert_eq!(fs::read(paths[taken].join("inside")).unwrap(), b"kept");
            let left = (0..4).filter(|&i| !is_new(i)).count() + 1;
            assert_eq!(names(folder.path()).len(), left, "{:?}", names(folder.path()));
        }
    }

    #[test]
    fn what_was_replaced_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
        fs::write(&old, b"before").unwrap();
        let held = [&old, &new].map(|path| kept(path).unwrap());
        [&old, &new].into_iter().for_each(|path| write_whole(path, b"after").unwrap());
        [&old, &new].into_iter().zip(held).for_each(|(path, held)| restore(path, held));
        assert_eq!(fs::read(&old).unwrap(), b"before");
        assert_eq!(names(folder.path()), ["old"]);
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
