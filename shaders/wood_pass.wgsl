// Trunks and branches of plants of one model in one indexed draw call, one instance per plant.
// WoodCorner and wood_vertex come from wood_stems or, if vertices slide, from wood_slides.

// A vertex of the wood.
struct WoodVertex {
    rest: vec3<f32>,
    // Displacement by the wind.
    shift: vec3<f32>,
    // How far from there it is drawn.
    widened: vec3<f32>,
    // Of a ribbon, along its centre line and as long as half of its width.
    across: vec3<f32>,
    normal: vec3<f32>,
    uv: vec2<f32>,
    color: vec3<f32>,
    // Fraction of a pixel's samples that may be covered.
    share: f32,
    material: u32,
    // Part of the texture that is shown: lowest coordinates, width and height.
    rect: vec4<f32>,
}

@vertex
fn wood_corner(corner: WoodCorner) -> Surface {
    let vertex = wood_vertex(corner, instances[corner.instance].wood_error, corner.instance);
    return wood_surface(corner.instance, vertex, frame.clip_from_anchor);
}

// Wood that is widened keeps its depth, so that it does not come out of the leaves around it.
fn wood_surface(number: u32, vertex: WoodVertex, clip_from_anchor: mat4x4<f32>) -> Surface {
    let instance = instances[number];
    var surface = surface_of(number, instance);
    let thin = clip_from_anchor * vec4(in_anchor_space(vertex.rest + vertex.shift, instance), 1.0);
    surface.normal = vertex.normal;
    surface.position_local = vertex.rest + vertex.widened + vertex.shift;
    if any(vertex.across != vec3(0.0)) {
        // The ribbon is turned towards the eye, and as round as a tube.
        let towards = unit(surface.eye - surface.position_local);
        let side = unit(cross(vertex.across, towards));
        surface.position_local += side * length(vertex.across);
        surface.normal = unit(side + towards);
    }
    surface.clip = clip_from_anchor * vec4(in_anchor_space(surface.position_local, instance), 1.0);
    surface.clip.z = select(surface.clip.z, thin.z / thin.w * surface.clip.w, any(vertex.widened != vec3(0.0)));
    surface.uv = vertex.uv;
    surface.middle = vec4(vertex.uv, NO_QUAD);
    surface.color = vertex.color;
    surface.share = vertex.share;
    surface.material = vertex.material;
    surface.rect = vertex.rect;
    return surface;
}

@fragment
fn wood_color(surface: Surface) -> Shaded {
    return shaded(surface, false);
}
