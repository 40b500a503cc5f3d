// Trunks and branches of plants of one model in one indexed draw call, one instance per plant.

// A vertex of the wood.
struct WoodVertex {
    rest: vec3<f32>,
    normal: vec3<f32>,
    uv: vec2<f32>,
    // Width of the stem.
    width: f32,
    look: Look,
}

// packed: position along x and y; position along z and the normal; texture coordinates; look and
// width of the stem.
@vertex
fn wood_corner(@builtin(instance_index) instance: u32, @location(0) packed: vec4<u32>) -> Surface {
    let vertex = wood_vertex(packed);
    var surface = wood_surface(instance, vertex, frame.clip_from_anchor);
    // The stem that is always drawn covers only as much as it would at its own width.
    surface.share = select(1.0, min(-vertex.width / instances[instance].stem_width, 1.0), vertex.width < 0.0);
    surface.color = vertex.look.color;
    surface.normal = vertex.normal;
    return surface;
}

fn wood_vertex(packed: vec4<u32>) -> WoodVertex {
    let has_width = packing.widths_in_looks == 0u;
    let look = looks[select(packed.w, packed.w & 0xffffu, has_width)];
    let size = exp2(f32((packed.w >> 16u) & 0x7fffu) / WIDTH_STEPS + LEAST_WIDTH) * packing.wood_step;
    let width = select(look.size, select(size, -size, packed.w >> 31u == 1u), has_width);
    let rest = grid_point(packed.x, packed.y, packing.wood_step, look);
    return WoodVertex(rest, normal_of(packed.y), uv_of(packed.z, look), width, look);
}

// Stems thinner than stem_width are drawn at that width. A widened stem keeps its depth, so that it
// does not come out of the leaves around it.
fn wood_surface(number: u32, vertex: WoodVertex, clip_from_anchor: mat4x4<f32>) -> Surface {
    let instance = instances[number];
    var surface = surface_of(number, instance);
    let rest = vertex.rest;
    let wide = rest + vertex.normal * (0.5 * max(instance.stem_width - abs(vertex.width), 0.0));
    let thin = clip_from_anchor * vec4(in_anchor_space(moved_wood(rest, number), instance), 1.0);
    surface.position_local = moved_wood(wide, number);
    surface.clip = clip_from_anchor * vec4(in_anchor_space(surface.position_local, instance), 1.0);
    surface.clip.z = select(surface.clip.z, thin.z / thin.w * surface.clip.w, any(wide != rest));
    surface.uv = vertex.uv;
    surface.middle = vec4(vertex.uv, NO_QUAD);
    surface.material = vertex.look.material;
    surface.rect = vec4(vertex.look.shown_low, vertex.look.shown);
    return surface;
}

@fragment
fn wood_color(surface: Surface) -> Shaded {
    return shaded(surface, false);
}
