//! Models of small plants with any options, and pictures of them.

use foliage_lod::{
    FoliageModel, LookAt, Plant,
    simplify::{Compensate, CpuFragments, Criterion, Quiet, SimplifyOptions, simplify},
    software::{Background, DrawOptions, Image, draw_model},
};
use glam::DVec3;

/// Every criterion with every compensation rule, with and without a cascade, on one thread.
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

/// Number of covered pixels; partly covered pixels count as fractions.
pub fn covered_px(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum()
}

/// A picture of the model at active count `n`, framed from the side.
pub fn picture(model: &FoliageModel, n: usize, fov_deg: f64) -> Image {
    let camera = LookAt::framing(&model.sphere(), DVec3::new(1.0, 0.3, 2.0), fov_deg.to_radians(), 1.1);
    draw_model(model, n, &camera.camera(SIZE[1]), SIZE, &bare()).unwrap()
}
