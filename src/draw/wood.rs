//! Wood of a model in the order in which it loses detail: what drawers on the CPU and on the GPU
//! have in common, so that both show the same.

#[cfg(feature = "software")]
use super::look::Look;
#[cfg(feature = "software")]
use crate::effects::Limbs;
use crate::{model::FoliageModel, wood::WoodOrder};
#[cfg(feature = "software")]
use glam::DVec3;

/// Steps of the wood's error per octave. Plants at the same step are drawn at once.
const STEPS_PER_OCTAVE: f32 = 8.0;
/// Number of the step of an error of 1.
const STEP_OF_ONE: i32 = 1024;
/// Most steps above that of 1: errors stay finite.
const MOST_STEPS: i32 = 1016;
/// Most stems that the GPU's records can tell apart. Wood of more of them, or of too many vertices,
/// is drawn as without an order.
pub(crate) const MOST_STEMS: usize = 1 << 16;

/// Number of vertices that the GPU's records can tell apart.
const MOST_VERTICES: usize = 1 << 24;

/// The order that a model's wood is drawn by, if there is one.
pub(crate) fn order_of(model: &FoliageModel) -> Option<&WoodOrder> {
    // Ribbons have at most twice the vertices of their tubes, and each material has its own.
    let vertices = 3 * model.wood.vertices.len() * model.wood.parts.len();
    model.wood_order.as_ref().filter(|order| order.stems.len() <= MOST_STEMS && vertices < MOST_VERTICES)
}

/// The limbs that the wind moves, if there are any; `origin` as for [`Limbs::new`].
#[cfg(feature = "software")]
pub(crate) fn limbs_of(model: &FoliageModel, look: &Look, origin: DVec3) -> Option<Limbs> {
    look.effects.wind.and_then(|_| Limbs::new(model, order_of(model)?, origin))
}

/// Number of the step of an error, rounded down, and the error that it stands for: 0 for none.
pub(crate) fn stepped(error: f32) -> (u32, f32) {
    if error.is_nan() || error < f32::MIN_POSITIVE {
        return (0, 0.0);
    }
    let step = ((error.log2() * STEPS_PER_OCTAVE).floor() as i32).min(MOST_STEPS) + STEP_OF_ONE;
    (step as u32, error_of(step as u32))
}

/// The error that a step stands for.
pub(super) fn error_of(step: u32) -> f32 {
    if step == 0 { 0.0 } else { ((step as i32 - STEP_OF_ONE) as f32 / STEPS_PER_OCTAVE).exp2() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_rounded_down_by_less_than_a_step() {
        for error in [f32::MIN_POSITIVE, 1e-9, 0.003, 0.75, 1.0, 17.0, 1e30] {
            let (step, rounded) = stepped(error);
            assert!(rounded <= error * 1.000_01 && rounded * 1.0906 > error, "{error} {rounded}");
            assert_eq!(error_of(step), rounded);
            assert_eq!(stepped(rounded * 1.001), (step, rounded));
        }
        assert_eq!([0.0, -1.0, f32::NAN, 1e-40].map(stepped), [(0, 0.0); 4]);
        assert!(stepped(f32::INFINITY).1.is_finite());
    }
}
