// Shadow casting of cards of clusters.

@fragment
fn cast_card(surface: Surface) {
    let is_open = is_card_hole(surface.material, surface.uv, surface.rect.xy, surface.seed);
    if is_open || (kept_samples(surface.clip.xy, surface.instance) & 1u) == 0u {
        discard;
    }
}
