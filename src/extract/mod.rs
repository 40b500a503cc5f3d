//! Run time: from where a plant is seen to how many of its leaves are drawn, and at what scales.
//!
//! ```text
//! Sight --LodPolicy--> LOD in 0..=1 --leaf_count--> n --Hysteresis--> n --Swap::set_active--> changed scales
//! ```
//!
//! Per plant and frame. [`lod`] holds the policies, [`swap`] the scales of one plant on screen; where scales are looked up
//! by [`Timeline`](crate::model::Timeline) instead, `n` is all that a plant needs.

pub mod lod;
pub mod swap;

pub use lod::{Hysteresis, LodPolicy, Sight, leaf_count};
pub use swap::Swap;
