//! Opens scenes: loads or grows their models and stages their frames.

mod budget;

use crate::{
    baking, curves,
    failure::complain,
    models,
    output::Steps,
    patches::{Patches, Thinning},
    pictures::DIRECTION,
    progress::{Bars, spinning},
    staging::{Shown, Staging},
};
pub use budget::{Budgeting, FIRST_LEAVES};
use foliage_lod::{
    Camera, Error, FoliageModel, Frustum, Grove, Look, LookAt, Result,
    bounds::Sphere,
    draw::{Ground, Lighting},
    effects::{Effects, Limbs, WindShape},
    file,
    grow::{GrowOptions, Species, grow},
    scene::{
        Active, Amount, BudgetEntry, Footing, Kind, ModelSource, Placement, Planted, SceneFile, SharedBudget,
        budget::Spent,
    },
    simplify::{CpuFragments, SimplifyOptions, simplify},
    software::{BakeOptions, mean_leaf_color},
    terrain::{HeightMap, Terrain},
};
use glam::{DVec3, Vec3};
use indicatif::HumanCount;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// Distance of the near plane, as a fraction of the smallest plant's radius.
const NEAR_RADII: f64 = 1e-2;

/// Default distance of the haze: the first factor times the smallest plant's radius plus the second
/// times the radius of the whole scene, or the reach of its patches if that is farther.
const HAZE_RADII: [f64; 2] = [160.0, 8.0];

/// A scene with its models.
pub struct Opened {
    /// The parsed scene file.
    pub file: SceneFile,
    /// Its models, in the order of the file.
    pub models: Vec<FoliageModel>,
    /// Plants of the file, followed by those of patches around the camera.
    planted: Vec<Planted>,
    /// Number of plants of the file.
    fixed: usize,
    patches: Patches,
    heights: HeightMap,
    /// The ground, if it has heights or colours.
    pub terrain: Option<Arc<Terrain>>,
    /// For each plant of a patch, until where it is shown.
    thinning: Vec<Thinning>,
    grove: Grove,
    /// Of each model, what culls its plants at their own size.
    reaches: Vec<Sphere>,
    /// Mean lit colour of each model's leaves, if plants have tints.
    means: Vec<Vec3>,
    /// Whether it was told that plants of patches are left out.
    has_told: bool,
    /// Bounding sphere of the scene.
    around: Sphere,
    /// Distance of the near plane.
    near: f64,
    active: Vec<Active>,
    /// The scene's budget, and what was spent of it last.
    budget: Option<(SharedBudget, Option<Spent>)>,
}

/// What lies under a scene's plants, read before its models are grown.
struct Landscape {
    heights: HeightMap,
    terrain: Option<Arc<Terrain>>,
    patches: Patches,
}

impl Landscape {
    fn read(file: &SceneFile, folder: &Path) -> Result<Self> {
        let ground = file.ground.clone().unwrap_or_default();
        let heights = ground.read_heights(folder)?;
        let terrain = ground.terrain(&heights, folder)?.map(Arc::new);
        Ok(Self { patches: Patches::open(file, folder, &heights)?, terrain, heights })
    }
}

/// Whether the path has the extension of a scene or species file.
pub fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Paths of the species files that the scene refers to; other species are embedded.
fn species_files(file: &SceneFile, folder: &Path) -> impl Iterator<Item = PathBuf> {
    let species = file.models.iter().filter_map(|source| source.species.as_ref());
    species.map(move |name| folder.join(name)).filter(|species| is_toml(species))
}

/// Paths of models and of maps.
fn data_files(file: &SceneFile, folder: &Path) -> impl Iterator<Item = PathBuf> {
    let models = file.models.iter().filter_map(|source| source.file.as_ref());
    let maps = file.patch.iter().flat_map(|patch| &patch.kinds).filter_map(|kind| kind.map.as_ref());
    let of_ground = file.ground.iter().flat_map(|ground| [&ground.heights, &ground.colors]).flatten();
    models.chain(maps).chain(of_ground).map(move |path| folder.join(path))
}

impl Opened {
    /// Reads a scene and loads or grows its models. `output` is the file that will be written, if
    /// any.
    ///
    /// # Errors
    /// Errors from reading, growing and simplifying; also if the output is one of the inputs.
    pub fn open(
        path: &Path,
        output: Option<&Path>,
        steps: &mut Steps,
    ) -> std::result::Result<Self, crate::failure::Failure> {
        let scene = SceneFile::read(path)?;
        // Reports impossible scattering before anything is grown.
        scene.scatter.iter().try_for_each(|scatter| scatter.spots().map(drop))?;
        let folder = path.parent().unwrap_or(Path::new("."));
        if let Some(output) = output {
            file::check_apart(output, data_files(&scene, folder).chain(species_files(&scene, folder)))?;
        }
        for path in data_files(&scene, folder) {
            std::fs::metadata(&path).map_err(|error| Error::io(&path, error))?;
        }
        let landscape = Landscape::read(&scene, folder)?;
        let mut models = Vec::new();
        for source in &scene.models {
            let model = load(source, folder)?;
            let (leaves, wood) = (HumanCount(model.leaves.len() as u64), HumanCount(model.wood.triangles() as u64));
            steps.done("model", format!("{}: {leaves} leaves, {wood} wood triangles", source.name))?;
            models.push(model);
        }
        let mut opened = Self::new(scene, models, landscape)?;
        let eye = opened.camera(0.0, 1.0).eye;
        opened.follow(eye, true)?;
        steps.done("scene", format!("{}: {} plants", path.display(), HumanCount(opened.planted.len() as u64)))?;
        Ok(opened)
    }

    fn new(file: SceneFile, models: Vec<FoliageModel>, landscape: Landscape) -> Result<Self> {
        let Landscape { heights, terrain, mut patches } = landscape;
        let has_heights = file.ground.as_ref().is_some_and(|ground| ground.heights.is_some());
        let planted = file.planted(&models, has_heights.then_some(&heights))?;
        let footings = models.iter().zip(&file.models).map(|(model, source)| Footing::new(model, source.height));
        patches.stand_on(footings.collect());
        let kinds: Vec<Kind> = models
            .iter()
            .map(|model| {
                let mut kind = Kind { policy: file.lod.policy(model), ..Kind::new(model) };
                if let Some(wind) = &file.effects.wind {
                    let mut shape = WindShape::new(&model.aabb());
                    let limbs = model.wood_order.as_ref().and_then(|order| Limbs::new(model, order, DVec3::ZERO));
                    shape.limbs = limbs.map(|limbs| limbs.reach());
                    kind.reach.radius += f64::from(wind.reach(&shape, kind.reach.radius as f32));
                }
                kind
            })
            .collect();
        let spheres: Vec<Sphere> =
            planted.iter().map(|plant| kinds[plant.model].sphere.transformed(&plant.world_from_plant)).collect();
        let least = file.patch.iter().flat_map(|patch| &patch.kinds).map(|kind| f64::from(kind.height[0]));
        let smallest = spheres.iter().map(|sphere| sphere.radius).chain(least).fold(f64::INFINITY, f64::min);
        let reaches: Vec<Sphere> = kinds.iter().map(|kind| kind.reach).collect();
        let culled = |(model, kind): (usize, Kind)| Kind { reach: patches.culled_by(model, kind.reach), ..kind };
        let mut grove = Grove::new(kinds.into_iter().enumerate().map(culled).collect(), &[])?;
        if let Some(dead_band) = file.lod.dead_band {
            grove.set_dead_band(dead_band);
        }
        let corners = spheres.iter().flat_map(|sphere| {
            let (center, radius) = (sphere.center().as_vec3(), sphere.radius as f32);
            [center - radius, center + radius].map(|corner| corner.to_array())
        });
        let around = Sphere::of_points(corners.collect::<Vec<_>>());
        let near = NEAR_RADII * if smallest > 0.0 && smallest.is_finite() { smallest } else { 1.0 };
        let (fixed, thinning, active, has_told) = (planted.len(), Vec::new(), Vec::new(), false);
        let mut opened = Self {
            file,
            models,
            planted,
            fixed,
            patches,
            heights,
            terrain,
            thinning,
            grove,
            reaches,
            means: Vec::new(),
            has_told,
            around,
            near,
            active,
            budget: None,
        };
        opened.fill_grove()?;
        if opened.patches.has_tints() {
            let lighting = opened.look().lighting();
            let mean = |model: &FoliageModel| mean_leaf_color(model, &lighting).map(Vec3::from);
            opened.means = opened.models.iter().map(mean).collect::<Result<_>>()?;
        }
        Ok(opened)
    }

    /// Puts all plants into the grove.
    fn fill_grove(&mut self) -> Result<()> {
        let placement =
            |plant: &Planted| Placement { kind: plant.model as u32, world_from_plant: plant.world_from_plant };
        let placements: Vec<Placement> = self.planted.iter().map(placement).collect();
        self.grove.replace(&placements)
    }

    /// Makes plants of patches around an eye: all within their reach if `all`, else some.
    ///
    /// # Errors
    /// None in practice: places are finite.
    pub fn follow(&mut self, eye: DVec3, all: bool) -> Result<()> {
        if self.patches.is_empty() {
            return Ok(());
        }
        let counts = self.patches.follow(eye, all);
        if counts.made + counts.dropped > 0 {
            self.planted.truncate(self.fixed);
            self.thinning.clear();
            let lighting = self.look().lighting();
            let faded = |model: usize, foot: DVec3| {
                let (mean, at) = (self.means[model], [foot.x, foot.z]);
                let plain = self.file.ground.as_ref().filter(|_| mean.min_element() > 0.0)?.color;
                let albedo = self.terrain.as_ref().and_then(|terrain| terrain.color(at)).unwrap_or(plain);
                let [x, z] = self.heights.gradient(at).map(|rise| rise as f32);
                Some(lighting.on_ground(albedo.into(), Vec3::new(-x, 1.0, -z).normalize()) / mean)
            };
            let left_out = self.patches.plant(&mut self.planted, &mut self.thinning, faded);
            if (left_out > 0 || counts.over > 0) && !std::mem::replace(&mut self.has_told, true) {
                complain(format_args!(
                    "warning: {left_out} plants and {} tiles of patches are left out; make their `reach` shorter or their \
                     `spacing` larger",
                    counts.over
                ));
            }
            self.fill_grove()?;
        }
        Ok(())
    }

    /// Bakes the impostors that the scene asks for and that its models have not: renderers would
    /// make them while they draw.
    ///
    /// # Errors
    /// As [`baking::bake`].
    pub fn bake(&mut self, steps: &mut Steps) -> std::result::Result<(), crate::failure::Failure> {
        let models = self.models.iter_mut().filter(|model| model.impostor.is_none());
        for model in models.filter(|_| self.file.far.is_some()) {
            model.impostor = Some(baking::bake(model, &BakeOptions::default())?);
            steps.done("bake", format!("{}: {}", model.name, baking::summary(model)))?;
        }
        Ok(())
    }

    /// Measures the error curves that budgets go by and that the models have not. Warns of wood
    /// that a budget of triangles cannot count as it is drawn.
    ///
    /// # Errors
    /// As [`curves::measure`].
    pub fn measure(&mut self, steps: &mut Steps) -> std::result::Result<(), crate::failure::Failure> {
        for model in self.models.iter_mut().filter(|model| model.curve.is_none()) {
            model.curve = Some(curves::measure(model)?);
            steps.done("curve", format!("{}: {}", model.name, curves::summary(model)))?;
        }
        let counts_wood = matches!(self.file.budget, Some(BudgetEntry { amount: Amount::Triangles(_), .. }));
        let is_counted_whole = |model: &&FoliageModel| model.wood_order.is_none() && !model.wood.indices.is_empty();
        for model in self.models.iter().filter(is_counted_whole).filter(|_| counts_wood) {
            complain(format_args!(
                "warning: all wood of {} counts in the budget of triangles, though less is drawn: it has no order; make \
                 the model anew with simplify",
                model.name
            ));
        }
        Ok(())
    }

    /// Number of plants in the scene.
    pub fn plants(&self) -> usize {
        self.planted.len()
    }

    /// Number of plants of the model with index `model`.
    pub fn plants_of(&self, model: usize) -> usize {
        self.planted.iter().filter(|plant| plant.model == model).count()
    }

    /// The look of the scene.
    pub fn look(&self) -> Look {
        let towards_sun = self.file.sun.direction().as_vec3();
        let lighting = Lighting { towards_sun, ..Lighting::default() };
        let ground = self.file.ground.as_ref().map(|ground| Ground {
            color: ground.color,
            height: ground.height,
            haze: ground.haze.unwrap_or_else(|| {
                let kinds = self.file.patch.iter().flat_map(|patch| &patch.kinds);
                let sides = ground.area.into_iter().flatten();
                let reach = kinds.map(|kind| kind.reach()).chain(sides).fold(self.around.radius, f64::max);
                HAZE_RADII[0] * self.near / NEAR_RADII + HAZE_RADII[1] * reach
            }),
        });
        Look {
            effects: self.file.effects,
            tone: self.file.tone,
            lighting,
            ground,
            far: self.file.far,
            tints: self.patches.has_tints(),
            wood_error_px: self.file.lod.wood_error.unwrap_or(Look::default().wood_error_px),
            ..Look::default()
        }
    }

    /// The camera at time `seconds`, for a picture with aspect ratio `aspect`.
    pub fn camera(&self, seconds: f64, aspect: f64) -> LookAt {
        self.file.look_at(seconds, aspect, self.near, Some(&self.heights)).unwrap_or_else(|| {
            let framing = LookAt::framing(&self.around, DIRECTION, 50_f64.to_radians(), 1.0).with_aspect(aspect);
            LookAt { near: self.near, ..framing }
        })
    }

    /// The place, or the one above it that is a near plane's distance over the ground.
    #[cfg(feature = "viewer")]
    pub fn above_ground(&self, at: DVec3) -> DVec3 {
        let least = self.heights.height([at.x, at.z]) + 2.0 * self.near;
        if self.terrain.is_some() { at.with_y(at.y.max(least)) } else { at }
    }

    /// Selects the plants in view, with all leaves if `full`, otherwise at their level of detail:
    /// by a budget, so many seconds after the last picture, or anew.
    pub fn shown(&mut self, camera: &Camera, full: bool, seconds: Option<f64>) -> Vec<Shown> {
        if self.budget.is_none() {
            self.budget = self.file.budget.map(|entry| (self.shared_budget(&entry, camera.height_px), None));
        }
        match &mut self.budget {
            Some((budget, spent)) => *spent = Some(self.grove.select_within(camera, budget, seconds, &mut self.active)),
            None => self.grove.select(camera, &mut self.active),
        }
        self.selected(full, camera.eye, Some(&Frustum::new(camera, DVec3::ZERO)))
    }

    /// Selects the plants that may cast shadows: every plant of the scene, in view or not, with its
    /// leaves as in [`shown`](Self::shown); none if the effect `shadow` is off.
    pub fn casters(&mut self, camera: &Camera, full: bool, effects: &Effects) -> Vec<Shown> {
        if effects.shadow.is_none() {
            return Vec::new();
        }
        match &mut self.budget {
            Some((budget, _)) => self.grove.select_all_within(camera, budget, &mut self.active),
            None => self.grove.select_all(camera, &mut self.active),
        }
        self.selected(full, camera.eye, None)
    }

    /// What is shown of the selected plants to an eye; with `seen_in`, of those that it may see.
    fn selected(&self, full: bool, eye: DVec3, seen_in: Option<&Frustum>) -> Vec<Shown> {
        let shown = |active: &Active| {
            let Planted { model, mut world_from_plant } = self.planted[active.instance as usize];
            let (mut seed, mut tint) = (active.instance, Vec3::ONE);
            if let Some(plant) = (seed as usize).checked_sub(self.fixed).map(|number| &self.thinning[number]) {
                seed = plant.seed;
                let is_in_view = || {
                    let Sphere { center, radius } = self.reaches[model].transformed(&world_from_plant);
                    seen_in.is_none_or(|frustum| frustum.may_see(center.into(), radius))
                };
                (world_from_plant, tint) = self.patches.shown(plant, world_from_plant, eye, is_in_view)?;
            }
            let leaves = self.models[model].leaves.len() as f32;
            let (active, far) = if full { (leaves, None) } else { (active.count, Some(active.far)) };
            Some(Shown { model, world_from_plant, active, leaf_scale: 1.0, far, seed, tint })
        };
        self.active.iter().filter_map(shown).collect()
    }

    /// Stages one frame, with all plants of patches within their reach.
    ///
    /// # Errors
    /// Those of [`follow`](Self::follow).
    pub fn staging(&mut self, seconds: f64, size: [u32; 2], full: bool) -> Result<Staging<'_>> {
        self.staging_after(seconds, size, full, None)
    }

    /// Same as [`staging`](Self::staging), with a budget that follows the picture so many seconds
    /// before.
    ///
    /// # Errors
    /// Those of [`follow`](Self::follow).
    pub fn staging_after(
        &mut self,
        seconds: f64,
        size: [u32; 2],
        full: bool,
        after: Option<f64>,
    ) -> Result<Staging<'_>> {
        let camera = self.camera(seconds, f64::from(size[0]) / f64::from(size[1]));
        let camera = camera.camera(size[1]);
        self.follow(camera.eye, true)?;
        let plants = self.shown(&camera, full, after);
        let effects = self.file.effects;
        let casters = self.casters(&camera, full, &effects);
        let (look, terrain) = (self.look(), self.terrain.clone());
        let unit = match self.file.budget.map(|entry| entry.amount) {
            Some(Amount::Triangles(_)) => "triangles",
            // Time is spent in leaves.
            _ => "leaves",
        };
        let budget = self.spent().map(|spent| (spent, unit));
        let visibility = self.budget.as_ref().and_then(|(budget, _)| Some(budget.visibility()?.estimate()));
        Ok(Staging { look, terrain, budget, visibility, models: &self.models, plants, casters, camera, seconds })
    }
}

fn load(source: &ModelSource, folder: &Path) -> Result<FoliageModel> {
    if let Some(file) = &source.file {
        return models::read(folder.join(file));
    }
    let name = source.species.as_deref().unwrap_or_default();
    let is_file = Path::new(name).extension().is_some();
    let species = if is_file { Species::named(folder.join(name))? } else { Species::named(name)? };
    let options = GrowOptions { leaves: source.leaves, seed: source.seed };
    let plant = spinning("growing", || grow(&species, &options))?;
    let options = SimplifyOptions::fast();
    let mut model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Bars::new())?.model;
    model.order_wood();
    Ok(model)
}

/// Rejects options that do not apply to scenes: the scene file sets them.
///
/// # Errors
/// [`Error::InvalidOption`] naming the first option that is set.
pub fn refuse(given: &[(&'static str, bool)]) -> Result<()> {
    match given.iter().find(|(_, is_given)| *is_given) {
        None => Ok(()),
        Some(&(option, _)) => {
            Err(Error::invalid(option, "given with a scene", "left out: a scene is drawn as its file says"))
        }
    }
}
