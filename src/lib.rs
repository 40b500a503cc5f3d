//! Continuous level of detail for trees, leaf by leaf.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod bounds;
mod error;
pub mod file;
pub mod leaf;
pub mod material;
pub mod plant;

#[cfg(feature = "simplify")]
pub mod grow;
#[cfg(feature = "simplify")]
pub mod import;
pub mod model;

pub mod extract;
#[cfg(feature = "simplify")]
pub mod simplify;

#[cfg(any(feature = "simplify", feature = "render"))]
pub mod render;

pub use error::{Error, Result};
pub use plant::Plant;

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
