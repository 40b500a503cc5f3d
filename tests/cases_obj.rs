//! OBJ files and their materials as other programs write them, textures and streams in newer
//! formats, files of other formats, and foliage named by the user.
//!
//! Files that show faults are in the folder named by the environment variable `FOLIAGE_CASES`. If
//! it is not set, the tests that need them print a note and pass.
#![cfg(feature = "simplify")]

#[path = "common/glb.rs"]
mod glb;

use foliage_lod::{
    Error,
    import::*,
    material::{AlphaMode, Pixels, Texture, TextureFormat, Wrap},
};
use glb::{Gltf, cards};
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

/// The path of `file`; `None`, with a note printed, if `FOLIAGE_CASES` is not set.
fn case(file: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("FOLIAGE_CASES") else {
        eprintln!("skipped: FOLIAGE_CASES is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(file);
    assert!(path.is_file(), "{} is missing", path.display());
    Some(path)
}

fn read(path: &Path) -> Imported {
    load(path, &ImportOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn naming(leaves: &[&str]) -> ImportOptions {
    ImportOptions { leaves: leaves.iter().map(|name| (*name).to_owned()).collect(), ..ImportOptions::default() }
}

/// The decoded texture of the first leaf, which must be cut by alpha.
fn cut(imported: &Imported) -> Pixels {
    let material = &imported.plant.materials[imported.plant.leaves[0].material as usize];
    assert_eq!(material.alpha_mode, AlphaMode::Mask, "{:?}", imported.warnings);
    imported.plant.textures[material.texture.unwrap() as usize].decode().unwrap()
}

/// Whether each texel is covered.
fn covered(pixels: &Pixels) -> Vec<bool> {
    pixels.rgba.iter().skip(3).step_by(4).map(|alpha| *alpha >= 128).collect()
}

#[test]
fn separate_opacity_tga_and_windows_1252_give_the_picture_of_one_rgba_file() {
    let Some(whole) = case("leaf rgba.png") else { return };
    let whole = Texture { name: String::new(), format: TextureFormat::Png, bytes: fs::read(whole).unwrap() };
    let whole = covered(&whole.decode().unwrap());
    for file in ["04-obj-separate-alpha.obj", "04c-obj-tga.obj", "32-obj-latin1.obj"] {
        let imported = read(&case(file).unwrap());
        let other = covered(&cut(&imported)).iter().zip(&whole).filter(|(a, b)| a != b).count();
        assert!(other * 100 <= whole.len(), "{file}: {other} of {} texels differ", whole.len());
        assert_eq!((imported.plant.leaves.len(), imported.warnings.len()), (80, 0), "{file}: {:?}", imported.warnings);
    }
    let names: Vec<String> =
        read(&case("32-obj-latin1.obj").unwrap()).plant.materials.into_iter().map(|m| m.name).collect();
    assert!(names.contains(&"Blätter".to_owned()), "{names:?}");
}

/// Texels of 8 x 8 that are covered on the left half.
fn half(x: usize) -> [u8; 4] {
    [60, 140, 40, if x < 4 { 255 } else { 0 }]
}

fn png() -> Vec<u8> {
    half_of(half(0))
}

/// A picture with this texel on the left half; on the right, its alpha is 0.
fn half_of([r, g, b, a]: [u8; 4]) -> Vec<u8> {
    let texels = (0..64).flat_map(|i| [r, g, b, if i % 8 < 4 { a } else { 0 }]).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(8, 8, texels).unwrap().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// 20 cards with texture coordinates 0 and 1, in the material `leaf`.
fn cards_obj(head: &str) -> String {
    let mut text = format!("{head}mtllib tree.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl leaf\n");
    for i in 0..20 {
        for [x, y] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
            text.push_str(&format!("v {} {y} 0\n", x + 3 * i));
        }
        text.push_str("f -4/1 -3/2 -2/3 -1/4\n");
    }
    text
}

/// A folder with cards, their library `mtl`, and the half-covered picture under the name `picture`.
fn folder(obj: &str, mtl: &str, picture: &str) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("tree.obj");
    fs::write(&path, obj).unwrap();
    fs::write(folder.path().join("tree.mtl"), mtl).unwrap();
    fs::write(folder.path().join(picture), png()).unwrap();
    (folder, path)
}

#[test]
fn options_foreign_paths_and_another_case_lead_to_the_picture() {
    for (statement, picture) in [
        ("map_Kd leaf.png", "leaf.png"),
        ("map_Kd -s 1 1 1 -o 0 0 0 my leaf.png", "my leaf.png"),
        ("map_Kd -blendu on -bm 1.0 -clamp off -mm 0 1 leaf.png", "leaf.png"),
        ("map_Kd C:\\Users\\me\\My Trees\\leaf.png", "leaf.png"),
        ("map_Kd ..\\maps\\leaf.png", "leaf.png"),
        ("map_Kd \\\\host\\trees\\leaf.png", "leaf.png"),
        ("map_Kd LEAF.PNG", "Leaf.png"),
        ("\tmap_Kd\tleaf.png\t", "leaf.png"),
        ("map_Kd \\\n leaf.png", "leaf.png"),
        ("map_Kd Bl\u{e4}tter.png", "Bl\u{e4}tter.png"),
        ("map_d leaf.png", "leaf.png"),
    ] {
        let mtl = format!("\u{feff}newmtl leaf\nKd 1 1 1\n{statement}\n");
        let (_folder, path) = folder(&cards_obj("\u{feff}"), &mtl, picture);
        let imported = read(&path);
        let expected: Vec<bool> = (0..64).map(|i| i % 8 < 4).collect();
        assert_eq!(covered(&cut(&imported)), expected, "{statement}");
        assert!(imported.warnings.is_empty(), "{statement}: {:?}", imported.warnings);
    }
}

#[test]
fn a_faint_opacity_is_cut_at_half_of_its_largest_alpha() {
    let (folder, path) = folder(&cards_obj(""), "newmtl leaf\nmap_Kd leaf.png\nmap_d faint.png\n", "leaf.png");
    let faint = half_of([0, 0, 0, 100]);
    fs::write(folder.path().join("faint.png"), faint).unwrap();
    let imported = read(&path);
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let material = &imported.plant.materials[0];
    assert!((material.alpha_cutoff - 50.0 / 255.0).abs() < 1e-6, "{material:?}");
    let alphas: Vec<u8> = cut(&imported).rgba.iter().skip(3).step_by(4).copied().collect();
    assert_eq!(alphas, (0..64).map(|i| if i % 8 < 4 { 100 } else { 0 }).collect::<Vec<_>>());
    let options = ImportOptions { alpha_cutoff: Some(0.9), ..ImportOptions::default() };
    let warnings = inspect(&path, &options).unwrap().warnings;
    assert!(warnings.iter().any(|warning| warning.kind == WarningKind::Invisible), "{warnings:?}");
}

#[test]
fn scale_offset_and_clamp_place_the_texture_and_other_options_are_warnings() {
    let uvs = |statement: &str| {
        let (_folder, path) = folder(&cards_obj(""), &format!("newmtl leaf\nmap_Kd {statement}\n"), "leaf.png");
        let imported = read(&path);
        let mut uvs: Vec<[f32; 2]> = imported.plant.vertices.iter().map(|vertex| vertex.uv).collect();
        uvs.sort_by(|a, b| a.partial_cmp(b).unwrap());
        uvs.dedup();
        (uvs, imported.plant.materials[0].wrap, imported.warnings)
    };
    assert_eq!(uvs("leaf.png").0, [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]);
    let (placed, wrap, warnings) = uvs("-s 2 0.5 -o 1 0.25 -clamp on leaf.png");
    assert_eq!(placed, [[1.0, 0.25], [1.0, 0.75], [3.0, 0.25], [3.0, 0.75]]);
    assert_eq!((wrap, warnings.len()), ([Wrap::Clamp; 2], 0));
    let warnings = uvs("-t 0.1 0.1 0.1 leaf.png").2;
    assert!(warnings[0].message.contains("-t 0.1 0.1 0.1") && !warnings[0].fix.is_empty(), "{warnings:?}");
}

#[test]
fn vertex_colours_of_obj_are_srgb_and_missing_ones_are_white() {
    let obj = cards_obj("").replacen("v 0 0 0\n", "v 0 0 0 0.5 0 1\n", 1);
    let (_folder, path) = folder(&obj, "newmtl leaf\n", "leaf.png");
    let imported = read(&path);
    let color = |x: f32, y: f32| {
        let of = imported.plant.vertices.iter().find(|vertex| vertex.position == [x, y, 0.0]).unwrap();
        of.color.map(|value| (value * 1000.0).round())
    };
    assert_eq!(color(0.0, 0.0), [214.0, 0.0, 1000.0, 1000.0]);
    assert_eq!(color(1.0, 0.0), [1000.0; 4]);
    let seven = cards_obj("").replace(" 0\nv", " 0 0.2 0.4 0.6 1\nv");
    assert!(load_obj_bytes(seven.as_bytes(), &path, &ImportOptions::default()).is_ok());
}

#[test]
fn materials_and_pictures_that_are_missing_are_named_with_a_fix() {
    let (_folder, path) = folder(&cards_obj(""), "newmtl other\n", "leaf.png");
    let warnings = read(&path).warnings;
    assert!(
        warnings.len() == 1 && warnings[0].message.contains("\"leaf\"") && !warnings[0].fix.is_empty(),
        "{warnings:?}"
    );
    let (_folder, path) = folder(&cards_obj(""), "newmtl leaf\nmap_Kd none.png\n", "leaf.png");
    let warnings = read(&path).warnings;
    assert!(
        warnings.len() == 1 && warnings[0].message.contains("none.png") && !warnings[0].fix.is_empty(),
        "{warnings:?}"
    );
}

#[test]
fn few_pictures_are_not_combined_in_very_many_ways() {
    let folder = TempDir::new().unwrap();
    let mut mtl = String::new();
    for i in 0..30 {
        fs::write(folder.path().join(format!("{i}.png")), png()).unwrap();
        (0..30).for_each(|j| mtl.push_str(&format!("newmtl {i}-{j}\nmap_Kd {i}.png\nmap_d {j}.png\n")));
    }
    fs::write(folder.path().join("tree.mtl"), mtl).unwrap();
    let path = folder.path().join("tree.obj");
    fs::write(&path, cards_obj("")).unwrap();
    let warnings = read(&path).warnings;
    assert!(warnings.iter().any(|warning| warning.message.contains("too many ways")), "{}", warnings.len());
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[i * 2..i * 2 + 2], 16).unwrap()).collect()
}

/// The half-covered picture as Basis Universal's encoder 2.50 writes it: UASTC, the same compressed
/// with Zstandard, and ETC1S.
const KTX2: [&str; 3] = [
    "ab4b5458203230bb0d0a1a0a000000000100000008000000080000000000000000000000010000000100000000000000680000002c000000940000002c00000000000000000000000000000000000000c000000000000000400000000000000040000000000000002c0000000000000002002800a601020003030000100000000000000000007f030000000000000000ffffffff1f0000004b545877726974657200426173697320556e6976657273616c20322e35300000040000007f7f0000978711e53f40d2000000000000000000978711052040d2000000000000000000978711e53f40d2000000000000000000978711052040d2000000000000000000",
    "ab4b5458203230bb0d0a1a0a000000000100000008000000080000000000000000000000010000000100000002000000680000002c000000940000002400000000000000000000000000000000000000b800000000000000210000000000000040000000000000002c0000000000000002002800a601020003030000100000000000000000007f030000000000000000ffffffff1f0000004b545877726974657200426173697320556e6976657273616c20322e3530000028b52ffd2040c5000068978711e53f40d2009787110520030043dd60a6d42fe002",
    "ab4b5458203230bb0d0a1a0a000000000100000008000000080000000000000000000000010000000100000001000000680000003c000000a400000024000000c8000000000000008b000000000000005301000000000000030000000000000000000000000000003c0000000000000002003800a301020003030000080800000000000000003f000000000000000000ffffffff40003f0f0000000000000000ffffffff1f0000004b545877726974657200426173697320556e6976657273616c20322e35300000030002002d000000090000002d00000000000000000000000000000001000000010000000200000020c044000000000000922202980800000000004016500053000400000040d08cb601c00400000000000002800504000000505555550560c0440000000000001221d00030012000000000807808881020000000008929a61000260004000000001081000ed104",
];

/// Five cards whose only picture is in `image`, by the extension `extension`.
fn textured(image: &[u8], extension: &str) -> Gltf {
    let mut file = cards(5);
    file.push(image, json!({ "componentType": 5121, "type": "SCALAR", "count": 1 }));
    let view = file.json["bufferViews"].as_array().unwrap().len() - 1;
    file.json["accessors"].as_array_mut().unwrap().pop();
    file.json["images"] = json!([{ "bufferView": view, "mimeType": "image/ktx2" }]);
    file.json["textures"] = json!([{ "extensions": { extension: { "source": 0 } } }]);
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
    file.json["extensionsUsed"] = json!([extension]);
    file
}

fn read_gltf(file: &Gltf) -> Result<Imported, Error> {
    load_gltf_bytes(&file.glb(), Path::new("case.glb"), &ImportOptions::default())
}

#[test]
fn ktx2_is_read_whether_it_is_required_or_not() {
    for hex in KTX2 {
        let mut file = textured(&bytes(hex), "KHR_texture_basisu");
        for required in [json!([]), json!(["KHR_texture_basisu"])] {
            file.json["extensionsRequired"] = required;
            let imported = read_gltf(&file).unwrap();
            let pixels = cut(&imported);
            assert_eq!(covered(&pixels), (0..64).map(|i| i % 8 < 4).collect::<Vec<_>>());
            for (found, expected) in pixels.rgba[..3].iter().zip(half(0)) {
                assert!(found.abs_diff(expected) < 16, "{:?}", &pixels.rgba[..4]);
            }
        }
    }
    let Some(path) = case("42-basisu-required.glb") else { return };
    assert!(cut(&read(&path)).width > 0);
}

#[test]
fn damaged_ktx2_never_panics() {
    for hex in KTX2 {
        let whole = bytes(hex);
        for at in 0..whole.len() {
            for value in [0, 0xff, whole[at] ^ 1, whole[at] ^ 0x80] {
                let mut damaged = whole.clone();
                damaged[at] = value;
                assert!(read_gltf(&textured(&damaged, "KHR_texture_basisu")).is_ok());
            }
            assert!(read_gltf(&textured(&whole[..at], "KHR_texture_basisu")).is_ok());
        }
    }
}

#[test]
fn a_texture_that_cannot_be_read_is_named_with_a_fix() {
    let mut files: Vec<Vec<u8>> = vec![
        textured(&[&bytes(KTX2[0])[..12], &[0; 68]].concat(), "KHR_texture_basisu").glb(),
        textured(b"\0\0\0\x20ftypavif\0\0\0\0", "EXT_texture_avif").glb(),
        textured(b"DDS ", "MSFT_texture_dds").glb(),
    ];
    let mut without = textured(b"", "ACME_texture");
    without.json["textures"] = json!([{}]);
    files.push(without.glb());
    files.extend(case("14b-basisu-without-fallback-not-required.glb").map(|path| fs::read(path).unwrap()));
    for file in files {
        let imported = load_gltf_bytes(&file, Path::new("case.glb"), &ImportOptions::default()).unwrap();
        let [warning] = &imported.warnings[..] else { panic!("{:?}", imported.warnings) };
        assert!(!warning.message.contains("4294967295") && !warning.fix.is_empty(), "{warning}");
    }
}

/// Positions of five cards as meshoptimizer 1.3 encodes them in version 1, at its levels 0, 2 and
/// 3: differences of bytes, the same with other bit widths, of 16-bit and of rotated 32-bit
/// numbers.
const STREAMS: [&str; 3] = [
    "a15a5aaa00babbffff80807fff403fa0201f0b0060201f001a107e7d80020000005455ffffffffffffff0500ffff0054557e7d7e7d7e7d7e05007d7e000000000000000000000000000000000000000000000000",
    "a11a5aaa00b8baff80807f403fa0201f0b0060201f011a017f7e8001001011ffffff0100ff0054557f7e7f7e7f7e7f05007e7f000000000000000000000000000000000000000000010100",
    "a1686aaa011a00030304020f0f4c0c8202f303f8f81d0b000501010054557f7f7f7f7f7f7f05007f7f000000000000000000000000000000000000000000421200",
];

#[test]
fn version_1_of_the_vertex_codec_is_read_in_the_newer_extension() {
    let plain = read_gltf(&cards(5)).unwrap().plant;
    for hex in STREAMS {
        let stream = bytes(hex);
        let mut file = cards(5);
        let offset = file.buffer.len();
        file.buffer.extend(&stream);
        file.json["bufferViews"][0]["buffer"] = json!(1);
        file.json["bufferViews"][0]["extensions"] = json!({ "KHR_meshopt_compression": {
            "buffer": 0, "byteOffset": offset, "byteLength": stream.len(), "byteStride": 12, "count": 20, "mode": "ATTRIBUTES"
        } });
        let fallback = json!({ "byteLength": 240, "extensions": { "KHR_meshopt_compression": { "fallback": true } } });
        file.json["buffers"].as_array_mut().unwrap().push(fallback);
        file.json["extensionsRequired"] = json!(["KHR_meshopt_compression"]);
        assert_eq!(read_gltf(&file).unwrap().plant, plain);
    }
}

#[test]
fn files_of_other_formats_are_named_with_the_way_to_a_gltf() {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1234567\n";
    for (content, what, fix) in [
        (&pointer[..], "a Git LFS pointer", "git lfs pull"),
        (b"Kaydara FBX Binary  \0\x1a\0", "an FBX file", "Blender"),
        (b"<!DOCTYPE html>\n<html>", "a web page", "download"),
        (b"BLENDER-v402", "a Blender file", "blender -b"),
        (b"b3dm\x01\0\0\0", "b3dm", "b3dmToGlb"),
    ] {
        let folder = TempDir::new().unwrap();
        for name in ["tree.glb", "tree.obj", "tree.gltf", "tree"] {
            let path = folder.path().join(name);
            fs::write(&path, content).unwrap();
            let line = inspect(&path, &ImportOptions::default()).unwrap_err().to_string();
            assert!(line.contains(what) && line.contains(fix) && line.contains(name), "{line}");
        }
    }
    let Some(path) = case("33-lfs-pointer.glb") else { return };
    assert!(load(&path, &ImportOptions::default()).unwrap_err().to_string().contains("git lfs pull"));
}

#[test]
fn a_picture_that_is_a_pointer_is_named_as_one() {
    let (folder, path) = folder(&cards_obj(""), "newmtl leaf\nmap_Kd leaf.png\n", "leaf.png");
    fs::write(folder.path().join("leaf.png"), "version https://git-lfs.github.com/spec/v1\nsize 7\n").unwrap();
    let warnings = read(&path).warnings;
    assert!(warnings[0].message.contains("Git LFS") && warnings[0].fix.contains("git lfs pull"), "{warnings:?}");
}

/// A tree of nodes: "tree" over "trunk", a closed box in the material "bark", and "crown" over
/// cards "card.0" to "card.5".
fn tree_of_nodes() -> Gltf {
    let mut file = cards(1);
    let corners: Vec<u8> =
        (0..8).flat_map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| bit as f32)).flat_map(f32::to_le_bytes).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let indices: Vec<u8> =
        faces.iter().flat_map(|f: &[u16; 4]| [0, 1, 2, 0, 2, 3].map(|i| f[i])).flat_map(u16::to_le_bytes).collect();
    let positions = file.push(&corners, json!({ "componentType": 5126, "type": "VEC3", "count": 8 }));
    let indices = file.push(&indices, json!({ "componentType": 5123, "type": "SCALAR", "count": 36 }));
    let twig = json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": 1 });
    file.json["meshes"].as_array_mut().unwrap().push(json!({ "primitives": [twig.clone()] }));
    let card = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"].as_array_mut().unwrap().push(json!({ "name": "both", "primitives": [card, twig] }));
    file.json["materials"].as_array_mut().unwrap().push(json!({ "name": "bark" }));
    let mut nodes = vec![
        json!({ "name": "tree", "children": [1, 2] }),
        json!({ "name": "trunk", "mesh": 1 }),
        json!({ "name": "crown", "children": [3, 4, 5, 6, 7, 8, 9] }),
        json!({ "name": "twig", "mesh": 1, "translation": [0, 9, 0] }),
    ];
    nodes.extend((0..6).map(|i| json!({ "name": format!("card.{i}"), "mesh": 0, "translation": [i * 2, 5, i] })));
    file.json["nodes"] = Value::Array(nodes);
    file
}

fn leaves_by(file: &Gltf, names: &[&str]) -> Result<usize, String> {
    let imported = load_gltf_bytes(&file.glb(), Path::new("tree.glb"), &naming(names));
    imported.map(|imported| imported.plant.leaves.len()).map_err(|error| error.to_string())
}

#[test]
fn a_node_stands_for_all_below_it_but_its_bark() {
    let file = tree_of_nodes();
    assert_eq!(
        [&["crown"][..], &["tree"], &["card.*"], &["card.1", "card.2"], &["card.1,card.2"]]
            .map(|names| leaves_by(&file, names)),
        [Ok(6), Ok(6), Ok(6), Ok(2), Ok(2)]
    );
    // A material, or a node of one material, is taken at the user's word.
    assert_eq!([leaves_by(&file, &["bark"]), leaves_by(&file, &["trunk"])], [Ok(2), Ok(1)]);
    assert_eq!(leaves_by(&file, &["crown", "trunk"]), Ok(6), "there are sheets, so the trunk is bark");
    let mut both = file.clone();
    both.json["nodes"][1]["mesh"] = json!(2);
    assert_eq!([leaves_by(&both, &["trunk"]), leaves_by(&both, &["both"])], [Ok(1), Ok(1)]);
}

#[test]
fn an_unknown_name_lists_a_few_close_ones() {
    let mut file = tree_of_nodes();
    let nodes = file.json["nodes"].as_array_mut().unwrap();
    (0..400).for_each(|i| nodes.push(json!({ "name": format!("Leaf.{i:03}"), "mesh": 0 })));
    file.json["nodes"][2]["children"].as_array_mut().unwrap().extend((10..410).map(|i| json!(i)));
    let line = leaves_by(&file, &["crwon"]).unwrap_err();
    assert!(line.contains("crown") && line.matches(',').count() <= 12 && line.len() < 300, "{line}");
    assert!(leaves_by(&file, &["Leaf.*,nothing"]).unwrap_err().contains("\"nothing\""));
    let Some(path) = case("19-leaf-nodes-linked.glb") else { return };
    for name in ["crown", "Leaf.*", "leaves"] {
        let imported = load(&path, &naming(&[name])).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(imported.plant.leaves.len(), 400, "{name}");
    }
}
