//! Helpers shared by the integration tests: generated plants and slow oracles.
#![allow(dead_code)] // Each test binary uses only some of it.

#[cfg(feature = "render")]
pub mod gpu;
pub mod models;
pub mod naive;
mod naive_raster;
pub mod plants;
#[cfg(feature = "render")]
pub mod stage;
pub mod version1;
pub mod version2;
