// Shadows that plants cast on each other.

// Fraction of sunlight at a point of a plant.
fn sunlit(position_local: vec3<f32>, instance: u32) -> f32 {
    let position = in_anchor_space(position_local, instances[instance]);
    return shadow_share((frame.light_from_anchor * vec4(position, 1.0)).xyz);
}
