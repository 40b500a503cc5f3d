//! Loads `.vds` files and continuous glTF.

use crate::asset::FoliageAsset;
use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    reflect::TypePath,
};
use foliage_lod::{FoliageModel, continuous};

/// Loads the models that the command `foliage-lod` writes: `.vds` files, and continuous glTF
/// (`foliage-lod export`), which is told by its content.
///
/// It is the only loader of [`FoliageAsset`]s, so a handle of that type loads a file of any name. A
/// `.glb` whose type is not told is left to Bevy's own loader, one named `.foliage.glb` is not.
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
        let is_gltf = continuous::is_glb(&bytes);
        let model = if is_gltf { continuous::read(&bytes)? } else { FoliageModel::from_bytes(&bytes)? };
        Ok(FoliageAsset::build(model, load_context)?)
    }

    fn extensions(&self) -> &[&str] {
        &["vds", "foliage.glb"]
    }
}
