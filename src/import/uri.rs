//! Resolves the URIs of a file: `data:` URIs and files next to it.

use super::{MAX_FILE_BYTES, fault::Fault, fault::limit};
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Reads the bytes that `uri` refers to. `beside` is the file that contains the URI.
pub(super) fn read(uri: &str, beside: &Path) -> Result<Vec<u8>, Fault> {
    if is_data(uri) {
        return decode_data(uri);
    }
    if uri.contains("://") {
        let feature = format!("fetching {uri:?}");
        return Err(Fault::Unsupported { feature, fix: "download it and refer to it by a relative path".to_owned() });
    }
    if percent_decode_str(uri).decode_utf8_lossy().contains(char::is_control) {
        return Err(Fault::broken(format!("the file name {uri:?} contains control characters")));
    }
    read_file(&beside_path(uri, beside))
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

/// Resolves a relative URI. Absolute paths, such as `C:/...` of another machine, are reduced to
/// their file name.
fn beside_path(uri: &str, file: &Path) -> PathBuf {
    let decoded = percent_decode_str(uri).decode_utf8_lossy().replace('\\', "/");
    let folder = file.parent().unwrap_or(Path::new(""));
    let is_absolute = decoded.starts_with('/') || decoded.as_bytes().get(1) == Some(&b':');
    if is_absolute {
        return folder.join(decoded.rsplit('/').next().unwrap_or_default());
    }
    // A percent sign may also be literal.
    [folder.join(&decoded), folder.join(uri)].into_iter().find(|path| path.exists()).unwrap_or(folder.join(decoded))
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
    }

    #[test]
    fn what_is_not_a_regular_file_is_refused() {
        assert!(matches!(read_file(Path::new("/")), Err(Fault::Io { .. })));
    }
}
