//! `foliage-lod report --paper`: repeats section 6 of the paper on this machine.

use crate::{
    args,
    failure::Failure,
    output::{self, Steps},
    progress::{Bars, spinning},
};
use foliage_lod::{
    Error, FoliageModel,
    file::{check_writable, write_whole},
    gpu::{GpuDevice, GpuOptions, guarded},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, SimplifyOptions, simplify},
    software::Image,
};
use foliage_lod_cli::report::paper::{PaperReport, Row};
use indicatif::HumanCount;
use serde_json::{Value, json};
use std::path::Path;

/// The paper's species, the oak first.
const SPECIES: [&str; 3] = ["english-oak", "carya-illinoinensis", "betula-populifolia"];
/// Gap between the pictures of a sheet in pixels.
const GAP_PX: u32 = 8;

/// Runs the subcommand.
pub fn run(args: &args::Report) -> Result<(), Failure> {
    let folder = &args.output;
    let gpu = GpuDevice::new(&GpuOptions::from_env()).map_err(needs_adapter)?;
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    check_writable(folder.join("paper.csv"))?;
    let mut steps = Steps::new(args.json);
    let models = SPECIES.iter().map(|name| model(name, args, &mut steps)).collect::<Result<Vec<_>, Failure>>()?;
    let report = spinning("measuring", || guarded(|| PaperReport::measure(&gpu, &models, args.size, |_| {})))?;
    steps.done("measure", format!("{} rows on {}", report.rows.len(), gpu.adapter_name()))?;
    write(&report, folder)?;
    steps.done("write", format!("paper.csv, figure-3 to figure-7 in {}", folder.display()))?;
    if args.json {
        let rows: Vec<Value> = report.rows.iter().map(json_row).collect();
        output::line(json!({ "adapter": gpu.adapter_name(), "rows": rows, "seconds": steps.total_seconds() }))?;
    }
    Ok(())
}

fn model(name: &str, args: &args::Report, steps: &mut Steps) -> Result<FoliageModel, Failure> {
    let species = Species::embedded(name)?;
    let plant = spinning("growing", || grow(&species, &GrowOptions { leaves: args.leaves, ..GrowOptions::default() }))?;
    let options = SimplifyOptions::paper();
    let model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Bars::new())?.model;
    steps.done("simplify", format!("{name}: {} leaves", HumanCount(model.leaves.len() as u64)))?;
    Ok(model)
}

fn write(report: &PaperReport, folder: &Path) -> foliage_lod::Result<()> {
    write_whole(folder.join("paper.csv"), report.csv().as_bytes())?;
    for (name, svg) in report.plots()? {
        write_whole(folder.join(name), svg.as_bytes())?;
    }
    Image::side_by_side(&report.shares, GAP_PX).write_png(folder.join("figure-6.png"))?;
    report.nine.write_png(folder.join("figure-7.png"))
}

fn json_row(row: &Row) -> Value {
    // JSON has no NaN: numbers that were not measured become null.
    json!({
        "figure": row.figure,
        "plant": row.species,
        "method": row.method,
        "distance_radii": row.distance_radii,
        "trees": row.trees,
        "leaves": row.leaves,
        "frame_ms": row.frame_ms,
        "extraction_us": row.extraction_us,
    })
}

/// Replaces the fix: frame times need a device, but a software one is enough.
fn needs_adapter(error: Error) -> Error {
    match error {
        Error::Gpu { reason, .. } => Error::Gpu {
            reason,
            fix: "the report needs a GPU or a software Vulkan driver such as Mesa's lavapipe".into(),
        },
        other => other,
    }
}
