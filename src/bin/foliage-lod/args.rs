//! The command line.

use crate::failure::Failure;
use clap::{Parser, Subcommand};
use foliage_lod::{
    import::{Group, ImportOptions},
    render::image::MAX_IMAGE_SIDE,
    simplify::{Compensate, SimplifyOptions, options::Criterion},
};
use std::path::PathBuf;

pub use crate::names::*;

/// Continuous level of detail for trees, leaf by leaf.
///
/// Without a command: grows an English oak, simplifies it, and writes the model and pictures into ./foliage-lod-out.
#[derive(Parser)]
#[command(name = "foliage-lod", version)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// One subcommand each, in its own file.
#[derive(Subcommand)]
pub enum Command {
    /// Turn a tree file into a continuous model.
    Simplify(Simplify),
    /// Tell what is in a model or scene, or what would be a leaf in a tree file, and why.
    Inspect(Inspect),
    /// Grow a tree and write it as GLB.
    Grow(Grow),
    /// Draw a model or a scene into a PNG file.
    Render(Render),
    /// Measure frame and extraction times as tables, plots and pictures.
    Report(Report),
    /// Look at a model or a scene in a window.
    #[cfg(feature = "viewer")]
    View(View),
}

/// `foliage-lod view`.
#[cfg(feature = "viewer")]
#[derive(Parser)]
pub struct View {
    /// The model (.vds), or a scene (.toml).
    pub model: PathBuf,
}

/// `foliage-lod report`.
#[derive(Parser)]
pub struct Report {
    /// Plants to compare methods on: tree files, or names of embedded species; and scenes (.toml) to tell what their
    /// level of detail saves and their effects cost.
    #[arg(value_name = "PLANT", required_unless_present = "paper", conflicts_with = "paper")]
    pub plants: Vec<String>,
    /// The published experiments, repeated instead: three species against distance, forests, pictures.
    #[arg(long)]
    pub paper: bool,
    /// Levels of detail made by others, tree files from fine to coarse, to compare with.
    #[arg(long, value_name = "LOD", num_args = 1.., conflicts_with = "paper")]
    pub against: Vec<PathBuf>,
    /// Shares of the leaves.
    #[arg(long, value_delimiter = ',', value_parser = share, default_value = "0.8,0.5,0.3,0.15,0.05,0.01")]
    pub levels: Vec<f64>,
    /// Sides of the measured pictures, which the full plant fills; frames are timed at the first.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(8..=2048), default_value = "256,64")]
    pub pixels: Vec<u32>,
    /// Only the four presets, without the variants of options.
    #[arg(long)]
    pub brief: bool,
    /// The folder to write into; made where it does not exist.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Width and height of a frame in pixels, with --paper.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "640x360")]
    pub size: [u32; 2],
    /// Leaves of each tree, for a quick look; the species' own number unless given.
    #[arg(long)]
    pub leaves: Option<u32>,
    /// Print one JSON object instead of steps.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod simplify`.
#[derive(Parser)]
pub struct Simplify {
    /// The tree: .glb, .gltf or .obj.
    pub input: PathBuf,
    /// The model to write.
    #[arg(short, long, value_name = "OUT.vds")]
    pub output: PathBuf,
    /// What the options below start from.
    #[arg(long, value_enum, default_value_t = Preset::Balanced)]
    pub preset: Preset,
    /// What decides which leaf goes next.
    #[arg(long, value_enum)]
    pub criterion: Option<CriterionName>,
    /// What becomes of the area that a leaf leaves.
    #[arg(long, value_enum)]
    pub compensate: Option<CompensateName>,
    /// Pixels on a side of each view.
    #[arg(long)]
    pub resolution: Option<u32>,
    /// Number of views: 4, 6, 8, 12 or 20.
    #[arg(long)]
    pub views: Option<u32>,
    /// The background is no polygon: holes against the sky count less. Slow for large plants.
    #[arg(long)]
    pub no_background: bool,
    /// Largest linear scale that a leaf may reach.
    #[arg(long)]
    pub max_scale: Option<f32>,
    /// Halve the resolution once leaves have grown: at 15 % of them, and again at 4 %. Faster, a little worse.
    #[arg(long, num_args = 0..=1, default_missing_value = "true", value_name = "true|false")]
    pub cascade: Option<bool>,
    /// Tell how many leaves keep a bound: ssim=0.9@200 is a structural similarity of at least 0.9 at 200 pixels; rmse and
    /// xor are at most. May be given several times; what it tells is what a scene's LOD policy `sizes` takes.
    #[arg(long, value_name = "MEASURE=BOUND@PIXELS")]
    pub target: Vec<String>,
    #[command(flatten)]
    pub import: Import,
    /// Where fragments are captured; auto takes a GPU where one answers.
    #[arg(long, value_enum, default_value_t = Raster::Auto)]
    pub raster: Raster,
    /// Threads; 0 is one per core. The model does not depend on it.
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Refuse to begin if more than this many megabytes are expected to be taken; unless given, more than the machine has
    /// available.
    #[arg(long, value_name = "MB")]
    pub max_memory: Option<u64>,
    /// Also draw the model with 100, 50 and 15 % of its leaves into this folder.
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod inspect`.
#[derive(Parser)]
pub struct Inspect {
    /// A model (.vds), a tree (.glb, .gltf, .obj) or a scene (.toml).
    pub file: PathBuf,
    #[command(flatten)]
    pub import: Import,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// How a tree file is cut into leaves.
#[derive(Parser)]
pub struct Import {
    /// Name of the material, node or mesh that is foliage, instead of guessing.
    #[arg(long, value_name = "NAME")]
    pub leaves: Option<String>,
    /// What is one leaf: cards that cross at one centre, or every piece.
    #[arg(long, value_enum, default_value_t = GroupName::Crossed)]
    pub group: GroupName,
}

/// `foliage-lod grow`.
#[derive(Parser)]
pub struct Grow {
    /// english-oak, carya-illinoinensis, betula-populifolia, or a species .toml file.
    pub species: String,
    /// The file to write.
    #[arg(short, long, value_name = "OUT.glb")]
    pub output: PathBuf,
    /// Exact number of leaves, instead of the species' own.
    #[arg(long)]
    pub leaves: Option<u32>,
    /// Another individual of the species.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod render`.
#[derive(Parser)]
pub struct Render {
    /// The model (.vds), or a scene (.toml).
    pub model: PathBuf,
    /// The picture to write.
    #[arg(short, long, value_name = "OUT.png")]
    pub output: PathBuf,
    /// Distance of the camera from the plant's centre, in radii of its bounding sphere. By default the plant fills the
    /// picture.
    #[arg(long)]
    pub distance: Option<f32>,
    /// Draw the tree at each of these distances, in radii, side by side.
    #[arg(long, value_name = "D1,D2,...", value_delimiter = ',', conflicts_with_all = ["distance", "ring", "grid"])]
    pub row: Option<Vec<f32>>,
    /// Draw N trees in a circle.
    #[arg(long, value_name = "N", conflicts_with_all = ["distance", "grid"])]
    pub ring: Option<u32>,
    /// Draw a forest of N x N trees.
    #[arg(long, value_name = "N", conflicts_with = "distance")]
    pub grid: Option<u32>,
    /// Level of detail from 0 to 1, instead of what the distance gives.
    #[arg(long, conflicts_with = "leaves_count")]
    pub lod: Option<f32>,
    /// Number of leaves to draw, instead of what the distance gives.
    #[arg(long, value_name = "N")]
    pub leaves_count: Option<u32>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "768x768", value_parser = size)]
    pub size: [u32; 2],
    /// The prefix at its level of detail, a random part of the leaves with the others enlarged, or every leaf.
    #[arg(long, value_enum, default_value_t = Method::Vds)]
    pub method: Method,
    /// Which leaves a stochastic picture keeps.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How much larger the leaves of a stochastic picture are.
    #[arg(long, value_enum, default_value_t = AreaName::Visible)]
    pub area: AreaName,
    /// The last leaves come and go gradually.
    #[arg(long, value_enum)]
    pub fade: Option<FadeRule>,
    /// What of a leaf that comes or goes changes.
    #[arg(long, value_enum, default_value_t = FadeByName::Size, requires = "fade")]
    pub fade_by: FadeByName,
    /// Fewer, larger leaves keep the contrast of many small ones.
    #[arg(long)]
    pub contrast: bool,
    /// Leaves are lit as parts of a round crown.
    #[arg(long)]
    pub crown_normals: bool,
    /// Light shines through leaves.
    #[arg(long)]
    pub translucency: bool,
    /// Trunk, branches and leaves move in a breeze.
    #[arg(long)]
    pub wind: bool,
    /// Time of what moves.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub seconds: f64,
    /// What draws; auto takes a GPU where one answers.
    #[arg(long, value_enum, default_value_t = Raster::Auto)]
    pub raster: Raster,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

impl Render {
    /// Options that a scene file takes the place of, and whether they are given.
    pub fn not_for_scenes(&self) -> [(&'static str, bool); 12] {
        [
            ("--distance", self.distance.is_some()),
            ("--row", self.row.is_some()),
            ("--ring", self.ring.is_some()),
            ("--grid", self.grid.is_some()),
            ("--lod", self.lod.is_some()),
            ("--leaves-count", self.leaves_count.is_some()),
            ("--method stochastic", self.method == Method::Stochastic),
            ("--fade", self.fade.is_some()),
            ("--contrast", self.contrast),
            ("--crown-normals", self.crown_normals),
            ("--translucency", self.translucency),
            ("--wind", self.wind),
        ]
    }
}

/// Reads the command line.
///
/// # Errors
/// [`Failure::Usage`], also for help and version.
pub fn parse() -> Result<Args, Failure> {
    Args::try_parse().map_err(Failure::Usage)
}

impl Simplify {
    /// The preset with what the command line changes of it.
    pub fn options(&self) -> SimplifyOptions {
        let mut options = match self.preset {
            Preset::Paper => SimplifyOptions::paper(),
            Preset::Fast => SimplifyOptions::fast(),
            Preset::Balanced => SimplifyOptions::balanced(),
            Preset::Best => SimplifyOptions::best(),
        };
        if let Some(criterion) = self.criterion {
            options.criterion = match criterion {
                CriterionName::Vmi => Criterion::Vmi,
                CriterionName::Area => Criterion::Area,
                CriterionName::Image => Criterion::Image,
            };
        }
        if let Some(compensate) = self.compensate {
            options.compensate = match compensate {
                CompensateName::Nearest => Compensate::Nearest,
                CompensateName::Silhouette => Compensate::Silhouette,
                CompensateName::Image => Compensate::Image,
                CompensateName::None => Compensate::None,
            };
        }
        options.resolution = self.resolution.unwrap_or(options.resolution);
        options.views = self.views.unwrap_or(options.views);
        options.background &= !self.no_background;
        options.max_scale = self.max_scale.unwrap_or(options.max_scale);
        options.cascade = self.cascade.unwrap_or(options.cascade);
        options.threads = self.threads;
        options.max_memory_mb = self.max_memory;
        options
    }
}

impl Import {
    /// As the library takes it.
    pub fn options(&self) -> ImportOptions {
        let group = match self.group {
            GroupName::Crossed => Group::Crossed,
            GroupName::Piece => Group::Piece,
        };
        ImportOptions { leaves: self.leaves.clone(), group, max_memory_mb: None }
    }
}

impl Report {
    /// How many methods --against adds.
    pub fn against_methods(&self) -> usize {
        usize::from(!self.against.is_empty())
    }
}

/// A share above 0, at most 1.
fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "write numbers such as 0.5,0.15")?;
    if share > 0.0 && share <= 1.0 { Ok(share) } else { Err("a share of the leaves is above 0 and at most 1".into()) }
}

/// `WxH` as two numbers.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let sides: [u32; 2] = sides.ok_or("write width, x and height in pixels, such as 768x768")?;
    if sides.iter().all(|side| (1..=MAX_IMAGE_SIDE).contains(side)) {
        Ok(sides)
    } else {
        Err(format!("a side has 1 to {MAX_IMAGE_SIDE} pixels"))
    }
}
