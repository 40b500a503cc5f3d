//! Files that claim far more data than they contain: reading them uses no more memory than their
//! size accounts for.
#![cfg(feature = "simplify")]

#[path = "common/glb.rs"]
mod glb;
#[path = "common/memory.rs"]
mod memory;

use foliage_lod::{
    Error, Result,
    import::{ImportOptions, Imported, inspect, load, load_gltf_bytes, load_obj_bytes},
};
use glb::{Gltf, cards};
use image::{ImageFormat, Rgb, RgbImage};
use memory::within_bounds;
use serde_json::{Value, json};
use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

fn read_by(file: &Gltf, options: &ImportOptions) -> Result<Imported> {
    let bytes = file.glb();
    within_bounds(bytes.len() as u64, || load_gltf_bytes(&bytes, Path::new("hostile.glb"), options)).0
}

fn read(file: &Gltf) -> Result<Imported> {
    read_by(file, &ImportOptions::default())
}

/// The limit that the file exceeded.
fn refused_for(read: Result<Imported>) -> String {
    match read {
        Err(Error::TooLarge { what, .. }) => what,
        other => panic!("not refused as too large: {other:?}"),
    }
}

/// Appends `bytes` as a buffer view and returns its index.
fn push_view(file: &mut Gltf, bytes: &[u8]) -> usize {
    let accessor = file.push(bytes, json!({ "componentType": 5121, "type": "SCALAR", "count": bytes.len() }));
    file.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize
}

/// Replaces the mesh's primitive by `count` copies; copy `n` has a material of its own,
/// `material(n)`.
fn split(file: &mut Gltf, count: usize, material: impl Fn(usize) -> Value) {
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    let primitive_with = |material: usize| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(material);
        primitive
    };
    file.json["materials"] = (0..count).map(material).collect();
    file.json["meshes"][0]["primitives"] = (0..count).map(primitive_with).collect();
}

fn encoded(image: &RgbImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A PNG, a JPEG and a WebP of 16 x 16 texels whose headers claim `side` x `side`.
fn images_that_claim(side: u32) -> [Vec<u8>; 3] {
    let image = RgbImage::from_pixel(16, 16, Rgb([60, 120, 30]));
    let [mut png, mut jpeg, mut webp] =
        [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP].map(|format| encoded(&image, format));
    // After the signature and the chunk header: width, height, 5 bytes, checksum.
    png[16..24].copy_from_slice(&[side.to_be_bytes(); 2].concat());
    let crc = crc32fast::hash(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    // After the frame marker, its length and the bits per sample: height, width.
    let frame = jpeg.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[(side as u16).to_be_bytes(); 2].concat());
    // After RIFF, length, WEBP, VP8L, length and signature: 14 bits each of width - 1 and
    // height - 1, and 4 other bits.
    assert_eq!(&webp[12..16], b"VP8L");
    let others = u32::from_le_bytes(webp[21..25].try_into().unwrap()) >> 28 << 28;
    webp[21..25].copy_from_slice(&(others | (side - 1) << 14 | (side - 1)).to_le_bytes());
    [png, jpeg, webp]
}

fn textured(image: &[u8]) -> Gltf {
    let mut file = cards(5);
    let view = push_view(&mut file, image);
    file.json["images"] = json!([{ "bufferView": view }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
    file
}

#[test]
fn images_that_claim_more_than_their_bytes_account_for_are_left_out() {
    let left_out = |image: &[u8]| {
        let imported = read(&textured(image)).unwrap();
        assert!(imported.plant.textures.is_empty());
        assert!(imported.warnings[0].message.contains("account for"), "{:?}", imported.warnings);
    };
    images_that_claim(8192).iter().for_each(|image| left_out(image));
    // Truncated, but not too large.
    let images = images_that_claim(3900);
    images.iter().for_each(|image| drop(read(&textured(image)).unwrap()));
    let mut progressive = images[1].clone();
    let frame = progressive.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    progressive[frame + 1] = 0xc2;
    left_out(&progressive);
}

#[test]
fn a_png_of_one_colour_may_have_4096_texels_on_a_side() {
    let png = encoded(&RgbImage::from_pixel(4096, 4096, Rgb([60, 120, 30])), ImageFormat::Png);
    let imported = read(&textured(&png)).unwrap();
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    assert_eq!(imported.plant.textures[0].decode().unwrap().rgba[4..8], [60, 120, 30, 255]);
}

/// 100 KB of noise, referenced by 3,000 images and textures and, through them, by 150 materials.
#[test]
fn an_image_that_many_materials_name_is_kept_once() {
    let noise = RgbImage::from_fn(200, 200, |x, y| Rgb([x * y % 251, x * 7 + y * 13, x ^ y].map(|value| value as u8)));
    let mut file = textured(&encoded(&noise, ImageFormat::Png));
    let images = 3000;
    let view = file.json["images"][0]["bufferView"].as_u64().unwrap() as usize;
    file.json["textures"] = (0..images).map(|i| json!({ "source": i })).collect();
    split(
        &mut file,
        images / 20,
        |i| json!({ "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } }),
    );
    file.json["images"] = vec![json!({ "bufferView": view }); images].into();
    let imported = read(&file).unwrap();
    assert_eq!((imported.plant.textures.len(), imported.warnings.len()), (1, 0));

    let first = file.json["bufferViews"].as_array().unwrap().len();
    let same = file.json["bufferViews"][view].clone();
    file.json["bufferViews"].as_array_mut().unwrap().extend(vec![same; images]);
    file.json["images"] = (0..images).map(|i| json!({ "bufferView": first + i })).collect();
    let imported = read(&file).unwrap();
    assert_eq!(imported.plant.textures.len(), 1);
    assert!(imported.warnings[0].message.contains("overlaps"), "{:?}", imported.warnings);
}

/// A PNG of one texel whose colour profile inflates to 80 MB of zeros.
#[test]
fn a_profile_that_inflates_beyond_its_image_is_left_out() {
    let zeros = encoded(&RgbImage::new(5200, 5200), ImageFormat::Png);
    let data = zeros.windows(4).position(|kind| kind == b"IDAT").unwrap();
    let length = u32::from_be_bytes(zeros[data - 4..data].try_into().unwrap()) as usize;
    let chunk = [b"iCCP", &b"a\0\0"[..], &zeros[data + 4..data + 4 + length]].concat();
    let mut png = encoded(&RgbImage::new(1, 1), ImageFormat::Png);
    let crc = crc32fast::hash(&chunk).to_be_bytes();
    png.splice(33..33, [&(chunk.len() as u32 - 4).to_be_bytes()[..], &chunk, &crc].concat());
    read(&textured(&png)).unwrap();
}

#[test]
fn nodes_and_materials_are_multiplied_before_they_are_listed() {
    let mut file = cards(5);
    split(&mut file, 240, |_| json!({ "alphaMode": "MASK" }));
    file.json["nodes"] = vec![json!({ "mesh": 0 }); 30_000].into();
    file.json["scenes"][0]["nodes"] = (0..30_000).collect();
    assert!(refused_for(read(&file)).contains("the number of indices, including instances"));

    // Two corners form no triangle, so these primitives add nothing to the count.
    let mut file = instanced(20_000);
    file.json["accessors"][2]["count"] = json!(2);
    split(&mut file, 5000, |_| json!({}));
    assert!(matches!(read(&file), Err(Error::NoLeaves { .. })));
}

#[test]
fn empty_objects_and_instances_without_data_are_counted_before_they_are_read() {
    let mut file = cards(5);
    file.json["extras"] = vec![json!({}); 400_000].into();
    assert!(refused_for(read(&file)).contains("the number of JSON objects"));

    let mut file = cards(5);
    let bytes = 500_000;
    let places = file.push(&vec![0; bytes], json!({ "componentType": 5126, "type": "VEC3", "count": bytes }));
    file.json["accessors"][places].as_object_mut().unwrap().remove("bufferView");
    let attributes = json!({ "attributes": { "TRANSLATION": places } });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": attributes });
    assert!(refused_for(read(&file)).contains("the number of instances for a file of its size"));
}

#[test]
fn a_file_that_is_named_often_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let buffers = vec![json!({ "uri": "./self.gltf", "byteLength": 0 }); 10_000];
    std::fs::write(path("self.gltf"), json!({ "asset": { "version": "2.0" }, "buffers": buffers }).to_string())
        .unwrap();
    let material = "newmtl a\nKd 1 1 1\n";
    std::fs::write(
        path("self.obj"),
        format!("{}{}v 0 0 0\nf 1 1 1\n", "mtllib self.obj\n".repeat(3000), material.repeat(3000)),
    )
    .unwrap();
    for (name, reason) in
        [("self.gltf", "refers to the same file as another buffer"), ("self.obj", "no separable leaves")]
    {
        let length = path(name).metadata().unwrap().len();
        let read = within_bounds(length, || load(&path(name), &ImportOptions::default())).0;
        let line = read.unwrap_err().to_string();
        assert!(line.contains(reason), "{line}");
    }
}

#[test]
fn long_names_of_obj_are_refused() {
    let groups = "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n".repeat(2000);
    let text = format!("o {}\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{groups}", "n".repeat(500_000));
    let read = || load_obj_bytes(text.as_bytes(), Path::new("hostile.obj"), &ImportOptions::default());
    let line = within_bounds(text.len() as u64, read).0.unwrap_err().to_string();
    assert!(line.contains("line 1 has a name of 500002 bytes"), "{line}");
}

/// Five cards, instanced at `count` positions.
fn instanced(count: usize) -> Gltf {
    let mut file = cards(5);
    let places: Vec<u8> = (0..count * 3).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let places = file.push(&places, json!({ "componentType": 5126, "type": "VEC3", "count": count }));
    let attributes = json!({ "attributes": { "TRANSLATION": places } });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": attributes });
    file
}

#[test]
fn instances_are_counted_before_they_are_written_out() {
    let mut file = instanced(20_000);
    split(&mut file, 150, |_| json!({ "alphaMode": "MASK" }));
    let limited = ImportOptions { max_memory_mb: Some(22_000), ..ImportOptions::default() };
    assert!(refused_for(read_by(&file, &limited)).contains("memory in MB for 30000000 triangles, including instances"));
    split(&mut file, 300, |_| json!({ "alphaMode": "MASK" }));
    assert!(refused_for(read(&file)).contains("the number of indices, including instances"));

    let mut file = instanced(20_000);
    file.json["nodes"] = vec![file.json["nodes"][0].clone(); 2000].into();
    file.json["scenes"][0]["nodes"] = (0..2000).collect();
    assert!(refused_for(read(&file)).contains("the number of instances for a file of its size"));
}

#[test]
fn long_names_are_truncated_before_they_are_reported() {
    let mut file = cards(5);
    let name = |letter: &str| json!(letter.repeat(200_000));
    (file.json["nodes"][0]["name"], file.json["meshes"][0]["name"]) = (name("n"), name("ä"));
    split(&mut file, 200, |i| match i {
        0 => json!({ "alphaMode": "MASK", "doubleSided": true, "name": "x".repeat(200_000) }),
        _ => json!({ "alphaMode": "MASK", "doubleSided": true }),
    });
    let imported = read(&file).unwrap();
    assert_eq!(imported.findings.len(), 200);
    assert_eq!([imported.findings[0].name.len(), imported.findings[0].material.len()], [256; 2]);
}

/// 481 KB of meshopt zeros decode to 2.5 million vertices, which would take 287 MB.
#[test]
fn what_a_compressed_stream_expands_to_is_held_against_the_memory_there_is() {
    let (blocks, stride) = (10_000, 12);
    let stream = [&[0xa0][..], &vec![0; blocks * stride * 4], &[0; 32]].concat();
    let mut file = cards(5);
    let view = push_view(&mut file, &stream);
    let mut extension = file.json["bufferViews"][view].clone();
    (extension["count"], extension["byteStride"]) = (json!(blocks * 256), json!(stride));
    extension["mode"] = json!("ATTRIBUTES");
    file.json["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": extension });
    file.json["accessors"][0]["count"] = json!(blocks * 256);
    file.json["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "material": 0 });
    let limited = ImportOptions { max_memory_mb: Some(600), ..ImportOptions::default() };
    assert!(refused_for(read_by(&file, &limited)).contains("memory in MB for 853333 triangles"));
}

#[test]
fn faces_of_obj_hold_what_their_text_accounts_for() {
    let count = 300_000;
    let cards = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    for faces in [
        format!("f{}\n", " 1 2 3".repeat(count)),
        "f 1 2 3\n".repeat(count),
        "f 1 2 3\nf 1 3 4\n".repeat(count / 2),
        "o\nf 1 2 3\n".repeat(count / 15),
    ] {
        let text = format!("{cards}{faces}");
        let read = || load_obj_bytes(text.as_bytes(), Path::new("hostile.obj"), &ImportOptions::default());
        let refused = within_bounds(text.len() as u64, read).0;
        assert!(matches!(refused, Err(Error::NoLeaves { .. })), "{refused:?}");
    }
}

#[test]
fn trees_from_elsewhere_hold_what_their_bytes_account_for() {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else { return println!("skipped: FOLIAGE_TREES is not set") };
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_tree = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "glb" || extension == "obj");
    let mut worst = 0.0_f64;
    for path in paths.filter(is_tree) {
        let length = path.metadata().unwrap().len();
        let (read, held) = within_bounds(length, || inspect(&path, &ImportOptions::default()));
        assert!(read.is_ok(), "{read:?}");
        worst = worst.max(held as f64 / length as f64);
    }
    println!("at most {worst:.1} bytes of memory per byte of a file");
    assert!(worst > 0.0);
}
