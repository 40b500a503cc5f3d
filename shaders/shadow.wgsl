// The effect `shadow`: fraction of the sun's light that arrives, looked up in a shadow map.

// Taps along each side of the filter's square, and the distance from the map's centre, in half
// sides of the map, at which shadows begin to fade out.
const TAPS = 3;
const FADE_FROM = 0.85;

@group(2) @binding(2) var shadow_map: texture_depth_2d;
@group(2) @binding(3) var shadow_sampler: sampler_comparison;

// Fraction of sunlight at a point in the sun's clip space; 1 beyond the map.
fn shadow_share(light: vec3<f32>) -> f32 {
    let uv = light.xy * vec2(0.5, -0.5) + 0.5;
    let edge = max(abs(light.x), abs(light.y));
    // A point beyond the map's depth range is tested at its far end.
    let depth = min(light.z - SHADOW_BIAS, 1.0);
    var lit = 0.0;
    for (var y = -TAPS / 2; y <= TAPS / 2; y++) {
        for (var x = -TAPS / 2; x <= TAPS / 2; x++) {
            let offset = vec2(f32(x), f32(y)) * SHADOW_STEP;
            lit += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + offset, depth);
        }
    }
    // Shadows fade out towards the edge of the map.
    return mix(lit / f32(TAPS * TAPS), 1.0, smoothstep(FADE_FROM, 1.0, edge));
}
