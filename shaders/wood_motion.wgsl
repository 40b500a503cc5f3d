// Vertices of trunks and branches for motion_pass, in this frame and the previous one.

@vertex
fn wood_motion(@builtin(instance_index) instance: u32, @location(0) packed: vec4<u32>) -> Moving {
    let vertex = wood_vertex(packed);
    return moving(
        wood_surface(instance, vertex, frame.clip_from_anchor),
        wood_surface(frame.plants + instance, vertex, frame.clip_from_anchor_before),
    );
}
