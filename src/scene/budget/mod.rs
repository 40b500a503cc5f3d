//! One budget for all plants in view: as many leaves (or triangles, or pixels) as it allows, split
//! so that the error that shows is least.
//!
//! ```text
//! ErrorCurve of each model --Rule--> demand: leaves that are worth more than a bound
//! Items (curve, size on screen, floor, ceiling, costs) --Splitter--> the bound that spends the
//!                                                 budget, and with it the count of each plant
//! ```
//!
//! After T. Funkhouser and C. Séquin, *Adaptive Display Algorithm for Interactive Frame Rates
//! During Visualization of Complex Virtual Environments* (1993), who maximise the sum of benefits
//! within a sum of costs, and E. Gobbetti and E. Bouvier, *Time-critical Multiresolution Scene
//! Rendering* (1999), for whom detail is continuous and the problem convex. Here the errors are
//! measured, and their curves are convex hulls, so that one number solves it: with n_i leaves of
//! plant i at the cost c_i each, and its error E_i(n_i) on screen,
//!
//! ```text
//! minimise sum E_i(n_i)^q with sum c_i n_i <= B:  n_i(mu) leaves take off more than mu c_i each
//! ```
//!
//! and the sum of costs falls as mu rises. Curves at another size on screen are the same, times a
//! power of the diameter: in octaves, shifted. So mu is found by bisection over the plants, or over
//! a histogram of how far their curves are shifted. Sums are of integers: counts depend neither on
//! the order of the plants nor on the machine.
//!
//! Where a share w_i of a plant's pixels shows behind others (see
//! [`visibility`](super::visibility)) that share of E_i^q is added, as of a plant of fewer pixels:
//! its weight is w_i^(1/q), but for q > 2 the root, as the worst error knows no shares.
//!
//! Limits: without such weights the error of plants behind others counts in full.

mod bisect;
mod crowd;
mod demand;
mod histogram;
mod item;
mod octaves;
mod pace;
mod rule;
mod splitter;
mod steady;
mod units;
mod weighed;

pub use demand::Exponent;
pub use item::{Item, MOST_DIAMETER_PX};
pub use pace::{Load, Pace, Times};
pub use rule::{CookShare, GomezShare, Rule};
pub use splitter::{Spent, Splitter};
