//! How many leaves each plant has: by a policy, within a budget.

use crate::{
    asset::FoliageAsset,
    foliage::{Foliage, FoliageDetail, FoliageLod, FoliagePart},
    plants::{PlantRecord, Plants, Slot},
    settings::{FoliageBudget, FoliageSettings, FoliageStats, FoliageWind},
};
use bevy::{
    asset::{AssetId, Assets},
    camera::{
        Camera, Camera3d,
        primitives::{Frustum, Sphere},
        visibility::{InheritedVisibility, RenderLayers, Visibility},
    },
    ecs::prelude::*,
    math::{Mat4, Vec3, Vec3A},
    mesh::Mesh3d,
    pbr::MeshMaterial3d,
    time::Time,
    transform::components::GlobalTransform,
};
use foliage_lod::{
    Depth,
    extract::{Sight, active_count},
    glam::{DAffine3, DMat4, DVec3},
    model::{ErrorCurve, Transition},
    scene::budget::{Item, Splitter},
};

/// A camera that plants are seen by.
struct Seer<'a> {
    camera: foliage_lod::Camera,
    frustum: &'a Frustum,
    layers: RenderLayers,
}

/// A plant, and how it is seen.
struct Seen {
    plant: Entity,
    model: AssetId<FoliageAsset>,
    /// As the camera that shows it largest does.
    sight: Sight,
    pixels_per_unit: f64,
    in_view: bool,
    /// Share of the plant that its impostor takes at this size.
    far: f32,
}

/// What a budget keeps from frame to frame.
#[derive(Default)]
pub(crate) struct Budgeting {
    splitter: Option<(Vec<AssetId<FoliageAsset>>, Splitter)>,
    counts: Vec<f32>,
}

type Cameras<'w, 's> = Query<
    'w,
    's,
    (&'static Camera, &'static GlobalTransform, &'static Frustum, Option<&'static RenderLayers>),
    With<Camera3d>,
>;
type AllPlants<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        &'static Foliage,
        &'static mut FoliageDetail,
        &'static Slot,
        &'static GlobalTransform,
        &'static InheritedVisibility,
        Option<&'static RenderLayers>,
    ),
>;

/// Sets the count of every plant from the cameras, and the rungs of its meshes.
#[expect(clippy::too_many_arguments, reason = "parameters of a system are what it reads and writes")]
pub(crate) fn select(
    cameras: Cameras,
    mut plants: AllPlants,
    mut parts: Query<(&FoliagePart, &mut Mesh3d, &mut MeshMaterial3d<crate::FoliageMaterial>)>,
    mut shown: Query<(&FoliagePart, &mut Visibility)>,
    assets: Res<Assets<FoliageAsset>>,
    settings: Res<FoliageSettings>,
    budget: Option<Res<FoliageBudget>>,
    wind: Option<Res<FoliageWind>>,
    time: Res<Time>,
    mut records: ResMut<Plants>,
    mut stats: ResMut<FoliageStats>,
    mut budgeting: Local<Budgeting>,
) {
    let seers: Vec<Seer> = cameras.iter().filter_map(seer).collect();
    let moment = wind.as_ref().map(|wind| wind.0.at(time.elapsed_secs_f64()));
    let mut all = Vec::new();
    let mut shares = Vec::new();
    for (plant, foliage, _, _, place, visible, layers) in &plants {
        let Some(asset) = assets.get(&foliage.model).filter(|_| visible.get()) else { continue };
        let Some(mut seen) = seen(plant, foliage.model.id(), asset, place, layers, &seers) else { continue };
        let share = match foliage.lod {
            FoliageLod::Share(share) => Some(share_of(asset, share)),
            _ => None,
        };
        if let (Some(_), Some(far), None) = (&asset.far, settings.far, share) {
            seen.far = far.share(2.0 * seen.sight.radius_px(), plant.index_u32());
        }
        shares.push(share);
        all.push(seen);
    }
    let counts = match &budget {
        Some(budget) => budgeting.split(budget, &all, &shares, &assets, time.delta_secs_f64()),
        None => &[],
    };
    let mut drawn = FoliageStats { plants: all.len() as u32, ..FoliageStats::default() };
    for (number, seen) in all.iter().enumerate() {
        let Ok((_, foliage, mut detail, slot, place, ..)) = plants.get_mut(seen.plant) else { continue };
        let Some(asset) = assets.get(&foliage.model) else { continue };
        let leaves = asset.leaf_count();
        let policy = match &foliage.lod {
            FoliageLod::Policy(policy) => policy,
            _ => &settings.policy,
        };
        let count = shares[number].unwrap_or_else(|| {
            let by_policy = || share_of(asset, policy.lod(&seen.sight));
            let wanted = counts.get(number).map_or_else(by_policy, |count| f64::from(*count));
            detail.bypass_change_detection().follow(wanted, leaves, settings.dead_band)
        });
        let transition = Transition::new(count, settings.window, leaves);
        let error = (f64::from(settings.wood_error_px) / seen.pixels_per_unit) as f32;
        let rung = asset.rung(transition.drawn().min(leaves), detail.rung);
        let wood = asset.wood_rung(error, detail.wood);
        let far = match (&asset.far, settings.far, shares[number]) {
            (Some(_), Some(_), None) => seen.far.max(policy.far(count as f32 / leaves.max(1) as f32)),
            _ => 0.0,
        };
        if detail.is_new || (far > 0.0, far < 1.0) != (detail.far > 0.0, detail.far < 1.0) {
            for part in &detail.parts {
                let Ok((part, mut visibility)) = shown.get_mut(*part) else { continue };
                let is_shown = if matches!(part, FoliagePart::Far) { far > 0.0 } else { far < 1.0 };
                visibility.set_if_neq(if is_shown { Visibility::Inherited } else { Visibility::Hidden });
            }
        }
        if detail.is_new || (rung, wood) != (detail.rung, detail.wood) {
            for part in detail.parts.iter() {
                let Ok((part, mut mesh, mut material)) = parts.get_mut(*part) else { continue };
                let Some((new_mesh, new_material)) = part.rung(asset, rung, wood) else { continue };
                mesh.set_if_neq(Mesh3d(new_mesh.clone()));
                material.set_if_neq(MeshMaterial3d(new_material.clone()));
            }
        }
        let vertices = asset.rung_vertices[rung] + asset.wood.get(wood).map_or(0, |rung| rung.vertices);
        let sway = wind.as_ref().zip(moment).map(|(wind, moment)| {
            let shares = wind.0.limb_shares(&asset.shape, seen.pixels_per_unit);
            moment.sway(&asset.shape, &affine(place)).with_limbs(shares)
        });
        let record = PlantRecord { far, ..PlantRecord::new(&transition, seen.plant.index_u32()) };
        records.set(slot.0, record, sway);
        if (detail.leaves, detail.rung, detail.wood, detail.far, detail.is_new)
            != (count as f32, rung, wood, far, false)
        {
            (detail.leaves, detail.rung, detail.wood, detail.far, detail.is_new) =
                (count as f32, rung, wood, far, false);
            detail.vertices = vertices;
        }
        drawn.in_view += u32::from(seen.in_view);
        drawn.impostors += u32::from(seen.in_view && far >= 1.0);
        if seen.in_view && far < 1.0 {
            drawn.leaves += count;
            drawn.leaves_processed += u64::from(asset.rungs[rung]);
            drawn.wood_triangles += asset.wood.get(wood).map_or(0, |rung| u64::from(rung.triangles));
        }
    }
    *stats = drawn;
}

fn share_of(asset: &FoliageAsset, share: f32) -> f64 {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let least = if share > 0.0 { active_count(&asset.model, f32::MIN_POSITIVE) } else { 0 };
    (f64::from(share) * f64::from(asset.leaf_count())).max(f64::from(least))
}

fn seer<'a>(
    (camera, place, frustum, layers): (&Camera, &GlobalTransform, &'a Frustum, Option<&RenderLayers>),
) -> Option<Seer<'a>> {
    let size = camera.physical_viewport_size().filter(|size| camera.is_active && size.y > 0)?;
    let view_from_world = place.to_matrix().inverse();
    let camera = foliage_lod::Camera {
        clip_from_world: matrix(camera.clip_from_view()) * matrix(view_from_world),
        eye: vector(place.translation()),
        height_px: size.y,
        depth: Depth::Reversed,
    };
    camera.check().is_ok().then(|| Seer { camera, frustum, layers: layers.cloned().unwrap_or_default() })
}

/// How a plant is seen; `None` if no camera shows its layers.
fn seen(
    plant: Entity,
    model: AssetId<FoliageAsset>,
    asset: &FoliageAsset,
    place: &GlobalTransform,
    layers: Option<&RenderLayers>,
    seers: &[Seer],
) -> Option<Seen> {
    let center = place.transform_point(asset.center);
    let scale = place.affine().matrix3;
    let scale = [scale.x_axis, scale.y_axis, scale.z_axis].map(Vec3A::length).into_iter().fold(0.0, f32::max);
    let radius = scale * asset.radius;
    let layers = layers.cloned().unwrap_or_default();
    let mut best: Option<Seen> = None;
    for seer in seers.iter().filter(|seer| seer.layers.intersects(&layers)) {
        let sight = Sight::new(&seer.camera, vector(center), f64::from(radius));
        let sphere = Sphere { center: Vec3A::from(center), radius };
        let in_view = seer.frustum.intersects_sphere(&sphere, true);
        let nearest = (f64::from(sight.distance) - f64::from(radius)).max(1e-3 * f64::from(radius));
        let px = 0.5 * f64::from(sight.height_px) / (f64::from(0.5 * sight.fov_y).tan() * nearest);
        // In the plant's own units.
        let pixels_per_unit = px * f64::from(scale);
        // Those that show it go first.
        if best.as_ref().is_none_or(|best: &Seen| (best.in_view, best.pixels_per_unit) < (in_view, pixels_per_unit)) {
            best = Some(Seen { plant, model, sight, pixels_per_unit, in_view, far: 0.0 });
        }
    }
    best
}

impl Budgeting {
    /// Splits a budget among the plants in view that go by a policy, after what others take. Those
    /// out of view, which may cast shadows, have as many leaves as if they were in it.
    fn split(
        &mut self,
        budget: &FoliageBudget,
        all: &[Seen],
        shares: &[Option<f64>],
        assets: &Assets<FoliageAsset>,
        seconds: f64,
    ) -> &[f32] {
        let mut models: Vec<AssetId<FoliageAsset>> = all.iter().map(|seen| seen.model).collect();
        models.sort_unstable();
        models.dedup();
        let curves = models.iter().filter_map(|model| assets.get(*model)).map(|asset| asset.curve.clone());
        let curves: Vec<ErrorCurve> = curves.collect();
        let is_kept = self.splitter.as_ref().is_some_and(|(of, by)| *of == models && by.rule() == budget.rule);
        if !is_kept {
            self.splitter = Some((models.clone(), Splitter::new(&curves, budget.rule)));
        }
        let Some((_, splitter)) = &mut self.splitter else { return &[] };
        let item = |seen: &Seen, share: Option<f64>| {
            let curve = models.binary_search(&seen.model).unwrap_or_default();
            let item = Item::seen(curve as u32, &curves[curve], &seen.sight);
            match share {
                Some(leaves) => Item { ceiling: 0.0, fixed_cost: leaves as f32, ..item },
                // No leaf of it shows.
                None if seen.far >= 1.0 => Item { ceiling: 0.0, ..item },
                None => item,
            }
        };
        let [in_view, beyond] = [true, false].map(|in_view| {
            let of = all.iter().zip(shares).filter(move |(seen, _)| seen.in_view == in_view);
            of.map(|(seen, share)| item(seen, *share)).collect::<Vec<Item>>()
        });
        let [mut shown, mut others] = [Vec::new(), Vec::new()];
        splitter.follow(&in_view, budget.leaves, seconds, &mut shown);
        splitter.repeat(&beyond, &mut others);
        let (mut shown, mut others) = (shown.into_iter(), others.into_iter());
        self.counts.clear();
        let next = |seen: &Seen| if seen.in_view { shown.next() } else { others.next() };
        self.counts.extend(all.iter().map(next).map(Option::unwrap_or_default));
        &self.counts
    }
}

pub(crate) fn vector(v: Vec3) -> DVec3 {
    DVec3::new(v.x.into(), v.y.into(), v.z.into())
}

fn matrix(m: Mat4) -> DMat4 {
    DMat4::from_cols_array(&m.to_cols_array().map(f64::from))
}

fn affine(place: &GlobalTransform) -> DAffine3 {
    DAffine3::from_mat4(matrix(place.to_matrix()))
}
