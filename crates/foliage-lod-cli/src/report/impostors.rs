//! Small plants: what a prefix of the leaves, an impostor, both at once and two older ways cost,
//! and how far each is from every leaf, against the plant's diameter in pixels.
//!
//! All ways are drawn by the same renderer from the same held-out views
//! ([`far_cameras`](measure::far_cameras)). The older ways are three levels of detail, made of the
//! model's own prefixes, and crossed cards with the impostor's pictures. Colours
//! of the cards are multiplied by one factor, as the impostor's are, so that they are as bright as
//! the plant.
//!
//! Limits: one model and one light; frames of four plants, in which fixed costs count as well.

use super::{far::encoded, frames::median, study::FRONT};
use foliage_lod::{
    Camera, Error, FoliageModel, FoliageRenderer, Instance, Look, LookAt, Plant, Result,
    bounds::Sphere,
    draw::ModelId,
    export::far_cards,
    extract::{Blend, Far, LodPolicy, REFERENCE_FOV_Y, Sight, fewest_leaves, leaf_count},
    gpu::{GpuDevice, Offscreen, TARGET, guarded},
    measure::{self, Comparison, Quality},
    model::scaled,
    software::{DrawList, Image, SoftwareRenderer, mean_color},
    stochastic::shuffled,
};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use std::time::Instant;

/// Diameters in pixels.
pub const DIAMETERS: [u32; 5] = [8, 16, 32, 64, 128];
/// Fractions of the leaves of the levels of detail.
const LEVELS: [f64; 3] = [1.0, 0.3, 0.05];
/// Share of the impostor where both are drawn: the middle of the band of a hand-over.
const MIDDLE: f32 = 0.5;
/// Diameter at which the brightness of cards is compared.
const CARDS_PX: u32 = 64;
/// Plants along each side of a timed frame, half of what it shows over the distance, and the number
/// of times that it is drawn.
const ROW: u32 = 2;
const TIMED_SLOPE: f64 = 0.1;
pub(super) const ROUNDS: usize = 3;

/// A way to draw a small plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Every leaf: the reference.
    Full,
    /// As many leaves as the default policy draws.
    Prefix,
    /// The fewest leaves with at most the impostor's error.
    EqualPrefix,
    /// The impostor.
    Impostor,
    /// Prefix and impostor, each in half of the samples.
    Both,
    /// The coarsest of three levels with no fewer leaves than the policy draws.
    Levels,
    /// Crossed cards.
    Cards,
}

/// Measurements of one way at one size.
#[derive(Debug, Clone, PartialEq)]
pub struct SmallRow {
    /// The way.
    pub way: Way,
    /// Diameter of the plant's bounding sphere in pixels.
    pub diameter_px: u32,
    /// Leaves drawn; cards count as leaves.
    pub leaves: u32,
    /// Mean quality over the held-out views, against every leaf.
    pub quality: Quality,
    /// Largest difference of a channel of the mean colour from that of every leaf, on the sRGB
    /// scale of 0 to 255.
    pub color: f64,
    /// RMSE between views one degree apart.
    pub change: f64,
    /// Median time of a frame of four plants; NaN if not measured.
    pub frame_seconds: f64,
    /// Bytes on the GPU of everything that the way needs of the plant at any size, with the mip
    /// levels of its textures; `None` without a device.
    pub bytes: Option<u64>,
    /// The plant from the front.
    pub image: Image,
}

impl Way {
    /// All ways.
    pub const ALL: [Self; 7] =
        [Self::Full, Self::Prefix, Self::EqualPrefix, Self::Impostor, Self::Both, Self::Levels, Self::Cards];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "every leaf",
            Self::Prefix => "prefix",
            Self::EqualPrefix => "prefix, error of the impostor",
            Self::Impostor => "impostor",
            Self::Both => "both",
            Self::Levels => "three levels",
            Self::Cards => "crossed cards",
        }
    }
}

/// Measures a model that has an impostor, at all diameters. `check` can return an error to stop.
///
/// # Errors
/// [`Error::InvalidOption`] for a model without an impostor, errors from the software renderer and
/// from `check`.
pub fn measure(
    model: &FoliageModel,
    gpu: Option<&GpuDevice>,
    check: &mut dyn FnMut() -> Result<()>,
) -> Result<Vec<SmallRow>> {
    let Some(impostor) = &model.impostor else {
        return Err(Error::invalid("impostor", "none", "a model with one"));
    };
    let levels: Vec<FoliageModel> =
        LEVELS.iter().map(|&level| shuffled(&at_level(model, level), 0)).collect::<Result<_>>()?;
    let mut cards = far_cards(model, impostor)?;
    let gain = gain(model, &shuffled(&cards, 0)?)?;
    cards.materials.iter_mut().for_each(|material| material.base_color = [gain, gain, gain, 1.0]);
    let cards = shuffled(&cards, 0)?;
    let models: Vec<&FoliageModel> = [model].into_iter().chain(&levels).chain([&cards]).collect();
    let drawer = Drawer::new(&models)?;
    let mut timer = gpu.and_then(|gpu| guarded(|| Timer::new(gpu, &models)).ok());
    let mut rows = Vec::new();
    for diameter_px in DIAMETERS {
        check()?;
        let full = drawer.pictures(&drawn(Way::Full, model, diameter_px), diameter_px, 0.0)?;
        let rmse = drawer.compared(&drawn(Way::Impostor, model, diameter_px), &full, diameter_px)?.quality().rmse;
        let drawn: Vec<Shown> = Way::ALL
            .into_iter()
            .map(|way| match way {
                Way::EqualPrefix => drawer.closest(rmse, &full, diameter_px),
                way => Ok(drawn(way, model, diameter_px)),
            })
            .collect::<Result<_>>()?;
        let seconds = match timer.as_mut().map(|timer| guarded(|| timer.medians(&drawn, diameter_px))) {
            Some(Err(Error::Gpu { .. } | Error::TooLarge { .. })) => {
                timer = None;
                vec![f64::NAN; drawn.len()]
            }
            Some(seconds) => seconds?,
            None => vec![f64::NAN; drawn.len()],
        };
        for ((way, shown), frame_seconds) in Way::ALL.into_iter().zip(&drawn).zip(seconds) {
            let pictures = drawer.pictures(shown, diameter_px, 0.0)?;
            let turned = drawer.pictures(shown, diameter_px, 1.0_f64.to_radians())?;
            rows.push(SmallRow {
                way,
                diameter_px,
                leaves: if shown.share == Some(1.0) {
                    0
                } else {
                    shown.count.min(models[shown.model].leaves.len() as u32)
                },
                quality: compared(&full, &pictures)?.quality(),
                color: color_error(&full, &pictures),
                change: compared(&pictures, &turned)?.quality().rmse,
                frame_seconds,
                bytes: timer.as_ref().map(|timer| bytes(way, &timer.bytes, impostor.gpu_bytes())),
                image: drawer.front(shown, diameter_px)?,
            });
        }
    }
    Ok(rows)
}

/// What is drawn of a plant.
#[derive(Clone, Copy)]
struct Shown {
    /// Index into the models: the plant's own, the levels', the cards'.
    model: usize,
    /// Leaves drawn.
    count: u32,
    /// Share of the impostor; `None` for leaves alone.
    share: Option<f32>,
}

/// What a way draws at a size. The closest prefix needs pictures: it counts as every leaf here.
fn drawn(way: Way, model: &FoliageModel, diameter_px: u32) -> Shown {
    let leaves = model.leaves.len() as u32;
    let policy = policy_count(model, diameter_px);
    let own = |count, share| Shown { model: 0, count, share };
    match way {
        Way::Full | Way::EqualPrefix => own(leaves, None),
        Way::Prefix => own(policy, None),
        Way::Impostor => own(policy, Some(1.0)),
        Way::Both => own(policy, Some(MIDDLE)),
        Way::Levels => {
            let counts = LEVELS.map(|level| count(level, leaves));
            let level = counts.iter().rposition(|&count| count >= policy).unwrap_or(0);
            Shown { model: 1 + level, count: counts[level], share: None }
        }
        Way::Cards => Shown { model: 1 + LEVELS.len(), count: u32::MAX, share: None },
    }
}

fn count(level: f64, leaves: u32) -> u32 {
    leaf_count(level as f32, leaves, 1)
}

/// Leaves that the default policy draws of a plant of this diameter, on a screen of 1080 rows.
pub(super) fn policy_count(model: &FoliageModel, diameter_px: u32) -> u32 {
    let height_px = 1080.0;
    let slope = f64::from(REFERENCE_FOV_Y / 2.0).tan() * f64::from(diameter_px) / f64::from(height_px);
    let radius = model.sphere().radius as f32;
    let sight = Sight { distance: radius / slope.atan().sin() as f32, radius, fov_y: REFERENCE_FOV_Y, height_px };
    let leaves = model.leaves.len() as u32;
    leaf_count(Blend::default().lod(&sight), leaves, fewest_leaves(leaves))
}

/// A prefix of a model as a plant of its own: a level of detail.
fn at_level(model: &FoliageModel, level: f64) -> Plant {
    let leaves = count(level, model.leaves.len() as u32) as usize;
    let mut plant = Plant {
        name: model.name.clone(),
        wood: model.wood.clone(),
        materials: model.materials.clone(),
        textures: model.textures.clone(),
        ..Plant::default()
    };
    let mut scales = vec![1.0; leaves];
    for part in DrawList::of_model(model, leaves).parts {
        part.leaf.into_iter().for_each(|leaf| scales[leaf as usize] = part.scale);
    }
    for (leaf, scale) in model.leaves.iter().zip(scales) {
        let [first, end] = leaf.vertices.map(|vertex| vertex as usize);
        let mut vertices = model.vertices[first..end].to_vec();
        vertices.iter_mut().for_each(|vertex| vertex.position = scaled(vertex.position, leaf.pivot, scale));
        let indices = &model.indices[leaf.indices[0] as usize..leaf.indices[1] as usize];
        let own: Vec<u32> = indices.iter().map(|index| index - leaf.vertices[0]).collect();
        plant.push_leaf(&vertices, &own, leaf.pivot, leaf.material);
    }
    plant
}

/// Luminance of a model over that of cards.
fn gain(model: &FoliageModel, cards: &FoliageModel) -> Result<f32> {
    let drawer = Drawer::new(&[model, cards])?;
    let whole = |model, count| Shown { model, count, share: None };
    let [plant, cards] = [whole(0, u32::MAX), whole(1, u32::MAX)]
        .map(|shown| drawer.pictures(&shown, CARDS_PX, 0.0).map(|images| mean_color(&images)));
    let light = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    Ok(light(plant?) / light(cards?).max(f32::MIN_POSITIVE))
}

/// The look of all pictures: the shares of plants decide what hands over.
fn look() -> Look {
    Look { far: Some(Far { at_px: 0.0, ..Far::default() }), ..Look::default() }
}

fn instance(ids: &[ModelId], shown: &Shown, place: DAffine3) -> Instance {
    Instance { far: shown.share, ..Instance::new(ids[shown.model], place, shown.count as f32) }
}

/// Draws pictures on the CPU.
struct Drawer<'a> {
    renderer: SoftwareRenderer<'a>,
    ids: Vec<ModelId>,
    leaves: u32,
    sphere: Sphere,
    front: LookAt,
}

impl<'a> Drawer<'a> {
    /// The first model is the plant.
    fn new(models: &[&'a FoliageModel]) -> Result<Self> {
        let mut renderer = SoftwareRenderer::new(look())?;
        let ids = models.iter().map(|model| renderer.add_model(model)).collect::<Result<Vec<_>>>()?;
        let sphere = models[0].sphere();
        let front = LookAt::framing(&sphere, FRONT, measure::FOV_Y, 1.0);
        Ok(Self { renderer, ids, leaves: models[0].leaves.len() as u32, sphere, front })
    }

    /// Cut-outs from the held-out views, each turned about the vertical.
    fn pictures(&self, shown: &Shown, diameter_px: u32, turn: f64) -> Result<Vec<Image>> {
        let center = self.sphere.center();
        let turn =
            DAffine3::from_translation(center) * DAffine3::from_rotation_y(turn) * DAffine3::from_translation(-center);
        let plants = [instance(&self.ids, shown, turn)];
        let picture = |camera: &Camera| Ok(self.renderer.cutout(*camera, &plants, [camera.height_px; 2])?.image);
        measure::far_cameras(&self.sphere, diameter_px).par_iter().map(picture).collect()
    }

    fn compared(&self, shown: &Shown, full: &[Image], diameter_px: u32) -> Result<Comparison> {
        compared(full, &self.pictures(shown, diameter_px, 0.0)?)
    }

    /// The prefix of fewest leaves with at most this error, by bisection.
    fn closest(&self, rmse: f64, full: &[Image], diameter_px: u32) -> Result<Shown> {
        let shown = |count| Shown { model: 0, count, share: None };
        let (mut too_few, mut enough) = (0, self.leaves);
        while too_few + 1 < enough {
            let middle = (too_few + enough) / 2;
            let is_close = self.compared(&shown(middle), full, diameter_px)?.quality().rmse <= rmse;
            if is_close { enough = middle } else { too_few = middle }
        }
        Ok(shown(enough))
    }

    fn front(&self, shown: &Shown, side: u32) -> Result<Image> {
        let plants = [instance(&self.ids, shown, DAffine3::IDENTITY)];
        Ok(self.renderer.draw(self.front.camera(side), &plants, [side; 2])?.image)
    }
}

pub(super) fn compared(full: &[Image], others: &[Image]) -> Result<Comparison> {
    let pairs = full.par_iter().zip(others);
    let sums: Vec<Comparison> = pairs.map(|(full, other)| Comparison::of(full, other)).collect::<Result<_>>()?;
    Ok(sums.into_iter().fold(Comparison::default(), Comparison::plus))
}

fn color_error(full: &[Image], others: &[Image]) -> f64 {
    let [full, other] = [full, others].map(|images| mean_color(images).map(|channel| encoded(f64::from(channel))));
    full.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Times frames of four plants on the GPU.
struct Timer<'a> {
    gpu: &'a GpuDevice,
    foliage: FoliageRenderer,
    ids: Vec<ModelId>,
    sphere: Sphere,
    /// Bytes of each model and its textures, without impostors.
    bytes: Vec<u64>,
}

impl<'a> Timer<'a> {
    fn new(gpu: &'a GpuDevice, models: &[&FoliageModel]) -> Result<Self> {
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look())?;
        let (mut ids, mut bytes) = (Vec::new(), Vec::new());
        let mut before = 0;
        for model in models {
            ids.push(foliage.add_model(gpu.device(), gpu.queue(), model)?);
            let all = foliage.diagnostics().model_bytes.iter().sum();
            bytes.push(all - before + texture_bytes(model)?);
            before = all;
        }
        Ok(Self { gpu, foliage, ids, sphere: models[0].sphere(), bytes })
    }

    /// Median time of a frame for each of what is drawn; they are drawn in turn.
    fn medians(&mut self, drawn: &[Shown], diameter_px: u32) -> Result<Vec<f64>> {
        let target = Offscreen::new(self.gpu, [ROW * diameter_px; 2])?;
        let (camera, places) = four(&self.sphere, diameter_px);
        let mut times = vec![Vec::new(); drawn.len()];
        for round in 0..=ROUNDS {
            for (shown, times) in drawn.iter().zip(&mut times) {
                let plants: Vec<Instance> = places.iter().map(|&place| instance(&self.ids, shown, place)).collect();
                let started = Instant::now();
                let (device, queue) = (self.gpu.device(), self.gpu.queue());
                self.foliage.prepare(device, queue, camera, &plants)?;
                target.draw(&self.foliage)?;
                if round > 0 {
                    times.push(started.elapsed().as_secs_f64());
                }
            }
        }
        Ok(times.iter_mut().map(|times| median(times)).collect())
    }
}

/// A square picture of four plants side by side, each of this diameter: its camera, as many pixels
/// high, and their places.
pub(super) fn four(sphere: &Sphere, diameter_px: u32) -> (Camera, [DAffine3; 4]) {
    let away = f64::from(ROW) * sphere.radius / TIMED_SLOPE;
    let camera = LookAt {
        eye: sphere.center() + DVec3::Z * away,
        fov_y_radians: 2.0 * TIMED_SLOPE.atan(),
        ..LookAt::framing(sphere, DVec3::Z, 1.0, 1.0)
    };
    let at = |i: u32| (2.0 * f64::from(i) + 1.0 - f64::from(ROW)) * sphere.radius;
    let place = |i: u32| DAffine3::from_translation(DVec3::new(at(i % ROW), at(i / ROW), 0.0));
    (camera.camera(ROW * diameter_px), [0, 1, 2, 3].map(place))
}

/// Bytes that a way needs, from those of all models.
fn bytes(way: Way, models: &[u64], impostor: u64) -> u64 {
    match way {
        Way::Full | Way::Prefix | Way::EqualPrefix => models[0],
        Way::Impostor => impostor,
        Way::Both => models[0] + impostor,
        Way::Levels => models[1..=LEVELS.len()].iter().sum(),
        Way::Cards => models[1 + LEVELS.len()],
    }
}

/// Bytes of a model's textures with their mip levels, a third more than without.
fn texture_bytes(model: &FoliageModel) -> Result<u64> {
    let sizes = model.textures.iter().map(|texture| Ok(texture.decode()?.rgba.len() as u64));
    Ok(sizes.sum::<Result<u64>>()? * 4 / 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foliage_lod::{
        leaf::Vertex,
        material::Material,
        software::{BakeOptions, bake},
    };
    use glam::Vec3;

    /// A ball of 32 leaves, one for each patch of its surface.
    fn ball() -> FoliageModel {
        let material = Material { base_color: [0.2, 0.5, 0.1, 1.0], double_sided: true, ..Material::default() };
        let mut plant = Plant { name: "ball".into(), materials: vec![material], ..Plant::default() };
        let at = |turn: u32, height: u32| {
            let (turn, height) =
                (turn as f32 * std::f32::consts::TAU / 48.0, height as f32 * std::f32::consts::PI / 24.0);
            Vec3::new(height.sin() * turn.cos(), height.cos(), height.sin() * turn.sin())
        };
        for patch in 0..32 {
            let [turn, height] = [patch % 8 * 6, patch / 8 * 6];
            let places = (0..49).map(|i| at(turn + i % 7, height + i / 7));
            let vertex =
                |at: Vec3| Vertex { position: at.to_array(), normal: at.to_array(), uv: [0.0; 2], color: [1.0; 4] };
            let vertices: Vec<Vertex> = places.map(vertex).collect();
            let squares = (0..36).map(|i| i / 6 * 7 + i % 6);
            let indices: Vec<u32> = squares.flat_map(|i| [i, i + 1, i + 8, i, i + 8, i + 7]).collect();
            plant.push_leaf(&vertices, &indices, vertices[24].position, 0);
        }
        let mut model = shuffled(&plant, 1).unwrap();
        let sizes = BakeOptions { across: 6, frame_px: 32, is_whole_sphere: false };
        model.impostor = Some(bake(&model, &sizes, &mut |_| true).unwrap());
        model
    }

    #[test]
    fn the_impostor_of_a_ball_covers_what_the_ball_does_and_hardly_changes_with_the_view() {
        let model = ball();
        let mut checks = 0;
        let rows = measure(&model, None, &mut || {
            checks += 1;
            Ok(())
        });
        let rows = rows.unwrap();
        assert_eq!((checks, rows.len()), (DIAMETERS.len(), Way::ALL.len() * DIAMETERS.len()));
        let row = |way: Way, px: u32| rows.iter().find(|row| row.way == way && row.diameter_px == px).unwrap();
        for px in DIAMETERS {
            let full = row(Way::Full, px);
            assert_eq!([full.quality.rmse, full.quality.coverage, full.color], [0.0; 3]);
            assert_eq!((full.quality.ssim, full.leaves), (1.0, 32));
            let impostor = row(Way::Impostor, px);
            assert_eq!(impostor.leaves, 0);
            // The soft rim of a small sprite is cut off at its outline.
            let most = if px < 32 { 0.06 } else { 0.03 };
            let off = impostor.quality.coverage;
            assert!(off.abs() < most && impostor.color < 6.0, "{px} px: {off}, {}", impostor.color);
            // Samples of a sprite's pixel are spread at random.
            assert!(impostor.change < if px < 32 { 12.0 } else { 4.0 }, "{px} px: {}", impostor.change);
            assert!(row(Way::EqualPrefix, px).quality.rmse <= impostor.quality.rmse);
            let [both, prefix] = [Way::Both, Way::Prefix].map(|way| row(way, px).quality);
            let between = 0.5 * (prefix.coverage + impostor.quality.coverage);
            assert!((both.coverage - between).abs() < 0.06 && both.rmse < prefix.rmse, "{px} px: {both:?} {prefix:?}");
            assert!(rows.iter().all(|row| row.frame_seconds.is_nan() && row.bytes.is_none()));
        }
        // Cards that are seen at an angle are narrower than a ball.
        let cards = row(Way::Cards, 128).quality;
        assert!(
            (-0.2..0.0).contains(&cards.coverage) && cards.rmse > row(Way::Impostor, 128).quality.rmse,
            "{cards:?}"
        );
    }

    #[test]
    fn a_level_is_the_prefix_as_it_is_drawn_and_a_way_needs_what_it_draws() {
        let mut model = ball();
        model.leaves[31].scale = 2.0;
        let target = model.leaves[31].leaf_to_collapse as usize;
        let plant = at_level(&model, 31.0 / 32.0);
        assert_eq!(plant.leaves.len(), 31);
        plant.validate().unwrap();
        let reach = |vertices: &[Vertex], pivot: [f32; 3], own: [u32; 2]| {
            let own = &vertices[own[0] as usize..own[1] as usize];
            own.iter().map(|vertex| Vec3::from(vertex.position).distance(pivot.into())).fold(0.0, f32::max)
        };
        let [before, after] = [
            reach(&model.vertices, model.leaves[target].pivot, model.leaves[target].vertices),
            reach(&plant.vertices, plant.leaves[target].pivot, plant.leaves[target].vertices),
        ];
        assert!((after / before - 2.0).abs() < 1e-4, "{before} {after}");
        let needed = Way::ALL.map(|way| bytes(way, &[1000, 1, 10, 100, 7], 50));
        assert_eq!(needed, [1000, 1000, 1000, 50, 1050, 111, 7]);
    }

    #[test]
    fn a_model_without_an_impostor_is_refused() {
        let model = FoliageModel { impostor: None, ..ball() };
        assert!(measure(&model, None, &mut || Ok(())).is_err());
    }
}
