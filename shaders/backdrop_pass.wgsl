// A soft gradient from ground to sky behind everything.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    // 0 at the bottom of the picture, 1 at its top.
    @location(0) height: f32,
}

// One triangle over the whole picture, at the far end of reversed depth.
@vertex
fn backdrop_corner(@builtin(vertex_index) corner: u32) -> Corner {
    let at = vec2(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0);
    return Corner(vec4(at, 0.0, 1.0), at.y * 0.5 + 0.5);
}

@fragment
fn backdrop(corner: Corner) -> @location(0) vec4<f32> {
    return vec4(encoded(backdrop_color(corner.height)), 1.0);
}
