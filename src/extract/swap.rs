//! Split and collapse: the drawn scales of one plant on screen, moved between active counts by swaps.
//!
//! After J. Gasch, M. Chover, I. Remolar, C. Rebollo, *Multiresolution Foliage Rendering*, Algorithms 1 and 2. A model's
//! leaves are sorted so that the first to be lost is last. To go from one active count to another, leaves are collapsed or
//! split one at a time, each swapping one scale with its target:
//!
//! ```text
//! collapse: n -= 1; swap(slot[n], drawn[target(n)])        split: swap(slot[n], drawn[target(n)]); n += 1
//! ```
//!
//! A swap is its own inverse and only moves bits, so every walk that comes back to a count restores every scale and slot
//! to the bit. Where this differs from the printed algorithms:
//!
//! - The printed loop runs `i < newLeaf - currentLeaf` while its body changes `currentLeaf`, so it stops half way. Here
//!   it runs until the count is reached.
//! - The printed collapse touches leaf `currentLeaf`, the first one that is *not* drawn (and at full detail does not
//!   exist). Here the count falls first, so that collapse and split are exact inverses.
//! - The printed leaf has one `scale` for two things: what it is drawn with, and what it hands to its target. As soon as
//!   an enlarged leaf is itself removed the two get mixed up. Here drawn scales and slots are separate.
//! - The printed scales live in the shared list of leaves, so all plants of a kind would have one count. Here they belong
//!   to the plant on screen, and the model stays as it is.
//! - `leafToModifiy`, `leaf` and `lastLeave` are used without being defined; all mean the one target of a leaf.
//!
//! Limits: 8 bytes of state a leaf and plant on screen. For thousands of plants use [`Timeline`](crate::model::Timeline).

use crate::model::{FoliageModel, NO_LEAF};
use std::{ops::Range, sync::Arc};

/// Leaves whose scales are reported as changed together: 256 bytes of scales, below which an upload costs the same.
pub const BLOCK_LEAVES: u32 = 64;
/// Blocks in one word of the set of changed blocks.
const WORD_BLOCKS: u32 = 64;

/// Drawn scales of one plant on screen at its active count.
///
/// Clones share the targets; each clone walks on its own.
#[derive(Debug, Clone)]
pub struct Swap {
    active: u32,
    drawn: Vec<f32>,
    slots: Vec<f32>,
    targets: Arc<[u32]>,
    /// One bit for every [`BLOCK_LEAVES`] leaves; all clear between calls.
    changed_blocks: Vec<u64>,
    changed: Vec<Range<u32>>,
}

impl Swap {
    /// The plant with all its leaves active, every drawn scale 1. O(leaves); allocates all that it will ever need.
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

    /// Drawn scale of every leaf; those from the active count on are not drawn, yet kept current.
    pub fn scales(&self) -> &[f32] {
        &self.drawn
    }

    /// Swap slot of every leaf: what its target's drawn scale is exchanged with next.
    pub fn slots(&self) -> &[f32] {
        &self.slots
    }

    /// Splits or collapses until `n` leaves are active (all of them for a larger `n`).
    ///
    /// Returns where [`scales`](Self::scales) changed: ranges of leaves in rising order without overlap, rounded out to
    /// whole blocks of [`BLOCK_LEAVES`]. Empty when the count stays. Costs O(leaves split or collapsed) and a scan of one
    /// word per 4,096 leaves; allocates nothing.
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

    /// Turns the set of changed blocks into ranges of leaves and clears it.
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
