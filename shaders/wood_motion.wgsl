// Vertices of trunks and branches for motion_pass, in this frame and the previous one, both at this
// frame's error.

@vertex
fn wood_motion(corner: WoodCorner) -> Moving {
    let error = instances[corner.instance].wood_error;
    let then = frame.plants + corner.instance;
    return moving(
        wood_surface(corner.instance, wood_vertex(corner, error, corner.instance), frame.clip_from_anchor),
        wood_surface(then, wood_vertex(corner, error, then), frame.clip_from_anchor_before),
    );
}
