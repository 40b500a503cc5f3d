// Leaves of many plants of one model in one draw call. Each instance of the draw call is a run of
// RUN_QUADS of one plant's quads; corners past the plant's prefix collapse to a point.

struct LeafCorner {
    offset_xy: u32,
    // Offset along z, and the normal.
    offset_z_normal: u32,
    uv: u32,
}

struct LeafRecord {
    pivot_xy: u32,
    // Pivot along z, and the upper half of the seed of partial coverage.
    pivot_z_seed: u32,
    // First of the leaf's events in the timeline; they end where the next leaf's begin.
    first_event: u32,
    // Square roots of the colour over the look's, and the number of the look.
    color_look: u32,
}

@group(0) @binding(4) var<storage, read> corners: array<LeafCorner>;
// One more than there are leaves.
@group(0) @binding(6) var<storage, read> leaves: array<LeafRecord>;
@group(0) @binding(7) var<storage, read> events: array<Event>;
// What only some models need; see Packing.
@group(0) @binding(9) var<storage, read> extras: array<u32>;
// Drawn scales of the plants that store their own.
@group(1) @binding(1) var<storage, read> scales: array<f32>;

// item: index of the plant's record, and of the run within the plant.
@vertex
fn leaf_corner(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Surface {
    return leaf_surface(corner, item, frame.clip_from_anchor);
}

// A corner of a leaf, its offset from the pivot.
struct Corner {
    offset: vec3<f32>,
    normal: vec3<f32>,
    uv: vec2<f32>,
    color: vec3<f32>,
}

// Corners of a run's quads are followed by those of its trimmed cards.
fn leaf_surface(corner_in_run: u32, item: vec2<u32>, clip_from_anchor: mat4x4<f32>) -> Surface {
    let is_trimmed = corner_in_run >= 4u * RUN_QUADS;
    let sides = select(4u, TRIMMED_CORNERS, is_trimmed);
    let from_first = corner_in_run - select(0u, 4u * RUN_QUADS, is_trimmed);
    let quad = item.y * RUN_QUADS + from_first / sides;
    if 4u * quad >= arrayLength(&corners) {
        return Surface();
    }
    let instance = instances[item.x];
    let number = leaf_of(quad);
    if number >= instance.drawn {
        return Surface();
    }
    var surface = surface_of(item.x, instance);
    let leaf = leaves[number];
    let look = looks[look_of(number, leaf)];
    let pivot = grid_point(leaf.pivot_xy, leaf.pivot_z_seed, packing.grid_step, look);
    let place = from_first % sides;
    var corner: Corner;
    if is_trimmed && look.outline != NO_EXTRA {
        let bits = extras[packing.first_outline + look.outline + place];
        corner = outline_corner(4u * quad, uv_of(bits, look), number, leaf, look);
    } else {
        corner = quad_corner(4u * quad + min(place, 3u), number, leaf, look);
    }
    let scale = drawn_scale(number, leaf.first_event, leaves[number + 1u].first_event, instance) * instance.leaf_scale;
    let moved = moved_leaf(pivot, corner.offset * scale, corner.normal, number, item.x);
    surface.position_local = moved.position;
    surface.clip = clip_from_anchor * vec4(in_anchor_space(moved.position, instance), 1.0);
    surface.uv = corner.uv;
    surface.color = corner.color;
    surface.normal = moved.normal;
    surface.material = look.material;
    surface.leaf = number;
    surface.seed = leaf.pivot_z_seed & 0xffff0000u;
    surface.share = 1.0;
    surface.kept = kept_at(scale);
    surface.uv_size = look.shown;
    return surface;
}

fn quad_corner(at: u32, number: u32, leaf: LeafRecord, look: Look) -> Corner {
    let bits = corners[at];
    let offset = vec3(unpack2x16snorm(bits.offset_xy), unpack2x16snorm(bits.offset_z_normal).x) * look.size;
    return Corner(offset, normal_of(bits.offset_z_normal), uv_of(bits.uv, look), leaf_tint(number, leaf, at, look));
}

// The point of a card that shows `uv`.
fn outline_corner(first: u32, uv: vec2<f32>, number: u32, leaf: LeafRecord, look: Look) -> Corner {
    let a = quad_corner(first, number, leaf, look);
    let b = quad_corner(first + 1u, number, leaf, look);
    let c = quad_corner(first + 2u, number, leaf, look);
    let d = quad_corner(first + 3u, number, leaf, look);
    let ab = b.uv - a.uv;
    let ad = d.uv - a.uv;
    let s = dot(uv - a.uv, ab) / dot(ab, ab);
    let t = dot(uv - a.uv, ad) / dot(ad, ad);
    return Corner(
        mix(mix(a.offset, b.offset, s), mix(d.offset, c.offset, s), t),
        mix(mix(a.normal, b.normal, s), mix(d.normal, c.normal, s), t),
        uv,
        mix(mix(a.color, b.color, s), mix(d.color, c.color, s), t),
    );
}

// Leaf of a quad.
fn leaf_of(quad: u32) -> u32 {
    if packing.quads_per_leaf == 0u {
        return extras[quad];
    }
    return quad / packing.quads_per_leaf;
}

fn look_of(number: u32, leaf: LeafRecord) -> u32 {
    if packing.first_look != NO_EXTRA {
        return extras[packing.first_look + number];
    }
    return leaf.color_look >> 24u;
}

@fragment
fn leaf_color(surface: Surface) -> Shaded {
    return shaded(surface, true);
}

fn leaf_tint(number: u32, leaf: LeafRecord, corner: u32, look: Look) -> vec3<f32> {
    switch COLORING {
        case COLORING_FLAT: {
            // Any hash will do; this is Knuth's multiplicative hash.
            let mixed = number * HASH_MULTIPLIER;
            return vec3(f32(mixed >> 24u), f32((mixed >> 16u) & 255u), f32((mixed >> 8u) & 255u)) / 255.0;
        }
        case COLORING_ORDER: {
            // Blue for the leaf that is kept longest, orange for the one that is pruned first.
            let order = f32(number) / f32(arrayLength(&leaves) - 1u);
            return mix(vec3(0.02, 0.1, 0.6), vec3(1.0, 0.5, 0.02), order);
        }
        default: {
            var root = unpack4x8unorm(leaf.color_look).rgb;
            if packing.first_color != NO_EXTRA {
                let bits = extras[packing.first_color + corner];
                root = vec3(f32(bits & 1023u), f32((bits >> 10u) & 1023u), f32(bits >> 20u)) / 1023.0;
            }
            return root * root * look.color;
        }
    }
}

fn drawn_scale(leaf: u32, first_event: u32, end_event: u32, instance: Instance) -> f32 {
    if instance.first_scale != NO_SCALES {
        return scales[instance.first_scale + leaf];
    }
    // The first event whose leaf may be only partly present.
    var low = event_at(first_event, end_event, instance.first_partial);
    // A leaf that fades by alpha keeps its size.
    let own = select(presence(leaf, instance), 1.0, FADES_BY_ALPHA);
    let is_still = low >= end_event || events[low].leaf >= instance.drawn;
    if is_still && own == 1.0 {
        return scale_of(low, end_event);
    }
    var area = 0.0;
    while low < end_event && events[low].leaf < instance.drawn {
        let gone = 1.0 - presence(events[low].leaf, instance);
        area += gone * (pow2(scale_of(low, end_event)) - pow2(scale_of(low + 1u, end_event)));
        low += 1u;
    }
    return sqrt(max(pow2(scale_of(low, end_event)) + area, 0.0) * own);
}

fn pow2(x: f32) -> f32 {
    return x * x;
}
