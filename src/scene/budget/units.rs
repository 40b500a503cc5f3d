//! Costs as whole numbers, whose sums are the same in any order. Sums stop at the largest number.

/// Units of a cost of 1.
const UNITS: f64 = 65536.0;

/// A cost in units, rounded up: sums are never below those of the costs. None for NaN.
#[inline]
pub fn units(cost: f64) -> u64 {
    let exact = cost * UNITS;
    let down = exact as i64;
    (down + i64::from((down as f64) < exact && down < i64::MAX)).max(0) as u64
}

/// A budget in units, rounded down; none for NaN, and the largest number if it is beyond all.
pub fn budget_units(budget: f64) -> u64 {
    (budget * UNITS) as u64
}

/// The cost of so many units.
pub fn cost(units: u64) -> f64 {
    units as f64 / UNITS
}

/// Sum that stops at the largest number.
pub fn sum(costs: impl Iterator<Item = u64>) -> u64 {
    costs.fold(0, u64::saturating_add)
}
