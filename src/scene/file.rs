//! Scene files: models, where they stand, who looks, what the sun does, and which effects that calls for.
//!
//! TOML; `data/scenes/` has samples of every key. Read and checked here; models are loaded by who draws the scene.
//!
//! Limits: plants do not move; every plant of a scene has the same rule for its level of detail.

use super::scatter::{Scatter, Spot};
use crate::{
    Error, Result,
    effects::Effects,
    extract::{
        LodPolicy,
        lod::{Blend, CookLambda, PixelError, Sizes},
    },
    model::FoliageModel,
};
use glam::{DAffine3, DQuat, DVec3};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Most plants in a scene.
pub const MAX_PLANTS: u32 = 1_000_000;
/// What messages point to.
const SEE: &str = "see data/scenes/forest.toml for every key";

/// A scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// What stands in it.
    pub models: Vec<ModelSource>,
    /// Plants, one by one.
    #[serde(default)]
    pub plants: Vec<PlantEntry>,
    /// Plants, many at once.
    #[serde(default)]
    pub scatter: Vec<Scatter>,
    /// Who looks; by default from where all plants are seen.
    pub camera: Option<CameraEntry>,
    /// Where the sun stands.
    #[serde(default)]
    pub sun: Sun,
    /// How many leaves are drawn.
    #[serde(default)]
    pub lod: Lod,
    /// What is simulated and shaded beyond that.
    #[serde(default)]
    pub effects: Effects,
    /// The ground, if it is drawn.
    pub ground: Option<GroundEntry>,
}

/// A level ground.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GroundEntry {
    /// Linear colour, each channel from 0 to 1.
    pub color: [f32; 3],
    /// Its height.
    pub height: f64,
    /// Distance at which a third of its own light arrives; by default far for the plants' size.
    pub haze: Option<f64>,
}

impl Default for GroundEntry {
    /// Grass.
    fn default() -> Self {
        Self { color: [0.10, 0.15, 0.05], height: 0.0, haze: None }
    }
}

/// Where a model comes from: a file, or a species that is grown and simplified when the scene is opened.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSource {
    /// Name by which plants refer to it.
    pub name: String,
    /// A model (.vds), relative to the scene file.
    pub file: Option<PathBuf>,
    /// An embedded species, or a species `.toml` relative to the scene file.
    pub species: Option<String>,
    /// Leaves of a grown plant, instead of the species' own.
    pub leaves: Option<u32>,
    /// Another individual of the species.
    pub seed: Option<u64>,
    /// Height in the scene's units; by default that of the model.
    pub height: Option<f64>,
}

/// One plant.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantEntry {
    /// Name of its model.
    pub model: String,
    /// Where its foot stands.
    #[serde(default)]
    pub at: [f64; 3],
    /// Turn about the vertical, in degrees.
    #[serde(default)]
    pub turn: f64,
    /// Size factor, above 0.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// Who looks: from a place, around a place, or along a path.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Where it stands.
    pub eye: Option<[f64; 3]>,
    /// What it looks at.
    pub target: Option<[f64; 3]>,
    /// Vertical field of view in degrees: 1 to 170.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// Around `target` instead of from `eye`.
    pub orbit: Option<Orbit>,
    /// From station to station instead, in a straight line between two, by rising time.
    #[serde(default)]
    pub path: Vec<Station>,
}

fn default_fov() -> f64 {
    50.0
}

/// A turn around a place.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Distance from the target.
    pub distance: f64,
    /// Height over the target.
    #[serde(default)]
    pub height: f64,
    /// Seconds for one turn.
    #[serde(default = "default_turn")]
    pub seconds: f64,
}

fn default_turn() -> f64 {
    20.0
}

/// Where the camera is at one time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// When.
    pub seconds: f64,
    /// Where it stands.
    pub eye: [f64; 3],
    /// What it looks at.
    pub target: [f64; 3],
}

/// A camera at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Where it stands.
    pub eye: DVec3,
    /// What it looks at.
    pub target: DVec3,
    /// Vertical field of view in radians.
    pub fov_y: f64,
}

/// Where the sun stands.
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
        Self { azimuth: 46.0, elevation: 46.0 }
    }
}

impl Sun {
    /// Unit vector towards the sun.
    pub fn direction(&self) -> DVec3 {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        DVec3::new(azimuth.cos() * elevation.cos(), elevation.sin(), azimuth.sin() * elevation.cos())
    }
}

/// Names of the rules for the level of detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// By distance and projected area.
    #[default]
    Blend,
    /// Cook's lambda.
    Cook,
    /// By recorded error in pixels.
    Pixels,
    /// By shares measured at some sizes.
    Sizes,
    /// Every leaf.
    Full,
}

/// How many leaves are drawn. A number that is missing has the rule's own default; one that another rule takes is an error.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lod {
    /// The rule.
    pub policy: Policy,
    /// `blend`: distance in radii up to which everything is drawn.
    pub near: Option<f32>,
    /// `blend`: distance in radii from which distance takes off no more.
    pub far: Option<f32>,
    /// `cook`: distance in radii within which everything is drawn.
    pub start: Option<f32>,
    /// `cook`: screen area, over that at `start`, at which half of the leaves stay.
    pub half_area: Option<f32>,
    /// `pixels`: most pixels that may be wrong.
    pub bound: Option<f32>,
    /// `sizes`: diameters in pixels, rising, each with the share of the leaves that is enough there.
    pub shares: Vec<[f32; 2]>,
    /// Dead band over the count: 0 follows the camera at once.
    pub dead_band: Option<f32>,
}

impl Lod {
    /// The rule for one model.
    pub fn policy(&self, model: &FoliageModel) -> Box<dyn LodPolicy + Send + Sync> {
        match self.policy {
            Policy::Blend => {
                let own = Blend::default();
                let (near, far) = (self.near.unwrap_or(own.near), self.far.unwrap_or(own.far));
                Box::new(Blend { near, far, ..own })
            }
            Policy::Cook => {
                let own = CookLambda::default();
                let half_area = self.half_area.unwrap_or(own.half_area);
                Box::new(CookLambda { start: self.start.unwrap_or(own.start), half_area })
            }
            Policy::Pixels => Box::new(PixelError::new(model, self.bound.unwrap_or(DEFAULT_BOUND_PX))),
            Policy::Sizes => match self.sizes() {
                Some(sizes) => Box::new(sizes),
                None => Box::new(Everything),
            },
            Policy::Full => Box::new(Everything),
        }
    }
}

impl Lod {
    fn sizes(&self) -> Option<Sizes> {
        Sizes::new(&self.shares.iter().map(|&[px, share]| (px, share)).collect::<Vec<_>>())
    }
}

/// Pixels that may be wrong unless a scene says otherwise.
const DEFAULT_BOUND_PX: f32 = 200.0;

/// Draws every leaf.
struct Everything;

impl LodPolicy for Everything {
    fn lod(&self, _: &crate::extract::Sight) -> f32 {
        1.0
    }
}

/// A plant of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planted {
    /// Index into the scene's models.
    pub model: usize,
    /// From the plant's space to the scene's.
    pub world_from_plant: DAffine3,
}

impl SceneFile {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read, else those of [`SceneFile::from_toml`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::io::read_to_string(crate::file::open(path)?).map_err(|error| Error::io(path, error))?;
        Self::from_toml(&text, path)
    }

    /// Reads and checks a scene; `origin` stands in messages.
    ///
    /// # Errors
    /// [`Error::Unreadable`] that names the line, the key and what is allowed.
    pub fn from_toml(text: &str, origin: &Path) -> Result<Self> {
        let at = |offset: usize| 1 + text.get(..offset).unwrap_or(text).matches('\n').count();
        let scene: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| at(span.start));
            Error::unreadable(origin, format!("line {line}: {}", error.message().replace('\n', " ")), SEE)
        })?;
        scene.check().map_err(|Wrong { key, value, allowed }| {
            let place = offset_of(text, &key).map_or(String::new(), |offset| format!("line {}: ", at(offset)));
            Error::unreadable(origin, format!("{place}{key} is {value}"), format!("it must be {allowed}; {SEE}"))
        })?;
        Ok(scene)
    }

    /// Where every plant stands; `models` are those of the scene, in its order.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] when a scattering does not fit into its area.
    pub fn planted(&self, models: &[FoliageModel]) -> Result<Vec<Planted>> {
        let standing: Vec<Footing> =
            self.models.iter().zip(models).map(|(source, model)| Footing::new(source, model)).collect();
        let number = |name: &str| self.models.iter().position(|model| model.name == name).unwrap_or(0);
        let mut planted = Vec::new();
        for plant in &self.plants {
            let model = number(&plant.model);
            let place = Spot { at: DVec3::from(plant.at), turn: plant.turn.to_radians(), scale: plant.scale, kind: 0 };
            planted.push(Planted { model, world_from_plant: standing[model].world_from_plant(&place) });
        }
        for scatter in &self.scatter {
            for spot in scatter.spots()? {
                let model = number(&scatter.models[spot.kind]);
                planted.push(Planted { model, world_from_plant: standing[model].world_from_plant(&spot) });
            }
        }
        Ok(planted)
    }

    /// The camera at a time; `None` where the scene has none.
    pub fn view(&self, seconds: f64) -> Option<View> {
        let camera = self.camera.as_ref()?;
        let fov_y = camera.fov.to_radians();
        let target = DVec3::from(camera.target.unwrap_or_default());
        if let Some(orbit) = &camera.orbit {
            let (x, z) = (std::f64::consts::TAU * seconds / orbit.seconds).sin_cos();
            let eye = target + DVec3::new(x * orbit.distance, orbit.height, z * orbit.distance);
            return Some(View { eye, target, fov_y });
        }
        let Some((first, last)) = camera.path.first().zip(camera.path.last()) else {
            return Some(View { eye: DVec3::from(camera.eye?), target, fov_y });
        };
        let seconds = seconds.clamp(first.seconds, last.seconds);
        let next = camera.path.partition_point(|station| station.seconds < seconds).min(camera.path.len() - 1);
        let [from, to] = [&camera.path[next.saturating_sub(1)], &camera.path[next]];
        let span = to.seconds - from.seconds;
        let t = if span > 0.0 { (seconds - from.seconds) / span } else { 1.0 };
        let between = |a: [f64; 3], b: [f64; 3]| DVec3::from(a).lerp(DVec3::from(b), t);
        Some(View { eye: between(from.eye, to.eye), target: between(from.target, to.target), fov_y })
    }

    fn check(&self) -> std::result::Result<(), Wrong> {
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
                "given one of file and species",
            )?;
            in_range(&key("height"), model.height.unwrap_or(1.0), 1e-6, 1e6)?;
        }
        let names: Vec<&str> = self.models.iter().map(|model| &model.name[..]).collect();
        let known = |key: &str, name: &str| wrong_if(!names.contains(&name), key, name, &format!("one of {names:?}"));
        for (i, plant) in self.plants.iter().enumerate() {
            known(&format!("plants.{i}.model"), &plant.model)?;
            in_range(&format!("plants.{i}.scale"), plant.scale, 1e-6, 1e6)?;
            in_range(&format!("plants.{i}.turn"), plant.turn, -1e6, 1e6)?;
            plant.at.iter().try_for_each(|&at| in_range(&format!("plants.{i}.at"), at, -1e9, 1e9))?;
        }
        let mut plants = self.plants.len() as u64;
        for (i, scatter) in self.scatter.iter().enumerate() {
            let key = |name: &str| format!("scatter.{i}.{name}");
            wrong_if(scatter.models.is_empty(), &key("models"), "empty", &format!("some of {names:?}"))?;
            scatter.models.iter().try_for_each(|name| known(&key("models"), name))?;
            scatter.area.iter().try_for_each(|&side| in_range(&key("area"), side, 0.0, 1e9))?;
            scatter.at.iter().try_for_each(|&at| in_range(&key("at"), at, -1e9, 1e9))?;
            in_range(&key("spacing"), scatter.spacing, 0.0, 1e9)?;
            scatter.scale.iter().try_for_each(|&scale| in_range(&key("scale"), scale, 1e-6, 1e6))?;
            plants += u64::from(scatter.count);
        }
        let limit = format!("at least 1 and at most {MAX_PLANTS}");
        wrong_if(!(1..=u64::from(MAX_PLANTS)).contains(&plants), "plants", &plants.to_string(), &limit)?;
        self.check_camera()?;
        in_range("sun.azimuth", self.sun.azimuth, -360.0, 360.0)?;
        in_range("sun.elevation", self.sun.elevation, -5.0, 90.0)?;
        self.check_lod()?;
        let ground = self.ground.unwrap_or_default();
        ground.color.iter().try_for_each(|&channel| in_range("ground.color", f64::from(channel), 0.0, 1.0))?;
        in_range("ground.height", ground.height, -1e9, 1e9)?;
        in_range("ground.haze", ground.haze.unwrap_or(1.0), 1e-6, 1e12)?;
        self.effects.check().map_err(|error| match error {
            Error::InvalidOption { option, value, allowed } => Wrong { key: option.into(), value, allowed },
            other => Wrong { key: "effects".into(), value: other.to_string(), allowed: "in range".into() },
        })
    }

    fn check_camera(&self) -> std::result::Result<(), Wrong> {
        let Some(camera) = &self.camera else { return Ok(()) };
        in_range("camera.fov", camera.fov, 1.0, 170.0)?;
        let ways = [camera.eye.is_some(), camera.orbit.is_some(), !camera.path.is_empty()];
        let ways = ways.into_iter().filter(|&is_given| is_given).count();
        wrong_if(ways != 1, "camera", &format!("given {ways} ways"), "one of eye, orbit and path")?;
        if let Some(orbit) = &camera.orbit {
            in_range("camera.orbit.distance", orbit.distance, 1e-6, 1e9)?;
            in_range("camera.orbit.height", orbit.height, -1e9, 1e9)?;
            in_range("camera.orbit.seconds", orbit.seconds, 1e-3, 1e9)?;
        }
        for (i, station) in camera.path.iter().enumerate() {
            let key = format!("camera.path.{i}.seconds");
            in_range(&key, station.seconds, -1e9, 1e9)?;
            let is_late = i > 0 && camera.path[i - 1].seconds >= station.seconds;
            wrong_if(is_late, &key, &station.seconds.to_string(), "later than the station before")?;
        }
        let stations = camera.path.iter().flat_map(|station| [station.eye, station.target]);
        let places = stations.chain(camera.eye).chain(camera.target);
        places.flatten().try_for_each(|at| in_range("camera", at, -1e9, 1e9))
    }

    fn check_lod(&self) -> std::result::Result<(), Wrong> {
        let lod = &self.lod;
        let numbers = [
            ("lod.near", lod.near, Policy::Blend, [0.0, 1e9]),
            ("lod.far", lod.far, Policy::Blend, [0.0, 1e9]),
            ("lod.start", lod.start, Policy::Cook, [1e-3, 1e9]),
            ("lod.half_area", lod.half_area, Policy::Cook, [1e-6, 0.999]),
            ("lod.bound", lod.bound, Policy::Pixels, [0.0, 1e9]),
        ];
        for (key, number, policy, [least, most]) in numbers {
            let Some(number) = number else { continue };
            let policy_name = format!("{:?}", lod.policy).to_lowercase();
            let allowed = format!("left out: the policy {policy_name} does not take it");
            wrong_if(policy != lod.policy, key, &number.to_string(), &allowed)?;
            in_range(key, f64::from(number), least, most)?;
        }
        let allowed = "pairs of a rising diameter in pixels and a share above 0, at most 1, with the policy sizes";
        let fits = if lod.policy == Policy::Sizes { lod.sizes().is_some() } else { lod.shares.is_empty() };
        wrong_if(!fits, "lod.shares", &format!("{:?}", lod.shares), allowed)?;
        in_range("lod.dead_band", f64::from(lod.dead_band.unwrap_or(0.0)), 0.0, 1.0)
    }
}

/// How a model is put on the ground.
struct Footing {
    /// The middle of the foot of its box, in plant space.
    foot: DVec3,
    scale: f64,
}

impl Footing {
    fn new(source: &ModelSource, model: &FoliageModel) -> Self {
        let bounds = model.aabb();
        let height = f64::from(bounds.size().y);
        let foot = DVec3::new(bounds.center().x, f64::from(bounds.min[1]), bounds.center().z);
        let scale = source.height.filter(|_| height > 0.0).map_or(1.0, |wanted| wanted / height);
        Self { foot, scale }
    }

    fn world_from_plant(&self, spot: &Spot) -> DAffine3 {
        let turn = DQuat::from_rotation_y(spot.turn);
        DAffine3::from_scale_rotation_translation(DVec3::splat(self.scale * spot.scale), turn, spot.at)
            * DAffine3::from_translation(-self.foot)
    }
}

/// A value that breaks a rule.
struct Wrong {
    key: String,
    value: String,
    allowed: String,
}

fn wrong_if(is_wrong: bool, key: &str, value: &str, allowed: &str) -> std::result::Result<(), Wrong> {
    let wrong = || Wrong { key: key.into(), value: value.into(), allowed: allowed.into() };
    if is_wrong { Err(wrong()) } else { Ok(()) }
}

fn in_range(key: &str, value: f64, least: f64, most: f64) -> std::result::Result<(), Wrong> {
    let is_within = (least..=most).contains(&value);
    wrong_if(!is_within, key, &value.to_string(), &format!("from {least} to {most}"))
}

/// Where the value of a dotted key starts, or the deepest table on the way to it.
fn offset_of(text: &str, key: &str) -> Option<usize> {
    let document = DeValue::Table(DeTable::parse(text).ok()?.into_inner());
    let (mut value, mut offset) = (&document, None);
    for part in key.split('.') {
        let next = match value {
            DeValue::Table(table) => table.iter().find(|(name, _)| name.get_ref() == part).map(|(_, next)| next),
            DeValue::Array(array) => part.parse().ok().and_then(|i: usize| array.get(i)),
            _ => None,
        };
        let Some(next) = next else { break };
        offset = Some(next.span().start);
        value = next.get_ref();
    }
    offset
}
