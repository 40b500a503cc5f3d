//! The command line.

use crate::failure::Failure;
use clap::{Parser, Subcommand};
use foliage_lod::{
    effects::FadeBy,
    scene::{Amount, BudgetEntry},
    simplify::{Compensate, Criterion, GrowBy, SimplifyOptions},
    software::{BakeOptions, MAX_IMAGE_SIDE},
    stochastic::AreaRule,
};
use std::path::PathBuf;

pub use crate::{export_args::Export, import_args::Import, names::*};

/// Continuous level of detail for trees, leaf by leaf.
///
/// Without a command: grows an English oak, simplifies it, and writes the model and pictures into
/// ./foliage-lod-out.
#[derive(Parser)]
#[command(name = "foliage-lod", version)]
pub struct Args {
    /// Subcommand; without one, the quick start runs.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// Subcommands, each in a file of its own.
#[derive(Subcommand)]
pub enum Command {
    /// Simplify a tree file into a model with continuous level of detail.
    Simplify(Simplify),
    /// Write a model as glTF, with its continuous level of detail or as discrete levels.
    Export(Export),
    /// Add an impostor to a model: pictures from all around, drawn in its place far away.
    Bake(Bake),
    /// Show the contents of a model or scene, or which parts of a tree file would become leaves and
    /// why.
    Inspect(Inspect),
    /// Grow a tree and write it as GLB.
    Grow(Grow),
    /// Render a model or a scene to a PNG file.
    Render(Render),
    /// Measure quality, frame time and extraction time, and write tables, plots and pictures.
    Report(Report),
    /// Show a model or a scene in a window.
    #[cfg(feature = "viewer")]
    View(View),
}

/// `foliage-lod view`.
#[cfg(feature = "viewer")]
#[derive(Parser)]
pub struct View {
    /// A model (.vds) or a scene (.toml).
    pub model: PathBuf,
    /// Draw enlarged leaves nearer to the plant's mean colour, if their model has a tone.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub tone: Switch,
    /// Error in pixels that the wood is drawn at; 0 draws all of it. By default the scene's, or
    /// 0.5.
    #[arg(long, value_name = "PX")]
    pub wood_error: Option<f32>,
}

/// `foliage-lod report`.
#[derive(Parser)]
pub struct Report {
    /// Plants to compare methods on: tree files or names of embedded species. Also scenes (.toml),
    /// to measure the savings from level of detail and the cost of each effect.
    #[arg(value_name = "PLANT", required_unless_present = "paper", conflicts_with = "paper")]
    pub plants: Vec<String>,
    /// Repeat the published experiments instead: three species at increasing distances, forests of
    /// increasing size, and pictures.
    #[arg(long)]
    pub paper: bool,
    /// Levels of detail made by another tool, as tree files from fine to coarse, to compare with.
    #[arg(long, value_name = "LOD", num_args = 1.., conflicts_with = "paper")]
    pub against: Vec<PathBuf>,
    /// Fractions of the leaves to measure at.
    #[arg(long, value_delimiter = ',', value_parser = share, default_value = "0.8,0.5,0.3,0.15,0.05,0.01")]
    pub levels: Vec<f64>,
    /// Side lengths of the measured pictures, in pixels; the full plant fills each. Frames are
    /// timed at the first.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(8..=2048), default_value = "256,64")]
    pub pixels: Vec<u32>,
    /// Measure only the four presets, without variants of their options.
    #[arg(long)]
    pub brief: bool,
    /// Also bake an impostor and compare it at 8 to 128 pixels across with leaves, both at once,
    /// three levels of detail and crossed cards: frames along each side of the lattice of
    /// directions, and their side in pixels.
    #[arg(long, value_name = "FRAMESxPX", value_parser = frames, num_args = 0..=1, default_missing_value = "12x64", conflicts_with = "paper")]
    pub far: Option<Frames>,
    /// Also compare the wood with less detail at 48 to 256 pixels across: by its order, by the
    /// width of its stems and, if the command was built with it, by meshoptimizer.
    #[arg(long, conflicts_with = "paper")]
    pub wood: bool,
    /// Also compare the rules of a scene's budget along its camera path: frame times and errors at
    /// 3 and 10 % of the leaves in view.
    #[arg(long, conflicts_with = "paper")]
    pub budgets: bool,
    /// Folder to write into; created if it does not exist.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Width and height in pixels of the frames of --paper and of scenes.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "640x360")]
    pub size: [u32; 2],
    /// Number of leaves of each grown tree, for a quicker run; by default the species' own number.
    #[arg(long)]
    pub leaves: Option<u32>,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod simplify`.
#[derive(Parser)]
pub struct Simplify {
    /// The tree: .glb, .gltf or .obj.
    pub input: PathBuf,
    /// Model file to write.
    #[arg(short, long, value_name = "OUT.vds")]
    pub output: PathBuf,
    /// Preset that the options below override.
    #[arg(long, value_enum, default_value_t = Preset::Balanced)]
    pub preset: Preset,
    /// Criterion that selects the next leaf to prune.
    #[arg(long, value_parser = variant::<Criterion>())]
    pub criterion: Option<Criterion>,
    /// Rule that compensates for the area of a pruned leaf.
    #[arg(long, value_parser = variant::<Compensate>())]
    pub compensate: Option<Compensate>,
    /// Side of each view in pixels.
    #[arg(long)]
    pub resolution: Option<u32>,
    /// Number of views: 4, 6, 8, 12 or 20.
    #[arg(long)]
    pub views: Option<u32>,
    /// Do not count the background as a polygon (vmi only), so that holes against the sky matter
    /// less. Slow for large plants.
    #[arg(long)]
    pub no_background: bool,
    /// Cost of leaves that no view sees, 0 to 1 (criterion image only); by default 0, so that they
    /// all go first. With 0.01 many last, which may help where the crown is seen from within, but
    /// half of the leaves differ more from all of them when seen from outside.
    #[arg(long, value_name = "COST")]
    pub intrinsic: Option<f32>,
    /// Largest linear scale that a leaf may reach.
    #[arg(long)]
    pub max_scale: Option<f32>,
    /// Halve the resolution when 15 % of the leaves remain, and again at 4 %: faster, slightly
    /// lower quality.
    #[arg(long, num_args = 0..=1, default_missing_value = "true", value_name = "true|false")]
    pub cascade: Option<bool>,
    /// Find the fewest leaves that meet a quality bound: ssim=0.9@200 is a structural similarity of
    /// at least 0.9 at 200 pixels; rmse and xor are upper bounds. Repeatable; the results can be
    /// used in a scene's LOD policy `sizes`.
    #[arg(long, value_name = "MEASURE=BOUND@PIXELS")]
    pub target: Vec<String>,
    /// Keep every bit of positions, normals, texture coordinates and colours: twice the file.
    #[arg(long)]
    pub exact: bool,
    /// How leaves grow that make up for pruned ones; by default the preset's.
    #[arg(long, value_parser = variant::<GrowBy>())]
    pub growth: Option<GrowBy>,
    /// Find an outline around what shows of each picture of cut-out leaves; only its inside is then
    /// drawn. Changes neither the order nor the scales of the leaves.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub trim: Switch,
    /// Also bake an impostor: frames along each side of the lattice of directions, and their side
    /// in pixels.
    #[arg(long, value_name = "FRAMESxPX", value_parser = frames, num_args = 0..=1, default_missing_value = "12x64")]
    pub far: Option<Frames>,
    /// Find the order in which the wood loses detail where it is small, and store it.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub wood_order: Switch,
    /// Measure how wrong the model looks with fewer leaves, which budgets go by, and store it; by
    /// default with the presets balanced and best.
    #[arg(long, value_enum)]
    pub curve: Option<Switch>,
    #[command(flatten)]
    pub import: Import,
    /// Processor that captures the fragments; auto uses a hardware GPU if there is one.
    #[arg(long, value_enum, default_value_t = Raster::Auto)]
    pub raster: Raster,
    /// Number of threads; 0 uses one per core. The model does not depend on it.
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Refuse to start if the estimated memory exceeds this many megabytes; by default, the
    /// available memory is the limit.
    #[arg(long, value_name = "MB")]
    pub max_memory: Option<u64>,
    /// Also render the model with 100, 50 and 15 % of its leaves into this folder.
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod bake`.
#[derive(Parser)]
pub struct Bake {
    /// The model (.vds).
    pub model: PathBuf,
    /// Model file to write; may be the same.
    #[arg(short, long, value_name = "OUT.vds")]
    pub output: PathBuf,
    /// Frames along each side of the lattice of directions, and their side in pixels.
    #[arg(long, value_name = "FRAMESxPX", value_parser = frames, default_value = "12x64")]
    pub far: Frames,
    /// Also draw the frames that are seen from below.
    #[arg(long)]
    pub whole_sphere: bool,
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
    /// Print every part, material and warning of a tree file; by default, at most a screenful.
    #[arg(long)]
    pub all: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod grow`.
#[derive(Parser)]
pub struct Grow {
    /// english-oak, carya-illinoinensis, betula-populifolia, hazel, male-fern, meadow-grass, or a
    /// species .toml file.
    pub species: String,
    /// File to write.
    #[arg(short, long, value_name = "OUT.glb")]
    pub output: PathBuf,
    /// Exact number of leaves; by default the species' own number.
    #[arg(long)]
    pub leaves: Option<u32>,
    /// Random seed; a different seed grows a different tree of the same species.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

/// `foliage-lod render`.
#[derive(Parser)]
pub struct Render {
    /// A model (.vds) or a scene (.toml).
    pub model: PathBuf,
    /// Picture to write.
    #[arg(short, long, value_name = "OUT.png")]
    pub output: PathBuf,
    /// Distance of the camera from the plant's centre, in radii of its bounding sphere; by default
    /// the plant fills the picture.
    #[arg(long)]
    pub distance: Option<f32>,
    /// Render the tree at each of these distances, in radii, side by side.
    #[arg(long, value_name = "D1,D2,...", value_delimiter = ',', conflicts_with_all = ["distance", "ring", "grid"])]
    pub row: Option<Vec<f32>>,
    /// Render N trees in a circle.
    #[arg(long, value_name = "N", conflicts_with_all = ["distance", "grid"])]
    pub ring: Option<u32>,
    /// Render a forest of N x N trees.
    #[arg(long, value_name = "N", conflicts_with = "distance")]
    pub grid: Option<u32>,
    /// Level of detail from 0 to 1; by default it depends on the distance. Above 0, a plant without
    /// wood keeps at least one leaf.
    #[arg(long, conflicts_with = "leaves_count")]
    pub lod: Option<f32>,
    /// Number of leaves to draw; by default it depends on the distance.
    #[arg(long, value_name = "N")]
    pub leaves_count: Option<u32>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "768x768", value_parser = size)]
    pub size: [u32; 2],
    /// How the leaves to draw are chosen.
    #[arg(long, value_enum, default_value_t = Method::Vds)]
    pub method: Method,
    /// Random seed that selects the leaves kept in a stochastic picture.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Draw the model's impostor, or one made for the picture, where the tree has at most this
    /// diameter in pixels.
    #[arg(long, value_name = "PX")]
    pub far: Option<f32>,
    /// Error in pixels that the wood is drawn at; 0 draws all of it. By default 0.5.
    #[arg(long, value_name = "PX")]
    pub wood_error: Option<f32>,
    /// Draw so many leaves or triangles in all, or what a frame of so many milliseconds has room
    /// for, split among the plants of a scene so that the error that shows is least, or by the rule
    /// of its `[budget]`.
    #[arg(long, value_name = "leaves=N|triangles=N|ms=X", value_parser = amount)]
    pub budget: Option<Amount>,
    /// Rule for enlarging the leaves of a stochastic picture.
    #[arg(long, value_parser = variant::<AreaRule>(), default_value_t)]
    pub area: AreaRule,
    /// Fade the last leaves in and out by this rule.
    #[arg(long, value_enum)]
    pub fade: Option<FadeRule>,
    /// Property of a leaf that changes as it fades.
    #[arg(long, value_parser = variant::<FadeBy>(), default_value_t, requires = "fade")]
    pub fade_by: FadeBy,
    /// Keep the contrast of the full plant as leaves become fewer and larger.
    #[arg(long)]
    pub contrast: bool,
    /// Draw enlarged leaves nearer to the plant's mean colour, if their model has a tone; then
    /// --contrast has no effect.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub tone: Switch,
    /// Light the leaves as parts of a round crown.
    #[arg(long)]
    pub crown_normals: bool,
    /// Let light shine through the leaves.
    #[arg(long)]
    pub translucency: bool,
    /// Move the trunk, branches and leaves in a breeze.
    #[arg(long)]
    pub wind: bool,
    /// Time of the animation in seconds.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub seconds: f64,
    /// Processor that renders the picture.
    #[arg(long, value_enum, default_value_t = Raster::Auto)]
    pub raster: Raster,
    /// Print one JSON object instead of a line per step.
    #[arg(long)]
    pub json: bool,
}

impl Render {
    /// Options that a scene file replaces, and whether each one is set.
    pub fn not_for_scenes(&self) -> [(&'static str, bool); 14] {
        [
            ("--far", self.far.is_some()),
            ("--wood-error", self.wood_error.is_some()),
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

/// Parses the command line.
///
/// # Errors
/// [`Failure::Usage`], also for help and version.
pub fn parse() -> Result<Args, Failure> {
    Args::try_parse().map_err(Failure::Usage)
}

impl Preset {
    /// The library's options.
    pub fn options(self) -> SimplifyOptions {
        match self {
            Self::Paper => SimplifyOptions::paper(),
            Self::Fast => SimplifyOptions::fast(),
            Self::Balanced => SimplifyOptions::balanced(),
            Self::Best => SimplifyOptions::best(),
        }
    }
}

impl Simplify {
    /// The preset with the command line's overrides.
    pub fn options(&self) -> SimplifyOptions {
        let mut options = self.preset.options();
        options.criterion = self.criterion.unwrap_or(options.criterion);
        options.compensate = self.compensate.unwrap_or(options.compensate);
        options.resolution = self.resolution.unwrap_or(options.resolution);
        options.views = self.views.unwrap_or(options.views);
        options.background &= !self.no_background;
        options.intrinsic = self.intrinsic.unwrap_or(options.intrinsic);
        options.max_scale = self.max_scale.unwrap_or(options.max_scale);
        options.cascade = self.cascade.unwrap_or(options.cascade);
        options.grow_by = self.growth.unwrap_or(options.grow_by);
        options.threads = self.threads;
        options.max_memory_mb = self.max_memory;
        options
    }
}

impl Report {
    /// Number of methods that `--against` adds.
    pub fn against_methods(&self) -> usize {
        usize::from(!self.against.is_empty())
    }
}

/// Sizes of an impostor.
#[derive(Clone, Copy)]
pub struct Frames(pub BakeOptions);

/// Parses the sizes of an impostor, such as 12x64.
fn frames(text: &str) -> Result<Frames, String> {
    let numbers = text.split_once('x').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let (across, frame_px) = numbers.ok_or("two numbers such as 12x64 are needed")?;
    let options = BakeOptions { across, frame_px, ..BakeOptions::default() };
    options.check().map_err(|error| error.to_string())?;
    Ok(Frames(options))
}

/// Parses `WxH`.
fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let sides: [u32; 2] = sides.ok_or("write the width and height in pixels as WxH, such as 768x768")?;
    if sides.iter().all(|side| (1..=MAX_IMAGE_SIDE).contains(side)) {
        Ok(sides)
    } else {
        Err(format!("each side must be 1 to {MAX_IMAGE_SIDE} pixels long"))
    }
}

/// Parses the amount of a budget.
fn amount(text: &str) -> Result<Amount, String> {
    let allowed = "leaves=N, triangles=N or ms=X, such as leaves=500000";
    let (unit, number) = text.split_once('=').ok_or(allowed)?;
    let number: f64 = number.parse().map_err(|_| allowed)?;
    let amount = match unit {
        "leaves" => Amount::Leaves(number),
        "triangles" => Amount::Triangles(number),
        "ms" => Amount::Ms(number),
        _ => return Err(allowed.into()),
    };
    BudgetEntry::of(amount).check().map(|()| amount).map_err(|error| error.to_string())
}
