// Hand-over to the impostor: leaves and wood keep the samples that the impostor does not take. Twin
// of draw/handover.rs.

// Samples of a pixel that belong to the leaves and the wood.
fn kept_samples(pixel: vec2<f32>, instance: u32) -> u32 {
    return ~far_samples(pixel, far_share(instances[instance]), SAMPLES);
}

fn leaves_drawn(instance: Instance) -> u32 {
    return instance.drawn & ((1u << LEAF_BITS) - 1u);
}
