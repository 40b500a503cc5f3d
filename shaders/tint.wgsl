// Tints: a colour factor of each plant, and the light of the haze before it.

struct Tint {
    factor: array<f32, 3>,
    added: array<f32, 3>,
}

@group(2) @binding(4) var<storage, read> tints: array<Tint>;

fn tinted(color: vec3<f32>, instance: u32) -> vec3<f32> {
    let tint = tints[instance];
    let factor = vec3(tint.factor[0], tint.factor[1], tint.factor[2]);
    return color * factor + vec3(tint.added[0], tint.added[1], tint.added[2]);
}
