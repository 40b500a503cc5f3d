//! Random numbers from SplitMix64, identical on every machine.
//!
//! After Sebastiano Vigna, "An experimental exploration of Marsaglia's xorshift generators,
//! scrambled" (2014), which uses SplitMix64 for seeding: a Weyl sequence passed through Stafford's
//! 13th variant of the MurmurHash3 finaliser.
//!
//! Limits: 64 bits of state; not cryptographically secure.

/// Increment of the Weyl sequence: 2^64 divided by the golden ratio, made odd.
const GOLDEN_GAMMA: u64 = 0x9E37_79B9_7F4A_7C15;
/// 2^-24: maps the upper 24 bits of a draw to a value in [0, 1) that f32 represents exactly.
#[cfg(feature = "simplify")]
const UNIT: f32 = 1.0 / 16_777_216.0;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    /// Starts the stream for `seed`.
    pub fn new(seed: u64) -> Self {
        Self { state: mix(seed ^ GOLDEN_GAMMA) }
    }

    /// Starts the stream for part `index` of `seed`. Streams of neighbouring parts look unrelated.
    #[cfg(feature = "simplify")]
    pub fn of_part(seed: u64, index: u64) -> Self {
        Self::new(mix(seed).wrapping_add(mix(index.wrapping_add(1))))
    }

    /// Returns the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN_GAMMA);
        mix(self.state)
    }

    /// Returns a uniform value in [0, 1).
    #[cfg(feature = "simplify")]
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * UNIT
    }

    /// Returns a uniform value in [-1, 1).
    #[cfg(feature = "simplify")]
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// Returns a uniform value in [-1, 1), in steps of 2^-52.
    #[cfg(feature = "scene")]
    pub fn wide_signed(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Returns a uniform value in `value` ± `variation`.
    #[cfg(feature = "simplify")]
    pub fn vary(&mut self, value: f32, variation: f32) -> f32 {
        value + variation * self.signed()
    }
}

/// Stafford's variant 13: every input bit reaches every output bit.
fn mix(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ (bits >> 31)
}

#[cfg(all(test, feature = "simplify"))]
mod tests {
    use super::*;

    #[test]
    fn the_stream_of_a_seed_never_changes() {
        let mut random = Random { state: 0 };
        assert_eq!([random.bits(), random.bits()], [0xE220_A839_7B1D_CDAF, 0x6E78_9E6A_A1B9_65F4]);
    }

    #[test]
    fn numbers_stay_in_range_and_are_centred() {
        let mut random = Random::new(7);
        let draws: Vec<f32> = (0..10_000).map(|_| random.unit()).collect();
        assert!(draws.iter().all(|x| (0.0..1.0).contains(x)));
        assert!((draws.iter().sum::<f32>() / 10_000.0 - 0.5).abs() < 0.02);
    }
}
