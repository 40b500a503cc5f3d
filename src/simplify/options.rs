//! Options of the simplification, with presets.

use super::views::{MAX_RESOLUTION, check_view_count};
use crate::{Error, Result, error::check_range};
use strum::{Display, EnumMessage, EnumString, IntoStaticStr, VariantArray};

/// Upper limit of [`SimplifyOptions::max_scale`]. Together with the largest resolution it keeps
/// edge functions within `i64`.
pub const MAX_SCALE_LIMIT: f32 = 64.0;

/// Criterion that chooses the next leaf to prune.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Criterion {
    /// Smallest change in viewpoint mutual information.
    #[default]
    Vmi,
    /// Smallest visible area.
    Area,
    /// Smallest change in the images: colour and coverage, compared with the full plant's.
    Image,
}

/// Compensation for the area of a pruned leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Compensate {
    /// The nearest remaining leaf grows by the visible share of the area (after Gasch et al.).
    #[default]
    Nearest,
    /// Among the nearest remaining leaves, the one that restores the most pixels of the full
    /// plant's silhouettes, minus the pixels that it adds outside them; none if no growth is an
    /// improvement.
    Silhouette,
    /// Among the nearest remaining leaves and several growths, the one that brings the images
    /// closest to the full plant's; none if no growth is an improvement.
    Image,
    /// No compensation: the area is lost.
    None,
}

impl Criterion {
    /// Name on the command line and in the model.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

impl Compensate {
    /// Name on the command line and in the model.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// How leaves grow that make up for pruned ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum GrowBy {
    /// Each is drawn larger (after Gasch et al.).
    Scale,
    /// Cut-out leaves that fill a rectangle of their texture repeat it, so that what they show
    /// keeps its size; other leaves are drawn larger.
    Tile,
    /// By tiling, if a coarse trial finds neither the error nor the silhouette nor the grain of the
    /// views worse for it; not in sparse crowns, where tiles show as a grid.
    #[default]
    Auto,
    /// As auto, but a leaf that stands for four or more becomes a card with a picture of them,
    /// where the views show that it pays: mostly in sparse crowns. Renderers and exported levels
    /// draw the cards; continuous glTF, pages and the plug-in for Bevy enlarge the leaf.
    Picture,
}

/// Options of a simplification.
#[derive(Debug, Clone, PartialEq)]
pub struct SimplifyOptions {
    /// Name of the preset that the other fields started from, stored in the model's recipe.
    pub preset: String,
    /// Criterion that chooses the next leaf to prune. Matters less than `compensate`.
    pub criterion: Criterion,
    /// Rule for which leaf grows when one is pruned, and by how much.
    pub compensate: Compensate,
    /// Side of each view in pixels, 1 to [`MAX_RESOLUTION`]. Time and memory grow with its square;
    /// below 128, small leaves fall between the pixels of all views and count as hidden.
    pub resolution: u32,
    /// Number of views, one of [`VIEW_COUNTS`](super::views::VIEW_COUNTS). Time and memory grow in
    /// proportion; with few views, some visible leaves count as hidden.
    pub views: u32,
    /// Counts the background as one more polygon, so that holes against the sky matter (VMI only).
    /// Without it, every step recomputes every error: minutes instead of seconds for large plants.
    pub background: bool,
    /// Cost of leaves that no view sees, 0 to 1 (criterion image only): 1 prices a covered pixel of
    /// the dearest leaf like a pixel that shows the background instead of a polygon. At 0 all
    /// hidden leaves are pruned first; at 0.01 many of them last as long as visible leaves of
    /// little use. From outside, half of the leaves then have an RMSE that is up to twice as high;
    /// from within, it is lower on some plants and higher on others.
    pub intrinsic: f32,
    /// Largest linear scale of any leaf, 1 to [`MAX_SCALE_LIMIT`]. Without a cap, chains of targets
    /// reach 10 to 20 and look like balloons; a low cap thins out the last few percent of the
    /// leaves.
    pub max_scale: f32,
    /// Halves the resolution once leaves have grown: when 15 % of them are left, and again at 4 %.
    /// Saves a third of the time at little loss, since enlarged leaves need fewer pixels.
    pub cascade: bool,
    /// How leaves grow.
    pub grow_by: GrowBy,
    /// Gives the model a tone for enlarged leaves ([`Growth::tone`](crate::model::Growth::tone)),
    /// chosen by how many leaves lie behind each other. Does not affect order and scales.
    pub tone: bool,
    /// Number of threads; 0 uses one per core. Does not affect the result.
    pub threads: usize,
    /// Memory limit in megabytes. Simplifications with a higher [estimate](super::estimated_bytes)
    /// are refused before they start. `None` uses the available memory of the machine as the limit,
    /// or no limit if that is unknown. Does not affect the result.
    pub max_memory_mb: Option<u64>,
}

impl SimplifyOptions {
    /// The method as published: VMI, and the nearest leaf grows by the visible share of the lost
    /// area (the paper gives no formula); 20 views of 256 x 256.
    pub fn paper() -> Self {
        Self {
            preset: "paper".into(),
            criterion: Criterion::Vmi,
            compensate: Compensate::Nearest,
            resolution: 256,
            views: 20,
            background: true,
            intrinsic: 0.0,
            max_scale: 8.0,
            cascade: false,
            grow_by: GrowBy::Scale,
            tone: false,
            threads: 0,
            max_memory_mb: None,
        }
    }

    /// Quick: everything is judged by images of 128 x 128, with fewer pixels once leaves have
    /// grown.
    pub fn fast() -> Self {
        Self { preset: "fast".into(), resolution: 128, ..Self::balanced() }
    }

    /// Everything is judged by images of 256 x 256, with fewer pixels once leaves have grown.
    pub fn balanced() -> Self {
        Self {
            preset: "balanced".into(),
            criterion: Criterion::Image,
            compensate: Compensate::Image,
            cascade: true,
            grow_by: GrowBy::Auto,
            tone: true,
            ..Self::paper()
        }
    }

    /// Everything is judged by images of 512 x 512.
    pub fn best() -> Self {
        Self { preset: "best".into(), resolution: 512, cascade: false, ..Self::balanced() }
    }

    /// Checks the range of every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first field outside its range.
    pub fn validate(&self) -> Result<()> {
        check_range("resolution", self.resolution, 1..=MAX_RESOLUTION)?;
        check_view_count(self.views)?;
        check_range("intrinsic", self.intrinsic, 0.0..=1.0)?;
        if self.intrinsic > 0.0 && self.criterion != Criterion::Image {
            let allowed = format!("0 with the criterion {}: only `image` has an intrinsic cost", self.criterion);
            return Err(Error::invalid("intrinsic", self.intrinsic, allowed));
        }
        check_range("max_scale", self.max_scale, 1.0..=MAX_SCALE_LIMIT)
    }
}

impl Default for SimplifyOptions {
    fn default() -> Self {
        Self::balanced()
    }
}
