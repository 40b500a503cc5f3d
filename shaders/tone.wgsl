// Tone: the more a leaf is enlarged, the nearer its shaded colour is to the plant's mean. Twin of
// software/toning.rs.

fn kept_at(scale: f32) -> f32 {
    return pow(max(scale, 1.0), -2.0 * crown.tone);
}

fn toned(color: vec3<f32>, surface: Surface) -> vec3<f32> {
    return crown.mean + surface.enlarged.x * (color - crown.mean);
}
