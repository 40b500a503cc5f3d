//! The component of a plant, and the meshes that are spawned for it.

use crate::{
    asset::FoliageAsset,
    material::FoliageMaterial,
    plants::{Plants, Slot},
    settings::FoliageWind,
};
use bevy::{
    asset::{AssetEvent, AssetId, Assets, Handle},
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, RenderLayers, Visibility, VisibilityRange},
    },
    ecs::prelude::*,
    light::{NotShadowCaster, NotShadowReceiver},
    math::Vec3A,
    mesh::{Mesh, Mesh3d, MeshTag},
    pbr::MeshMaterial3d,
    platform::collections::HashSet,
    transform::components::Transform,
};
use foliage_lod::{LodPolicy, extract::Hysteresis};
use std::{fmt, sync::Arc};

/// A plant: a model, drawn with as many of its leaves as its level of detail asks for.
///
/// Meshes are spawned as children once the model is loaded, and anew when it is reloaded. They have
/// the plant's [`RenderLayers`], [`VisibilityRange`], [`NotShadowCaster`] and [`NotShadowReceiver`]
/// of that moment.
#[derive(Component, Debug, Clone, Default)]
#[require(Transform, Visibility, FoliageDetail)]
pub struct Foliage {
    /// The model.
    pub model: Handle<FoliageAsset>,
    /// How many leaves.
    pub lod: FoliageLod,
}

impl Foliage {
    /// A plant whose count follows the camera.
    pub fn new(model: Handle<FoliageAsset>) -> Self {
        Self { model, lod: FoliageLod::Auto }
    }
}

/// How many leaves a plant has.
#[derive(Clone, Default)]
pub enum FoliageLod {
    /// As the policy of the [settings](crate::FoliageSettings) asks for, or the
    /// [budget](crate::FoliageBudget).
    #[default]
    Auto,
    /// A share of the leaves, 0 to 1, whatever the camera and the budget. NaN counts as 0.
    Share(f32),
    /// As a policy of its own asks for, or the budget.
    Policy(Arc<dyn LodPolicy + Send + Sync>),
}

impl fmt::Debug for FoliageLod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("Auto"),
            Self::Share(share) => f.debug_tuple("Share").field(share).finish(),
            Self::Policy(_) => f.write_str("Policy"),
        }
    }
}

/// What a plant is drawn with.
#[derive(Component, Debug, Clone)]
pub struct FoliageDetail {
    /// Number of leaves; the last one may be present only in part.
    pub leaves: f32,
    /// Number of vertices that each pass processes: at most twice those of the leaves that are
    /// drawn, and those of the wood.
    pub vertices: u32,
    /// Which of the prefixes of the leaves, and which level of the wood.
    pub(crate) rung: usize,
    pub(crate) wood: usize,
    /// Share of the plant that its impostor takes.
    pub(crate) far: f32,
    /// Whether the meshes were spawned since.
    pub(crate) is_new: bool,
    /// Meshes.
    pub(crate) parts: Vec<Entity>,
    model: Option<AssetId<FoliageAsset>>,
    hysteresis: Hysteresis,
}

impl Default for FoliageDetail {
    fn default() -> Self {
        Self {
            leaves: 0.0,
            vertices: 0,
            rung: 0,
            wood: 0,
            far: 0.0,
            is_new: false,
            parts: Vec::new(),
            model: None,
            hysteresis: Hysteresis::default(),
        }
    }
}

impl FoliageDetail {
    /// The count to draw where so many leaves are wanted.
    pub(crate) fn follow(&mut self, wanted: f64, leaves: u32, dead_band: f32) -> f64 {
        self.hysteresis.dead_band = dead_band;
        self.hysteresis.follow(wanted, leaves, 0)
    }
}

/// A mesh of a plant: which part of the model it shows.
#[derive(Component, Debug, Clone, Copy)]
pub(crate) enum FoliagePart {
    /// The leaves of a material.
    Leaves(usize),
    /// The wood of a material.
    Wood(usize),
    /// The impostor.
    Far,
}

impl FoliagePart {
    /// Its mesh and material at the rungs of leaves and wood.
    pub(crate) fn rung(
        self,
        asset: &FoliageAsset,
        rung: usize,
        wood: usize,
    ) -> Option<(&Handle<Mesh>, &Handle<FoliageMaterial>)> {
        match self {
            Self::Leaves(group) => {
                let (material, meshes) = asset.leaves.get(group)?;
                Some((meshes.get(rung)?, material))
            }
            Self::Wood(part) => {
                let (material, mesh) = asset.wood.get(wood)?.parts.get(part)?;
                Some((mesh, material))
            }
            Self::Far => None,
        }
    }
}

/// Plants, and what of them goes over to their meshes.
type AllPlants<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        Ref<'static, Foliage>,
        &'static mut FoliageDetail,
        Option<&'static Slot>,
        Option<&'static RenderLayers>,
        Option<&'static VisibilityRange>,
        Has<NotShadowCaster>,
        Has<NotShadowReceiver>,
    ),
>;

/// Spawns the meshes of plants whose model is new, was reloaded or was changed.
pub(crate) fn spawn_parts(
    mut commands: Commands,
    mut changes: MessageReader<AssetEvent<FoliageAsset>>,
    assets: Res<Assets<FoliageAsset>>,
    mut plants: AllPlants,
    mut records: ResMut<Plants>,
) {
    let changed: HashSet<AssetId<FoliageAsset>> = changes
        .read()
        .filter_map(|event| match event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (plant, foliage, mut detail, slot, layers, range, casts_none, receives_none) in &mut plants {
        let id = foliage.model.id();
        let is_other = foliage.is_changed() && detail.model != Some(id);
        if !is_other && !changed.contains(&id) {
            continue;
        }
        for part in detail.parts.drain(..) {
            commands.entity(part).try_despawn();
        }
        detail.model = None;
        let Some(asset) = assets.get(id) else { continue };
        let slot = slot.map_or_else(
            || {
                let slot = records.take();
                commands.entity(plant).insert(Slot(slot));
                slot
            },
            |slot| slot.0,
        );
        let wood = asset.wood.first().map_or(0, |rung| rung.parts.len());
        let parts = (0..asset.leaves.len()).map(FoliagePart::Leaves).chain((0..wood).map(FoliagePart::Wood));
        let aside =
            (Transform::from_translation(asset.center), asset.aabb, NoAutoAabb, MeshTag::new(slot), ChildOf(plant));
        let mut children = Vec::new();
        for part in parts {
            let Some((mesh, material)) = part.rung(asset, 0, 0) else { continue };
            let drawn = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), part);
            children.push(commands.spawn((drawn, aside.clone())).id());
        }
        if let Some((mesh, material)) = &asset.far {
            let drawn = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), FoliagePart::Far, Visibility::Hidden);
            children.push(commands.spawn((drawn, aside)).id());
        }
        for child in &children {
            let mut child = commands.entity(*child);
            if let Some(layers) = layers {
                child.insert(layers.clone());
            }
            if let Some(range) = range {
                child.insert(range.clone());
            }
            if casts_none {
                child.insert(NotShadowCaster);
            }
            if receives_none {
                child.insert(NotShadowReceiver);
            }
        }
        detail.parts = children;
        (detail.rung, detail.wood, detail.is_new, detail.model) = (0, 0, true, Some(id));
    }
}

/// Despawns the meshes of what is no longer a plant.
pub(crate) fn despawn_parts(removed: On<Remove<Foliage>>, details: Query<&FoliageDetail>, mut commands: Commands) {
    if let Ok(detail) = details.get(removed.entity) {
        detail.parts.iter().for_each(|part| commands.entity(*part).try_despawn());
    }
    commands.entity(removed.entity).try_remove::<(FoliageDetail, Slot)>();
}

/// Widens the boxes of meshes by how far the wind moves them.
pub(crate) fn widen_bounds(
    wind: Option<Res<FoliageWind>>,
    mut was_on: Local<bool>,
    assets: Res<Assets<FoliageAsset>>,
    plants: Query<(&Foliage, Ref<FoliageDetail>)>,
    mut parts: Query<&mut Aabb, With<FoliagePart>>,
) {
    let is_changed = wind.as_ref().map_or(*was_on, |wind| wind.is_changed());
    *was_on = wind.is_some();
    for (foliage, detail) in &plants {
        if !(is_changed || detail.is_new) {
            continue;
        }
        let Some(asset) = assets.get(&foliage.model) else { continue };
        let reach = wind.as_ref().map_or(0.0, |wind| wind.0.reach(&asset.shape, asset.leaf_reach));
        let half_extents = asset.aabb.half_extents + Vec3A::splat(reach);
        for part in &detail.parts {
            if let Ok(mut aabb) = parts.get_mut(*part) {
                aabb.set_if_neq(Aabb { half_extents, ..asset.aabb });
            }
        }
    }
}
