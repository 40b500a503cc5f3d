//! Resolves the URIs of a file: `data:` URIs and files next to it.

use super::{MAX_FILE_BYTES, fault::Fault, fault::limit, foreign, text};
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Scheme of files of the machine that wrote the URI.
const LOCAL: &str = "file://";

/// Reads the bytes that `uri` refers to. `beside` is the file that contains the URI.
pub(super) fn read(uri: &str, beside: &Path) -> Result<Vec<u8>, Fault> {
    if is_data(uri) {
        return decode_data(uri);
    }
    if uri.contains("://") && !uri.starts_with(LOCAL) {
        let feature = format!("fetching {uri:?}");
        return Err(Fault::Unsupported { feature, fix: "download it and refer to it by a relative path".to_owned() });
    }
    if percent_decode_str(uri).decode_utf8_lossy().contains(char::is_control) {
        return Err(Fault::broken(format!("the file name {uri:?} contains control characters")));
    }
    let bytes = read_file(&beside_path(uri, beside))?;
    match foreign::pointer(&bytes) {
        Some((reason, fix)) => Err(Fault::Broken { reason: format!("{uri:?}: {reason}"), fix }),
        None => Ok(bytes),
    }
}

/// Returns true if `uri` is a `data:` URI, which contains its bytes.
pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Reads a whole regular file.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, Fault> {
    let io = |source| Fault::Io { path: path.to_path_buf(), source };
    let metadata = fs::metadata(path).map_err(io)?;
    if !metadata.is_file() {
        return Err(io(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file; name one that is")));
    }
    limit("the file size in bytes", metadata.len(), MAX_FILE_BYTES)?;
    fs::read(path).map_err(io)
}

fn decode_data(uri: &str) -> Result<Vec<u8>, Fault> {
    let broken = || Fault::broken("a data: URI is not valid base64");
    let (bytes, _) = DataUrl::process(uri).map_err(|_| broken())?.decode_to_vec().map_err(|_| broken())?;
    Ok(bytes)
}

/// Canonical path of the file that `uri` refers to, so that two names of one file compare equal.
pub(super) fn file_of(uri: &str, beside: &Path) -> PathBuf {
    let path = beside_path(uri, beside);
    fs::canonicalize(&path).unwrap_or(path)
}

/// Resolves a relative URI. Absolute paths, such as `C:/...` of another machine, and folders that
/// do not exist are reduced to their file name. A name in another case is found if it is the only
/// one.
fn beside_path(uri: &str, file: &Path) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    let plain = |uri: &str| uri.strip_prefix(LOCAL).map(|path| format!("/{path}")).unwrap_or(uri.replace('\\', "/"));
    // A percent sign may also be literal.
    let written = [&percent_decode_str(uri).decode_utf8_lossy(), uri].map(plain);
    let is_absolute = written[0].starts_with('/') || written[0].as_bytes().get(1) == Some(&b':');
    let names = written.each_ref().map(|path| path.rsplit('/').next().unwrap_or_default());
    let paths = written.iter().map(String::as_str).filter(|_| !is_absolute);
    let otherwise = folder.join(if is_absolute { names[0] } else { &written[0] });
    paths.chain(names).find_map(|path| found(folder, path)).unwrap_or(otherwise)
}

/// The file at `path` in `folder`, each step in any case if no name on disk is equal.
fn found(folder: &Path, path: &str) -> Option<PathBuf> {
    let exact = folder.join(path);
    if exact.is_file() {
        return Some(exact);
    }
    let mut at = folder.to_path_buf();
    for step in path.split('/').filter(|step| !step.is_empty()) {
        let exact = at.join(step);
        at = if exact.exists() { exact } else { only_alike(&at, step)? };
    }
    at.is_file().then_some(at)
}

/// The only entry of `folder` whose name differs from `name` in case or encoding alone.
fn only_alike(folder: &Path, name: &str) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let wanted = name.to_lowercase();
    let is_alike = |entry: &fs::DirEntry| {
        let name = entry.file_name();
        let bytes = name.as_encoded_bytes();
        let name = str::from_utf8(bytes).map_or_else(|_| text::windows_1252(bytes), str::to_owned);
        name.to_lowercase() == wanted
    };
    let mut alike = fs::read_dir(folder).ok()?.flatten().filter(is_alike);
    let first = alike.next()?;
    alike.next().is_none().then(|| first.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_data_is_decoded() {
        let uri = "data:application/octet-stream;base64,AQID/w==";
        assert_eq!(read(uri, Path::new("a.gltf")).unwrap(), [1, 2, 3, 255]);
        assert!(read("data:;base64,A", Path::new("a.gltf")).is_err());
        assert!(read("data:", Path::new("a.gltf")).is_err());
    }

    #[test]
    fn absolute_paths_never_leave_the_folder() {
        let beside = Path::new("/plants/oak.obj");
        assert_eq!(beside_path("C:/art/leaf.png", beside), Path::new("/plants/leaf.png"));
        assert_eq!(beside_path("C:\\art\\leaf.png", beside), Path::new("/plants/leaf.png"));
        assert_eq!(beside_path("/dev/zero", beside), Path::new("/plants/zero"));
        assert_eq!(beside_path("my%20leaf.png", beside), Path::new("/plants/my leaf.png"));
        assert_eq!(beside_path("file:///C:/art/leaf.png", beside), Path::new("/plants/leaf.png"));
        assert_eq!(beside_path("\\\\host\\art\\leaf.png", beside), Path::new("/plants/leaf.png"));
    }

    #[test]
    fn a_name_is_found_in_another_case_if_it_is_the_only_one() {
        let folder = tempfile::tempdir().unwrap();
        let tree = folder.path().join("tree.obj");
        let write = |name: &str| fs::write(folder.path().join(name), name).unwrap();
        fs::create_dir(folder.path().join("Maps")).unwrap();
        ["Leaf.PNG", "Maps/Bark.png", "100%25.png", "Twin.png", "twin.PNG"].into_iter().for_each(write);
        let read = |uri: &str| read(uri, &tree).map(|bytes| String::from_utf8(bytes).unwrap()).unwrap_or_default();
        assert_eq!(read("leaf.png"), "Leaf.PNG");
        assert_eq!(read("D:\\art\\LEAF.png"), "Leaf.PNG");
        assert_eq!(read("missing\\leaf.png"), "Leaf.PNG");
        assert_eq!(read("maps\\bark.PNG"), "Maps/Bark.png");
        assert_eq!(read("100%25.png"), "100%25.png");
        assert_eq!([read("TWIN.png"), read("Twin.png")], ["", "Twin.png"]);
        assert_eq!([read("maps"), read(""), read("..")], ["", "", ""]);
    }

    #[test]
    fn what_is_not_a_regular_file_is_refused() {
        assert!(matches!(read_file(Path::new("/")), Err(Fault::Io { .. })));
    }
}
