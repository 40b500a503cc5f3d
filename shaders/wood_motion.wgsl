// Vertices of trunks and branches for motion_pass, in this frame and the previous one.

@vertex
fn wood_motion(
    @builtin(instance_index) instance: u32,
    @location(0) rest: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(4) material: u32,
    @location(5) width: f32,
) -> Moving {
    let wide = widened(rest, normal, width, instance);
    var now = wood_surface(instance, rest, wide, frame.clip_from_anchor);
    now.uv = uv;
    now.material = material;
    now.uv_size = vec2(1.0);
    return moving(now, wood_surface(frame.plants + instance, rest, wide, frame.clip_from_anchor_before));
}
