// Growth by tiling: an enlarged card shows more pictures of their original size. Twin of
// plant/tiles.rs.

fn is_tiled(scale: f32, anchor: vec2<f32>) -> bool {
    return scale > 1.0 && anchor.x >= 0.0;
}

// rect: lowest texture coordinates, and size, of what the unscaled card shows.
fn tiled(uv: vec2<f32>, rect: vec4<f32>, scale: f32, anchor: vec2<f32>) -> Shown {
    if !is_tiled(scale, anchor) {
        return Shown(uv, vec2(1.0));
    }
    let u = pictures(uv.x, rect.x, rect.z, scale, anchor.x, 0.0);
    // Odd columns are shifted by half a picture.
    let v = pictures(uv.y, rect.y, rect.w, scale, anchor.y, select(0.0, 0.5, u.is_odd));
    return Shown(vec2(u.shown, v.shown), vec2(u.stretch, v.stretch));
}

struct Pictures {
    shown: f32,
    stretch: f32,
    is_odd: bool,
}

// Along one axis; lengths are in pictures, the first one from 0 to 1.
fn pictures(coordinate: f32, low: f32, size: f32, scale: f32, anchor: f32, shift: f32) -> Pictures {
    let edge = anchor - scale * anchor + shift;
    let end = edge + scale;
    let at = edge + (coordinate - low) * (scale / size);
    let picture = clamp(floor(at), floor(edge), ceil(end) - 1.0);
    let start = max(picture, edge);
    let part = max(min(picture + 1.0, end) - start, 1e-6);
    let place = clamp((at - start) / part, 0.0, 1.0);
    let is_odd = (i32(picture) & 1) == 1;
    return Pictures(low + size * select(place, 1.0 - place, is_odd), scale / part, is_odd);
}
