// Vertices of trunks and branches for motion_pass, in this frame and the previous one, both at this
// frame's error.

@vertex
fn wood_motion(corner: WoodCorner) -> Moving {
    let vertex = wood_vertex(corner, instances[corner.instance].wood_error);
    return moving(
        wood_surface(corner.instance, vertex, frame.clip_from_anchor),
        wood_surface(frame.plants + corner.instance, vertex, frame.clip_from_anchor_before),
    );
}
