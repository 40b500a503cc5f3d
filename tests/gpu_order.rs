//! The pruning order does not depend on the rasteriser; the model records which one was used.
//!
//! Without an adapter the test prints a note and passes; with `FOLIAGE_REQUIRE_ADAPTER=1` it fails.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::{gpu::gpu, plants};
use foliage_lod::{
    gpu::GpuFragments,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};

#[test]
fn models_from_gpu_and_cpu_fragments_differ_in_their_recipe_alone() {
    let Some(gpu) = gpu() else { return };
    let mut source = GpuFragments::new(&gpu).unwrap();
    // `balanced` also captures enlarged leaves, at lower resolutions.
    let presets = [SimplifyOptions::paper(), SimplifyOptions::balanced()];
    let plants = [plants::masked(300, 31), plants::with_wood(300, 32), plants::bent(300, 33)];
    for (options, plant) in presets.iter().flat_map(|options| plants.iter().map(move |plant| (options, plant))) {
        let options = SimplifyOptions { resolution: 96, ..options.clone() };
        let mut drawn = simplify(plant, &options, &mut source, &mut Quiet).unwrap().model;
        let computed = simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        assert_eq!((drawn.recipe.raster.as_str(), drawn.recipe.adapter.clone()), ("gpu", Some(gpu.adapter_name())));
        assert_eq!((computed.recipe.raster.as_str(), &computed.recipe.adapter), ("cpu", &None));
        drawn.recipe = computed.recipe.clone();
        assert!(drawn == computed, "{}", plant.name);
    }
}
