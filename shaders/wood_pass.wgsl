// Trunks and branches of plants of one model in one indexed draw call, one instance per plant.

@vertex
fn wood_corner(
    @builtin(instance_index) instance: u32,
    @location(0) rest: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) color: vec3<f32>,
    @location(4) material: u32,
    @location(5) width: f32,
) -> Surface {
    var surface = wood_surface(instance, rest, widened(rest, normal, width, instance), frame.clip_from_anchor);
    // The stem that is always drawn covers only as much as it would at its own width.
    surface.share = select(1.0, min(-width / instances[instance].stem_width, 1.0), width < 0.0);
    surface.uv = uv;
    surface.color = color;
    surface.normal = normal;
    surface.material = material;
    surface.uv_size = vec2(1.0);
    return surface;
}

// Stems thinner than stem_width are drawn at that width.
fn widened(rest: vec3<f32>, normal: vec3<f32>, width: f32, instance: u32) -> vec3<f32> {
    return rest + normal * (0.5 * max(instances[instance].stem_width - abs(width), 0.0));
}

// A widened stem keeps its depth, so that it does not come out of the leaves around it.
fn wood_surface(instance: u32, rest: vec3<f32>, wide: vec3<f32>, clip_from_anchor: mat4x4<f32>) -> Surface {
    var surface: Surface;
    let thin = clip_from_anchor * vec4(in_anchor_space(moved_wood(rest, instance), instances[instance]), 1.0);
    surface.position_local = moved_wood(wide, instance);
    surface.clip = clip_from_anchor * vec4(in_anchor_space(surface.position_local, instances[instance]), 1.0);
    surface.clip.z = select(surface.clip.z, thin.z / thin.w * surface.clip.w, any(wide != rest));
    surface.instance = instance;
    return surface;
}

@fragment
fn wood_color(surface: Surface) -> Shaded {
    return shaded(surface, false);
}
