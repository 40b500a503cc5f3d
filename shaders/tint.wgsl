// Tints: a colour factor of each plant.

@group(2) @binding(4) var<storage, read> tints: array<f32>;

fn tinted(color: vec3<f32>, instance: u32) -> vec3<f32> {
    let first = 3u * instance;
    return color * vec3(tints[first], tints[first + 1u], tints[first + 2u]);
}
