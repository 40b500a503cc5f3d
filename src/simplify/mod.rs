//! Placeholder head of `simplify`.

pub mod fragments;
pub mod options;
pub mod raster;
pub mod views;
