//! `foliage-lod` without arguments: from a species to pictures in under a minute.

use crate::{args::Raster, failure::Failure, output::Steps, pictures, progress::spinning, raster::simplified};
use foliage_lod::{
    Error, FoliageModel,
    file::{check_writable, write_whole},
    grow::{GrowOptions, Species, grow},
    plant::TRIM_CORNERS,
    simplify::{Simplified, SimplifyOptions},
};
use indicatif::{DecimalBytes, HumanCount};
use std::path::Path;

/// Folder that everything is written to.
const FOLDER: &str = "foliage-lod-out";
/// Species of the tree.
const SPECIES: &str = "english-oak";
/// Pictures, each with the distance, in radii of the plant, that sets its level of detail.
const PICTURES: [(&str, f32); 3] = [("near.png", 3.0), ("mid.png", 31.0), ("far.png", 50.0)];
/// Width and height of the pictures.
const PICTURE_SIDE_PX: u32 = 768;

/// Runs the quick start.
pub fn run() -> Result<(), Failure> {
    let folder = Path::new(FOLDER);
    let model_path = folder.join(SPECIES).with_extension("vds");
    prepare(folder, &model_path)?;
    let mut steps = Steps::new(false);
    let mut plant = spinning("growing", || grow(&Species::embedded(SPECIES)?, &GrowOptions::default()))?;
    let [leaves, wood] = [plant.leaves.len(), plant.wood.triangles()].map(|count| HumanCount(count as u64));
    steps.done("grow", format!("{SPECIES}: {leaves} leaves, {wood} wood triangles"))?;
    plant.trim(TRIM_CORNERS)?;
    let options = SimplifyOptions::default();
    let (Simplified { mut model, fragments, .. }, rasteriser) = simplified(Raster::Auto, &plant, &options)?;
    let views = format!("{} views of {1} x {1}", options.views, options.resolution);
    steps.done("simplify", format!("{views} on {rasteriser}, {} fragments", HumanCount(fragments)))?;
    model.quantize();
    model.order_wood();
    let bytes = model.to_bytes()?;
    write_whole(&model_path, &bytes)?;
    steps.done("write", format!("{}, {}", model_path.display(), DecimalBytes(bytes.len() as u64)))?;
    draw(&model, folder, &mut steps)
}

/// Creates the folder and checks that it is writable.
fn prepare(folder: &Path, model_path: &Path) -> foliage_lod::Result<()> {
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    check_writable(model_path)
}

fn draw(model: &FoliageModel, folder: &Path, steps: &mut Steps) -> Result<(), Failure> {
    for (name, distance) in PICTURES {
        let n = pictures::count_at(model, distance);
        let path = folder.join(name);
        let image = spinning("drawing", || pictures::draw_with_inset(model, n, distance, PICTURE_SIDE_PX))?;
        image.write_png(&path)?;
        let percent = 100.0 * f64::from(n) / model.leaves.len() as f64;
        let result = format!(
            "{}: {} leaves ({percent:.0} %), for a distance of {distance} radii",
            path.display(),
            HumanCount(n.into())
        );
        steps.done("draw", result)?;
    }
    Ok(())
}
