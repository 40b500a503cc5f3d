//! Options of the simplification, with presets.

use super::views::{MAX_RESOLUTION, check_view_count};
use crate::{Result, error::check_range};

/// Greatest linear growth that may be asked for; with the greatest resolution it keeps edge functions within `i64`.
pub const MAX_SCALE_LIMIT: f32 = 64.0;

/// What decides which leaf goes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// Least change of the viewpoint mutual information.
    #[default]
    Vmi,
    /// Least visible area.
    Area,
    /// Least change of the pictures: colour and coverage, compared with those of the full plant.
    Image,
}

/// What becomes of the area that a pruned leaf leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compensate {
    /// The nearest remaining leaf takes the share of it that was seen (after Gasch et al.).
    #[default]
    Nearest,
    /// Of the nearest remaining leaves the one grows that wins back most pixels of the full plant's silhouettes, less those
    /// that it adds outside them; none where none would.
    Silhouette,
    /// Of the nearest remaining leaves and several growths, what brings the pictures closest to the full plant's; nothing
    /// where nothing would.
    Image,
    /// It is lost.
    None,
}

impl Criterion {
    /// Name on the command line and in the model.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vmi => "vmi",
            Self::Area => "area",
            Self::Image => "image",
        }
    }
}

impl Compensate {
    /// Name on the command line and in the model.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Silhouette => "silhouette",
            Self::Image => "image",
            Self::None => "none",
        }
    }
}

/// How a plant is simplified.
#[derive(Debug, Clone, PartialEq)]
pub struct SimplifyOptions {
    /// Name of the preset that the other fields started from, for the model's recipe.
    pub preset: String,
    /// What decides which leaf goes next. Matters less than `compensate`.
    pub criterion: Criterion,
    /// Which leaf grows when one goes, and by how much.
    pub compensate: Compensate,
    /// Pixels on a side of each view, 1 to [`MAX_RESOLUTION`]. Time and memory grow with its square; below 128 small leaves
    /// fall between the pixels of all views and count as hidden.
    pub resolution: u32,
    /// Number of views: one of [`VIEW_COUNTS`]. Time and memory grow in proportion; few views see leaves as hidden that are not.
    pub views: u32,
    /// The background counts as one more polygon, so that holes against the sky are seen (VMI only). Without it every step
    /// computes every error again: minutes instead of seconds for large plants.
    pub background: bool,
    /// Largest linear scale that any leaf may reach, 1 to [`MAX_SCALE_LIMIT`]. Uncapped chains reach 10 to 20 and read as
    /// balloons; a low cap thins out the last few percent of the leaves.
    pub max_scale: f32,
    /// Halves the resolution once leaves have grown: when 15 % of them are left, and again at 4 %. Saves a third of the time
    /// at little loss, since enlarged leaves need fewer pixels.
    pub cascade: bool,
    /// Threads; 0 takes one per core. The result does not depend on it.
    pub threads: usize,
    /// Megabytes that may be taken, as [`memory`](super::memory) tells before the work: above that it is refused. `None`
    /// takes what the machine has available, and no limit where that is unknown. The result does not depend on it.
    pub max_memory_mb: Option<u64>,
}

impl SimplifyOptions {
    /// The method as published: VMI, and the nearest leaf takes the lost area as far as it was seen (the paper prints no
    /// law); 20 views of 256 x 256.
    pub fn paper() -> Self {
        Self {
            preset: "paper".into(),
            criterion: Criterion::Vmi,
            compensate: Compensate::Nearest,
            resolution: 256,
            views: 20,
            background: true,
            max_scale: 8.0,
            cascade: false,
            threads: 0,
            max_memory_mb: None,
        }
    }

    /// Quick: everything judged by pictures of 128 x 128, fewer pixels once leaves have grown.
    pub fn fast() -> Self {
        Self { preset: "fast".into(), resolution: 128, ..Self::balanced() }
    }

    /// Everything judged by pictures of 256 x 256, fewer pixels once leaves have grown.
    pub fn balanced() -> Self {
        Self {
            preset: "balanced".into(),
            criterion: Criterion::Image,
            compensate: Compensate::Image,
            cascade: true,
            ..Self::paper()
        }
    }

    /// Everything judged by pictures of 512 x 512.
    pub fn best() -> Self {
        Self { preset: "best".into(), resolution: 512, cascade: false, ..Self::balanced() }
    }

    /// Checks every field's range.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first field outside its range.
    pub fn validate(&self) -> Result<()> {
        check_range("resolution", self.resolution, 1..=MAX_RESOLUTION)?;
        check_view_count(self.views)?;
        check_range("max_scale", self.max_scale, 1.0..=MAX_SCALE_LIMIT)
    }
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        Self::balanced()
    }
}
