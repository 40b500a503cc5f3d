//! Savings of a scene's level of detail and costs of its effects: frame time, memory and simulation
//! counts.
//!
//! All cases are rendered in turn, frame by frame, so that each is timed under the same conditions.

use super::frames::median;
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Instance, Look, Result,
    draw::ModelId,
    effects::{Counts, Effects},
    gpu::{GpuDevice, MOTION, Offscreen, TARGET},
    software::Image,
    terrain::Terrain,
};
use glam::DAffine3;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Motion, in pixels per frame, that is shown fully saturated.
const FULL_PX: f32 = 4.0;
/// Time after which no further round of a shot is started.
const LONGEST_ROUNDS: Duration = Duration::from_secs(10);

/// A plant in a frame.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Index into the models.
    pub model: usize,
    /// Transform from the plant to the world.
    pub world_from_plant: DAffine3,
    /// Active count.
    pub active: f32,
    /// Least share of the plant that its impostor takes; `None` for leaves at any size.
    pub far: Option<f32>,
    /// Tells plants apart.
    pub seed: u32,
    /// Factor of its lit colour.
    pub tint: [f32; 3],
}

/// One frame, both with every leaf and at its level of detail.
pub struct Shot {
    /// Camera and time.
    pub frame: Frame,
    /// Plants in view: with every leaf, and at their level of detail.
    pub seen: [Vec<Seen>; 2],
    /// Plants that cast shadows, in the same two forms.
    pub casters: [Vec<Seen>; 2],
}

/// A scene to measure.
pub struct Scene<'a> {
    /// Its models.
    pub models: &'a [FoliageModel],
    /// Its ground with heights or colours.
    pub terrain: Option<&'a Arc<Terrain>>,
    /// Its frames.
    pub shots: &'a [Shot],
}

/// A configuration to measure.
pub struct Case {
    /// Name in tables.
    pub name: String,
    /// Effects, lighting and ground.
    pub look: Look,
    /// Whether plants are drawn at their level of detail; otherwise with every leaf.
    pub has_lod: bool,
    /// Whether small plants are drawn as impostors.
    pub has_far: bool,
    /// Whether motion vectors are rendered; they replace the picture.
    pub has_motion: bool,
}

/// Cost of a case.
pub struct Cost {
    /// The case's name.
    pub name: String,
    /// Median over the shots of the median frame time.
    pub frame_seconds: f64,
    /// Median over the shots of the frame time relative to the first case.
    pub ratio: f64,
    /// Leaves drawn, mean over the shots.
    pub leaves: u64,
    /// Wood triangles drawn, mean over the shots.
    pub wood_triangles: u64,
    /// Number of plants in view, mean over the shots.
    pub plants: u64,
    /// Bytes of the resources that only effects need, including the motion vector targets.
    pub effect_bytes: u64,
    /// Simulation counts in the first shot.
    pub effects: Counts,
    /// Picture of the first shot.
    pub image: Image,
}

/// The cases: no effects with every leaf; no effects at the level of detail; each enabled effect
/// alone; all of them, if there are several; and motion vectors. With impostors, also without them
/// and without effects, and with all of these.
pub fn cases(look: &Look) -> Vec<Case> {
    let with = |effects: Effects| Look { effects, ..*look };
    let (none, on) = (Effects::default(), look.effects);
    let case = |name: &str, effects: Effects| Case {
        name: name.into(),
        look: with(effects),
        has_lod: true,
        has_far: look.far.is_some(),
        has_motion: false,
    };
    let mut cases = vec![Case { has_lod: false, ..case("every leaf, no effects", none) }, case("no effects", none)];
    cases.extend(on.each().map(|(name, alone)| case(name, alone)));
    let has_several = cases.len() > 3;
    if has_several {
        cases.push(case("all effects", on));
    }
    if look.far.is_some() {
        cases.push(Case { has_far: false, ..case("no effects, no impostors", none) });
        if has_several {
            cases.push(Case { has_far: false, ..case("all effects, no impostors", on) });
        }
    }
    cases.push(Case { has_motion: true, ..case("motion vectors", none) });
    cases
}

/// Renders every case in every shot, up to `rounds` times, after one warm-up frame per case.
/// `advance` receives the progress, 0 to 1, and can return an error to stop.
///
/// # Errors
/// Errors from the device, from [`FoliageRenderer::add_model`], from
/// [`FoliageRenderer::set_terrain`] and from `advance`.
pub fn measure(
    gpu: &GpuDevice,
    scene: &Scene<'_>,
    cases: &[Case],
    size: [u32; 2],
    rounds: usize,
    mut advance: impl FnMut(f64) -> Result<()>,
) -> Result<Vec<Cost>> {
    let shots = scene.shots;
    let Some(opening) = shots.first().filter(|_| !cases.is_empty()) else { return Ok(Vec::new()) };
    let target = Offscreen::new(gpu, size)?;
    let mut drawers: Vec<Drawer<'_>> = cases.iter().map(|case| Drawer::new(gpu, scene, case)).collect::<Result<_>>()?;
    let mut costs: Vec<Cost> = Vec::new();
    for drawer in &mut drawers {
        costs.push(drawer.first_cost(gpu, &target, opening)?);
    }
    let total = (shots.len() * cases.len()) as f64;
    let mut times = vec![Vec::new(); cases.len()];
    for (number, shot) in shots.iter().enumerate() {
        let mut of_shot = vec![Vec::new(); cases.len()];
        let started = Instant::now();
        for round in 0..rounds.max(1) {
            if round > 0 && started.elapsed() > LONGEST_ROUNDS {
                break;
            }
            for (drawer, times) in drawers.iter_mut().zip(&mut of_shot) {
                times.push(drawer.time(gpu, &target, shot)?);
            }
        }
        for (case, drawer) in drawers.iter_mut().enumerate() {
            times[case].push(median(&mut of_shot[case]));
            let prepared = drawer.prepare(gpu, shot)?;
            costs[case].leaves += prepared.leaves;
            costs[case].wood_triangles += prepared.wood_triangles;
            costs[case].plants += u64::from(prepared.instances);
        }
        advance(((number + 1) * cases.len()) as f64 / total)?;
    }
    let first = times[0].clone();
    for (cost, times) in costs.iter_mut().zip(&times) {
        let mut ratios: Vec<f64> = times.iter().zip(&first).map(|(time, first)| time / first).collect();
        for sum in [&mut cost.leaves, &mut cost.wood_triangles, &mut cost.plants] {
            *sum /= shots.len() as u64;
        }
        (cost.ratio, cost.frame_seconds) = (median(&mut ratios), median(&mut times.clone()));
    }
    Ok(costs)
}

/// Motion vectors as colours: grey is no motion, red is rightward and green is downward, saturated
/// at [`FULL_PX`].
fn shown(vectors: &[[f32; 2]], picture: &Image) -> Image {
    let side = [picture.width as f32, picture.height as f32];
    let level = |i: usize, share: f32| (127.5 * (1.0 + (share * side[i] / FULL_PX).clamp(-1.0, 1.0))) as u8;
    Image { rgba: vectors.iter().flat_map(|v| [level(0, v[0]), level(1, v[1]), 127, 255]).collect(), ..*picture }
}

/// Renderer of one case.
struct Drawer<'a> {
    case: &'a Case,
    foliage: FoliageRenderer,
    ids: Vec<ModelId>,
}

impl<'a> Drawer<'a> {
    fn new(gpu: &GpuDevice, scene: &Scene<'_>, case: &'a Case) -> Result<Self> {
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, case.look)?;
        if case.has_motion {
            foliage = foliage.with_motion(gpu.device(), MOTION);
        }
        foliage.set_terrain(gpu.device(), gpu.queue(), scene.terrain.cloned())?;
        let ids = scene.models.iter().map(|model| foliage.add_model(gpu.device(), gpu.queue(), model));
        let ids = ids.collect::<Result<_>>()?;
        Ok(Self { case, foliage, ids })
    }

    fn prepare(&mut self, gpu: &GpuDevice, shot: &Shot) -> Result<foliage_lod::draw::Prepared> {
        let instance = |&Seen { model, world_from_plant, active, far, seed, tint }: &Seen| Instance {
            far: far.filter(|_| self.case.has_far),
            seed,
            tint,
            ..Instance::new(self.ids[model], world_from_plant, active)
        };
        let list = |seen: &[Vec<Seen>; 2]| -> Vec<Instance> {
            seen[usize::from(self.case.has_lod)].iter().map(instance).collect()
        };
        let (seen, casters) = (list(&shot.seen), list(&shot.casters));
        self.foliage.prepare_with_casters(gpu.device(), gpu.queue(), shot.frame, &seen, &casters)
    }

    fn time(&mut self, gpu: &GpuDevice, target: &Offscreen, shot: &Shot) -> Result<f64> {
        let started = Instant::now();
        self.prepare(gpu, shot)?;
        target.draw(&self.foliage)?;
        if self.case.has_motion {
            target.motion(&self.foliage)?;
        }
        Ok(started.elapsed().as_secs_f64())
    }

    /// Renders one frame, as a warm-up, and returns the costs known from it.
    fn first_cost(&mut self, gpu: &GpuDevice, target: &Offscreen, shot: &Shot) -> Result<Cost> {
        let effects = self.prepare(gpu, shot)?.effects;
        let mut image = target.picture(&self.foliage)?;
        let mut motion_bytes = 0;
        if self.case.has_motion {
            let vectors = target.motion(&self.foliage)?;
            // Two vector components and a depth value per pixel.
            motion_bytes = vectors.len() as u64 * 3 * size_of::<f32>() as u64;
            image = shown(&vectors, &image);
        }
        Ok(Cost {
            name: self.case.name.clone(),
            frame_seconds: f64::NAN,
            ratio: f64::NAN,
            leaves: 0,
            wood_triangles: 0,
            plants: 0,
            effect_bytes: self.foliage.diagnostics().effect_bytes + motion_bytes,
            effects,
            image,
        })
    }
}
