//! How much memory a plant may take while it is written, told from the number of its corners before they are.
//!
//! What a file is compressed to says little: Draco and meshopt need a byte for some triangles, one mesh may have many
//! instances, and both are what honest files do.

use super::{
    ImportOptions,
    fault::{Fault, limit},
};
use crate::{
    memory::{MEGABYTE, limit_mb},
    plant::MAX_ELEMENTS,
};
use std::cell::OnceCell;

/// Bytes held for each corner of a triangle. Measured: 135 to 275 for trees without large textures.
const CORNER_BYTES: u64 = 250;

/// Megabytes that any plant may take: the system is not asked about less.
const ALWAYS_MB: u64 = 64;

/// Memory that a plant may take.
pub(super) struct Budget {
    max_mb: Option<u64>,
    limit_mb: OnceCell<Option<u64>>,
}

impl Budget {
    /// What the options allow, or what there is.
    pub(super) fn new(options: &ImportOptions) -> Self {
        Self { max_mb: options.max_memory_mb, limit_mb: OnceCell::new() }
    }

    /// Fails for more corners, instances counted, than a plant may have or than memory is left for.
    pub(super) fn check(&self, corners: u64) -> Result<(), Fault> {
        limit("the number of indices, instances counted,", corners, MAX_ELEMENTS as u64)?;
        let value = (corners * CORNER_BYTES).div_ceil(MEGABYTE);
        if self.max_mb.is_none() && value <= ALWAYS_MB {
            return Ok(());
        }
        match *self.limit_mb.get_or_init(|| limit_mb(self.max_mb)) {
            Some(limit) if value > limit => Err(Fault::TooLarge {
                what: format!("the memory for {} triangles, instances counted, in MB,", corners / 3),
                value,
                limit,
                fix: "split the file, simplify it first or raise `max_memory_mb`",
            }),
            _ => Ok(()),
        }
    }
}
