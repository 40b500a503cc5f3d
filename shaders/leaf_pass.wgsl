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
    let drawn = drawn_corner(corner, item);
    return leaf_surface(drawn, outline_word(drawn, frame.clip_from_anchor), frame.clip_from_anchor);
}

// A corner of a leaf, its offset from the pivot.
struct Corner {
    offset: vec3<f32>,
    normal: vec3<f32>,
    uv: vec2<f32>,
    color: vec3<f32>,
    // Place on the quad, from 0 to 1 both ways; NO_QUAD for a triangle.
    on_quad: vec2<f32>,
}

// A corner to draw: of which quad of which leaf of which plant.
struct Drawn {
    is_drawn: bool,
    item: u32,
    instance: Instance,
    number: u32,
    leaf: LeafRecord,
    look: Look,
    pivot: vec3<f32>,
    scale: f32,
    turn: LeafTurn,
    // First corner of the quad, and which quad of the leaf it is.
    first: u32,
    nth: u32,
    // Which corner of the quad or of its outline.
    place: u32,
    is_trimmed: bool,
}

// Corners of a run's quads are followed by those of its trimmed quads.
fn drawn_corner(corner_in_run: u32, item: vec2<u32>) -> Drawn {
    let is_trimmed = corner_in_run >= 4u * RUN_QUADS;
    let sides = select(4u, TRIMMED_CORNERS, is_trimmed);
    let from_first = corner_in_run - select(0u, 4u * RUN_QUADS, is_trimmed);
    let quad = item.y * RUN_QUADS + from_first / sides;
    if 4u * quad >= arrayLength(&corners) {
        return Drawn();
    }
    let instance = instances[item.x];
    let of_leaf = leaf_of(quad);
    let number = of_leaf.x;
    if number >= leaves_drawn(instance) {
        return Drawn();
    }
    let leaf = leaves[number];
    let look = looks[look_of(number, leaf)];
    let pivot = grid_point(leaf.pivot_xy, leaf.pivot_z_seed, packing.grid_step, look);
    let scale = drawn_scale(number, leaf.first_event, leaves[number + 1u].first_event, instance) * instance.leaf_scale;
    return Drawn(
        true, item.x, instance, number, leaf, look, pivot, scale, leaf_turn(number, pivot, item.x), 4u * quad, of_leaf.y,
        from_first % sides, is_trimmed,
    );
}

// word: see outline_word.
fn leaf_surface(drawn: Drawn, word: u32, clip_from_anchor: mat4x4<f32>) -> Surface {
    if !drawn.is_drawn {
        return Surface();
    }
    var corner: Corner;
    if word == NO_EXTRA {
        corner = quad_corner(drawn.first + min(drawn.place, 3u), drawn);
    } else {
        corner = outline_corner(word, drawn);
    }
    var surface = surface_of(drawn.item, drawn.instance);
    let moved = moved_corner(corner, drawn);
    surface.position_local = moved.position;
    surface.clip = clip_from_anchor * vec4(in_anchor_space(moved.position, drawn.instance), 1.0);
    surface.uv = corner.uv;
    surface.middle = vec4(corner.uv, corner.on_quad);
    surface.color = corner.color;
    surface.normal = moved.normal;
    surface.material = drawn.look.material;
    surface.leaf = drawn.number;
    surface.seed = drawn.leaf.pivot_z_seed & 0xffff0000u;
    surface.share = 1.0;
    surface.enlarged = vec4(kept_at(drawn.scale), drawn.scale, drawn.look.anchor);
    surface.rect = vec4(drawn.look.shown_low, drawn.look.shown);
    return surface;
}

fn moved_corner(corner: Corner, drawn: Drawn) -> Moved {
    return moved_leaf(drawn.pivot, corner.offset * drawn.scale, corner.normal, drawn.turn);
}

fn quad_corner(at: u32, drawn: Drawn) -> Corner {
    let bits = corners[at];
    let look = drawn.look;
    let offset = vec3(unpack2x16snorm(bits.offset_xy), unpack2x16snorm(bits.offset_z_normal).x) * look.size;
    let tint = leaf_tint(drawn.number, drawn.leaf, at, look);
    let nth = at - drawn.first;
    let on_quad = select(vec2(f32(nth == 1u || nth == 2u), f32(nth >= 2u)), NO_QUAD, is_triangle(drawn.first));
    return Corner(offset, normal_of(bits.offset_z_normal), uv_of(bits.uv, look), tint, on_quad);
}

// Whether the last two corners of a quad are the same.
fn is_triangle(first: u32) -> bool {
    let c = corners[first + 2u];
    let d = corners[first + 3u];
    return c.offset_xy == d.offset_xy && c.offset_z_normal == d.offset_z_normal && c.uv == d.uv;
}

// Leaf of a quad, and which of its quads it is.
fn leaf_of(quad: u32) -> vec2<u32> {
    if packing.quads_per_leaf == 0u {
        return vec2(extras[quad] & ((1u << LEAF_BITS) - 1u), extras[quad] >> LEAF_BITS);
    }
    return vec2(quad / packing.quads_per_leaf, quad % packing.quads_per_leaf);
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
        case COLORING_FLAT, COLORING_ORDER, COLORING_PARTS: {
            return diagnostic_color(number, arrayLength(&leaves) - 1u);
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
    let transition = transition_of(instance);
    // A leaf that fades by alpha keeps its size.
    let own = select(presence(leaf, transition), 1.0, FADES_BY_ALPHA);
    return scale_in(first_event, end_event, own, transition);
}
