//! A budget that all plants of a grove in view share.

use super::{
    budget::{Item, Load, Rule, Spent, Splitter},
    cost::{IMPOSTOR, Triangles},
    visibility::{Crown, CrownShape, Parts, Visibility},
};
use crate::{
    Camera,
    extract::{Far, Sight},
    model::{ErrorCurve, FoliageModel},
};
use glam::DVec3;
use std::time::Instant;

/// Frames over which the cost of visibility is compared with what it saves.
const JUDGED: u32 = 60;
/// Frames that it is left out for, once it cost more.
const LEFT_OUT: u32 = 600;

/// A plant in view.
pub(super) struct InView {
    pub(super) instance: u32,
    pub(super) kind: u32,
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// Cosine and sine of its turn about the vertical.
    pub(super) turn: [f32; 2],
    /// Pixels covered by a length of 1 where it is nearest.
    pub(super) pixels_per_unit: f64,
    pub(super) sight: Sight,
}

/// What plants of a budget hide of each other.
struct Hidden {
    visibility: Visibility,
    /// Crowns of the kinds.
    shapes: Vec<CrownShape>,
    /// What it took, and frames, since it was judged last.
    seconds: f64,
    frames: u32,
    /// Frames for which it is still left out.
    left_out: u32,
    times_left_out: u32,
}

/// A budget, for [`Grove::select_within`](super::Grove::select_within).
pub struct SharedBudget {
    /// Number of leaves for all plants in view, or of [triangles](Self::with_triangles). For a
    /// time, set it each frame to the leaves of a [`Pace`](super::budget::Pace).
    pub amount: f64,
    /// When plants are handed over to impostors: those of which no leaf shows take nothing. `None`
    /// if there are no impostors.
    pub far: Option<Far>,
    /// What it takes to draw a leaf, or a triangle, in seconds: with it, visibility is left out for
    /// a while where estimating it takes longer than what it is for would. `None` never leaves it
    /// out.
    pub unit_seconds: Option<f64>,
    hidden: Option<Hidden>,
    /// Triangles of the kinds, and pixels that wood may be off, if triangles are counted.
    triangles: Option<(Vec<Triangles>, f32)>,
    /// Pixels that impostors cover.
    impostor_px: f64,
    curves: Vec<ErrorCurve>,
    splitter: Splitter,
    items: Vec<Item>,
    counts: Vec<f32>,
}

impl SharedBudget {
    /// A budget for a grove whose kinds are of these models, in their order. Models without an
    /// error curve are split by their recorded errors.
    pub fn new(models: &[FoliageModel], rule: Rule, amount: f64) -> Self {
        let curves: Vec<ErrorCurve> = models.iter().map(ErrorCurve::of).collect();
        let splitter = Splitter::new(&curves, rule);
        Self {
            amount,
            far: None,
            unit_seconds: None,
            hidden: None,
            triangles: None,
            impostor_px: 0.0,
            curves,
            splitter,
            items: Vec::new(),
            counts: Vec::new(),
        }
    }

    /// With an amount that counts triangles: of leaves by their model's mean, of wood that may be
    /// `wood_error_px` off (see [`Look`](crate::Look)) or, without an order, of all wood, and two
    /// of an impostor. The models are those that the budget is for. O(triangles log triangles).
    pub fn with_triangles(self, models: &[FoliageModel], wood_error_px: f32) -> Self {
        let of_models = models.iter().map(Triangles::new).collect();
        Self { triangles: Some((of_models, wood_error_px)), ..self }
    }

    /// What a frame draws of the plants that the budget was split among last, and so many triangles
    /// of wood: for a [`Pace`](super::budget::Pace).
    pub fn load(&self, wood_triangles: u64) -> Load {
        let of_leaves = self.items.iter().zip(&self.counts).filter(|(item, _)| item.ceiling > 0.0);
        Load {
            leaves: of_leaves.map(|(_, &count)| f64::from(count)).sum(),
            wood_triangles: wood_triangles as f64,
            impostor_px: self.impostor_px,
            plants: self.items.len() as f64,
        }
    }

    /// With errors weighted by what [shows](super::visibility) of each plant behind others. The
    /// models are those that the budget is for.
    pub fn with_visibility(self, models: &[FoliageModel]) -> Self {
        let shapes = models.iter().map(CrownShape::new).collect();
        let visibility = Visibility::new();
        let hidden = Hidden { visibility, shapes, seconds: 0.0, frames: 0, left_out: 0, times_left_out: 0 };
        Self { hidden: Some(hidden), ..self }
    }

    /// What shows of the plants, if that is asked for.
    pub fn visibility(&self) -> Option<&Visibility> {
        self.hidden.as_ref().map(|hidden| &hidden.visibility)
    }

    /// Same as [`visibility`](Self::visibility), to tell what else hides plants.
    pub fn visibility_mut(&mut self) -> Option<&mut Visibility> {
        self.hidden.as_mut().map(|hidden| &mut hidden.visibility)
    }

    /// Number of times that visibility was left out because it took more than it saved.
    pub fn times_left_out(&self) -> u32 {
        self.hidden.as_ref().map_or(0, |hidden| hidden.times_left_out)
    }

    /// Forgets the last frame, as after a cut.
    pub fn reset(&mut self) {
        self.splitter.reset();
        self.hidden.iter_mut().for_each(|hidden| hidden.visibility.reset());
    }

    /// Estimates what shows of the plants in view, if that is asked for.
    pub(super) fn look(&mut self, camera: &Camera, plants: impl Iterator<Item = InView>, seconds: Option<f64>) {
        let (amount, unit_seconds) = (self.amount, self.unit_seconds);
        let Some(hidden) = &mut self.hidden else { return };
        hidden.left_out = hidden.left_out.saturating_sub(1);
        if hidden.left_out > 0 {
            return;
        }
        let Hidden { visibility, shapes, .. } = hidden;
        let started = unit_seconds.map(|_| Instant::now());
        let crown = |plant: InView| {
            let CrownShape { height, half, opacity, parts } = shapes.get(plant.kind as usize)?;
            let center = plant.center + DVec3::Y * (f64::from(*height) * plant.radius);
            Some(Crown {
                instance: plant.instance,
                center,
                half: half.map(|half| f64::from(half) * plant.radius),
                opacity: *opacity,
                parts: Parts { parts, center: plant.center, radius: plant.radius, turn: plant.turn },
            })
        };
        visibility.update(camera, plants.filter_map(crown), seconds);
        let Some(started) = started.filter(|_| seconds.is_some()) else { return };
        hidden.seconds += started.elapsed().as_secs_f64();
        hidden.frames += 1;
        if let Some(unit_seconds) = unit_seconds.filter(|_| hidden.frames == JUDGED) {
            let saved = amount * f64::from(1.0 - hidden.visibility.estimate().shown) * unit_seconds;
            if hidden.seconds > saved * f64::from(JUDGED) {
                hidden.left_out = LEFT_OUT;
                hidden.times_left_out += 1;
                hidden.visibility.forget();
            }
        }
        if hidden.frames >= JUDGED {
            (hidden.frames, hidden.seconds) = (0, 0.0);
        }
    }

    /// Replaces the plants.
    pub(super) fn fill(&mut self, plants: impl Iterator<Item = InView>) {
        let Self { curves, items, far, hidden, triangles, impostor_px, splitter, .. } = self;
        let power = if let Rule::LeastError(exponent) = splitter.rule() { exponent.of_share() } else { 1.0 };
        let counted = |share: f32| if power == 0.5 { share.sqrt() } else { libm::powf(share, power) };
        let visibility = hidden.as_ref().map(|hidden| &hidden.visibility);
        items.clear();
        *impostor_px = 0.0;
        let leafless = ErrorCurve::hull(1.0, 2.0, [(0, 0.0)]);
        items.extend(plants.map(|InView { instance, kind, radius, pixels_per_unit, sight, .. }| {
            let item = Item::seen(kind, curves.get(kind as usize).unwrap_or(&leafless), &sight);
            let item = Item { weight: visibility.map_or(1.0, |shown| counted(shown.weight(instance))), ..item };
            let diameter_px = 2.0 * sight.radius_px();
            let share = far.map_or(0.0, |far| far.share(diameter_px, instance));
            if share > 0.0 {
                *impostor_px += f64::from(diameter_px).powi(2);
            }
            let of_triangles = triangles.as_ref().and_then(|(of, error_px)| Some((of.get(kind as usize)?, *error_px)));
            let [unit_cost, fixed_cost] = of_triangles.map_or([1.0, 0.0], |(of, error_px)| {
                let wood = if share < 1.0 { of.wood(f64::from(error_px) / (pixels_per_unit * radius)) } else { 0.0 };
                [of.leaf, wood + if share > 0.0 { IMPOSTOR } else { 0.0 }]
            });
            let ceiling = if share >= 1.0 { 0.0 } else { item.ceiling };
            Item { ceiling, unit_cost, fixed_cost, ..item }
        }));
    }

    /// Splits the budget, after `seconds`, or anew.
    pub(super) fn split(&mut self, seconds: Option<f64>) -> Spent {
        let Self { splitter, items, counts, amount, .. } = self;
        match seconds {
            Some(seconds) => splitter.follow(items, *amount, seconds, counts),
            None => splitter.split(items, *amount, counts),
        }
    }

    /// Counts by what was split last.
    pub(super) fn repeat(&mut self) {
        self.splitter.repeat(&self.items, &mut self.counts);
    }

    /// Counts of the plants; `None` for those that are left to their impostors.
    pub(super) fn counts(&self) -> impl Iterator<Item = Option<f32>> {
        self.items.iter().zip(&self.counts).map(|(item, &count)| (item.ceiling > 0.0).then_some(count))
    }
}
