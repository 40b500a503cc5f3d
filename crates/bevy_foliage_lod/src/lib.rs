//! Trees with a continuous level of detail, leaf by leaf, for Bevy.
//!
//! A plant is drawn with any number of its leaves: those that matter least go first, and their
//! neighbours grow to fill the gaps. Leaves and wood are drawn by Bevy's own passes, so lights,
//! shadows, prepasses and fog work as for any mesh.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_foliage_lod::prelude::*;
//!
//! fn main() {
//!     let plugins = (DefaultPlugins, FoliageLodPlugin);
//!     App::new().add_plugins(plugins).add_systems(Startup, plant).run();
//! }
//!
//! fn plant(mut commands: Commands, assets: Res<AssetServer>) {
//!     commands.spawn(Foliage::new(assets.load("oak.vds")));
//! }
//! ```

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod asset;
mod far;
mod foliage;
mod loader;
mod lod;
mod material;
mod plants;
mod settings;
mod texture;

pub use asset::{FoliageAsset, RUNG_RATIO};
pub use far::{FarExtension, FarMaterial};
pub use foliage::{Foliage, FoliageDetail, FoliageLod};
pub use foliage_lod;
pub use loader::{FoliageLoader, FoliageLoaderError};
pub use material::{ATTRIBUTE_LEAF, ATTRIBUTE_STEM, FoliageExtension, FoliageMaterial};
pub use settings::{FoliageBudget, FoliageSettings, FoliageStats, FoliageWind};

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetApp, Assets},
    camera::{CameraUpdateSystems, visibility::VisibilitySystems},
    ecs::schedule::{IntoScheduleConfigs, SystemSet},
    pbr::MaterialPlugin,
    shader::Shader,
    transform::TransformSystems,
};

/// What most programs need.
pub mod prelude {
    pub use crate::{
        Foliage, FoliageAsset, FoliageBudget, FoliageDetail, FoliageLod, FoliageLodPlugin, FoliageSettings,
        FoliageStats, FoliageWind,
    };
}

/// Loads models, and draws plants with a [`Foliage`] component. Needs Bevy's asset, render and PBR
/// plug-ins, as [`DefaultPlugins`](bevy::DefaultPlugins) has them, before it.
#[derive(Debug, Clone, Copy, Default)]
pub struct FoliageLodPlugin;

/// Systems of the plug-in, in [`PostUpdate`].
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FoliageSystems {
    /// Spawns the meshes of plants.
    Spawn,
    /// Sets the counts of plants by the cameras.
    Select,
}

impl Plugin for FoliageLodPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<FoliageAsset>()
            .init_asset_loader::<FoliageLoader>()
            .init_resource::<FoliageSettings>()
            .init_resource::<FoliageStats>()
            .init_resource::<plants::Plants>()
            .add_observer(foliage::despawn_parts)
            .add_plugins((MaterialPlugin::<FoliageMaterial>::default(), MaterialPlugin::<FarMaterial>::default()))
            .configure_sets(
                PostUpdate,
                (
                    FoliageSystems::Spawn.before(TransformSystems::Propagate),
                    FoliageSystems::Select
                        .after(CameraUpdateSystems)
                        .after(VisibilitySystems::UpdateFrusta)
                        .after(VisibilitySystems::VisibilityPropagate)
                        .before(VisibilitySystems::CheckVisibility),
                ),
            )
            .add_systems(
                PostUpdate,
                (
                    foliage::spawn_parts.in_set(FoliageSystems::Spawn),
                    (foliage::widen_bounds, lod::select, plants::write_plants).chain().in_set(FoliageSystems::Select),
                ),
            );
        let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
        for (handle, shader) in [(material::SHADER, material::shader()), (far::SHADER, far::shader())] {
            if let Err(error) = shaders.insert(handle.id(), shader) {
                bevy::log::error!("the shader of foliage cannot be stored: {error}");
            }
        }
    }
}

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
