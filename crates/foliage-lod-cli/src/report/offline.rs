//! Cost of simplification: time and memory against resolution, views, criterion and compensation.

use super::{method::Method, study::Study};
use foliage_lod::{
    Plant, Result,
    measure::Quality,
    simplify::{Compensate, Criterion, FragmentSource, Observer, SimplifyOptions, simplify},
};

/// Level at which quality is measured: the lowest level in the paper's pictures.
pub const LEVEL: f64 = 0.15;

/// Measurements of one simplification.
#[derive(Debug, Clone, PartialEq)]
pub struct OfflineRow {
    /// The plant's name.
    pub plant: String,
    /// Preset that the options started from, with a `*` if an option was changed.
    pub preset: String,
    /// Side of the views in pixels.
    pub resolution: u32,
    /// Number of views.
    pub views: u32,
    /// Name of the criterion.
    pub criterion: &'static str,
    /// Name of the compensation rule.
    pub compensate: &'static str,
    /// Whether the resolution is halved at 15 % of the leaves, and again at 4 %.
    pub cascade: bool,
    /// Wall-clock time of the trial of growth, of capturing fragments and of pruning.
    pub seconds: f64,
    /// Peak memory of the process during the simplification, including the plant and its pictures;
    /// `None` if the system does not report it.
    pub peak_bytes: Option<u64>,
    /// Quality at [`LEVEL`] and the study's first size.
    pub quality: Quality,
}

/// The presets: the paper's, then ours in order of cost.
pub fn presets() -> [SimplifyOptions; 4] {
    [SimplifyOptions::paper(), SimplifyOptions::fast(), SimplifyOptions::balanced(), SimplifyOptions::best()]
}

/// Variants of the presets: one option of `balanced` changed at a time, and `best` with the
/// cascade.
pub fn variants() -> Vec<SimplifyOptions> {
    let balanced = SimplifyOptions { preset: "balanced*".into(), ..SimplifyOptions::balanced() };
    let resolution = |resolution| SimplifyOptions { resolution, ..balanced.clone() };
    let views = |views| SimplifyOptions { views, ..balanced.clone() };
    let compensate = |compensate| SimplifyOptions { compensate, ..balanced.clone() };
    let best = SimplifyOptions { preset: "best*".into(), ..SimplifyOptions::best() };
    vec![
        resolution(64),
        views(6),
        views(12),
        SimplifyOptions { criterion: Criterion::Vmi, ..balanced.clone() },
        SimplifyOptions { criterion: Criterion::Area, ..balanced.clone() },
        compensate(Compensate::Silhouette),
        compensate(Compensate::Nearest),
        compensate(Compensate::None),
        SimplifyOptions { cascade: false, ..balanced.clone() },
        SimplifyOptions { cascade: true, ..best },
    ]
}

/// Simplifies a plant and measures time, memory and quality; the returned method draws the
/// prefixes.
///
/// # Errors
/// Errors from [`simplify`] and [`Study::quality`].
pub fn measure(
    plant: &Plant,
    study: &Study<'_>,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(OfflineRow, Method)> {
    reset_peak();
    let made = simplify(plant, options, source, observer)?;
    let peak_bytes = peak_bytes();
    let method = Method::of_toned_model(&options.preset, made.model, study.mean_shaded()?);
    let row = OfflineRow {
        plant: plant.name.clone(),
        preset: options.preset.clone(),
        resolution: options.resolution,
        views: options.views,
        criterion: options.criterion.name(),
        compensate: options.compensate.name(),
        cascade: options.cascade,
        seconds: made.seconds.growth + made.seconds.fragments + made.seconds.prune,
        peak_bytes,
        quality: study.quality(&method.at(LEVEL), 0)?,
    };
    Ok((row, method))
}

/// Resets the peak memory counter of the process, where the system supports it (Linux).
fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Peak memory of the process in bytes; `None` if the system does not report it.
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
