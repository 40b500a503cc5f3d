//! `foliage-lod grow`: grows a species into a GLB file.

use crate::{
    args,
    failure::Failure,
    output::{self, Steps},
    progress::spinning,
    scene::is_toml,
};
use foliage_lod::{
    export::write_glb,
    file::{check_apart, check_writable, write_whole},
    grow::{GrowOptions, Species, grow},
};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::json;

/// Runs the subcommand.
pub fn run(args: &args::Grow) -> Result<(), Failure> {
    check_writable(&args.output)?;
    check_apart(&args.output, Some(&args.species).filter(|species| is_toml(species.as_ref())))?;
    let species = Species::named(&args.species)?;
    let mut steps = Steps::new(args.json);
    let options = GrowOptions { leaves: args.leaves, seed: args.seed };
    let plant = spinning("growing", || grow(&species, &options))?;
    let [leaves, wood] = [plant.leaves.len() as u64, plant.wood.triangles() as u64];
    let result = format!("{}: {} leaves, {} wood triangles", plant.name, HumanCount(leaves), HumanCount(wood));
    let grow_seconds = steps.done("grow", result)?;
    let bytes = write_glb(&plant)?;
    write_whole(&args.output, &bytes)?;
    let write_seconds =
        steps.done("write", format!("{}, {}", args.output.display(), DecimalBytes(bytes.len() as u64)))?;
    if args.json {
        output::line(json!({
            "species": plant.name,
            "leaves": leaves,
            "wood_triangles": wood,
            "bytes": bytes.len(),
            "seconds": { "grow": grow_seconds, "write": write_seconds, "total": steps.total_seconds() },
        }))?;
    }
    Ok(())
}
