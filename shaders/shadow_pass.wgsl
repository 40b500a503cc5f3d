// Shadow casting: writes depth where the surface is opaque. Vertices come from leaf_pass and
// wood_pass.

@fragment
fn cast_shadow(surface: Surface) {
    let is_open = is_hole(materials[surface.material], surface.uv, surface.rect, surface.enlarged, surface.seed);
    if is_open || (kept_samples(surface.clip.xy, surface.instance) & 1u) == 0u {
        discard;
    }
}
