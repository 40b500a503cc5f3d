// Leaves of many plants of one model in one draw call. Each instance of the draw call is a run of
// RUN_INDICES indices of one plant; vertices past the plant's prefix collapse to a point.

struct LeafVertex {
    position: array<f32, 3>,
    normal: array<f32, 3>,
    uv: array<f32, 2>,
    color: array<f32, 3>,
    leaf: u32,
}

struct LeafRecord {
    pivot: array<f32, 3>,
    material: u32,
    // Range of the leaf's events in the timeline.
    first_event: u32,
    end_event: u32,
    // Width and height of the part of the texture that the leaf shows.
    uv_size: array<f32, 2>,
    // Seed of its partial coverage, like a fraction of 2^32.
    seed: u32,
}

@group(0) @binding(4) var<storage, read> vertices: array<LeafVertex>;
@group(0) @binding(5) var<storage, read> indices: array<u32>;
@group(0) @binding(6) var<storage, read> leaves: array<LeafRecord>;
@group(0) @binding(7) var<storage, read> events: array<Event>;
// Drawn scales of the plants that store their own.
@group(1) @binding(1) var<storage, read> scales: array<f32>;

// item: index of the plant's record, and of the run within the plant.
@vertex
fn leaf_corner(@builtin(vertex_index) corner: u32, @location(0) item: vec2<u32>) -> Surface {
    return leaf_surface(corner, item, frame.clip_from_anchor);
}

fn leaf_surface(corner: u32, item: vec2<u32>, clip_from_anchor: mat4x4<f32>) -> Surface {
    var surface: Surface;
    surface.instance = item.x;
    let at = item.y * RUN_INDICES + corner;
    let instance = instances[item.x];
    if at >= arrayLength(&indices) {
        return surface;
    }
    let vertex = vertices[indices[at]];
    if vertex.leaf >= instance.drawn {
        return surface;
    }
    let leaf = leaves[vertex.leaf];
    let pivot = vec3(leaf.pivot[0], leaf.pivot[1], leaf.pivot[2]);
    let rest = vec3(vertex.position[0], vertex.position[1], vertex.position[2]);
    let scale = drawn_scale(vertex.leaf, leaf, instance) * instance.leaf_scale;
    let normal = vec3(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
    let moved = moved_leaf(pivot, (rest - pivot) * scale, normal, vertex.leaf, item.x);
    surface.position_local = moved.position;
    surface.clip = clip_from_anchor * vec4(in_anchor_space(moved.position, instance), 1.0);
    surface.uv = vec2(vertex.uv[0], vertex.uv[1]);
    surface.color = leaf_tint(vertex);
    surface.normal = moved.normal;
    surface.material = leaf.material;
    surface.leaf = vertex.leaf;
    surface.seed = leaf.seed;
    surface.share = 1.0;
    surface.uv_size = vec2(leaf.uv_size[0], leaf.uv_size[1]);
    return surface;
}

@fragment
fn leaf_color(surface: Surface) -> Shaded {
    return shaded(surface, true);
}

fn leaf_tint(vertex: LeafVertex) -> vec3<f32> {
    switch COLORING {
        case COLORING_FLAT: {
            // Any hash will do; this is Knuth's multiplicative hash.
            let mixed = vertex.leaf * HASH_MULTIPLIER;
            return vec3(f32(mixed >> 24u), f32((mixed >> 16u) & 255u), f32((mixed >> 8u) & 255u)) / 255.0;
        }
        case COLORING_ORDER: {
            // Blue for the leaf that is kept longest, orange for the one that is pruned first.
            let order = f32(vertex.leaf) / f32(arrayLength(&leaves));
            return mix(vec3(0.02, 0.1, 0.6), vec3(1.0, 0.5, 0.02), order);
        }
        default: {
            return vec3(vertex.color[0], vertex.color[1], vertex.color[2]);
        }
    }
}

fn drawn_scale(leaf: u32, record: LeafRecord, instance: Instance) -> f32 {
    if instance.first_scale != NO_SCALES {
        return scales[instance.first_scale + leaf];
    }
    // The first event whose leaf may be only partly present.
    var low = event_at(record.first_event, record.end_event, instance.first_partial);
    // A leaf that fades by alpha keeps its size.
    let own = select(presence(leaf, instance), 1.0, FADES_BY_ALPHA);
    let is_still = low >= record.end_event || events[low].leaf >= instance.drawn;
    if is_still && own == 1.0 {
        return scale_of(low, record.end_event);
    }
    var area = 0.0;
    while low < record.end_event && events[low].leaf < instance.drawn {
        let gone = 1.0 - presence(events[low].leaf, instance);
        area += gone * (pow2(scale_of(low, record.end_event)) - pow2(scale_of(low + 1u, record.end_event)));
        low += 1u;
    }
    return sqrt(max(pow2(scale_of(low, record.end_event)) + area, 0.0) * own);
}

fn pow2(x: f32) -> f32 {
    return x * x;
}
