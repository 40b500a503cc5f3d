// What casts shadows: only where it is opaque. Vertices are those of leaf_pass and wood_pass.

@fragment
fn cast_shadow(surface: Surface) {
    let material = materials[surface.material];
    if material.cutoff > 0.0 && texel(material, surface.uv).a * material.base_color.a < material.cutoff {
        discard;
    }
}
