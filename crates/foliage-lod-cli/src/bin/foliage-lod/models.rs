//! Reads models, and tells what was skipped of their files.

use crate::{failure::complain, output};
use foliage_lod::{FoliageModel, Result, model::ModelFile};
use std::path::Path;

/// Reads a model; sections of the file that are not known give warnings on stderr.
pub fn read(path: impl AsRef<Path>) -> Result<FoliageModel> {
    let file = ModelFile::read(path)?;
    output::skipped_lines(&file).for_each(complain);
    Ok(file.model)
}
