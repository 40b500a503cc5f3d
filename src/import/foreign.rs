//! Names files that are neither glTF nor OBJ by their first bytes, and the way to a glTF file.

use super::fault::Fault;

/// First bytes of a file that Git LFS leaves in place of a large one.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";
/// Maximum size of such a file in bytes.
const MAX_POINTER_BYTES: usize = 1024;

/// Suggested fix for formats that Blender reads.
const IN_BLENDER: &str = "open it in Blender and export glTF 2.0 (.glb)";
const BLEND: &str =
    "export it: blender -b in.blend --python-expr \"import bpy; bpy.ops.export_scene.gltf(filepath='out.glb')\"";
const UNPACK: &str = "unpack it and use the .glb, .gltf or .obj file inside";
const B3DM: &str = "take the glTF out of it: npx 3d-tiles-tools b3dmToGlb -i in.b3dm -o out.glb";
const I3DM: &str = "take the glTF out of it: npx 3d-tiles-tools i3dmToGlb -i in.i3dm -o out.glb";

/// Formats by their first bytes: name, and fix.
const FORMATS: &[(&[u8], &str, &str)] = &[
    (b"Kaydara FBX Binary", "an FBX file", IN_BLENDER),
    (b"; FBX", "an FBX file", IN_BLENDER),
    (b"PXR-USDC", "a USD file", IN_BLENDER),
    (b"#usda", "a USD file", IN_BLENDER),
    (b"BLENDER", "a Blender file", BLEND),
    (b"ply\n", "a PLY file", IN_BLENDER),
    (b"ply\r\n", "a PLY file", IN_BLENDER),
    (b"solid ", "an STL file", IN_BLENDER),
    (b"Ogawa", "an Alembic file", IN_BLENDER),
    (b"b3dm", "a 3D tile (b3dm)", B3DM),
    (b"i3dm", "a 3D tile (i3dm)", I3DM),
    (b"pnts", "a 3D tile of points", "use a tile of meshes, or the tree as .glb, .gltf or .obj"),
    (b"cmpt", "a 3D tile of several (cmpt)", "use one of its tiles, or the tree as .glb, .gltf or .obj"),
    (b"\x1f\x8b", "packed with gzip", "unpack it first: gzip -d < in.gz > out.glb"),
    (b"\x28\xb5\x2f\xfd", "packed with Zstandard, as Blender's files are", IN_BLENDER),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"VDSFOLI\0", "a model already", "render it, or use the tree that it was made from"),
    (b"\x89PNG", "a picture", "use the .glb, .gltf or .obj file of the tree"),
    (b"\xff\xd8\xff", "a picture", "use the .glb, .gltf or .obj file of the tree"),
    (
        b"\xd0\xcf\x11\xe0",
        "a 3ds Max file or another document",
        "export it as glTF 2.0 (.glb) from the program that wrote it",
    ),
];

/// Fails with the name of the format if `bytes` begin like a file of another one.
pub(super) fn check(bytes: &[u8]) -> Result<(), Fault> {
    if bytes.is_empty() {
        return Err(Fault::Broken { reason: "the file is empty".to_owned(), fix: "copy or export it again" });
    }
    let found =
        pointer(bytes).or_else(|| other(bytes).map(|(what, fix)| (format!("it is {what}, not glTF or OBJ"), fix)));
    match found {
        Some((reason, fix)) => Err(Fault::Broken { reason, fix }),
        None => Ok(()),
    }
}

/// The reason and the fix if `bytes` are those that Git LFS leaves in place of a file.
pub(super) fn pointer(bytes: &[u8]) -> Option<(String, &'static str)> {
    let is_pointer = bytes.starts_with(POINTER) && bytes.len() <= MAX_POINTER_BYTES;
    let reason = "it is a Git LFS pointer, a few lines in place of the file itself".to_owned();
    is_pointer.then_some((reason, "fetch the file: git lfs pull"))
}

fn other(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let known =
        FORMATS.iter().find(|(first, ..)| bytes.starts_with(first) || first.is_ascii() && start.starts_with(first));
    match known {
        _ if bytes.starts_with(b"PK\x03\x04") => Some(zip(bytes)),
        Some((_, what, fix)) => Some((what, fix)),
        None if start.starts_with(b"<") => Some(markup(start)),
        None => is_binary_stl(bytes).then_some(("an STL file", IN_BLENDER)),
    }
}

/// A ZIP archive; USDZ is one whose first file is USD.
fn zip(bytes: &[u8]) -> (&'static str, &'static str) {
    let length = bytes.get(26..28).map_or(0, |length| usize::from(u16::from_le_bytes([length[0], length[1]])));
    let name = bytes.get(30..).and_then(|rest| rest.get(..length)).unwrap_or_default();
    match name.windows(4).any(|part| part.eq_ignore_ascii_case(b".usd")) {
        true => ("a USDZ file", IN_BLENDER),
        false => ("a ZIP archive", UNPACK),
    }
}

/// A file of tags: COLLADA, X3D, a web page or another.
fn markup(start: &[u8]) -> (&'static str, &'static str) {
    let head = start.get(..4096).unwrap_or(start).to_ascii_lowercase();
    let has = |tag: &[u8]| head.windows(tag.len()).any(|part| part == tag);
    match () {
        () if has(b"<collada") => ("a COLLADA file (.dae)", IN_BLENDER),
        () if has(b"<x3d") => ("an X3D file", IN_BLENDER),
        () if has(b"<html") || has(b"<!doctype html") => {
            ("a web page", "download the file itself, not the page that shows it")
        }
        () => ("an XML file", "export it as glTF 2.0 (.glb) from the program that wrote it"),
    }
}

/// Bytes of an STL file before its triangles, and of a triangle.
const STL_HEADER: usize = 84;
const STL_TRIANGLE: u64 = 50;

fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(STL_HEADER - 4..STL_HEADER).and_then(|count| count.first_chunk());
    let expected = count.map(|count| STL_HEADER as u64 + u64::from(u32::from_le_bytes(*count)) * STL_TRIANGLE);
    bytes.len() > STL_HEADER && expected == Some(bytes.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(bytes: &[u8]) -> String {
        let Err(Fault::Broken { reason, .. }) = check(bytes) else { return String::new() };
        reason
    }

    #[test]
    fn files_of_other_formats_are_named() {
        let stl = [&[0; 80][..], &1u32.to_le_bytes(), &[0; 50]].concat();
        let zipped = |name: &[u8]| [b"PK\x03\x04", &[0; 22][..], &[name.len() as u8, 0, 0, 0], name].concat();
        for (bytes, what) in [
            (&b"Kaydara FBX Binary  \0\x1a\0"[..], "FBX"),
            (b"; FBX 7.4.0 project file", "FBX"),
            (b"\xef\xbb\xbf<?xml version=\"1.0\"?>\n<COLLADA xmlns=", "COLLADA"),
            (b"\n<!DOCTYPE html><html>", "a web page"),
            (b"#usda 1.0", "a USD file"),
            (b"PXR-USDC\0", "a USD file"),
            (b"BLENDER-v402", "Blender"),
            (b"b3dm\x01\0\0\0", "b3dm"),
            (b"\x1f\x8b\x08\0", "gzip"),
            (b"ply\nformat ascii 1.0", "PLY"),
            (b"solid tree\nfacet normal 0 0 1", "STL"),
            (&stl, "STL"),
            (&zipped(b"tree.usdc"), "USDZ"),
            (&zipped(b"tree/tree.glb"), "ZIP"),
            (b"", "empty"),
        ] {
            assert!(named(bytes).contains(what), "{what}: {:?}", named(bytes));
        }
    }

    #[test]
    fn gltf_obj_and_other_text_pass() {
        for bytes in
            [&b"glTF\x02\0\0\0"[..], b" {\"asset\"", b"# an OBJ file\nv 0 0 0", b"solidity", b"version 7", b"P"]
        {
            assert_eq!(named(bytes), "");
        }
    }
}
