//! The glTF extensions that are read or can be ignored, and fixes for the others.

use super::fault::Fault;

/// Extensions whose data is read.
const READ: &[&str] = &[
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "KHR_materials_pbrSpecularGlossiness",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
];

/// Extensions that do not affect anything a plant stores, even if a file requires them.
const HARMLESS: &[&str] = &[
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_node_visibility",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "EXT_lights_image_based",
    "MSFT_lod",
];

/// Prefix of the extensions that only change shading: the material is drawn without them.
const SHADING: &str = "KHR_materials_";

/// Fixes for extensions that a known tool can convert.
const FIXES: &[(&str, &str)] = &[
    ("KHR_texture_basisu", "convert the textures first: npx @gltf-transform/cli png in.glb out.glb"),
    ("EXT_texture_avif", "convert the textures first: npx @gltf-transform/cli png in.glb out.glb"),
    ("KHR_meshopt_compression", "decompress it first: npx @gltf-transform/cli copy in.glb out.glb"),
];

/// Checks that every extension required by a file is known.
pub(super) fn check_required<'a>(required: impl IntoIterator<Item = &'a String>) -> Result<(), Fault> {
    let known = |name: &str| READ.contains(&name) || HARMLESS.contains(&name) || name.starts_with(SHADING);
    match required.into_iter().find(|name| !known(name)) {
        Some(name) => Err(unsupported(name)),
        None => Ok(()),
    }
}

/// The error for the unsupported extension `name`.
pub(super) fn unsupported(name: &str) -> Fault {
    let fix = FIXES.iter().find(|(known, _)| *known == name).map_or("export the plant without it", |(_, fix)| fix);
    Fault::Unsupported { feature: format!("the glTF extension {}", name.escape_debug()), fix: fix.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_requirements_are_refused_by_name() {
        let required = ["EXT_meshopt_compression", "KHR_materials_sheen", "ACME_secret"].map(str::to_owned);
        assert!(check_required(&required[..2]).is_ok());
        let Err(Fault::Unsupported { feature, .. }) = check_required(&required) else { panic!("accepted") };
        assert!(feature.contains("ACME_secret"), "{feature}");
    }
}
