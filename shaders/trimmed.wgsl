// Quads that are drawn within an outline; twin of draw/trimmed.rs.

// The word of a corner of an outline, or NO_EXTRA if the quad is drawn whole. The outline depends
// on the mip level at which the quad is sampled.
fn outline_word(drawn: Drawn, clip_from_anchor: mat4x4<f32>) -> u32 {
    if !drawn.is_drawn || !drawn.is_trimmed || drawn.look.outline == NO_EXTRA {
        return NO_EXTRA;
    }
    // An outline belongs to one picture.
    if is_tiled(drawn.scale, drawn.look.anchor) {
        return NO_EXTRA;
    }
    let outlines = packing.first_outline + extras[packing.first_outline + drawn.look.outline + drawn.nth];
    let level = outline_level(drawn, clip_from_anchor);
    let row = (extras[outlines] >> (4u * min(level, 7u))) & 15u;
    if level > 7u || row == 15u {
        return NO_EXTRA;
    }
    return extras[outlines + 1u + row * TRIMMED_CORNERS + drawn.place];
}

// The point of a quad with the weights in `word`.
fn outline_corner(word: u32, drawn: Drawn) -> Corner {
    let a = quad_corner(drawn.first, drawn);
    let b = quad_corner(drawn.first + select(1u, 3u, word >> 30u == 1u), drawn);
    let c = quad_corner(drawn.first + 2u, drawn);
    let s = f32(word & 0x7fffu) / 32767.0;
    let t = f32((word >> 15u) & 0x7fffu) / 32767.0;
    return Corner(
        a.offset + (b.offset - a.offset) * s + (c.offset - a.offset) * t,
        a.normal + (b.normal - a.normal) * s + (c.normal - a.normal) * t,
        a.uv + (b.uv - a.uv) * s + (c.uv - a.uv) * t,
        a.color + (b.color - a.color) * s + (c.color - a.color) * t,
        a.on_quad + (b.on_quad - a.on_quad) * s + (c.on_quad - a.on_quad) * t,
    );
}

// Coarsest mip level that any pixel of a quad is sampled at, of its material's own texture; more
// than 7 if it is not known.
fn outline_level(drawn: Drawn, clip_from_anchor: mat4x4<f32>) -> u32 {
    let size = vec2<f32>(textureDimensions(textures));
    var at: array<vec2<f32>, 4>;
    var texels: array<vec2<f32>, 4>;
    var nearest = 1e30;
    var farthest = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let corner = quad_corner(drawn.first + i, drawn);
        let position = in_anchor_space(moved_corner(corner, drawn).position, drawn.instance);
        let clip = clip_from_anchor * vec4(position, 1.0);
        at[i] = clip.xy / clip.w * frame.half_size_px;
        texels[i] = corner.uv * size;
        nearest = min(nearest, clip.w);
        farthest = max(farthest, clip.w);
    }
    if nearest <= 0.0 {
        return 8u;
    }
    let shown = drawn.look.shown * size;
    var level = 0.0;
    for (var i = 1u; i < 3u; i++) {
        let right = at[i] - at[0];
        let down = at[i + 1u] - at[0];
        let along = texels[i] - texels[0];
        let across = texels[i + 1u] - texels[0];
        // The change per pixel is greatest where the quad is farthest away.
        let per_px = farthest / nearest / max(abs(right.x * down.y - right.y * down.x), 1e-12);
        let of_x = (along * down.y - across * right.y) * per_px;
        let of_y = (across * right.x - along * down.x) * per_px;
        if any(at[i] != at[i + 1u]) {
            level = max(level, mip_level(of_x, of_y, shown));
        }
    }
    return u32(max(ceil(ceil(level) + drawn.look.farther), 0.0));
}
