//! Scene files: models, plants, camera, sun, level of detail, effects and ground.
//!
//! The format is TOML; `data/scenes/` has samples of every key. Files are parsed and checked here;
//! loading the models is left to the caller.
//!
//! Limits: plants do not move; all plants of a scene use the same level-of-detail policy.

use super::{
    camera::CameraEntry,
    check::{offset_of, wrong_if},
    footing::Footing,
    ground::GroundEntry,
    lod::Lod,
    patch::PatchEntry,
    portions::BudgetEntry,
    scatter::{Scatter, Spot},
};
use crate::{
    Error, LookAt, Result,
    effects::{Effects, sky::REFERENCE_ELEVATION},
    error::check_range,
    extract::Far,
    model::FoliageModel,
    terrain::HeightMap,
};
use glam::{DAffine3, DVec3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Maximum number of plants in a scene.
pub const MAX_PLANTS: u32 = 1_000_000;
/// Hint appended to error messages.
const SEE: &str = "see data/scenes/forest.toml, meadow.toml and landscape.toml for every key";

/// A scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Models of the plants.
    pub models: Vec<ModelSource>,
    /// Plants placed one by one.
    #[serde(default)]
    pub plants: Vec<PlantEntry>,
    /// Plants scattered over areas.
    #[serde(default)]
    pub scatter: Vec<Scatter>,
    /// Plants over landscapes, made around the camera.
    #[serde(default)]
    pub patch: Vec<PatchEntry>,
    /// The camera; by default all plants are in view.
    pub camera: Option<CameraEntry>,
    /// Direction of the sun.
    #[serde(default)]
    pub sun: Sun,
    /// Level-of-detail policy.
    #[serde(default)]
    pub lod: Lod,
    /// Leaves that all plants in view share; by default each has those of the level-of-detail
    /// policy.
    pub budget: Option<BudgetEntry>,
    /// Simulation and shading effects.
    #[serde(default)]
    pub effects: Effects,
    /// Whether enlarged leaves are drawn with the tone of their model.
    #[serde(default = "on")]
    pub tone: bool,
    /// The ground; not drawn by default.
    pub ground: Option<GroundEntry>,
    /// When plants are handed over to impostors; by default they are drawn with leaves at any size.
    pub far: Option<Far>,
}

fn on() -> bool {
    true
}

/// Source of a model: a file, or a species that is grown and simplified when the scene is opened.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    /// Name that plants refer to.
    pub name: String,
    /// Model file (.vds), relative to the scene file.
    pub file: Option<PathBuf>,
    /// An embedded species, or a species `.toml` relative to the scene file.
    pub species: Option<String>,
    /// Number of leaves of a grown plant; by default the species' own.
    pub leaves: Option<u32>,
    /// Random seed: another one grows another individual of the species.
    pub seed: Option<u64>,
    /// Height in the scene's units; by default the model's own.
    pub height: Option<f64>,
}

/// One plant.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantEntry {
    /// Name of its model.
    pub model: String,
    /// Position of its foot.
    #[serde(default)]
    pub at: [f64; 3],
    /// Rotation about the vertical, in degrees.
    #[serde(default)]
    pub turn: f64,
    /// Size factor, above 0.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// Direction of the sun.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sun {
    /// Degrees from +X towards +Z.
    pub azimuth: f64,
    /// Degrees above the horizon: -5 to 90.
    pub elevation: f64,
}

impl Default for Sun {
    fn default() -> Self {
        Self { azimuth: 46.0, elevation: f64::from(REFERENCE_ELEVATION) }
    }
}

impl Sun {
    /// Unit vector towards the sun.
    pub fn direction(&self) -> DVec3 {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        DVec3::new(azimuth.cos() * elevation.cos(), elevation.sin(), azimuth.sin() * elevation.cos())
    }
}

/// A plant of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planted {
    /// Index into the scene's models.
    pub model: usize,
    /// Transform from the plant's space to the scene's.
    pub world_from_plant: DAffine3,
}

impl SceneFile {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read; otherwise the errors of
    /// [`SceneFile::from_toml`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::io::read_to_string(crate::file::open(path)?).map_err(|error| Error::io(path, error))?;
        Self::from_toml(&text, path)
    }

    /// Parses and checks a scene; `origin` names it in error messages.
    ///
    /// # Errors
    /// [`Error::Unreadable`] with the line, the key and the allowed values.
    pub fn from_toml(text: &str, origin: &Path) -> Result<Self> {
        let at = |offset: usize| 1 + text.get(..offset).unwrap_or(text).matches('\n').count();
        let scene: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| at(span.start));
            Error::unreadable(origin, format!("line {line}: {}", error.message().replace(char::is_control, " ")), SEE)
        })?;
        scene.check().map_err(|error| {
            let Error::InvalidOption { field, value, allowed } = error else { return error };
            let place = offset_of(text, &field).map_or(String::new(), |offset| format!("line {}: ", at(offset)));
            // Names in the message come from the file.
            let [value, allowed] = [value, allowed].map(|text| text.replace(char::is_control, " "));
            Error::unreadable(origin, format!("{place}{field} is {value}"), format!("it must be {allowed}; {SEE}"))
        })?;
        Ok(scene)
    }

    /// Positions of all plants but those of patches; `models` are the scene's models, in its order.
    /// Heights of the file are above `ground`, if it is given.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if a scattering does not fit into its area.
    pub fn planted(&self, models: &[FoliageModel], ground: Option<&HeightMap>) -> Result<Vec<Planted>> {
        let standing: Vec<Footing> =
            self.models.iter().zip(models).map(|(source, model)| Footing::new(model, source.height)).collect();
        let number = |name: &str| self.model_number(name);
        let raised = |at: DVec3| at + DVec3::Y * ground.map_or(0.0, |ground| ground.height([at.x, at.z]));
        let mut planted = Vec::new();
        for plant in &self.plants {
            let model = number(&plant.model);
            let at = raised(plant.at.into());
            let place = Spot { at, turn: plant.turn.to_radians(), scale: plant.scale, kind: 0 };
            planted.push(Planted { model, world_from_plant: standing[model].world_from_plant(&place) });
        }
        for scatter in &self.scatter {
            for spot in scatter.spots()? {
                let model = number(&scatter.models[spot.kind]);
                let spot = Spot { at: raised(spot.at), ..spot };
                planted.push(Planted { model, world_from_plant: standing[model].world_from_plant(&spot) });
            }
        }
        Ok(planted)
    }

    /// Index of the model of that name; 0 if there is none.
    pub fn model_number(&self, name: &str) -> usize {
        self.models.iter().position(|model| model.name == name).unwrap_or(0)
    }

    /// The camera at a time, with a near plane at `near`; `None` if the scene has none.
    /// [`above_ground`](CameraEntry::above_ground) is above `ground`, if it is given.
    pub fn look_at(&self, seconds: f64, aspect: f64, near: f64, ground: Option<&HeightMap>) -> Option<LookAt> {
        let camera = self.camera.as_ref()?;
        let mut look = camera.look_at(seconds, aspect, near)?;
        if let Some(ground) = ground.filter(|_| camera.above_ground) {
            [&mut look.eye, &mut look.target].into_iter().for_each(|at| at.y += ground.height([at.x, at.z]));
        }
        Some(look)
    }

    fn check(&self) -> Result<()> {
        wrong_if(self.models.is_empty(), "models", "empty", "at least one [[models]]")?;
        for (i, model) in self.models.iter().enumerate() {
            let key = |name: &str| format!("models.{i}.{name}");
            let is_twice = self.models[..i].iter().any(|other| other.name == model.name);
            wrong_if(is_twice, &key("name"), &model.name, "a name that no other model has")?;
            let sources = usize::from(model.file.is_some()) + usize::from(model.species.is_some());
            wrong_if(
                sources != 1,
                &key("name"),
                &format!("{}, with {sources} sources", model.name),
                "given exactly one of file and species",
            )?;
            check_range(key("height"), model.height.unwrap_or(1.0), 1e-6..=1e6)?;
        }
        let names: Vec<&str> = self.models.iter().map(|model| &model.name[..]).collect();
        let known = |key: &str, name: &str| wrong_if(!names.contains(&name), key, name, &format!("one of {names:?}"));
        for (i, plant) in self.plants.iter().enumerate() {
            known(&format!("plants.{i}.model"), &plant.model)?;
            check_range(format!("plants.{i}.scale"), plant.scale, 1e-6..=1e6)?;
            check_range(format!("plants.{i}.turn"), plant.turn, -1e6..=1e6)?;
            plant.at.iter().try_for_each(|&at| check_range(format!("plants.{i}.at"), at, -1e9..=1e9))?;
        }
        let mut plants = self.plants.len() as u64;
        for (i, scatter) in self.scatter.iter().enumerate() {
            let key = |name: &str| format!("scatter.{i}.{name}");
            wrong_if(scatter.models.is_empty(), &key("models"), "empty", &format!("some of {names:?}"))?;
            scatter.models.iter().try_for_each(|name| known(&key("models"), name))?;
            scatter.area.iter().try_for_each(|&side| check_range(key("area"), side, 0.0..=1e9))?;
            scatter.at.iter().try_for_each(|&at| check_range(key("at"), at, -1e9..=1e9))?;
            check_range(key("spacing"), scatter.spacing, 0.0..=1e9)?;
            scatter.scale.iter().try_for_each(|&scale| check_range(key("scale"), scale, 1e-6..=1e6))?;
            plants += u64::from(scatter.count);
        }
        for (i, patch) in self.patch.iter().enumerate() {
            patch.check(|name| format!("patch.{i}.{name}"))?;
            let kinds = patch.kinds.iter().enumerate();
            for (k, kind) in kinds {
                let key = |name: &str| format!("patch.{i}.kinds.{k}.{name}");
                known(&key("model"), &kind.model)?;
                let blends_with_none = kind.blends && self.ground.is_none();
                wrong_if(blends_with_none, &key("blends"), "true without a ground", "false, or given with a [ground]")?;
            }
        }
        let least = u64::from(self.patch.is_empty());
        let limit = format!("at least 1 and at most {MAX_PLANTS}");
        wrong_if(!(least..=u64::from(MAX_PLANTS)).contains(&plants), "plants", &plants.to_string(), &limit)?;
        let needs_camera = self.camera.is_none() && plants == 0;
        wrong_if(needs_camera, "camera", "missing", "given in a scene whose plants all belong to patches")?;
        self.camera.as_ref().map_or(Ok(()), CameraEntry::check)?;
        check_range("sun.azimuth", self.sun.azimuth, -360.0..=360.0)?;
        check_range("sun.elevation", self.sun.elevation, -5.0..=90.0)?;
        self.lod.check()?;
        self.budget.map_or(Ok(()), |budget| budget.check())?;
        self.ground.as_ref().map_or(Ok(()), GroundEntry::check)?;
        self.far.map_or(Ok(()), |far| far.check())?;
        self.effects.check()
    }
}
