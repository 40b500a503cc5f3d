// Motion vectors: how far what a pixel shows has moved since the frame before, as a share of the picture's width and height,
// to the right and down. Vertices are those of leaf_pass and wood_pass, each taken twice.

struct Moving {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    // Clip space without its depth.
    @location(1) now: vec3<f32>,
    @location(2) before: vec3<f32>,
    @location(3) @interpolate(flat) material: u32,
    @location(4) @interpolate(flat) instance: u32,
    @location(5) @interpolate(flat) leaf: u32,
}

fn moving(now: Surface, before: Surface) -> Moving {
    return Moving(now.clip, now.uv, now.clip.xyw, before.clip.xyw, now.material, now.instance, now.leaf);
}

@fragment
fn motion(moving: Moving) -> @location(0) vec2<f32> {
    let instance = instances[moving.instance];
    // A leaf that fades by alpha is there or not.
    if is_hole(materials[moving.material], moving.uv) || fade_share(moving.leaf, instance) < 0.5 {
        discard;
    }
    if moving.before.z <= 0.0 {
        // It was behind the eye.
        return vec2(0.0);
    }
    let now = moving.now.xy / moving.now.z - instance.jitter;
    return (now - moving.before.xy / moving.before.z) * vec2(0.5, -0.5);
}
