// The effect `shadow`: how much of the sun's light arrives, from a map of what it meets first.

@group(2) @binding(3) var shadow_map: texture_depth_2d;
@group(2) @binding(4) var shadow_sampler: sampler_comparison;

// At a point in the light's clip space; 1 beyond the map.
fn shadow_share(light: vec3<f32>) -> f32 {
    let uv = light.xy * vec2(0.5, -0.5) + 0.5;
    let edge = max(abs(light.x), abs(light.y));
    // What lies beyond the map's depth is met by nothing.
    let depth = min(light.z - SHADOW_BIAS, 1.0);
    var lit = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let offset = vec2(f32(x), f32(y)) * SHADOW_STEP;
            lit += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + offset, depth);
        }
    }
    // Shadows fade out where the map ends.
    return mix(lit / 9.0, 1.0, smoothstep(0.85, 1.0, edge));
}
