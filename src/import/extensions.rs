//! The glTF extensions that are read or can be ignored, and fixes for the others.

use super::{Warning, WarningKind, fault::Fault};
use ::gltf::json::Root;

/// Extensions whose data is read.
const READ: &[&str] = &[
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "KHR_materials_pbrSpecularGlossiness",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
];

/// Extensions that do not affect anything a plant stores, even if a file requires them: they
/// describe, light, sound, collide or move later.
const HARMLESS: &[&str] = &[
    "CVTOOLS_unity_metadata",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_edge_visibility",
    "EXT_structural_metadata",
    "CESIUM_primitive_outline",
    "CESIUM_RTC",
    "FB_geometry_metadata",
    "FB_ngon_encoding",
    "GODOT_single_root",
    "GRIFFEL_bim_data",
    "KHR_animation_pointer",
    "KHR_collision_shapes",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_physics_rigid_bodies",
    "MPEG_audio_spatial",
    "MPEG_haptic",
    "MSFT_lod",
];

/// Prefixes of the extensions that only describe, light or sound, or that only change shading: the
/// material is drawn without them.
const HARMLESS_PREFIXES: &[&str] = &[
    "ADOBE_materials_",
    "AGI_",
    "EXT_lights_",
    "EXT_materials_",
    "KHR_audio",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_xmp",
    "MSFT_packing_",
];

/// Suggested fix for AVIF images, which the command leaves as they are without `--formats`.
pub(super) const CONVERT_AVIF: &str = "convert the images: npx @gltf-transform/cli png --formats \"*\" in.glb out.glb";

/// Fixes for extensions that a known tool can convert.
const FIXES: &[(&str, &str)] = &[("EXT_texture_avif", CONVERT_AVIF)];

/// Checks that every extension required by a file is known.
pub(super) fn check_required<'a>(required: impl IntoIterator<Item = &'a String>) -> Result<(), Fault> {
    let is_harmless = |name: &str| HARMLESS_PREFIXES.iter().any(|prefix| name.starts_with(prefix));
    let known = |name: &str| READ.contains(&name) || HARMLESS.contains(&name) || is_harmless(name);
    match required.into_iter().find(|name| !known(name)) {
        Some(name) => Err(unsupported(name)),
        None => Ok(()),
    }
}

/// A warning for a file whose place on the Earth is in an extension: a plant has none.
pub(super) fn place_on_earth(root: &Root) -> Option<Warning> {
    let center = root.extensions.as_ref()?.others.get("CESIUM_RTC")?.get("center")?.as_array()?;
    let center: Vec<f64> = center.iter().filter_map(|value| value.as_f64()).take(3).collect();
    let message = format!("CESIUM_RTC: the place of the plant on the Earth, {center:?}, is not kept");
    Some(Warning::new(WarningKind::Moved, message, ""))
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
