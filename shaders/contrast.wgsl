// The effect `contrast`: moves the shaded colours of reduced plants towards their mean. Twin of
// stochastic/contrast.rs.

struct Tone {
    // Mean shaded colour of the plant's leaves, linear.
    mean: vec3<f32>,
    // Fraction of a colour's distance from the mean that is kept.
    kept: f32,
}

// One per instance.
@group(2) @binding(0) var<storage, read> tones: array<Tone>;

fn kept_at(scale: f32) -> f32 {
    return 1.0;
}

fn toned(color: vec3<f32>, surface: Surface) -> vec3<f32> {
    let tone = tones[surface.instance];
    return tone.mean + tone.kept * (color - tone.mean);
}
