// Trunks and branches of plants of one model in one indexed draw call, one instance per plant.

// A vertex of the wood.
struct WoodVertex {
    rest: vec3<f32>,
    normal: vec3<f32>,
    uv: vec2<f32>,
    look: Look,
}

// packed: position along x and y; position along z and the normal; texture coordinates; look.
@vertex
fn wood_corner(@builtin(instance_index) instance: u32, @location(0) packed: vec4<u32>) -> Surface {
    let vertex = wood_vertex(packed);
    let width = vertex.look.size;
    var surface = wood_surface(instance, vertex, frame.clip_from_anchor);
    // The stem that is always drawn covers only as much as it would at its own width.
    surface.share = select(1.0, min(-width / instances[instance].stem_width, 1.0), width < 0.0);
    surface.color = vertex.look.color;
    surface.normal = vertex.normal;
    return surface;
}

fn wood_vertex(packed: vec4<u32>) -> WoodVertex {
    let look = looks[packed.w];
    let rest = grid_point(packed.x, packed.y, packing.wood_step, look);
    return WoodVertex(rest, normal_of(packed.y), uv_of(packed.z, look), look);
}

// Stems thinner than stem_width are drawn at that width. A widened stem keeps its depth, so that it
// does not come out of the leaves around it.
fn wood_surface(number: u32, vertex: WoodVertex, clip_from_anchor: mat4x4<f32>) -> Surface {
    var surface: Surface;
    let instance = instances[number];
    let rest = vertex.rest;
    let wide = rest + vertex.normal * (0.5 * max(instance.stem_width - abs(vertex.look.size), 0.0));
    let thin = clip_from_anchor * vec4(in_anchor_space(moved_wood(rest, number), instance), 1.0);
    surface.position_local = moved_wood(wide, number);
    surface.clip = clip_from_anchor * vec4(in_anchor_space(surface.position_local, instance), 1.0);
    surface.clip.z = select(surface.clip.z, thin.z / thin.w * surface.clip.w, any(wide != rest));
    surface.instance = number;
    surface.uv = vertex.uv;
    surface.material = vertex.look.material;
    surface.uv_size = vertex.look.shown;
    return surface;
}

@fragment
fn wood_color(surface: Surface) -> Shaded {
    return shaded(surface, false);
}
