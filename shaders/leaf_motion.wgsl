// Vertices of leaves for motion_pass, in this frame and the previous one.

@vertex
fn leaf_motion(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Moving {
    let before = vec2(frame.plants + item.x, item.y);
    return moving(
        leaf_surface(corner, item, frame.clip_from_anchor),
        leaf_surface(corner, before, frame.clip_from_anchor_before),
    );
}
