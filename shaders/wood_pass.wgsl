// Trunks and branches of plants of one model in one indexed draw call, one instance per plant.

@vertex
fn wood_corner(
    @builtin(instance_index) instance: u32,
    @location(0) rest: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) color: vec3<f32>,
    @location(4) material: u32,
) -> Surface {
    var surface = wood_surface(instance, rest);
    surface.uv = uv;
    surface.color = color;
    surface.normal = normal;
    surface.material = material;
    return surface;
}

fn wood_surface(instance: u32, rest: vec3<f32>) -> Surface {
    var surface: Surface;
    surface.position_local = moved_wood(rest, instance);
    surface.clip = instances[instance].clip_from_local * vec4(surface.position_local, 1.0);
    surface.instance = instance;
    return surface;
}

@fragment
fn wood_color(surface: Surface) -> Shaded {
    return shaded(surface, false, 0u);
}
