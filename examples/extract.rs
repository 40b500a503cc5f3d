//! CPU work that a game does per frame: from the camera's distance to the scales to upload.
//!
//! `cargo run --example extract -- oak.vds`; without a file, it grows a small birch.

use foliage_lod::{
    FoliageModel, Swap,
    extract::{Blend, Hysteresis, LodPolicy, Sight, fewest_leaves, leaf_count},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};

fn main() -> foliage_lod::Result<()> {
    let model = match std::env::args().nth(1) {
        Some(path) => FoliageModel::read(path)?,
        None => small_birch()?,
    };
    let leaves = model.leaves.len() as u32;
    let radius = model.sphere().radius as f32;

    let least = fewest_leaves(leaves);

    // One of each per tree on the screen.
    let mut swap = Swap::new(&model);
    let mut hysteresis = Hysteresis::default();

    // The camera moves back; each frame prints one line.
    for distance_in_radii in [2.0, 5.0, 5.01, 10.0, 20.0, 40.0, 80.0] {
        let sight = Sight { distance: distance_in_radii * radius, radius, fov_y: 1.0, height_px: 1080.0 };
        let wanted = leaf_count(Blend::default().lod(&sight), leaves, least);
        let active = hysteresis.settle(wanted, leaves, least);
        let ranges = swap.set_active(active);
        let uploaded: u32 = ranges.iter().map(|range| range.end - range.start).sum();
        println!("{distance_in_radii:>5} radii: {active:>6} of {leaves} leaves, {uploaded:>6} scales to upload");
    }
    Ok(())
}

fn small_birch() -> foliage_lod::Result<FoliageModel> {
    let birch =
        grow(&Species::embedded("betula-populifolia")?, &GrowOptions { leaves: Some(800), ..Default::default() })?;
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    Ok(simplify(&birch, &options, &mut CpuFragments::new(), &mut Quiet)?.model)
}
