//! Stochastic pruning: leaves are dropped in random order and the rest are scaled uniformly. Serves
//! as the baseline and as a mode of its own.
//!
//! After R. Cook, J. Halstead, M. Planck, D. Ryu, *Stochastic Simplification of Aggregate Detail*
//! (2007), with the alternatives of three open implementations: F. Gomez, *Rendering Dense
//! Foliage*; M. Fichtner, *GPU-based Stochastic Foliage Simplification*; M. Mack, *Stochastic
//! Pruning for Real-Time LOD*.
//!
//! ```text
//! offline    Plant --order(seed)--> FoliageModel without enlargement
//!            Plant --views--------> visible share r
//! run time   distance or screen area --lambda--> share of the leaves
//!            share of the leaves --area-----> scale of every leaf
//!                                --fade-----> presence of the last leaves
//!                                --contrast-> shaded colours moved towards their mean
//! ```
//!
//! `lambda` is the share of the leaves that remain, 0 to 1. A leaf's *rank* is its position in the
//! order divided by the number of leaves. The LOD policy with Cook's law is
//! [`CookLambda`](crate::extract::CookLambda).
//!
//! Limits: suited to leaves that are numerous, small on screen and similar. The order ignores
//! silhouettes and occlusion.

mod area;
pub mod contrast;
mod fade;
pub mod lambda;
#[cfg(feature = "simplify")]
mod order;

pub use area::{AreaRule, visible_factor};
pub use fade::FadeWindow;
#[cfg(feature = "simplify")]
pub use order::{Stochastic, order, shuffled, visible_share};
