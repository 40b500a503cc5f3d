//! Weights in steps: eighths of an octave below 1.

/// Steps of a weight per octave.
const STEPS: f32 = 8.0;
/// Least weight, in steps: 1/256.
const LEAST: i8 = -64;

/// Weights by the number of steps below 1.
#[derive(Debug)]
pub(super) struct Weights(Vec<f32>);

impl Default for Weights {
    fn default() -> Self {
        let step = |steps: i32| libm::exp2f(-(steps as f32) / STEPS);
        Self((0..=-i32::from(LEAST)).map(step).collect())
    }
}

impl Weights {
    /// Weight of a number of steps, between whole ones too.
    pub(super) fn of(&self, steps: f32) -> f32 {
        let below = (-steps).clamp(0.0, (self.0.len() - 1) as f32);
        let [low, high] = [below.floor(), below.ceil()].map(|at| self.0[at as usize]);
        low + (high - low) * below.fract()
    }

    /// Number of steps of a weight, rounded down.
    pub(super) fn steps(&self, weight: f32) -> i8 {
        let below = self.0.partition_point(|&other| other > weight * 1.000_01);
        -(below.min(self.0.len() - 1) as i8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_eighths_of_an_octave() {
        let weights = Weights::default();
        for steps in LEAST..=0 {
            assert_eq!(weights.steps(weights.of(f32::from(steps))), steps);
        }
        assert_eq!((weights.of(-8.0), weights.of(9.0), weights.of(-1e9)), (0.5, 1.0, 1.0 / 256.0));
        assert_eq!([1.0, 2.0, 0.0, f32::NAN].map(|weight| weights.steps(weight)), [0, 0, LEAST, 0]);
        assert!(weights.of(-4.5) < weights.of(-4.0) && weights.of(-4.5) > weights.of(-5.0));
    }
}
