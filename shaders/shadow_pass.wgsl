// What casts shadows: only where it is opaque. Vertices are those of leaf_pass and wood_pass.

@fragment
fn cast_shadow(surface: Surface) {
    if is_hole(materials[surface.material], surface.uv) {
        discard;
    }
}
