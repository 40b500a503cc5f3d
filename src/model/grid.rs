//! Numbers that are whole multiples of a power of two: integers that give back every bit.

/// Smallest and largest exponent: those of the least and of the greatest bit of an `f32`.
pub(super) const EXPONENTS: std::ops::RangeInclusive<i16> = -149..=127;

/// Largest exponent such that every value is a whole multiple of 2^exponent, with a multiple of at
/// most 31 bits; `None` if there is none, or if a value is -0, which multiples cannot be.
pub(super) fn exponent_of(values: impl Iterator<Item = f32>) -> Option<i16> {
    let (mut exponent, mut largest) = (i16::MAX, 0.0_f64);
    for value in values {
        if value == 0.0 {
            if value.is_sign_negative() {
                return None;
            }
            continue;
        }
        exponent = exponent.min(least_bit(value));
        largest = largest.max(f64::from(value).abs());
    }
    if exponent == i16::MAX {
        return Some(0);
    }
    (largest / power(exponent) <= f64::from(i32::MAX)).then_some(exponent)
}

/// The multiple of 2^exponent nearest to the value; saturates at 31 bits.
#[inline]
pub(super) fn code(value: f32, exponent: i16) -> i32 {
    nearest(f64::from(value) * power(-exponent))
}

/// The integer nearest to a number, the one farther from 0 if two are; saturates, and gives 0 for
/// NaN. Unlike `round`, it takes a few instructions on every processor.
#[inline]
pub(super) fn nearest(number: f64) -> i32 {
    (number + 0.5f64.copysign(number)) as i32
}

/// A multiple of 2^exponent, rounded to `f32`.
#[inline]
pub(super) fn value(code: i32, exponent: i16) -> f32 {
    (f64::from(code) * power(exponent)) as f32
}

/// 2^exponent, for any exponent of [`EXPONENTS`] or its negative.
#[inline]
pub(super) fn power(exponent: i16) -> f64 {
    f64::from_bits(((i64::from(exponent) + 1023) as u64) << 52)
}

/// Largest exponent with 2^exponent <= `value`, which is positive, within [`EXPONENTS`].
pub(super) fn exponent_below(value: f64) -> i16 {
    let exponent = (value.to_bits() >> 52) as i16 - 1023;
    exponent.clamp(*EXPONENTS.start(), *EXPONENTS.end())
}

/// Exponent of the lowest bit that is set in a finite value other than 0.
fn least_bit(value: f32) -> i16 {
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 23 & 0xff) as i16, bits & 0x007f_ffff);
    let significand = if exponent == 0 { fraction } else { fraction | 1 << 23 };
    exponent.max(1) - 150 + significand.trailing_zeros() as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_give_back_every_bit() {
        for values in [
            vec![0.0, 1.0, -3.5, 1000.0],
            vec![f32::from_bits(1), -f32::MIN_POSITIVE],
            vec![f32::MAX, -f32::MAX],
            vec![0.1, 0.3, 0.7],
            vec![0.0],
            vec![],
        ] {
            let exponent = exponent_of(values.iter().copied()).unwrap();
            assert!(EXPONENTS.contains(&exponent), "{values:?}: {exponent}");
            for value in values {
                assert_eq!(super::value(code(value, exponent), exponent).to_bits(), value.to_bits());
            }
        }
        assert_eq!(exponent_of([12.0, 20.0].into_iter()), Some(2));
    }

    #[test]
    fn minus_zero_and_a_range_of_more_than_31_bits_are_no_multiples() {
        assert_eq!(exponent_of([1.0, -0.0].into_iter()), None);
        assert_eq!(exponent_of([1e10, 1e-10].into_iter()), None);
    }

    #[test]
    fn powers_and_their_exponents_agree() {
        for exponent in EXPONENTS {
            assert_eq!(exponent_below(power(exponent)), exponent);
            assert_eq!(exponent_below(power(exponent) * 1.99), exponent);
        }
        assert_eq!(exponent_below(1e-300), -149);
        assert_eq!(power(-3), 0.125);
    }
}
