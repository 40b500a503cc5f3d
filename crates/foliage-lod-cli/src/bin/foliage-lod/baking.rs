//! `foliage-lod bake`, and the impostors of other commands.

use crate::{
    args,
    failure::Failure,
    models,
    output::{self, Steps},
    progress::Bars,
};
use foliage_lod::{FoliageModel, Result, file, model::Impostor, simplify::Observer, software::BakeOptions};
use indicatif::{DecimalBytes, HumanCount};
use serde_json::{Value, json};

/// Runs the subcommand.
pub fn run(args: &args::Bake) -> std::result::Result<(), Failure> {
    let options = BakeOptions { is_whole_sphere: args.whole_sphere, ..args.far.0 };
    options.check()?;
    file::check_writable(&args.output)?;
    let mut steps = Steps::new(args.json);
    let mut model = models::read(&args.model)?;
    steps.done("read", format!("{}: {} leaves", model.name, HumanCount(model.leaves.len() as u64)))?;
    model.impostor = Some(bake(&model, &options)?);
    let seconds = steps.done("bake", summary(&model))?;
    let bytes = model.to_bytes()?;
    file::write_whole(&args.output, &bytes)?;
    steps.done("write", format!("{}, {}", args.output.display(), DecimalBytes(bytes.len() as u64)))?;
    if args.json {
        let about = json!({ "leaves": model.leaves.len(), "model_bytes": bytes.len(), "seconds": seconds });
        output::line(output::merged(about, json!({ "impostor": model.impostor.as_ref().map(to_json) })))?;
    }
    Ok(())
}

/// Bakes the impostor of a model, with a progress bar.
///
/// # Errors
/// As [`foliage_lod::software::bake`].
pub fn bake(model: &FoliageModel, options: &BakeOptions) -> Result<Impostor> {
    let mut bars = Bars::new();
    bars.phase("baking", u64::from(options.across * options.across));
    foliage_lod::software::bake(model, options, &mut |done| bars.advance(done))
}

/// Frames of a model's impostor, in words.
pub fn summary(model: &FoliageModel) -> String {
    let Some(Impostor { lattice, frame_px, .. }) = &model.impostor else { return "no impostor".into() };
    let all = if lattice.is_whole_sphere { "from all around" } else { "from above" };
    format!("impostor of {0} x {0} frames of {frame_px} pixels, {all}", lattice.across)
}

/// An impostor's sizes.
pub fn to_json(impostor: &Impostor) -> Value {
    let Impostor { lattice, frame_px, .. } = impostor;
    json!({ "across": lattice.across, "frame_px": frame_px, "whole_sphere": lattice.is_whole_sphere })
}
