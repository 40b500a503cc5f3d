// Motion vectors of cards of clusters, from motion_pass.

@vertex
fn card_motion(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Moving {
    return moving(
        card_surface(corner, item, frame.clip_from_anchor),
        card_surface(corner, vec2(frame.plants + item.x, item.y), frame.clip_from_anchor_before),
    );
}

@fragment
fn card_moved(moving: Moving) -> @location(0) vec2<f32> {
    let is_open = is_card_hole(moving.material, moving.uv, moving.rect.xy, moving.seed);
    if is_open || (kept_samples(moving.clip.xy, moving.instance) & 1u) == 0u {
        discard;
    }
    return motion_of(moving);
}
