//! Run time: from how a plant is seen to the number of leaves drawn and their scales.
//!
//! ```text
//! Sight --LodPolicy--> LOD in 0..=1 --active_count--> n --Hysteresis--> n
//! n --Swap::set_active--> changed scales
//! ```
//!
//! This runs once per plant and frame. [`LodPolicy`] is the rule, and [`Swap`] holds the scales of
//! one plant on screen. If scales are looked up in a [`Timeline`](crate::model::Timeline) instead,
//! `n` is all that a plant needs.

mod far;
pub(crate) mod lod;
pub(crate) mod sight;
pub(crate) mod swap;

pub use far::Far;
pub use lod::{
    Blend, CookLambda, Hysteresis, LodPolicy, PixelError, Sizes, active_count, fewest_leaves, fewest_visible,
    leaf_count,
};
pub use sight::{REFERENCE_FOV_Y, Sight};
pub use swap::{BLOCK_LEAVES, Swap};
