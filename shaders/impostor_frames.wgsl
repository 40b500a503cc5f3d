// Pictures of an impostor, and what a ray sees in them. Twin of software/sprite.rs.
//
// Declare in your shader the uniform `impostor: Impostor`, and `colors`, `surfaces` and `clamping`,
// textures with a layer for each picture and their sampler.

struct Impostor {
    // Middle of every picture, in local space.
    center: vec3<f32>,
    // Half the side of a picture.
    half_side: f32,
    // Radius of the plant's bounding sphere.
    radius: f32,
    // Side of a picture without its margin, in texels.
    texels: f32,
    // Pictures along each side of the lattice.
    across: u32,
    is_whole_sphere: u32,
}

// Twins of model/impostor.rs.

// Unit vectors to the right and up in the picture of a viewer in this direction.
fn axes_of(towards_viewer: vec3<f32>) -> mat2x3<f32> {
    let level = vec3(towards_viewer.z, 0.0, -towards_viewer.x);
    let right = select(vec3(1.0, 0.0, 0.0), level * inverseSqrt(dot(level, level)), dot(level, level) > 0.0);
    return mat2x3(right, cross(towards_viewer, right));
}

fn folded(flat_place: vec2<f32>) -> vec2<f32> {
    return (vec2(1.0) - abs(flat_place.yx)) * select(vec2(1.0), vec2(-1.0), flat_place < vec2(0.0));
}

// Unit vector from the plant towards the viewer of a picture.
fn direction(layer: u32) -> vec3<f32> {
    let place = vec2(f32(layer % impostor.across), f32(layer / impostor.across)) / f32(impostor.across - 1u);
    if impostor.is_whole_sphere == 1u {
        let unfolded = 2.0 * place - 1.0;
        let y = 1.0 - abs(unfolded.x) - abs(unfolded.y);
        let flat_place = select(unfolded, folded(unfolded), y < 0.0);
        return normalize(vec3(flat_place.x, y, flat_place.y));
    }
    let x = place.x - place.y;
    let z = place.x + place.y - 1.0;
    return normalize(vec3(x, 1.0 - abs(x) - abs(z), z));
}

struct Around {
    layers: vec3<u32>,
    weights: vec3<f32>,
}

// The pictures around a direction, and their weights.
fn around(towards_viewer: vec3<f32>) -> Around {
    let is_whole = impostor.is_whole_sphere == 1u;
    let up = select(max(towards_viewer.y, 0.0), towards_viewer.y, is_whole);
    let flat_place = towards_viewer.xz / max(abs(towards_viewer.x) + abs(up) + abs(towards_viewer.z), 1e-30);
    var place = vec2(1.0 + flat_place.x + flat_place.y, 1.0 + flat_place.y - flat_place.x) * 0.5;
    if is_whole {
        place = (select(flat_place, folded(flat_place), up < 0.0) + 1.0) * 0.5;
    }
    let steps = f32(impostor.across - 1u);
    let cell = clamp(floor(place * steps), vec2(0.0), vec2(steps - 1.0));
    let part = clamp(place * steps - cell, vec2(0.0), vec2(1.0));
    let first = u32(cell.y) * impostor.across + u32(cell.x);
    let third = first + select(impostor.across, 1u, part.x > part.y);
    return Around(
        vec3(first, third, first + impostor.across + 1u),
        vec3(1.0 - max(part.x, part.y), abs(part.x - part.y), min(part.x, part.y)),
    );
}

// What a pixel shows.
struct Seen {
    color: vec3<f32>,
    coverage: f32,
    // Mean normal of the surfaces.
    normal: vec3<f32>,
    // Part of them that is leaves.
    leaf: f32,
    // Place relative to the centre, and displacement by the wind.
    hit: vec3<f32>,
    shift: vec3<f32>,
}

// Adds what one picture shows on a ray, by its weight and coverage.
fn add_picture(
    sum: ptr<function, Seen>,
    layer: u32,
    weight: f32,
    towards: vec3<f32>,
    origin: vec3<f32>,
    ray: vec3<f32>,
    level: f32,
    is_deep: bool,
) {
    if weight <= 0.0 {
        return;
    }
    let axes = axes_of(towards);
    let approach = min(dot(ray, towards), -LEAST_APPROACH);
    let before = dot(origin, towards);
    var at = origin - ray * (before / approach);
    var surface = vec4(0.0);
    if is_deep {
        // The last step's surface is the one that is shown: a pixel's fraction from the place.
        for (var i = 0u; i < DEPTH_STEPS; i++) {
            surface = textureSampleLevel(surfaces, clamping, place_in(at, axes), layer, level);
            at = origin + ray * (((2.0 * surface.b - 1.0) * impostor.half_side - before) / approach);
        }
    }
    let uv = place_in(at, axes);
    if any(uv < vec2(0.0)) || any(uv > vec2(1.0)) {
        return;
    }
    let color = textureSampleLevel(colors, clamping, uv, layer, level);
    if !is_deep {
        surface = textureSampleLevel(surfaces, clamping, uv, layer, level);
        at = origin + ray * (((2.0 * surface.b - 1.0) * impostor.half_side - before) / approach);
    }
    let share = weight * color.a;
    let parts = 2.0 * surface.rg - 1.0;
    let normal = axes[0] * parts.x + axes[1] * parts.y + towards * abs(2.0 * surface.a - 1.0);
    (*sum).coverage += share;
    (*sum).color += share * color.rgb;
    (*sum).normal += share * normal;
    (*sum).leaf += share * f32(surface.a >= 0.5);
    (*sum).hit += share * at;
}

// Texture coordinates of a point in a picture.
fn place_in(at: vec3<f32>, axes: mat2x3<f32>) -> vec2<f32> {
    return vec2(dot(at, axes[0]), -dot(at, axes[1])) * (0.5 / impostor.half_side) + 0.5;
}
