// Shadows that plants cast on each other.

// Transforms from local space to the sun's clip space, one per instance.
@group(2) @binding(2) var<storage, read> light_from_local: array<mat4x4<f32>>;

fn sunlit(position_local: vec3<f32>, instance: u32) -> f32 {
    return shadow_share((light_from_local[instance] * vec4(position_local, 1.0)).xyz);
}
