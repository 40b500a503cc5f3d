//! Stochastic pruning: leaves in random order, those that stay grow alike. The baseline, and a mode of its own.
//!
//! After R. Cook, J. Halstead, M. Planck, D. Ryu, *Stochastic Simplification of Aggregate Detail* (2007), with the choices of
//! three open implementations beside it: F. Gomez, *Rendering Dense Foliage*; M. Fichtner, *GPU-based Stochastic Foliage
//! Simplification*; M. Mack, *Stochastic Pruning for Real-Time LOD*.
//!
//! ```text
//! offline    Plant --order(seed)--> FoliageModel, nothing enlarged;  Plant --views--> visible share r
//! run time   sight --lambda--> share of the leaves --area--> scale of each of them
//!                                                 --fade--> how much of each of the last ones is there
//!                                                 --contrast--> shaded colours drawn to their mean
//! ```
//!
//! `lambda` is the share of the leaves that stay, 0 to 1; a leaf's *rank* is its place in the order over the number of leaves.
//! Cook's law for lambda itself is [`CookLambda`](crate::extract::lod::CookLambda).
//!
//! Limits: fit for leaves that are many, small on screen and alike. The order does not know silhouettes or what is hidden.

pub mod area;
pub mod contrast;
pub mod fade;
pub mod lambda;
#[cfg(feature = "simplify")]
pub mod order;

pub use area::AreaRule;
pub use fade::Fade;
#[cfg(feature = "simplify")]
pub use order::{Stochastic, visible_share};
