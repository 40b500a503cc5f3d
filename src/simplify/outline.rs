//! The crown's outline in a view: the full plant's silhouette with its small gaps closed.
//!
//! Leaves that are enlarged may fill gaps between leaves, since a crown would thin out otherwise,
//! but a leaf beyond the outline makes the plant grow out of its shape. Gaps are closed by dilation
//! followed by erosion (J. Serra, *Image Analysis and Mathematical Morphology*, 1982), which moves
//! no convex edge.

/// Widest gap that is closed, as a fraction of the view: sky between branches is wider, sky between
/// the leaves of a sparse crown is not.
const WIDEST_GAP: f64 = 1.0 / 32.0;

/// Reference of pixels beyond the outline: the row after the wood's, where leaves are numbered from
/// 0 and followed by the background and the wood.
pub fn beyond(background: u32) -> u32 {
    background + 2
}

/// Marks the pixels beyond the outline with the row [`beyond`]. `fronts` holds the frontmost
/// polygon of each pixel of a square view, `side` pixels on a side, with every leaf drawn.
pub fn marked(mut fronts: Vec<u32>, background: u32, side: usize) -> Vec<u32> {
    let covered: Vec<bool> = fronts.iter().map(|&front| front != background).collect();
    let closed = closed(&covered, side, (side as f64 * WIDEST_GAP / 2.0).ceil() as usize);
    fronts.iter_mut().zip(closed).filter(|(_, closed)| !closed).for_each(|(front, _)| *front = beyond(background));
    fronts
}

/// Sets the pixels in gaps up to `2 * reach` pixels wide.
fn closed(mask: &[bool], side: usize, reach: usize) -> Vec<bool> {
    // The dilated mask extends beyond the view.
    let wide = side + 2 * reach;
    let mut padded = vec![false; wide * wide];
    let row = |y: usize| (y + reach) * wide + reach;
    (0..side).for_each(|y| padded[row(y)..][..side].copy_from_slice(&mask[y * side..][..side]));
    let inverted = |mask: Vec<bool>| mask.into_iter().map(|set| !set).collect();
    let closed: Vec<bool> = inverted(dilated(inverted(dilated(padded, wide, reach)), wide, reach));
    (0..side).flat_map(|y| closed[row(y)..][..side].iter().copied()).collect()
}

/// Sets the pixels of every square of `2 * reach + 1` pixels around a set pixel.
fn dilated(mask: Vec<bool>, side: usize, reach: usize) -> Vec<bool> {
    let along = |mask: Vec<bool>, step: usize, line_step: usize| {
        let mut wide = vec![false; mask.len()];
        for line in 0..side {
            let at = |i: usize| line * line_step + i * step;
            let mut end = 0;
            for i in (0..side).filter(|&i| mask[at(i)]) {
                let from = i.saturating_sub(reach).max(end);
                end = (i + reach + 1).min(side);
                (from..end).for_each(|j| wide[at(j)] = true);
            }
        }
        wide
    };
    along(along(mask, 1, side), side, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(rows: [&str; 8]) -> Vec<bool> {
        rows.iter().flat_map(|row| row.bytes().map(|byte| byte == b'#')).collect()
    }

    #[test]
    fn narrow_gaps_are_closed_wide_ones_are_not_and_no_convex_edge_moves() {
        let open = ["........", ".#.#....", ".#.#....", ".###....", "........", ".....#..", "........", "........"];
        let shut = ["........", ".###....", ".###....", ".###....", "........", ".....#..", "........", "........"];
        assert_eq!(closed(&mask(open), 8, 1), mask(shut));
    }

    #[test]
    fn only_what_is_beyond_the_outline_is_marked() {
        let row = |front: u32| vec![9, 9, front, 9, 1, 9, 9, 9];
        let fronts: Vec<u32> = (0..8).flat_map(|y| row(if y < 4 { 9 } else { 2 })).collect();
        let marked = marked(fronts, 9, 8);
        assert_eq!(marked[..8], [11, 11, 11, 11, 1, 11, 11, 11]);
        assert_eq!(marked[56..], [11, 11, 2, 9, 1, 11, 11, 11]);
    }
}
