//! Scenes for the command: their models loaded or grown, and what a frame of them stages.

use crate::{
    output::{Steps, grouped},
    pictures::DIRECTION,
    progress::{Bars, spinning},
    staging::{Shown, Staging},
};
use foliage_lod::{
    Error, Result,
    bounds::Sphere,
    grow::{GrowOptions, Species, grow},
    model::FoliageModel,
    render::{camera::Camera, landscape_pass::Ground, light::Lighting, look::Look},
    scene::{
        Active, Grove, Kind, Placement, SceneFile, Viewer,
        camera::View,
        file::{ModelSource, Planted},
    },
    simplify::{SimplifyOptions, raster::CpuFragments, simplify},
};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Distance of the near plane over the smallest plant's radius.
const NEAR_RADII: f64 = 1e-2;

/// Distance of the haze, over the smallest plant's radius and over that of everything that stands in the scene.
const HAZE_RADII: [f64; 2] = [40.0, 2.0];

/// A scene with its models.
pub struct Opened {
    /// What the file says.
    pub file: SceneFile,
    /// Its models, in its order.
    pub models: Vec<FoliageModel>,
    planted: Vec<Planted>,
    grove: Grove,
    /// A sphere around everything, and the distance of the near plane.
    around: Sphere,
    near: f64,
    active: Vec<Active>,
}

/// True for what is read as a scene, or as a species where one is asked for.
pub fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// The files that the scene at `path` reads.
///
/// # Errors
/// Those of reading the scene itself.
pub fn files(path: &Path) -> Result<Vec<PathBuf>> {
    let file = SceneFile::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let species = file.models.iter().filter_map(|source| source.species.as_ref()).map(|name| folder.join(name));
    // Others are embedded.
    Ok(model_files(&file, folder).chain(species.filter(|species| is_toml(species))).collect())
}

fn model_files(file: &SceneFile, folder: &Path) -> impl Iterator<Item = PathBuf> {
    file.models.iter().filter_map(|source| source.file.as_ref()).map(move |model| folder.join(model))
}

impl Opened {
    /// Reads a scene and everything that it refers to.
    ///
    /// # Errors
    /// Those of reading, growing and simplifying.
    pub fn open(path: &Path, steps: &mut Steps) -> std::result::Result<Self, crate::failure::Failure> {
        let file = SceneFile::read(path)?;
        // What cannot be is told before anything is grown.
        file.scatter.iter().try_for_each(|scatter| scatter.spots().map(drop))?;
        let folder = path.parent().unwrap_or(Path::new("."));
        for model in model_files(&file, folder) {
            std::fs::metadata(&model).map_err(|error| Error::io(&model, error))?;
        }
        let mut models = Vec::new();
        for source in &file.models {
            let model = load(source, folder)?;
            let (leaves, wood) = (grouped(model.leaves.len() as u64), grouped(model.wood.triangles() as u64));
            steps.done("model", format!("{}: {leaves} leaves, {wood} triangles of wood", source.name))?;
            models.push(model);
        }
        let opened = Self::new(file, models)?;
        steps.done("scene", format!("{}: {} plants", path.display(), grouped(opened.planted.len() as u64)))?;
        Ok(opened)
    }

    fn new(file: SceneFile, models: Vec<FoliageModel>) -> Result<Self> {
        let planted = file.planted(&models)?;
        let kinds: Vec<Kind> = models
            .iter()
            .map(|model| {
                let mut kind = Kind { policy: file.lod.policy(model), ..Kind::new(model) };
                if let Some(wind) = &file.effects.wind {
                    let shape = foliage_lod::effects::wind::Shape::new(&model.aabb());
                    kind.reach.radius += f64::from(wind.reach(&shape, kind.reach.radius as f32));
                }
                kind
            })
            .collect();
        let spheres: Vec<Sphere> = planted.iter().map(|plant| placed_sphere(plant, &kinds)).collect();
        let placement =
            |plant: &Planted| Placement { kind: plant.model as u32, world_from_plant: plant.world_from_plant };
        let placements: Vec<Placement> = planted.iter().map(placement).collect();
        let mut grove = Grove::new(kinds, &placements)?;
        if let Some(dead_band) = file.lod.dead_band {
            grove.set_dead_band(dead_band);
        }
        let corners = spheres.iter().flat_map(|sphere| {
            let (center, radius) = (sphere.center().as_vec3(), sphere.radius as f32);
            [center - radius, center + radius].map(|corner| corner.to_array())
        });
        let around = Sphere::of_points(corners.collect::<Vec<_>>());
        let smallest = spheres.iter().map(|sphere| sphere.radius).fold(f64::INFINITY, f64::min);
        let near = NEAR_RADII * if smallest > 0.0 { smallest } else { 1.0 };
        Ok(Self { file, models, planted, grove, around, near, active: Vec::new() })
    }

    /// Plants of the scene.
    pub fn plants(&self) -> usize {
        self.planted.len()
    }

    /// Plants of one of its models.
    pub fn plants_of(&self, model: usize) -> usize {
        self.planted.iter().filter(|plant| plant.model == model).count()
    }

    /// What plants look like.
    pub fn look(&self) -> Look {
        let towards_sun = self.file.sun.direction().as_vec3();
        let lighting = Lighting { towards_sun, ..Lighting::default() };
        let ground = self.file.ground.map(|ground| Ground {
            color: ground.color,
            height: ground.height,
            haze: ground.haze.unwrap_or(HAZE_RADII[0] * self.near / NEAR_RADII + HAZE_RADII[1] * self.around.radius),
        });
        Look { effects: self.file.effects, lighting, ground, ..Look::default() }
    }

    /// The camera at a time, for a picture of this shape.
    pub fn camera(&self, seconds: f64, aspect: f64) -> Camera {
        let framing = Camera::framing(&self.around, DIRECTION, 50_f64.to_radians(), 1.0).with_aspect(aspect);
        match self.file.view(seconds) {
            None => Camera { near: self.near, ..framing },
            Some(View { eye, target, fov_y }) => {
                Camera { eye, target, up: DVec3::Y, fov_y_radians: fov_y, aspect, near: self.near }
            }
        }
    }

    /// The plants that a viewer sees, with all leaves or at their level of detail.
    pub fn shown(&mut self, viewer: &Viewer, full: bool) -> Vec<Shown> {
        self.grove.select(viewer, &mut self.active);
        let shown = |active: &Active| {
            let Planted { model, world_from_plant } = self.planted[active.instance as usize];
            let leaves = self.models[model].leaves.len() as f32;
            Shown { model, world_from_plant, active: if full { leaves } else { active.count }, leaf_scale: 1.0 }
        };
        self.active.iter().map(shown).collect()
    }

    /// One frame.
    pub fn staging(&mut self, seconds: f64, size: [u32; 2], full: bool) -> Staging<'_> {
        let camera = self.camera(seconds, f64::from(size[0]) / f64::from(size[1]));
        let plants = self.shown(&camera.viewer(size[1] as f32), full);
        let casters = match self.file.effects.shadow {
            Some(_) => self.shown(&camera.viewer(size[1] as f32).all_around(), full),
            None => Vec::new(),
        };
        Staging { look: self.look(), models: &self.models, plants, casters, camera, seconds }
    }
}

fn placed_sphere(plant: &Planted, kinds: &[Kind]) -> Sphere {
    let sphere = &kinds[plant.model].sphere;
    let scale = plant.world_from_plant.matrix3.x_axis.length();
    let center = plant.world_from_plant.transform_point3(sphere.center());
    Sphere { center: center.to_array(), radius: sphere.radius * scale }
}

fn load(source: &ModelSource, folder: &Path) -> Result<FoliageModel> {
    if let Some(file) = &source.file {
        return FoliageModel::read(folder.join(file));
    }
    let name = source.species.as_deref().unwrap_or_default();
    let is_file = Path::new(name).extension().is_some();
    let species = if is_file { Species::named(folder.join(name))? } else { Species::named(name)? };
    let options = GrowOptions { leaves: source.leaves, seed: source.seed };
    let plant = spinning("growing", || grow(&species, &options))?;
    let options = SimplifyOptions::fast();
    let simplified = simplify(&plant, &options, &mut CpuFragments::new(), &mut Bars::new())?;
    Ok(simplified.model)
}

/// Options that place plants of a model are not for scenes, which place their own.
///
/// # Errors
/// [`Error::InvalidOption`] that names the first one given.
pub fn refuse(given: &[(&'static str, bool)]) -> Result<()> {
    match given.iter().find(|(_, is_given)| *is_given) {
        None => Ok(()),
        Some(&(option, _)) => {
            Err(Error::invalid(option, "given with a scene", "left out: a scene file says it itself"))
        }
    }
}
