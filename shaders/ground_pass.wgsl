// Ground with heights: triangles made for each camera, lit by slopes and coloured by a picture.
// Twin of software/ground.rs.

struct GroundFrame {
    // Transform from world space relative to the eye to clip space, in this frame and the previous.
    clip_from_eye: mat4x4<f32>,
    clip_from_eye_before: mat4x4<f32>,
    // Shift of the picture, in clip space.
    jitter: vec2<f32>,
    // Whether there is a picture of the colours.
    has_colors: u32,
}

struct GroundPoint {
    @builtin(position) clip: vec4<f32>,
    // Position relative to the eye.
    @location(0) from_eye: vec3<f32>,
    // Fractions of the area's sides.
    @location(1) uv: vec2<f32>,
}

struct MovingGround {
    @builtin(position) clip: vec4<f32>,
    // Clip-space x, y and w in this frame and in the previous one.
    @location(0) now: vec3<f32>,
    @location(1) before: vec3<f32>,
}

@group(1) @binding(0) var<uniform> ground: GroundFrame;
@group(1) @binding(1) var ground_colors: texture_2d<f32>;
@group(1) @binding(2) var ground_slopes: texture_2d<f32>;
@group(1) @binding(3) var ground_sampler: sampler;

@vertex
fn ground_corner(@location(0) from_eye: vec3<f32>, @location(1) uv: vec2<f32>) -> GroundPoint {
    return GroundPoint(ground.clip_from_eye * vec4(from_eye, 1.0), from_eye, uv);
}

@fragment
fn ground_color(point: GroundPoint) -> @location(0) vec4<f32> {
    let slope = textureSample(ground_slopes, ground_sampler, point.uv).xy;
    let normal = vec3(slope.x, sqrt(max(1.0 - dot(slope, slope), 0.0)), slope.y);
    let texel = textureSample(ground_colors, ground_sampler, point.uv).rgb;
    let outside = abs(point.uv - clamp(point.uv, vec2(0.0), vec2(1.0)));
    let fade = select(1.0, smoothstep(0.0, FADES_OVER, max(outside.x, outside.y)), ground.has_colors != 0u);
    let albedo = mix(texel, landscape.ground, fade);
    return vec4(encoded(ground_shown(albedo, unit(normal), point.from_eye)), 1.0);
}

// Depth for the shadow map.
@vertex
fn ground_towards_sun(@location(0) from_eye: vec3<f32>, @location(1) uv: vec2<f32>) -> @builtin(position) vec4<f32> {
    return landscape.light_from_eye * vec4(from_eye, 1.0);
}

@fragment
fn cast_by_ground() {}

@vertex
fn ground_motion(@location(0) from_eye: vec3<f32>, @location(1) uv: vec2<f32>) -> MovingGround {
    let now = ground.clip_from_eye * vec4(from_eye, 1.0);
    return MovingGround(now, now.xyw, (ground.clip_from_eye_before * vec4(from_eye, 1.0)).xyw);
}

@fragment
fn motion_of_ground(moving: MovingGround) -> @location(0) vec2<f32> {
    if moving.before.z <= 0.0 {
        // The point was behind the eye in the previous frame.
        return vec2(0.0);
    }
    let now = moving.now.xy / moving.now.z - ground.jitter;
    return (now - moving.before.xy / moving.before.z) * vec2(0.5, -0.5);
}
