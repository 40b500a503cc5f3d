// Shadow casting: writes depth where the surface is opaque. Vertices come from leaf_pass and
// wood_pass.

@fragment
fn cast_shadow(surface: Surface) {
    if is_hole(materials[surface.material], surface.uv, surface.rect, surface.enlarged, surface.seed) {
        discard;
    }
}
