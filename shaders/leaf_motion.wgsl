// Vertices of leaves for motion_pass, in this frame and the previous one.

@vertex
fn leaf_motion(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Moving {
    let now = drawn_corner(corner, item);
    let before = drawn_corner(corner, vec2(frame.plants + item.x, item.y));
    let word = outline_word(now, frame.clip_from_anchor);
    return moving(
        leaf_surface(now, word, frame.clip_from_anchor),
        leaf_surface(before, word, frame.clip_from_anchor_before),
    );
}
