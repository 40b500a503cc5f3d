//! Models of small plants by any options, and pictures of them.

use foliage_lod::{
    Plant,
    model::FoliageModel,
    render::{
        camera::Camera,
        image::Image,
        software::{Background, DrawOptions, draw_model},
    },
    simplify::{Compensate, Quiet, SimplifyOptions, options::Criterion, raster::CpuFragments, simplify},
};
use glam::DVec3;

/// Every criterion with every rule that enlarges, with and without a cascade; one thread.
pub fn all_options(resolution: u32) -> Vec<SimplifyOptions> {
    let mut all = Vec::new();
    for criterion in [Criterion::Vmi, Criterion::Area, Criterion::Image] {
        for compensate in [Compensate::Nearest, Compensate::Silhouette, Compensate::Image, Compensate::None] {
            for cascade in [false, true] {
                let paper = SimplifyOptions::paper();
                all.push(SimplifyOptions { criterion, compensate, cascade, resolution, threads: 1, ..paper });
            }
        }
    }
    all
}

pub fn model_of(plant: &Plant, options: &SimplifyOptions) -> FoliageModel {
    simplify(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

pub const SIZE: [u32; 2] = [96, 96];
pub fn bare() -> DrawOptions {
    DrawOptions { background: Background::Transparent, ..DrawOptions::default() }
}

/// Covered pixels, partly covered ones by their share.
pub fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum()
}

/// The model at active count `n` from the side, framed.
pub fn picture(model: &FoliageModel, n: usize, fov_deg: f64) -> Image {
    let camera = Camera::framing(&model.sphere(), DVec3::new(1.0, 0.3, 2.0), fov_deg.to_radians(), 1.1);
    draw_model(model, n, &camera, SIZE, &bare()).unwrap()
}
