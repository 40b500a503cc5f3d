// Full-screen triangle, for passes that draw the background.

struct Corner {
    @builtin(position) clip: vec4<f32>,
    // Position in the picture: x (right) and y (up), from -1 to 1.
    @location(0) at: vec2<f32>,
}

@vertex
fn cover_corner(@builtin(vertex_index) corner: u32) -> Corner {
    let at = vec2(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0);
    return Corner(vec4(at, 0.0, 1.0), at);
}
