// Cards of clusters: pictures of the leaves that a leaf stands for. Each instance of the draw call
// is a run of RUN_QUADS cards of one plant; those that do not show collapse to a point. Twin of
// model/clusters.rs.

struct CardRecord {
    // Middle, in local space.
    center: array<f32, 3>,
    // The leaf that stands for the others, and HAS_NEXT if another card of it follows.
    leaf: u32,
    // From the middle to those of the right and of the upper side: six fractions of the unit.
    half_sides: array<u32, 3>,
    unit: f32,
    // Normal, and in 255ths the share of the colour's distance from the plant's mean that is kept.
    normal_kept: u32,
    // Linear.
    color: array<f32, 3>,
    // Texels along the lower side, and in the second byte along the left one.
    size: u32,
    // First of the card's events in the timeline, and the last, with which it appears.
    first_event: u32,
    last_event: u32,
    // First word of its picture.
    texels: u32,
    // Seed of what shows while it appears or disappears.
    number: u32,
}

// One more than there are leaves without leaf 0.
@group(0) @binding(7) var<storage, read> events: array<Event>;
@group(0) @binding(17) var<storage, read> cards: array<CardRecord>;
// Steps of texels, half a byte each.
@group(0) @binding(18) var<storage, read> texels: array<u32>;

@vertex
fn card_corner(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Surface {
    return card_surface(corner, item, frame.clip_from_anchor);
}

fn card_surface(corner: u32, item: vec2<u32>, clip_from_anchor: mat4x4<f32>) -> Surface {
    let number = item.y * RUN_QUADS + corner / 4u;
    if number >= arrayLength(&cards) {
        return Surface();
    }
    let card = cards[number];
    let instance = instances[item.x];
    let shown = shown_card(card, transition_of(instance));
    if shown.x <= 0.0 {
        return Surface();
    }
    let nth = corner % 4u;
    let uv = vec2(f32(nth == 1u || nth == 2u), f32(nth >= 2u));
    let a = unpack2x16snorm(card.half_sides[0]);
    let b = unpack2x16snorm(card.half_sides[1]);
    let c = unpack2x16snorm(card.half_sides[2]);
    let at = 2.0 * uv - 1.0;
    let offset = (vec3(a, b.x) * at.x + vec3(b.y, c) * at.y) * (card.unit * instance.leaf_scale);
    let center = vec3(card.center[0], card.center[1], card.center[2]);
    let leaf = card.leaf & ~HAS_NEXT;
    let moved = moved_leaf(center, offset, normal_of(card.normal_kept), leaf_turn(leaf, center, item.x));
    var surface = surface_of(item.x, instance);
    surface.position_local = moved.position;
    surface.clip = clip_from_anchor * vec4(in_anchor_space(moved.position, instance), 1.0);
    surface.uv = uv;
    surface.middle = vec4(uv, uv);
    surface.color = vec3(card.color[0], card.color[1], card.color[2]);
    if COLORING != COLORING_PICTURE {
        surface.color = diagnostic_color(leaf, arrayLength(&events));
    }
    surface.normal = moved.normal;
    surface.material = number;
    surface.leaf = leaf;
    surface.seed = (card.number * HASH_MULTIPLIER) & 0xffff0000u;
    surface.share = 1.0;
    surface.enlarged = vec4(f32(card.normal_kept & 255u) / 255.0, 1.0, NO_QUAD);
    surface.rect = vec4(shown, 0.0, 0.0);
    return surface;
}

// Share of a card's texels that may show, and the step up to which they do.
fn shown_card(card: CardRecord, transition: Transition) -> vec2<f32> {
    var share = (1.0 - presence(events[card.last_event].leaf, transition)) * presence(card.leaf & ~HAS_NEXT, transition);
    if (card.leaf & HAS_NEXT) != 0u {
        share *= presence(events[card.first_event - 1u].leaf, transition);
    }
    var event = event_at(card.first_event, card.last_event, transition.drawn);
    var step = f32(card.last_event - event);
    while event > card.first_event {
        event--;
        let gone = 1.0 - presence(events[event].leaf, transition);
        if gone <= 0.0 {
            break;
        }
        step += gone;
    }
    return vec2(share, step);
}

// What a pixel shows of a card's picture. right, down: change of the texture coordinates from pixel
// to pixel.
fn card_cutout(number: u32, uv: vec2<f32>, right: vec2<f32>, down: vec2<f32>, shown: vec2<f32>, seed: u32) -> Cutout {
    let card = cards[number];
    let size = vec2<f32>(card_size(card));
    let across = vec2(length(vec2(right.x, down.x)), length(vec2(right.y, down.y))) * size;
    let footprint = log2(max(max(across.x, across.y), 1e-6));
    // Two texels for a pixel, of which each stands for those of the picture that it covers.
    let level = i32(clamp(floor(footprint), 0.0, 5.0));
    let place = uv * size * exp2(-f32(level)) - 0.5;
    let first = vec2<i32>(floor(place));
    let part = place - floor(place);
    let lower = mix(card_texel(card, first, level, shown), card_texel(card, first + vec2(1, 0), level, shown), part.x);
    let upper = mix(
        card_texel(card, first + vec2(0, 1), level, shown), card_texel(card, first + vec2(1, 1), level, shown), part.x,
    );
    let filtered = mix(lower, upper, part.y);
    // Where a texel is larger than a pixel, its edge is as sharp as a pixel.
    let sharp = clamp((filtered - 0.5) * max(exp2(-footprint), 1.0) + 0.5, 0.0, 1.0);
    let coverage = select(select(0.0, 1.0, sharp >= 0.5), sharp, SAMPLES > 1u);
    let is_large = footprint < 0.0;
    return Cutout(select(filtered, coverage, is_large), cutout_dither(uv * size, max(footprint, 0.0), seed));
}

// 1 if a texel shows. At a level above 0, that of any of the texels that it stands for, so that
// their coverage is kept on average.
fn card_texel(card: CardRecord, at: vec2<i32>, level: i32, shown: vec2<f32>) -> f32 {
    let number = i32(card.number);
    let side = f32(1 << u32(level));
    let inside = vec2(hash(vec3(at, 4 * level + 2)), hash(vec3(at, 4 * level + 3))) * side;
    let texel = at * (1 << u32(level)) + vec2<i32>(floor(inside));
    let size = card_size(card);
    if any(texel < vec2(0)) || any(texel >= size) {
        return 0.0;
    }
    let place = u32(texel.y * size.x + texel.x);
    let step = (texels[card.texels + place / TEXELS_PER_WORD] >> (4u * (place % TEXELS_PER_WORD))) & 15u;
    let late = f32(step) - shown.y;
    let is_early = late <= 0.0 || late < hash(vec3(texel, 2 * number));
    let is_there = shown.x >= 1.0 || hash(vec3(texel, 2 * number + 1)) < shown.x;
    return f32(step != EMPTY_TEXEL && is_early && is_there);
}

fn card_size(card: CardRecord) -> vec2<i32> {
    return vec2<i32>(vec2(card.size & 255u, card.size >> 8u));
}

@fragment
fn card_color(surface: Surface) -> Shaded {
    let on_quad = surface.middle.zw;
    let is_on_quad = all(on_quad >= vec2(0.0)) && all(on_quad <= vec2(1.0));
    let uv = select(surface.uv, surface.middle.xy, is_on_quad);
    let cutout =
        card_cutout(surface.material, uv, dpdx(surface.middle.xy), dpdy(surface.middle.xy), surface.rect.xy, surface.seed);
    let covered = covered_samples(cutout.coverage, cutout.dither, surface.seed, SAMPLES);
    let samples = covered & kept_samples(surface.clip.xy, surface.instance);
    if samples == 0u {
        discard;
    }
    return Shaded(vec4(encoded(surface_color(surface, vec3(1.0), true, true)), 1.0), samples);
}

// Whether a card is open here, for passes with one sample per pixel.
fn is_card_hole(number: u32, uv: vec2<f32>, shown: vec2<f32>, seed: u32) -> bool {
    let cutout = card_cutout(number, uv, dpdx(uv), dpdy(uv), shown, seed);
    return cutout.coverage + cutout.dither < 1.0;
}
