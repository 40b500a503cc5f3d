//! Correction of an impostor: one exponent of coverage and one factor of colours, with which
//! sprites cover as much as the plant does and are as bright, on average over views between the
//! frames.

use super::{
    Background, DrawOptions, Image,
    baker::{Baker, Texels, pages},
    frame_pages::FramePages,
    painter::{Contents, mean_color},
    sprite::PlacedImpostor,
};
use crate::{
    Camera, LookAt, Result,
    bounds::Sphere,
    draw::{
        light::{Lighting, TOWARDS_SUN, luminance},
        mips::srgb_from_linear,
        pages::Pages,
        tint::Tint,
    },
    srgb::linear_bytes,
};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::OnceLock,
};

/// Diameters in pixels at which coverage is compared, and views at each.
const COVERED_AT: [u32; 2] = [64, 32];
const COVERAGE_VIEWS: u32 = 8;
/// Views at which brightness is compared, under each of these suns.
const SUN_VIEWS: u32 = 5;
const SUNS: [Vec3; 3] = [TOWARDS_SUN, Vec3::new(-1.0, 0.4, 0.2), Vec3::new(0.3, 0.5, -1.0)];
/// Vertical field of view of these views in radians: plants that are small on screen are far away.
const VIEW_FOV_Y: f64 = 0.05;
/// Side of what they show over the plant's diameter: a sprite's soft edge reaches beyond it.
const VIEW_MARGIN: f64 = 1.1;
/// Exponents of coverage that may correct it.
const EXPONENTS: [f32; 2] = [0.25, 2.0];
/// Halvings of that range.
const HALVINGS: u32 = 7;

/// What is applied to every texel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    /// Power to which coverage is raised.
    exponent: f32,
    /// Factor of linear colours.
    gain: f32,
}

impl Correction {
    /// Corrects the texels of a frame.
    pub(super) fn apply(&self, texels: &mut Texels) {
        let linear = linear_bytes();
        for (color, _) in texels {
            if color[3] > 0 {
                let coverage = libm::powf(f32::from(color[3]) / 255.0, self.exponent);
                color[3] = ((coverage * 255.0 + 0.5) as u8).max(1);
            }
            if self.gain != 1.0 {
                color[..3].iter_mut().for_each(|byte| *byte = srgb_from_linear(linear[*byte as usize] * self.gain));
            }
        }
    }
}

/// Frames that the views of the comparison show.
pub(super) fn compared_frames(baker: &Baker<'_>) -> BTreeSet<u32> {
    let center = Vec3::from(baker.framing.center).as_dvec3();
    let around = |camera: Camera| baker.framing.lattice.around((camera.eye - center).as_vec3());
    let shown = coverage_views(&baker.sphere).into_iter().chain(sun_views(&baker.sphere)).flat_map(around);
    shown.filter(|(_, weight)| *weight > 0.0).map(|(frame, _)| frame).collect()
}

/// Finds the correction from the [`compared_frames`], which must all be among `frames`.
///
/// # Errors
/// As [`Painter::draw`](super::Painter::draw).
pub(super) fn fitted(baker: &Baker<'_>, frames: &BTreeMap<u32, &Texels>) -> Result<Correction> {
    let compared = Compared { baker, frames };
    let views = coverage_views(&baker.sphere);
    let options = bare(Lighting::default());
    let wanted = covered(&compared.plant(&views, &options)?);
    // The greater the exponent, the less is covered.
    let [mut low, mut high] = EXPONENTS;
    for _ in 0..HALVINGS {
        let exponent = 0.5 * (low + high);
        let sprites = compared.sprites(&Correction { exponent, gain: 1.0 }, &views, &options)?;
        if covered(&sprites) > wanted { low = exponent } else { high = exponent }
    }
    let even = Correction { exponent: 0.5 * (low + high), gain: 1.0 };
    let views = sun_views(&baker.sphere);
    let (mut plant, mut sprites) = (Vec::new(), Vec::new());
    for towards_sun in SUNS {
        let options = bare(Lighting { towards_sun, ..Lighting::default() });
        plant.extend(compared.plant(&views, &options)?);
        sprites.extend(compared.sprites(&even, &views, &options)?);
    }
    let [plant, sprites] = [plant, sprites].map(|images| luminance(mean_color(&images).into()));
    Ok(if sprites > 0.0 { Correction { gain: plant / sprites, ..even } } else { even })
}

/// Compares sprites of an impostor with the plant.
struct Compared<'a> {
    baker: &'a Baker<'a>,
    frames: &'a BTreeMap<u32, &'a Texels>,
}

impl Compared<'_> {
    fn plant(&self, views: &[Camera], options: &DrawOptions) -> Result<Vec<Image>> {
        let Baker { painter, list, .. } = self.baker;
        let draw = |camera: &Camera| painter.draw(list, camera, [camera.height_px; 2], options);
        views.par_iter().map(draw).collect()
    }

    fn sprites(&self, correction: &Correction, views: &[Camera], options: &DrawOptions) -> Result<Vec<Image>> {
        let Baker { painter, list, framing, .. } = self.baker;
        let corrected = |(&frame, texels): (&u32, &&Texels)| {
            let mut texels = Texels::clone(texels);
            correction.apply(&mut texels);
            (frame, pages(framing.frame_px, &texels))
        };
        let made: Vec<(u32, Pages)> = self.frames.par_iter().map(corrected).collect();
        let mut frames: Vec<OnceLock<Pages>> = (0..framing.lattice.frames()).map(|_| OnceLock::new()).collect();
        made.into_iter().for_each(|(frame, pages)| frames[frame as usize] = pages.into());
        let placed = PlacedImpostor {
            framing: *framing,
            pages: FramePages::Each(&frames),
            crown: list.crown,
            world_from_plant: DAffine3::IDENTITY,
            sway: None,
            share: 1.0,
            tint: Tint::NONE,
            seed: 0,
        };
        let draw = |camera: &Camera| {
            let contents = Contents { impostors: &[placed], ..Contents::default() };
            painter.draw_all(&contents, camera, [camera.height_px; 2], options)
        };
        views.par_iter().map(draw).collect()
    }
}

fn bare(lighting: Lighting) -> DrawOptions {
    DrawOptions { background: Background::Transparent, lighting, ..DrawOptions::default() }
}

/// Sum of the coverage of all pixels.
fn covered(images: &[Image]) -> u64 {
    images.iter().flat_map(|image| image.rgba.iter().skip(3).step_by(4)).map(|&alpha| u64::from(alpha)).sum()
}

fn coverage_views(sphere: &Sphere) -> Vec<Camera> {
    COVERED_AT.into_iter().flat_map(|side| views(sphere, side, COVERAGE_VIEWS)).collect()
}

fn sun_views(sphere: &Sphere) -> Vec<Camera> {
    views(sphere, COVERED_AT[0], SUN_VIEWS).collect()
}

/// So many views between the frames, all around and from level to steep.
fn views(sphere: &Sphere, side_px: u32, count: u32) -> impl Iterator<Item = Camera> {
    (0..count).map(move |i| {
        let turn = 0.37 + f64::from(i) * std::f64::consts::TAU / f64::from(count);
        let height = 0.07 + 0.88 / f64::from(count) * f64::from(i * 3 % count);
        let direction = DVec3::new(libm::sin(turn), height, libm::cos(turn));
        LookAt::framing(sphere, direction, VIEW_FOV_Y, VIEW_MARGIN).camera(side_px)
    })
}
