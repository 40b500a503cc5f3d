//! Static plants, culled through a bounding volume hierarchy, each with its own level of detail.
//!
//! The hierarchy (obvhs) is built over bounding spheres that hold the plants with their leaves at
//! their largest, so nothing in view is ever missed. Its boxes are `f32`, relative to the grove's
//! centre and rounded outwards, so a grove may lie anywhere in an `f64` world.
//!
//! Limits: no occlusion culling (a budget may [weigh](super::visibility) what shows); moving a
//! plant means rebuilding the grove (0.3 ms for 1,000 plants).

use super::{
    budget::Spent,
    shared::{InView, SharedBudget},
};
use crate::{
    Camera, Error, Result,
    bounds::{Sphere, largest_scale},
    camera::NearScale,
    extract::{Blend, Hysteresis, LodPolicy, fewest_leaves, sight::SeenBy},
    frustum::{ALL_PLANES, Crossed, Frustum},
    model::FoliageModel,
};
use glam::{DAffine3, DVec3, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};
use std::{collections::HashMap, time::Duration};

/// Properties shared by all plants of one model.
pub struct Kind {
    /// Number of leaves of the model.
    pub leaves: u32,
    /// Minimum number of leaves for a plant in view.
    pub min_leaves: u32,
    /// Bounding sphere of the plant at full detail, in the plant's units; distances refer to it.
    pub sphere: Sphere,
    /// Bounding sphere of everything drawn at any active count; used for culling.
    pub reach: Sphere,
    /// Level-of-detail policy.
    pub policy: Box<dyn LodPolicy + Send + Sync>,
}

impl Kind {
    /// The plants of `model` with the default [`Blend`] policy and at least [`fewest_leaves`].
    /// O(vertices).
    pub fn new(model: &FoliageModel) -> Self {
        Self {
            leaves: model.leaves.len() as u32,
            min_leaves: fewest_leaves(model.leaves.len() as u32),
            sphere: model.sphere(),
            reach: model.enlarged_sphere(),
            policy: Box::new(Blend::default()),
        }
    }
}

/// One plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Index into the grove's kinds.
    pub kind: u32,
    /// Transform from the plant to the world. Under non-uniform scaling the largest axis counts.
    pub world_from_plant: DAffine3,
}

/// A plant in view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Active {
    /// Index into the grove's placements.
    pub instance: u32,
    /// Active count with its fraction: leaves `0..floor` are drawn, and the next one is grown to
    /// the fraction.
    pub count: f32,
    /// Least share of the plant that its impostor takes, from 0 to 1: above 0 where the policy asks
    /// for hardly more leaves than the fewest. For [`Instance::far`](crate::Instance::far).
    pub far: f32,
}

/// Static plants, with the state that each keeps from frame to frame.
pub struct Grove {
    kinds: Vec<Kind>,
    plants: Vec<Plant>,
    /// Parallel to `plants`: culling reads these alone.
    reaches: Vec<Reach>,
    /// Centre of all plants; the origin of `bvh` and `reaches`.
    anchor: DVec3,
    bvh: Bvh2,
    /// Nodes still to visit, each with the planes that it may cross.
    stack: Vec<(u32, Crossed)>,
    /// One bit per plant, set while it is in view; all 0 between calls.
    in_view: Vec<u64>,
    dead_band: f32,
}

struct Plant {
    kind: u32,
    center: DVec3,
    radius: f64,
    /// Cosine and sine of its turn about the vertical.
    turn: [f32; 2],
    hysteresis: Hysteresis,
}

/// Sphere around everything that is drawn of a plant; its centre is relative to the grove's.
struct Reach {
    center: DVec3,
    radius: f64,
}

impl Grove {
    /// Builds a grove of `placements`. O(n log n).
    ///
    /// # Errors
    /// [`Error::InvalidOption`] naming the first placement whose kind does not exist or whose
    /// transform is not finite.
    pub fn new(kinds: Vec<Kind>, placements: &[Placement]) -> Result<Self> {
        let dead_band = Hysteresis::default().dead_band;
        let planted = Self::planted(&kinds, placements, |_| Hysteresis::new(dead_band))?;
        Ok(Self { kinds, dead_band, ..planted })
    }

    /// Replaces all plants; kinds stay, and so do the counts of plants of one kind at one place, so
    /// that their level of detail does not jump. O(n log n).
    ///
    /// # Errors
    /// Those of [`new`](Self::new); the grove is then as it was.
    pub fn replace(&mut self, placements: &[Placement]) -> Result<()> {
        let key = |kind: u32, at: DVec3| (kind, at.to_array().map(f64::to_bits));
        let settled = self.plants.iter().map(|plant| (key(plant.kind, plant.center), plant.hysteresis));
        let settled: HashMap<_, _> = settled.collect();
        let dead_band = self.dead_band;
        let of = |plant: &Plant| settled.get(&key(plant.kind, plant.center)).copied();
        let planted = Self::planted(&self.kinds, placements, |plant| of(plant).unwrap_or(Hysteresis::new(dead_band)))?;
        *self = Self { kinds: std::mem::take(&mut self.kinds), dead_band, ..planted };
        Ok(())
    }

    /// A grove of `placements` without its kinds, each plant with a hysteresis.
    fn planted(kinds: &[Kind], placements: &[Placement], settled: impl Fn(&Plant) -> Hysteresis) -> Result<Self> {
        let (mut plants, mut reaches) = (Vec::with_capacity(placements.len()), Vec::with_capacity(placements.len()));
        for (instance, placement) in placements.iter().enumerate() {
            let (mut plant, reach) =
                plant(kinds, placement).ok_or_else(|| invalid(instance, placement, kinds.len()))?;
            plant.hysteresis = settled(&plant);
            plants.push(plant);
            reaches.push(reach);
        }
        let low = reaches.iter().map(|reach| reach.center).reduce(DVec3::min).unwrap_or_default();
        let high = reaches.iter().map(|reach| reach.center).reduce(DVec3::max).unwrap_or_default();
        let anchor = low.midpoint(high);
        reaches.iter_mut().for_each(|reach| reach.center -= anchor);
        let boxes: Vec<Aabb> = reaches.iter().map(box_around).collect();
        let bvh = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        let in_view = vec![0; plants.len().div_ceil(64)];
        Ok(Self { kinds: Vec::new(), plants, reaches, anchor, bvh, stack: Vec::new(), in_view, dead_band: 0.0 })
    }

    /// Number of plants.
    pub fn len(&self) -> usize {
        self.plants.len()
    }

    /// Whether the grove has no plants.
    pub fn is_empty(&self) -> bool {
        self.plants.is_empty()
    }

    /// Sets the dead band of every plant (see [`Hysteresis`]) and resets their counts.
    pub fn set_dead_band(&mut self, dead_band: f32) {
        self.dead_band = dead_band;
        self.plants.iter_mut().for_each(|plant| plant.hysteresis = Hysteresis::new(dead_band));
    }

    /// Replaces `out` with the plants in the frustum of `camera`, by increasing index, each with
    /// its active count.
    ///
    /// Culling is conservative: plants are tested by their bounding spheres. A camera with a
    /// non-finite matrix sees all plants. Costs O(plants in view and along the sides of the
    /// picture), and one step per 64 plants; does not allocate once `out` and the grove have
    /// reached their largest size.
    pub fn select(&mut self, camera: &Camera, out: &mut Vec<Active>) {
        out.clear();
        self.cull(camera);
        let seen_by = SeenBy::new(camera);
        for (word, bits) in self.in_view.iter_mut().enumerate() {
            let mut left = std::mem::take(bits);
            while left != 0 {
                let instance = 64 * word as u32 + left.trailing_zeros();
                left &= left - 1;
                let plant = &mut self.plants[instance as usize];
                out.push(plant.active(instance, &self.kinds[plant.kind as usize], &seen_by));
            }
        }
    }

    /// As [`select`](Self::select), with counts that spend a budget on the plants in view with the
    /// least error, instead of those of the kinds' policies: `seconds` after the last frame, or
    /// anew if `None`. Fewest leaves of kinds do not count, but a crown around the camera is not
    /// hollow. `budget` must be of the models of this grove's kinds.
    pub fn select_within(
        &mut self,
        camera: &Camera,
        budget: &mut SharedBudget,
        seconds: Option<f64>,
        out: &mut Vec<Active>,
    ) -> Spent {
        self.select(camera, out);
        budget.look(camera, self.in_view(camera, out), seconds);
        budget.fill(self.in_view(camera, out));
        let spent = budget.split(seconds);
        self.take(budget, out);
        spent
    }

    /// As [`select_all`](Self::select_all), with the counts that plants have, or would have if they
    /// were in view, by what `budget` was split by last.
    pub fn select_all_within(&mut self, camera: &Camera, budget: &mut SharedBudget, out: &mut Vec<Active>) {
        self.select_all(camera, out);
        budget.fill(self.in_view(camera, out));
        budget.repeat();
        self.take(budget, out);
    }

    /// Selected plants as a budget knows them.
    fn in_view<'a>(&'a self, camera: &Camera, selected: &'a [Active]) -> impl Iterator<Item = InView> + use<'a> {
        let (seen_by, scale) = (SeenBy::new(camera), NearScale::new(camera));
        selected.iter().map(move |active| {
            let Plant { kind, center, radius, turn, .. } = self.plants[active.instance as usize];
            let (sight, pixels_per_unit) = (seen_by.sight(center, radius), scale.at(center, radius));
            InView { instance: active.instance, kind, center, radius, turn, pixels_per_unit, sight }
        })
    }

    /// Gives the plants the counts of a budget. Those that it leaves to their impostors keep the
    /// leaves of their policy, which are drawn only while an impostor is not there yet.
    fn take(&self, budget: &SharedBudget, selected: &mut [Active]) {
        for (active, count) in selected.iter_mut().zip(budget.counts()) {
            let Some(count) = count else { continue };
            let kind = &self.kinds[self.plants[active.instance as usize].kind as usize];
            active.count = count;
            active.far = kind.policy.far(count / kind.leaves.max(1) as f32);
        }
    }

    /// Sets the bits of the plants in the frustum of `camera`.
    fn cull(&mut self, camera: &Camera) {
        let frustum = Frustum::new(camera, self.anchor);
        self.stack.clear();
        if !self.plants.is_empty() {
            self.stack.push((0, ALL_PLANES));
        }
        while let Some((node, crossed)) = self.stack.pop() {
            let node = &self.bvh.nodes[node as usize];
            let [min, max] = [node.aabb.min, node.aabb.max].map(|corner| Vec3::from(corner).as_dvec3());
            let Some(crossed) = frustum.crossed_by_box(crossed, min, max) else { continue };
            if !node.is_leaf() {
                self.stack.extend([(node.first_index, crossed), (node.first_index + 1, crossed)]);
                continue;
            }
            for slot in node.first_index..node.first_index + node.prim_count {
                let instance = self.bvh.primitive_indices[slot as usize] as usize;
                let reach = &self.reaches[instance];
                if crossed == 0 || frustum.meets_sphere(crossed, reach.center, reach.radius) {
                    self.in_view[instance / 64] |= 1 << (instance % 64);
                }
            }
        }
    }

    /// As [`select`](Self::select) with all plants, whatever the direction: for what casts shadows.
    /// O(plants).
    pub fn select_all(&mut self, camera: &Camera, out: &mut Vec<Active>) {
        let (kinds, seen_by) = (&self.kinds, SeenBy::new(camera));
        out.clear();
        let plants = (0..).zip(&mut self.plants);
        out.extend(plants.map(|(i, plant)| plant.active(i, &kinds[plant.kind as usize], &seen_by)));
    }
}

impl Plant {
    fn active(&mut self, instance: u32, kind: &Kind, seen_by: &SeenBy) -> Active {
        let sight = seen_by.sight(self.center, self.radius);
        let of_leaves = |lod: f32| f64::from(lod) * f64::from(kind.leaves);
        let lod = kind.policy.lod(&sight);
        let settled = self.hysteresis.follow(of_leaves(lod), kind.leaves, kind.min_leaves);
        // The dead band may leave the count below what is wanted, but not below the least.
        let count = settled.max(of_leaves(sight.least_lod())) as f32;
        Active { instance, count, far: kind.policy.far(lod) }
    }
}

fn plant(kinds: &[Kind], placement: &Placement) -> Option<(Plant, Reach)> {
    let kind = kinds.get(placement.kind as usize)?;
    let to_world = placement.world_from_plant;
    let scale = largest_scale(&to_world);
    let plant = Plant {
        kind: placement.kind,
        center: to_world.transform_point3(kind.sphere.center()),
        radius: kind.sphere.radius * scale,
        turn: turn(&to_world),
        hysteresis: Hysteresis::default(),
    };
    let reach = Reach { center: to_world.transform_point3(kind.reach.center()), radius: kind.reach.radius * scale };
    let is_finite = to_world.is_finite() && plant.center.is_finite() && reach.center.is_finite();
    (is_finite && plant.radius.is_finite() && reach.radius.is_finite()).then_some((plant, reach))
}

/// Cosine and sine of the turn about the vertical that takes x where a transform takes it.
fn turn(to_world: &DAffine3) -> [f32; 2] {
    let along = to_world.matrix3.x_axis;
    let level = libm::hypot(along.x, along.z);
    if level > 0.0 && level.is_finite() { [(along.x / level) as f32, (-along.z / level) as f32] } else { [1.0, 0.0] }
}

fn invalid(instance: usize, placement: &Placement, kinds: usize) -> Error {
    let Placement { kind, world_from_plant, .. } = placement;
    let value = format!("number {instance}, of kind {kind}, at {}", world_from_plant.translation);
    Error::invalid("placement", value, format!("finite and of one of the {kinds} kinds"))
}

/// Bounding box of a plant's reach, in `f32`, rounded outwards.
fn box_around(reach: &Reach) -> Aabb {
    let outwards = |corner: DVec3, up: bool| {
        let round = |exact: f64| {
            let rounded = exact as f32;
            let is_inside = if up { f64::from(rounded) < exact } else { f64::from(rounded) > exact };
            match (is_inside, up) {
                (false, _) => rounded,
                (true, true) => rounded.next_up(),
                (true, false) => rounded.next_down(),
            }
        };
        Vec3A::from_array(corner.to_array().map(round))
    };
    let half_size = DVec3::splat(reach.radius);
    Aabb::new(outwards(reach.center - half_size, false), outwards(reach.center + half_size, true))
}
