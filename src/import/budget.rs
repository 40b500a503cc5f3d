//! Memory budget of an import, estimated from the number of triangle corners to be written.
//!
//! The compressed size of a file says little: Draco and meshopt need a byte for several triangles,
//! one mesh may have many instances, and ordinary files do both.

use super::{
    ImportOptions,
    fault::{Fault, limit},
};
use crate::{
    memory::{MEGABYTE, limit_mb},
    plant::MAX_ELEMENTS,
};
use std::cell::OnceCell;

/// Bytes of memory per triangle corner. Measured: 135 to 275 for trees without large textures.
const CORNER_BYTES: u64 = 250;

/// Memory in megabytes that any plant may use: below this the system is not queried.
const ALWAYS_MB: u64 = 64;

/// Memory that a plant may use.
pub(super) struct Budget {
    max_mb: Option<u64>,
    limit_mb: OnceCell<Option<u64>>,
}

impl Budget {
    /// Uses the limit of the options, or the available memory.
    pub(super) fn new(options: &ImportOptions) -> Self {
        Self { max_mb: options.max_memory_mb, limit_mb: OnceCell::new() }
    }

    /// Fails if `corners`, including instances, exceeds the limit of a plant or the memory.
    pub(super) fn check(&self, corners: u64) -> Result<(), Fault> {
        limit("the number of indices, including instances,", corners, MAX_ELEMENTS as u64)?;
        let value = (corners * CORNER_BYTES).div_ceil(MEGABYTE);
        if self.max_mb.is_none() && value <= ALWAYS_MB {
            return Ok(());
        }
        match *self.limit_mb.get_or_init(|| limit_mb(self.max_mb)) {
            Some(limit) if value > limit => Err(Fault::TooLarge {
                what: format!("the estimated memory in MB for {} triangles, including instances,", corners / 3),
                value,
                limit,
                fix: "split the file, simplify it first or raise `max_memory_mb`",
            }),
            _ => Ok(()),
        }
    }
}
