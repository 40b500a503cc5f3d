//! Fixed-point logarithms that make sums of information integers: exact, in any order, on every
//! machine.
//!
//! Let a_z(v) be the visible area of polygon z in view v (pixels), A_z its sum over the views, and
//! L = log2. A view's part of the viewpoint mutual information (Castelló, Sbert, Chover, Feixas,
//! "Viewpoint-driven simplification using mutual information", Computers & Graphics 32(4), 2008; in
//! the form of the reference code of limdor/quoniam, VMI.cpp) is
//!
//! ```text
//! I(v) = F(v) / a_t(v) + L(A) - L(a_t(v)),    F(v) = sum over z of a_z(v) (L(a_z(v)) - L(A_z))
//! ```
//!
//! With the background as one more polygon, a_t and A are constants, so errors are compared by F
//! alone. L is rounded once, to [`FixedLog::fraction_bits`] fraction bits. F is then a sum of
//! products of integers without further rounding, so incremental sums equal sums from scratch bit
//! for bit.
//!
//! Limits: areas are at most 2^32, and sums stay within `i64` for at most `max_area` pixels over
//! all views.

use libm::log2;

/// Precision before rounding, in bits: results equal the correctly rounded logarithm except for one
/// in 2^20.
const INTERNAL_BITS: u32 = 58;
/// Arguments below `1 << TABLE_BITS` are looked up; larger ones also take four terms of a series.
const TABLE_BITS: u32 = 16;
/// Precision at which the table is summed: after 65,536 roundings it still exceeds `INTERNAL_BITS`.
const SERIES_BITS: u32 = 120;
/// Largest number of fraction bits; more would not change any order.
const MAX_FRACTION_BITS: u32 = 36;
/// Sums stay below two to this power.
const SUM_BITS: f64 = 62.0;

/// Table of `log2(n)` in steps of `2^-fraction_bits`.
#[derive(Debug, Clone)]
pub struct FixedLog {
    fraction_bits: u32,
    rounded: Vec<i64>,
    internal: Vec<u64>,
}

impl FixedLog {
    /// Creates a table for sums over at most `max_area` pixels (the number of views times the
    /// pixels of a view).
    ///
    /// Uses as many fraction bits as keep the sum of any error over all views within `i64`.
    pub fn new(max_area: u64) -> Self {
        let area = max_area.max(2) as f64;
        let headroom = SUM_BITS - log2(area * log2(area)).ceil() - 1.0;
        let fraction_bits = (headroom.max(1.0) as u32).min(MAX_FRACTION_BITS);
        let internal = internal_table();
        let rounded = internal.iter().map(|&log| round(log, fraction_bits)).collect();
        Self { fraction_bits, rounded, internal }
    }

    /// Number of fraction bits.
    pub fn fraction_bits(&self) -> u32 {
        self.fraction_bits
    }

    /// `log2(n)` rounded to the nearest step. Returns 0 for n = 0, where the product with the area
    /// of 0 vanishes anyway.
    #[inline]
    pub fn log2(&self, n: u32) -> i64 {
        match self.rounded.get(n as usize) {
            Some(&log) => log,
            None => round(self.internal_log2(n), self.fraction_bits),
        }
    }

    /// Increase of the term of a polygon of `before` pixels that receives `handed` more, where
    /// `log_after` is the logarithm of its new sum: (a + d) L(a + d) - a L(a) - d L(A + D).
    #[inline]
    pub fn handed_over(&self, before: u32, handed: u32, log_after: i64) -> i64 {
        let after = before + handed;
        i64::from(after) * self.log2(after) - i64::from(before) * self.log2(before) - i64::from(handed) * log_after
    }

    /// For n = h 2^s + l, with h from the upper half of the table: s + log2(h) + log2(1 + x), where
    /// x = l / (h 2^s) < 2^-15.
    fn internal_log2(&self, n: u32) -> u64 {
        let shift = u32::BITS - TABLE_BITS - n.leading_zeros();
        let head = n >> shift;
        let rest = u64::from(n - (head << shift));
        let x = u128::from((rest << (INTERNAL_BITS - shift)) / u64::from(head));
        let x2 = (x * x) >> INTERNAL_BITS;
        let x3 = (x2 * x) >> INTERNAL_BITS;
        let x4 = (x3 * x) >> INTERNAL_BITS;
        let ln = x - x2 / 2 + x3 / 3 - x4 / 4;
        let log2 = (ln * LOG2_E) >> LOG2_E_BITS;
        (u64::from(shift) << INTERNAL_BITS) + self.internal[head as usize] + log2 as u64
    }

    /// Converts a fixed-point sum to bits of information.
    pub fn to_bits(&self, sum: i64) -> f64 {
        sum as f64 / (1_u64 << self.fraction_bits) as f64
    }
}

/// log2(e) = 1.4426950408889634... in steps of 2^-63, truncated.
const LOG2_E: u128 = 13_306_513_097_844_322_491;
/// Number of fraction bits of [`LOG2_E`].
const LOG2_E_BITS: u32 = 63;

/// log2 of 0 (stored as 0) to `2^TABLE_BITS - 1` in steps of `2^-INTERNAL_BITS`, summed up from
/// ln(n + 1) - ln(n) = 2 atanh(1 / (2n + 1)).
fn internal_table() -> Vec<u64> {
    let mut table = vec![0, 0];
    let mut ln: u128 = 0;
    for n in 1..(1_u128 << TABLE_BITS) - 1 {
        let odd = 2 * n + 1;
        let (mut power, mut divisor, mut atanh) = ((1 << SERIES_BITS) / odd, 1, 0);
        while power > 0 {
            atanh += power / divisor;
            power /= odd * odd;
            divisor += 2;
        }
        ln += 2 * atanh;
        let half_precision = ln >> (SERIES_BITS / 2);
        table.push(((half_precision * LOG2_E) >> (SERIES_BITS / 2 + LOG2_E_BITS - INTERNAL_BITS)) as u64);
    }
    table
}

fn round(internal: u64, fraction_bits: u32) -> i64 {
    let dropped = INTERNAL_BITS - fraction_bits;
    ((internal + (1 << (dropped - 1))) >> dropped) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes the logarithm bit by bit: squaring doubles it, and each time the square reaches 2
    /// the next bit is 1.
    fn log2_by_squaring(n: u32, bits: u32) -> i64 {
        let whole = n.ilog2();
        let mut mantissa = u128::from(n) << (63 - whole);
        let mut fraction = 0_i64;
        for _ in 0..bits + 1 {
            mantissa = (mantissa * mantissa) >> 63;
            let reached = mantissa >> 64;
            mantissa >>= reached;
            fraction = fraction << 1 | reached as i64;
        }
        (i64::from(whole) << bits) + ((fraction + 1) >> 1)
    }

    #[test]
    fn logarithms_equal_those_found_digit_by_digit() {
        let log = FixedLog::new(20 * 64 * 64);
        let large = (1 << 16..u32::MAX - 99_991).step_by(99_991).chain([u32::MAX, 1 << 31, (1 << 16) + 1]);
        for n in (1..1 << 16).chain(large) {
            assert_eq!(log.log2(n), log2_by_squaring(n, log.fraction_bits()), "n = {n}");
        }
    }

    #[test]
    fn powers_of_two_are_exact_and_zero_counts_as_zero() {
        let log = FixedLog::new(20 * 512 * 512);
        assert_eq!(log.log2(0), 0);
        for power in 0..32 {
            assert_eq!(log.log2(1 << power), i64::from(power) << log.fraction_bits());
        }
    }

    #[test]
    fn the_largest_error_of_any_view_set_fits_64_bits() {
        for (views, resolution) in [(4, 1), (20, 128), (20, 256), (20, 512), (20, 2048)] {
            let max_area = views * resolution * resolution;
            let log = FixedLog::new(max_area);
            // Each |F| is at most a_t L(A); an error sums the differences of two over all views.
            let bound = 2 * i128::from(max_area) * i128::from(log.log2(max_area as u32));
            assert!(bound <= i128::from(i64::MAX), "{resolution}: {} bits", log.fraction_bits());
            assert!(log.fraction_bits() >= 28);
        }
    }
}
