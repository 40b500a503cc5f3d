//! Quality measures: differences between pictures with fewer leaves and pictures of the full plant.
//!
//! A [`Reference`] holds the full plant's pictures from views that no simplification uses;
//! [`matched_px`] is the picture size at which a level is looked at; [`Target`] finds the fewest
//! leaves that keep a bound, such as a structural similarity of 0.9 at 200 pixels.

mod held_out;
mod matched;
mod metrics;
mod reference;
mod target;

pub use held_out::{FOV_Y, cameras, far_camera, far_cameras};
pub use matched::matched_px;
pub use metrics::{Comparison, Quality, largest_change};
pub use reference::{Reference, measured, pictures};
pub use target::{Measure, Reached, Target};
