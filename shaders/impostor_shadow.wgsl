// Impostors in the shadow map: they face the sun.

@fragment
fn cast_impostor(sprite: Sprite) -> @builtin(frag_depth) f32 {
    let shown = seen(sprite, true);
    if samples_of(sprite, shown) == 0u {
        discard;
    }
    return depth_of(sprite, shown);
}
