//! OBJ and its material libraries.

use super::{check, survive_reading};
use crate::{
    common::plants,
    mutate::{Random, damage_text},
};
use foliage_lod::{
    import::{ImportOptions, Imported, load_obj_bytes},
    material::Material,
};
use std::path::Path;

const OBJ: &str = "mtllib tree.mtl\no tree\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\ng crown\nusemtl leaf\n\
    f 1/1/1 2/2/1 3/2/1 4/1/1\nv 5 0 0\nv 6 0 0\nv 6 1 0\nv 5 1 0\nf -4//1 -3//1 -2//1 -1//1\nv 9 0 0\nv 9 1 0\nv 9 1 1\n\
    v 9 0 1\nv 9 0 2\nf 9/1 10/2 11/2 12/1 13/1\nusemtl bark\nf 1 2 3\nl 1 2\np 1\n";
const MTL: &str =
    "newmtl leaf\nKd 0.1 0.8 0.2\nd 0.5\nmap_Kd ring.png\nmap_d ring.png\nnewmtl bark\nNs 10.0\nillum 2\n";
// 4294967296/1 \
const OBJ_WORDS: &str = "f v vt vn l p g o usemtl mtllib tree.mtl newmtl map_Kd ring.png Kd d 0/0/0 -1/-1/-1 1//
    -9223372036854775808 # \\";

#[test]
fn damaged_obj_and_its_materials_are_refused_or_sound() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ring.png"), &plants::masked(1, 1).textures[0].bytes).unwrap();
    std::fs::write(folder.path().join("tree.mtl"), MTL).unwrap();
    let (tree, damaged) = (folder.path().join("tree.obj"), folder.path().join("damaged.mtl"));
    let make = move |random: &mut Random| {
        if random.below(3) > 0 {
            return damage_text(OBJ, OBJ_WORDS, random);
        }
        std::fs::write(&damaged, damage_text(MTL, OBJ_WORDS, random)).unwrap();
        OBJ.replace("tree.mtl", "damaged.mtl").into_bytes()
    };
    survive_reading("OBJ", &["accepted", "unreadable", "leafless"], make, move |obj| {
        let leaves = (obj.len() % 2 == 0).then(|| "leaf".to_owned()).into_iter().collect();
        check(load_obj_bytes(obj, &tree, &ImportOptions { leaves, ..ImportOptions::default() }))
    });
}

#[test]
fn faces_that_count_back_beyond_the_first_vertex_are_refused() {
    for (faces, reason) in [
        ("f -4//1 -13 -2//1 -1//1", "refers to v -13 of 8"),
        ("f -4 -3//-2 -2 -1", "refers to vn -2 of 1"),
        ("f 1/-9223372036854775808 2 3", "refers to vt -9223372036854775808 of 2"),
        ("f 1//6148914691236517206 2 3", "refers to vn 6148914691236517206 of 1"),
    ] {
        let obj = OBJ.replace("f -4//1 -3//1 -2//1 -1//1", faces);
        let read = load_obj_bytes(obj.as_bytes(), Path::new("back.obj"), &ImportOptions::default());
        let line = read.unwrap_err().to_string();
        assert!(line.contains(reason), "{line}");
    }
}

/// Imports [`OBJ`] with the material library `library`; returns its first material and the
/// warnings.
fn read_material(library: &str) -> (Material, Vec<foliage_lod::import::Warning>) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("tree.mtl"), format!("{library}\nnewmtl bark\n")).unwrap();
    let options = ImportOptions { leaves: vec!["crown".into()], ..ImportOptions::default() };
    let Imported { plant, warnings, .. } =
        load_obj_bytes(OBJ.as_bytes(), &folder.path().join("tree.obj"), &options).unwrap();
    (plant.materials[0].clone(), warnings)
}

#[test]
fn an_obj_colour_of_one_number_is_a_grey_and_one_of_none_or_two_is_left_out() {
    for (color, expected) in [("Kd 0.25", 0.25), ("Kd", 1.0), ("Kd 0.25 0.5", 1.0), ("Ka 1\nKs\nKe 1 1", 1.0)] {
        let (material, warnings) = read_material(&format!("newmtl leaf\n{color}\n"));
        assert_eq!(material.base_color, [expected, expected, expected, 1.0], "{color:?}");
        assert!(warnings.is_empty(), "{warnings:?}");
    }
    let (_, warnings) = read_material("newmtl leaf\nKd red\n");
    assert!(warnings[0].message.starts_with("material \"leaf\": its colour \"red\" is not"), "{warnings:?}");
}
