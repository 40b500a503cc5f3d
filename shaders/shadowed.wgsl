// Shadows that plants cast on each other.

// Fraction of sunlight at a point in anchor space.
fn sunlit(position: vec3<f32>) -> f32 {
    return shadow_share((frame.light_from_anchor * vec4(position, 1.0)).xyz);
}
