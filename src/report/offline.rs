//! What a model costs to make: time and memory against resolution, views, criterion and compensation.

use super::{method::Method, metrics::Quality, study::Study};
use crate::{
    Plant, Result,
    simplify::{Compensate, Observer, SimplifyOptions, fragments::FragmentSource, options::Criterion, simplify},
};

/// The level at which quality is told: the paper's smallest picture.
pub const LEVEL: f64 = 0.15;

/// One model made.
#[derive(Debug, Clone, PartialEq)]
pub struct OfflineRow {
    /// The plant's name.
    pub plant: String,
    /// Preset that the options started from; with changed options it carries a `*`.
    pub preset: String,
    /// Pixels on a side of the views.
    pub resolution: u32,
    /// Number of views.
    pub views: u32,
    /// Name of the criterion.
    pub criterion: &'static str,
    /// Name of the rule that enlarges.
    pub compensate: &'static str,
    /// Half the resolution from 15 % of the leaves on, and a quarter from 4 %.
    pub cascade: bool,
    /// Fragments and order, wall-clock.
    pub seconds: f64,
    /// Most memory that the process held meanwhile, the plant and its pictures included; `None` where the system does not tell.
    pub peak_bytes: Option<u64>,
    /// At [`LEVEL`], at the study's first size.
    pub quality: Quality,
}

/// The presets, in the order of their cost.
pub fn presets() -> [SimplifyOptions; 4] {
    [SimplifyOptions::paper(), SimplifyOptions::fast(), SimplifyOptions::balanced(), SimplifyOptions::best()]
}

/// What else is tried: one option of `balanced` changed at a time.
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

/// Makes a model and measures what it took; the method draws its prefixes.
///
/// # Errors
/// Those of [`simplify`] and of the study's drawing.
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
    let method = Method::of_model(&options.preset, made.model);
    let row = OfflineRow {
        plant: plant.name.clone(),
        preset: options.preset.clone(),
        resolution: options.resolution,
        views: options.views,
        criterion: options.criterion.name(),
        compensate: options.compensate.name(),
        cascade: options.cascade,
        seconds: made.seconds.fragments + made.seconds.prune,
        peak_bytes,
        quality: study.quality(&method.at(LEVEL), 0)?,
    };
    Ok((row, method))
}

/// Lets the system count the peak anew, where it can.
fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Most memory that the process held at once, in bytes; `None` where the system does not tell.
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
