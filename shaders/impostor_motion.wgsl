// Motion vectors of impostors; see motion_pass.wgsl.

struct MovingSprite {
    @location(0) motion: vec2<f32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn impostor_motion(sprite: Sprite) -> MovingSprite {
    let shown = seen(sprite, true);
    if samples_of(sprite, shown) == 0u {
        discard;
    }
    let rest = impostor.center + shown.hit;
    let then = frame.plants + sprite.instance;
    let now = frame.clip_from_anchor * vec4(in_anchor_space(moved_wood(rest, sprite.instance), instances[sprite.instance]), 1.0);
    let before = frame.clip_from_anchor_before * vec4(in_anchor_space(moved_wood(rest, then), instances[then]), 1.0);
    var motion = vec2(0.0);
    if before.w > 0.0 {
        motion = (now.xy / now.w - frame.jitter - before.xy / before.w) * vec2(0.5, -0.5);
    }
    return MovingSprite(motion, depth_of(sprite, shown));
}
