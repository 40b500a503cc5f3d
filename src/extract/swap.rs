//! Split and collapse: moves the drawn scales of one plant on screen between active counts by
//! swaps.
//!
//! After C. Gasch, M. Chover, I. Remolar, C. Rebollo, *Multiresolution Foliage Rendering*,
//! Algorithms 1 and 2. A model's leaves are sorted so that the first to be removed comes last. To
//! get from one active count to another, leaves are collapsed or split one at a time, each swapping
//! one scale with its target:
//!
//! ```text
//! collapse: n -= 1; swap(slot[n], drawn[target(n)])
//! split:    swap(slot[n], drawn[target(n)]); n += 1
//! ```
//!
//! A swap is its own inverse and only moves bits, so every walk that returns to a count restores
//! every scale and slot to the bit. Differences from the printed algorithms:
//!
//! - The printed loop runs `i < newLeaf - currentLeaf` while its body changes `currentLeaf`, so it
//!   stops halfway. Here it runs until the count is reached.
//! - The printed collapse accesses leaf `currentLeaf`, the first one that is *not* drawn (and does
//!   not exist at full detail). Here the count is decremented first, so that collapse and split are
//!   exact inverses.
//! - The printed leaf has one `scale` for two purposes: the scale it is drawn with, and the scale
//!   it hands to its target. The two get mixed up as soon as an enlarged leaf is itself removed.
//!   Here drawn scales and slots are separate.
//! - The printed scales live in the shared list of leaves, so all plants of a species would have
//!   the same count. Here they belong to the plant on screen, and the model is unchanged.
//! - `leafToModifiy`, `leaf` and `lastLeave` are used without being defined; all refer to the one
//!   target of a leaf.
//!
//! Limits: 8 bytes of state per leaf for each plant on screen. For thousands of plants use
//! [`Timeline`](crate::model::Timeline).

use crate::model::{FoliageModel, NO_LEAF};
use std::{ops::Range, sync::Arc};

/// Number of leaves whose scales are reported as changed together. Their scales take 256 bytes; a
/// smaller upload costs the same.
pub const BLOCK_LEAVES: u32 = 64;
/// Number of blocks per word of the set of changed blocks.
const WORD_BLOCKS: u32 = 64;

/// Drawn scales of one plant on screen at its active count.
///
/// Clones share the targets, but each has its own active count and scales.
#[derive(Debug, Clone)]
pub struct Swap {
    active: u32,
    drawn: Vec<f32>,
    slots: Vec<f32>,
    targets: Arc<[u32]>,
    /// One bit per block of [`BLOCK_LEAVES`] leaves; all clear between calls.
    changed_blocks: Vec<u64>,
    changed: Vec<Range<u32>>,
}

impl Swap {
    /// Creates the state of a plant with all leaves active and every drawn scale 1. O(leaves); all
    /// memory is allocated here.
    pub fn new(model: &FoliageModel) -> Self {
        let count = model.leaves.len();
        let blocks = count.div_ceil(BLOCK_LEAVES as usize);
        Self {
            active: count as u32,
            drawn: vec![1.0; count],
            slots: model.leaves.iter().map(|leaf| leaf.scale).collect(),
            targets: model.leaves.iter().map(|leaf| leaf.leaf_to_collapse).collect(),
            changed_blocks: vec![0; blocks.div_ceil(WORD_BLOCKS as usize)],
            changed: Vec::with_capacity(blocks.div_ceil(2)),
        }
    }

    /// The active count: leaves `0..active` are drawn.
    pub fn active(&self) -> u32 {
        self.active
    }

    /// Number of leaves, active or not.
    pub fn leaves(&self) -> u32 {
        self.drawn.len() as u32
    }

    /// Drawn scale of every leaf. Leaves from the active count on are not drawn, but their scales
    /// are kept up to date.
    pub fn scales(&self) -> &[f32] {
        &self.drawn
    }

    /// Swap slot of every leaf: the scale to be exchanged next with its target's drawn scale.
    pub fn slots(&self) -> &[f32] {
        &self.slots
    }

    /// Splits or collapses until `n` leaves are active (all of them if `n` is larger).
    ///
    /// Returns the ranges of leaves whose [`scales`](Self::scales) may have changed: ascending,
    /// without overlap, rounded out to whole blocks of [`BLOCK_LEAVES`]. Empty if the count does
    /// not change. Costs O(leaves split or collapsed) plus a scan of one word per 4,096 leaves;
    /// allocates nothing.
    pub fn set_active(&mut self, n: u32) -> &[Range<u32>] {
        let n = n.min(self.leaves());
        self.changed.clear();
        if n == self.active {
            return &self.changed;
        }
        while self.active > n {
            self.active -= 1;
            self.swap(self.active);
        }
        while self.active < n {
            self.swap(self.active);
            self.active += 1;
        }
        self.collect_changed();
        &self.changed
    }

    /// Exchanges the slot of `leaf` with the drawn scale of its target.
    fn swap(&mut self, leaf: u32) {
        let target = self.targets[leaf as usize];
        if target == NO_LEAF {
            return;
        }
        std::mem::swap(&mut self.slots[leaf as usize], &mut self.drawn[target as usize]);
        let block = target / BLOCK_LEAVES;
        self.changed_blocks[(block / WORD_BLOCKS) as usize] |= 1 << (block % WORD_BLOCKS);
    }

    /// Converts the set of changed blocks to ranges of leaves and clears it.
    fn collect_changed(&mut self) {
        let leaves = self.leaves();
        for (word, bits) in self.changed_blocks.iter_mut().enumerate() {
            let mut rest = std::mem::take(bits);
            while rest != 0 {
                let block = word as u32 * WORD_BLOCKS + rest.trailing_zeros();
                rest &= rest - 1;
                let start = block * BLOCK_LEAVES;
                let end = (start + BLOCK_LEAVES).min(leaves);
                match self.changed.last_mut() {
                    Some(last) if last.end == start => last.end = end,
                    _ => self.changed.push(start..end),
                }
            }
        }
    }
}
