//! Logarithms to base 2, from a table: the same on every machine, and fast.

/// Bits of a mantissa that find its place in the table; the others interpolate.
const PLACE_BITS: u32 = 10;
const MANTISSA_BITS: u32 = 23;
const REST_BITS: u32 = MANTISSA_BITS - PLACE_BITS;

/// Table of the logarithms of 1 to 2.
#[derive(Debug, Clone)]
pub struct Octaves(Vec<f32>);

impl Octaves {
    pub fn new() -> Self {
        let places = 1 << PLACE_BITS;
        Self((0..=places).map(|place| libm::log2(1.0 + f64::from(place) / f64::from(places)) as f32).collect())
    }

    /// Logarithm within 1e-5, mostly 1e-6. Minus infinity for 0, for numbers below the smallest
    /// normal one and for NaN; that of the largest number for infinity.
    #[inline]
    pub fn of(&self, number: f32) -> f32 {
        if number.is_nan() || number < f32::MIN_POSITIVE {
            return f32::NEG_INFINITY;
        }
        let bits = number.min(f32::MAX).to_bits();
        let exponent = (bits >> MANTISSA_BITS) as i32 - 127;
        let place = (bits >> REST_BITS & ((1 << PLACE_BITS) - 1)) as usize;
        let rest = (bits & ((1 << REST_BITS) - 1)) as f32 / (1 << REST_BITS) as f32;
        let [from, to] = [self.0[place], self.0[place + 1]];
        exponent as f32 + (from + (to - from) * rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_are_right_and_rise() {
        let octaves = Octaves::new();
        let mut last = f32::NEG_INFINITY;
        for step in 0..200_000_u32 {
            let number = f32::from_bits(f32::MIN_POSITIVE.to_bits() + step * 10_000);
            let found = octaves.of(number);
            assert!((f64::from(found) - libm::log2(f64::from(number))).abs() < 1e-5, "{number}: {found}");
            assert!(found >= last);
            last = found;
        }
        assert_eq!([1.0, 2.0, 0.25].map(|number| octaves.of(number)), [0.0, 1.0, -2.0]);
        for odd in [0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 1e-45] {
            assert_eq!(octaves.of(odd), f32::NEG_INFINITY, "{odd}");
        }
        assert!(octaves.of(f32::INFINITY) == octaves.of(f32::MAX));
    }
}
