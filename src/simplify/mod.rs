//! Placeholder head of `simplify`.

pub mod fragments;
