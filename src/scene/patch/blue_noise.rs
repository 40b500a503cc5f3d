//! Ranks of the cells of a pattern that tiles: the first n of them are spread evenly for every n.
//!
//! Best candidates (D. P. Mitchell, *Spectrally Optimal Sampling for Distribution Ray Tracing*,
//! SIGGRAPH 1991): each next cell is the one of some random cells that is farthest from all before,
//! as many as there are before. Distances are integers, so that the ranks are the same everywhere.
//!
//! Limits: distances are those of a grid, so that above a quarter of the cells the pattern is as
//! even as the grid lets it be.

use super::hash::{Stream, draw};
use std::sync::OnceLock;

/// Side of the pattern in cells.
pub(super) const SIDE: usize = 64;
/// Number of its cells.
pub(super) const CELLS: usize = SIDE * SIDE;
/// Seed of the random cells.
const SEED: u32 = 1;

/// Rank of each cell, row by row: each number from 0 to [`CELLS`] - 1 once.
pub(super) fn ranks() -> &'static [u16; CELLS] {
    static RANKS: OnceLock<Box<[u16; CELLS]>> = OnceLock::new();
    RANKS.get_or_init(made)
}

fn made() -> Box<[u16; CELLS]> {
    let mut ranks = Box::new([0; CELLS]);
    let mut free: Vec<usize> = (0..CELLS).collect();
    // Square of the distance of each cell to the nearest that has a rank.
    let mut nearest = vec![u32::MAX; CELLS];
    for rank in 0..CELLS {
        let candidate = |number: i32| {
            let random = u64::from(draw(SEED, [rank as i32, number], Stream::Kind));
            ((random * free.len() as u64) >> 32) as usize
        };
        let candidates = (0..rank.max(1) as i32).map(candidate);
        // The first of the farthest.
        let best = candidates.reduce(|best, next| if nearest[free[next]] > nearest[free[best]] { next } else { best });
        let cell = free.swap_remove(best.unwrap_or(0));
        ranks[cell] = rank as u16;
        nearest.iter_mut().enumerate().for_each(|(at, nearest)| *nearest = apart_squared(at, cell).min(*nearest));
    }
    ranks
}

/// Square of the distance of two cells on the torus.
fn apart_squared(a: usize, b: usize) -> u32 {
    let along = |a: usize, b: usize| a.abs_diff(b).min(SIDE - a.abs_diff(b)) as u32;
    let [x, z] = [along(a % SIDE, b % SIDE), along(a / SIDE, b / SIDE)];
    x * x + z * z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Least distance of two of the first `count` cells, on the torus.
    fn least_distance(count: usize) -> f64 {
        let first: Vec<usize> = (0..CELLS).filter(|&cell| usize::from(ranks()[cell]) < count).collect();
        assert_eq!(first.len(), count);
        let pairs = first.iter().enumerate().flat_map(|(i, &a)| first[..i].iter().map(move |&b| apart_squared(a, b)));
        f64::from(pairs.min().unwrap_or(0)).sqrt()
    }

    #[test]
    fn every_prefix_is_spread_evenly() {
        // Points in the densest packing are sqrt(2 / (sqrt(3) density)) apart.
        for count in [64, 256, 409, 1024] {
            let densest = (2.0 / 3.0_f64.sqrt() * CELLS as f64 / count as f64).sqrt();
            let least = least_distance(count);
            assert!(least > 0.55 * densest, "{count} points: {least} of {densest}");
        }
    }
}
