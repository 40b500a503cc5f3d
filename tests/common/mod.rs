//! Shared by the integration tests: generated plants and slow oracles.
#![allow(dead_code)] // Each test binary uses its part.

pub mod naive;
pub mod plants;
