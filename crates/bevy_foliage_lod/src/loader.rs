//! Loads `.vds` files.

use crate::asset::FoliageAsset;
use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    reflect::TypePath,
};
use foliage_lod::FoliageModel;

/// Loads `.vds` files, as the command `foliage-lod` writes them.
#[derive(Debug, Default, TypePath)]
pub struct FoliageLoader;

/// Why a file was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum FoliageLoaderError {
    /// The file cannot be read.
    #[error("cannot read the file: {0}")]
    Io(#[from] std::io::Error),
    /// The file is not a valid model; the message tells what is wrong and how to mend it.
    #[error(transparent)]
    Model(#[from] foliage_lod::Error),
}

impl AssetLoader for FoliageLoader {
    type Asset = FoliageAsset;
    type Settings = ();
    type Error = FoliageLoaderError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        load_context: &mut LoadContext<'_>,
    ) -> Result<FoliageAsset, FoliageLoaderError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let model = FoliageModel::from_bytes(&bytes)?;
        Ok(FoliageAsset::build(model, load_context)?)
    }

    fn extensions(&self) -> &[&str] {
        &["vds"]
    }
}
