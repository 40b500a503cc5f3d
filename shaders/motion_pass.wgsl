// Motion vectors: displacement of the visible point since the previous frame, to the right and
// down, as a fraction of the picture's width and height. Vertices come from leaf_pass and
// wood_pass, each computed for both frames.

struct Moving {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    // Clip-space x, y and w in this frame and in the previous one.
    @location(1) now: vec3<f32>,
    @location(2) before: vec3<f32>,
    @location(3) @interpolate(flat) material: u32,
    @location(4) @interpolate(flat) instance: u32,
    @location(5) @interpolate(flat) leaf: u32,
    @location(6) @interpolate(flat) rect: vec4<f32>,
    @location(7) @interpolate(flat) seed: u32,
    @location(8) @interpolate(flat) enlarged: vec4<f32>,
}

fn moving(now: Surface, before: Surface) -> Moving {
    return Moving(
        now.clip, now.uv, now.clip.xyw, before.clip.xyw, now.material, now.instance, now.leaf, now.rect,
        now.seed, now.enlarged,
    );
}

@fragment
fn motion(moving: Moving) -> @location(0) vec2<f32> {
    // A leaf that fades by alpha is drawn if at least half present.
    let is_open = is_hole(materials[moving.material], moving.uv, moving.rect, moving.enlarged, moving.seed);
    let is_far = (kept_samples(moving.clip.xy, moving.instance) & 1u) == 0u;
    if is_open || is_far || fade_share(moving.leaf, moving.instance) < 0.5 {
        discard;
    }
    return motion_of(moving);
}

fn motion_of(moving: Moving) -> vec2<f32> {
    if moving.before.z <= 0.0 {
        // The point was behind the eye in the previous frame.
        return vec2(0.0);
    }
    let now = moving.now.xy / moving.now.z - frame.jitter;
    return (now - moving.before.xy / moving.before.z) * vec2(0.5, -0.5);
}
