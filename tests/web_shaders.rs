//! Every variant of every shader is legal for a browser, whose compiler refuses some that naga
//! accepts.
//!
//! Without Node, Chromium and the packages of `web` the test prints a note and passes; with
//! `FOLIAGE_REQUIRE_WEB=1` it fails.
#![cfg(all(feature = "render", feature = "simplify"))]

#[path = "common/node.rs"]
mod node;

use foliage_lod::{
    Look,
    draw::{Ground, Variant, shaders},
    effects::{CrownNormals, Effects, Fade, FadeBy, Shadow, Sky, Translucency},
    internals::capture,
};
use std::collections::BTreeMap;

/// Looks that differ in the parts of the shaders.
fn looks() -> Vec<Look> {
    let plain = Look::default();
    let shadowed = Effects { shadow: Some(Shadow::default()), sky: Some(Sky::default()), ..Effects::default() };
    let soft = Effects {
        fade: Some(Fade { by: FadeBy::Alpha, ..Fade::default() }),
        crown_normals: Some(CrownNormals::default()),
        translucency: Some(Translucency::default()),
        ..Effects::default()
    };
    vec![
        plain,
        Look { effects: shadowed, ground: Some(Ground { color: [0.2; 3], height: 0.0, haze: 500.0 }), ..plain },
        Look { effects: soft, tints: true, ..plain },
    ]
}

/// Different texts, each with a name that says what makes it.
fn modules() -> BTreeMap<String, String> {
    let mut modules = BTreeMap::new();
    let mut add = |name: String, wgsl: String| {
        modules.entry(wgsl).or_insert(name);
    };
    add("fragment_pass".into(), capture::wgsl());
    add("backdrop_pass".into(), shaders::backdrop_pass());
    for has_ground in [false, true] {
        add(format!("landscape_motion {has_ground}"), shaders::landscape_motion(has_ground));
    }
    for (number, look) in looks().iter().enumerate() {
        add(format!("landscape_pass, look {number}"), shaders::landscape_pass(look));
        add(format!("ground_pass, look {number}"), shaders::ground_pass(look));
        for variant in Variant::all() {
            let mut add = |name: &str, wgsl| {
                add(format!("{name}, look {number}, {variant:?}"), wgsl);
            };
            add("leaf_pass", shaders::leaf_pass(look, variant));
            add("leaf_shadow", shaders::leaf_shadow(look, variant));
            add("leaf_motion", shaders::leaf_motion(look, variant));
            add("impostor_pass", shaders::impostor_pass(look, variant));
            add("impostor_shadow", shaders::impostor_shadow(look, variant));
            add("impostor_motion", shaders::impostor_motion(look, variant));
            for slides in [false, true] {
                add("wood_pass", shaders::wood_pass(look, variant, slides));
                add("wood_shadow", shaders::wood_shadow(look, variant, slides));
                add("wood_motion", shaders::wood_motion(look, variant, slides));
            }
        }
    }
    modules
}

#[test]
fn chromium_compiles_every_variant_of_every_pass() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("modules.json");
    let modules = modules();
    assert!(modules.len() > 500, "{}", modules.len());
    std::fs::write(&file, serde_json::to_vec(&modules).unwrap()).unwrap();
    let Some(said) = node::run("webgpu.mjs", &[&file]) else { return };
    assert_eq!(said.trim(), format!("{} modules, 0 errors", modules.len()));
}
