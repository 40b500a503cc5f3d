//! Live fragments of one view, sorted front to back in each pixel, so that nothing has to be
//! rendered again when a leaf is removed or grows.
//!
//! Each pixel keeps its two nearest fragments in its record and the deeper ones on a stack, nearest
//! on top. A pruned leaf is removed from the front and second places at once; its fragments on the
//! stacks are dropped when they are next visited. Every update is recorded as [`Change`]s of
//! (front, second) pairs, from which areas and criteria are updated.

use super::{
    appearance::ViewLook,
    change::{Change, Gain},
    footprint::Footprint,
    fragments::Coverage,
    occlusion::{Extent, Farthest},
};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// A fragment packed into one integer that is smaller when nearer: depth in the upper half, leaf
/// index in the lower, which also breaks ties.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Fragment(u64);

impl Fragment {
    fn new(depth: u32, leaf: u32) -> Self {
        Self(u64::from(depth) << 32 | u64::from(leaf))
    }

    fn leaf(self) -> u32 {
        self.0 as u32
    }

    fn depth(self) -> u32 {
        (self.0 >> 32) as u32
    }
}

#[derive(Debug, Clone, Copy)]
struct Pixel {
    front: Fragment,
    second: Fragment,
    /// Index of the stack's first slot.
    start: u32,
    /// Number of fragments on the stack, including dead ones.
    len: u32,
    /// Number of slots reserved for the stack.
    capacity: u32,
    /// Depth of the nearest wood, or [`NO_WOOD`]. Leaves behind it are not kept.
    wood_depth: u32,
}

/// Wood depth of a pixel without wood; the background lies behind everything.
const NO_WOOD: u32 = u32::MAX;

/// Fragments of one view.
#[derive(Debug)]
pub struct Layers {
    pixels: Vec<Pixel>,
    stacks: Vec<Fragment>,
    /// Number of slots abandoned by stacks that moved to grow.
    abandoned: usize,
    /// Number of leaves, which is also the background's row; the wood's row is the next.
    leaves: u32,
    /// Frontmost polygon of each pixel at full detail, or the row
    /// [`outline::beyond`](super::outline::beyond); empty if references are not kept.
    reference: Vec<u32>,
    /// Occlusion data; `None` if references are not kept.
    farthest: Option<Farthest>,
    /// Changes recorded since this list was last cleared.
    pub changes: Vec<Change>,
}

/// Fraction of abandoned slots above which all stacks are repacked.
const MAX_ABANDONED: f64 = 0.25;
/// Smallest capacity of a stack that has grown.
const LEAST_CAPACITY: u32 = 4;

impl Layers {
    /// Sorts captured coverage into the fragments of each pixel.
    ///
    /// `depth(coverage)` returns the depth of an entry and `leaf_of(triangle)` the leaf of a
    /// triangle, or `leaves + 1` for the wood, where `leaves` is the length of `covered`. Fragments
    /// behind the wood are dropped, since nothing ever uncovers them. Adds the number of pixels
    /// that each leaf covers, including pixels behind the wood, to its entry in `covered`.
    pub fn new(
        pixels: usize,
        coverage: &[Coverage],
        depth: impl Fn(Coverage) -> u32,
        leaf_of: impl Fn(u32) -> u32,
        covered: &mut [u32],
    ) -> Self {
        let leaves = covered.len() as u32;
        let wood_row = leaves + 1;
        let mut wood_depth = vec![NO_WOOD; pixels];
        let mut starts = vec![0_u32; pixels + 1];
        for entry in coverage {
            if leaf_of(entry.triangle) == wood_row {
                let nearest = &mut wood_depth[entry.pixel as usize];
                *nearest = depth(*entry).min(*nearest);
            } else {
                starts[entry.pixel as usize + 1] += 1;
            }
        }
        for pixel in 0..pixels {
            starts[pixel + 1] += starts[pixel];
        }
        let mut stacks = vec![Fragment::default(); starts[pixels] as usize];
        let mut lens = vec![0_u32; pixels];
        for entry in coverage {
            let (leaf, pixel) = (leaf_of(entry.triangle), entry.pixel as usize);
            if leaf != wood_row {
                stacks[(starts[pixel] + lens[pixel]) as usize] = Fragment::new(depth(*entry), leaf);
                lens[pixel] += 1;
            }
        }
        let pixels = (0..pixels).map(|at| {
            let stack = &mut stacks[starts[at] as usize..][..lens[at] as usize];
            let bottom = bottom(wood_depth[at], leaves);
            let mut pixel = Pixel {
                front: bottom,
                second: bottom,
                start: starts[at],
                len: sorted(stack, wood_depth[at], covered),
                capacity: starts[at + 1] - starts[at],
                wood_depth: wood_depth[at],
            };
            pixel.front = pixel.pop(&stacks, &[], bottom);
            pixel.second = pixel.pop(&stacks, &[], bottom);
            pixel
        });
        Self {
            pixels: pixels.collect(),
            stacks,
            abandoned: 0,
            leaves,
            reference: Vec::new(),
            farthest: None,
            changes: Vec::new(),
        }
    }

    /// Keeps `full` as the reference: for every pixel of the same view the frontmost polygon at
    /// full detail, or the row [`outline::beyond`](super::outline::beyond).
    pub fn keep_reference(&mut self, full: Vec<u32>) {
        self.reference = full;
        self.farthest = Some(Farthest::new(self.pixels.len()));
    }

    /// Returns the frontmost polygon of every pixel.
    pub fn front_rows(&self) -> Vec<u32> {
        self.pixels.iter().map(|pixel| pixel.front.leaf()).collect()
    }

    /// Iterates over the reference and the (front, second) pair of every pixel. Returns `None` if
    /// references are not kept.
    pub fn references(&self) -> Option<impl Iterator<Item = (u32, [u32; 2])> + '_> {
        (!self.reference.is_empty()).then(|| self.reference.iter().copied().zip(self.fronts()))
    }

    /// Returns the gain of changing a leaf's footprint from `old` to `new`. The footprints need
    /// only the fragments that are frontmost now or would become frontmost.
    pub fn gain(&self, leaf: u32, old: &Footprint, new: &Footprint, look: ViewLook<'_>) -> Gain {
        let mut gain = Gain::default();
        for &(index, _) in &new.fragments {
            let front = self.pixels[index as usize].front.leaf();
            gain = gain.plus(look.gain(front, leaf, self.reference[index as usize]));
        }
        for &(index, _) in &old.fragments {
            if new.depth_at(index).is_none() {
                let second = self.pixels[index as usize].second.leaf();
                gain = gain.plus(look.gain(leaf, second, self.reference[index as usize]));
            }
        }
        gain
    }

    /// Whether a fragment of `leaf` at `depth` would be frontmost at pixel `index`.
    pub fn would_show(&self, index: u32, depth: u32, leaf: u32) -> bool {
        let Pixel { front, second, .. } = self.pixels[index as usize];
        Fragment::new(depth, leaf) < if front.leaf() == leaf { second } else { front }
    }

    /// Whether `leaf` is frontmost at pixel `index`.
    pub fn shows(&self, index: u32, leaf: u32) -> bool {
        self.pixels[index as usize].front.leaf() == leaf
    }

    /// Updates the occlusion data that [`hides`](Self::hides) uses.
    pub fn refresh(&mut self) {
        if let Some(farthest) = &mut self.farthest {
            farthest.refresh(|pixel| self.pixels[pixel].front.depth());
        }
    }

    /// Whether everything within `extent` is hidden. Conservative: may return false for a hidden
    /// extent, and always does if references are not kept.
    pub fn hides(&self, extent: &Extent) -> bool {
        self.farthest.as_ref().is_some_and(|farthest| farthest.hides(extent))
    }

    /// Iterates over the (front, second) pairs of all pixels.
    pub fn fronts(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.pixels.iter().map(|pixel| pixel.pair())
    }

    /// Removes a leaf that was just marked dead. `footprint` is its footprint or its outline.
    pub fn remove(&mut self, leaf: u32, footprint: &Footprint, dead: &[AtomicBool]) {
        for &(index, _) in &footprint.fragments {
            let from = self.pixels[index as usize].pair();
            if self.take_visible(index, leaf, dead) {
                self.record(index, from);
            }
        }
    }

    /// Replaces a leaf's footprint `old` with `new`, touching only the pixels where they differ.
    pub fn regrow(&mut self, leaf: u32, old: &Footprint, new: &Footprint, dead: &[AtomicBool]) {
        for &(index, depth) in &new.fragments {
            let old_depth = old.depth_at(index);
            if old_depth == Some(depth) {
                continue;
            }
            let from = self.pixels[index as usize].pair();
            if old_depth.is_some() {
                self.take(index, leaf, dead);
            }
            self.insert(index, Fragment::new(depth, leaf), dead);
            self.record(index, from);
        }
        for &(index, _) in &old.fragments {
            if new.depth_at(index).is_none() {
                let from = self.pixels[index as usize].pair();
                self.take(index, leaf, dead);
                self.record(index, from);
            }
        }
        if self.abandoned as f64 > self.stacks.len() as f64 * MAX_ABANDONED {
            self.pack(dead);
        }
    }

    /// Records the change of a pixel, merging it with the previous change if both are the same.
    fn record(&mut self, index: u32, from: [u32; 2]) {
        let to = self.pixels[index as usize].pair();
        let reference = self.reference.get(index as usize).copied().unwrap_or(self.leaves);
        if from[0] != to[0]
            && let Some(farthest) = &mut self.farthest
        {
            farthest.touch(index);
        }
        match self.changes.last_mut() {
            _ if from == to => {}
            Some(last) if last.from == from && last.to == to && last.reference == reference => last.count += 1,
            _ => self.changes.push(Change { from, to, reference, count: 1 }),
        }
    }

    /// Removes a leaf from the front or second place of a pixel and refills the place from the
    /// stack. Returns whether the leaf was there.
    fn take_visible(&mut self, index: u32, leaf: u32, dead: &[AtomicBool]) -> bool {
        let pixel = &mut self.pixels[index as usize];
        let is_front = pixel.front.leaf() == leaf;
        if !is_front && pixel.second.leaf() != leaf {
            return false;
        }
        if is_front {
            pixel.front = pixel.second;
        }
        pixel.second = pixel.pop(&self.stacks, dead, bottom(pixel.wood_depth, self.leaves));
        true
    }

    /// Removes a live leaf from a pixel, wherever it is; does nothing if it was behind the wood.
    fn take(&mut self, index: u32, leaf: u32, dead: &[AtomicBool]) {
        if self.take_visible(index, leaf, dead) {
            return;
        }
        let pixel = &mut self.pixels[index as usize];
        let stack = &mut self.stacks[pixel.start as usize..][..pixel.len as usize];
        if let Some(at) = stack.iter().rposition(|fragment| fragment.leaf() == leaf) {
            stack.copy_within(at + 1.., at);
            pixel.len -= 1;
        }
    }

    /// Adds a fragment unless it is behind the wood.
    fn insert(&mut self, index: u32, mut fragment: Fragment, dead: &[AtomicBool]) {
        let pixel = &mut self.pixels[index as usize];
        let bottom = bottom(pixel.wood_depth, self.leaves);
        if fragment > bottom {
            return;
        }
        if fragment < pixel.front {
            std::mem::swap(&mut fragment, &mut pixel.front);
        }
        if fragment < pixel.second {
            std::mem::swap(&mut fragment, &mut pixel.second);
        }
        if fragment != bottom {
            self.push(index, fragment, dead);
        }
    }

    /// Inserts a fragment into the stack in depth order.
    fn push(&mut self, index: u32, fragment: Fragment, dead: &[AtomicBool]) {
        if self.pixels[index as usize].len == self.pixels[index as usize].capacity {
            self.make_room(index, dead);
        }
        let pixel = &mut self.pixels[index as usize];
        let mut at = (pixel.start + pixel.len) as usize;
        pixel.len += 1;
        while at > pixel.start as usize && self.stacks[at - 1] < fragment {
            self.stacks[at] = self.stacks[at - 1];
            at -= 1;
        }
        self.stacks[at] = fragment;
    }

    /// Drops the dead fragments of a full stack; if there are none, moves the stack to twice the
    /// capacity.
    fn make_room(&mut self, index: u32, dead: &[AtomicBool]) {
        let pixel = &mut self.pixels[index as usize];
        let slots = pixel.start as usize..(pixel.start + pixel.len) as usize;
        let mut kept = slots.start;
        for at in slots.clone() {
            if !is_dead(dead, self.stacks[at]) {
                self.stacks[kept] = self.stacks[at];
                kept += 1;
            }
        }
        pixel.len = (kept - slots.start) as u32;
        if pixel.len == pixel.capacity {
            self.abandoned += pixel.capacity as usize;
            pixel.start = self.stacks.len() as u32;
            pixel.capacity = (pixel.capacity * 2).max(LEAST_CAPACITY);
            self.stacks.extend_from_within(slots);
            self.stacks.resize((pixel.start + pixel.capacity) as usize, Fragment::default());
        }
    }

    /// Repacks all stacks without gaps or dead fragments.
    fn pack(&mut self, dead: &[AtomicBool]) {
        let mut packed = Vec::with_capacity(self.stacks.len() - self.abandoned);
        for pixel in &mut self.pixels {
            let start = packed.len();
            let stack = &self.stacks[pixel.start as usize..][..pixel.len as usize];
            packed.extend(stack.iter().filter(|fragment| !is_dead(dead, **fragment)));
            pixel.start = start as u32;
            pixel.len = (packed.len() - start) as u32;
            pixel.capacity = pixel.len;
        }
        self.stacks = packed;
        self.abandoned = 0;
    }
}

impl Pixel {
    fn pair(&self) -> [u32; 2] {
        [self.front.leaf(), self.second.leaf()]
    }

    /// Pops the nearest live fragment from the stack, or returns `bottom` if there is none. `dead`
    /// may be empty if no leaf is dead.
    fn pop(&mut self, stacks: &[Fragment], dead: &[AtomicBool], bottom: Fragment) -> Fragment {
        while self.len > 0 {
            self.len -= 1;
            let fragment = stacks[(self.start + self.len) as usize];
            if !is_dead(dead, fragment) {
                return fragment;
            }
        }
        bottom
    }
}

/// Whether a fragment's leaf is pruned. `dead` may be empty if no leaf is.
fn is_dead(dead: &[AtomicBool], fragment: Fragment) -> bool {
    dead.get(fragment.leaf() as usize).is_some_and(|dead| dead.load(Relaxed))
}

/// Returns the fragment behind all leaves: the wood, or else the background.
fn bottom(wood_depth: u32, leaves: u32) -> Fragment {
    Fragment::new(wood_depth, if wood_depth == NO_WOOD { leaves } else { leaves + 1 })
}

/// Sorts the fragments of a pixel, nearest last. Keeps only the nearest one of each leaf, counts
/// the pixel as covered by that leaf, and drops fragments behind the wood. Returns the number of
/// fragments kept.
fn sorted(stack: &mut [Fragment], wood_depth: u32, covered: &mut [u32]) -> u32 {
    stack.sort_unstable_by_key(|fragment| (fragment.leaf(), fragment.0));
    let (mut kept, mut last) = (0, None);
    for at in 0..stack.len() {
        let fragment = stack[at];
        if last.replace(fragment.leaf()) != Some(fragment.leaf()) {
            covered[fragment.leaf() as usize] += 1;
            stack[kept] = fragment;
            kept += usize::from(fragment.depth() <= wood_depth);
        }
    }
    stack[..kept].sort_unstable_by(|a, b| b.cmp(a));
    kept as u32
}
