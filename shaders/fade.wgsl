// The effect `fade` by alpha: a leaf at the end of the prefix covers only a fraction of a pixel's
// samples.

fn fade_share(leaf: u32, instance: u32) -> f32 {
    return presence(leaf, transition_of(instances[instance]));
}
