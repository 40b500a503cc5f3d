// Backdrop: a soft gradient from ground to sky behind everything.

@fragment
fn backdrop(corner: Corner) -> @location(0) vec4<f32> {
    return vec4(encoded(backdrop_color(corner.at.y * 0.5 + 0.5)), 1.0);
}
