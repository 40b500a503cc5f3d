//! Live fragments of one view, sorted front to back in each pixel, so that nothing has to be
//! rendered again when a leaf is removed or grows.
//!
//! Each pixel has a stack of fragments, nearest on top and wood, if there is any, at the bottom, as
//! well as a record that names the polygons of the two nearest. The fragments of a pruned leaf are
//! dropped when they come to the top or their stack is full. Every update is recorded as
//! [`Change`]s of (front, second) pairs, from which areas and criteria are updated.

use super::{
    change::Change,
    footprint::Footprints,
    fragments::Coverage,
    occlusion::Occlusion,
    order::PixelOrder,
    pixels::{MAX_ROOM, Pixels},
};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// A fragment packed into one integer that is smaller when nearer: depth in the upper half, row in
/// the lower, which also breaks ties. Rows are leaves, then the background, then the wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Fragment(u64);

impl Fragment {
    fn new(depth: u32, row: u32) -> Self {
        Self(u64::from(depth) << 32 | u64::from(row))
    }

    fn row(self) -> u32 {
        self.0 as u32
    }

    fn depth(self) -> u32 {
        (self.0 >> 32) as u32
    }
}

/// Wood depth of a pixel without wood; the background lies behind everything.
pub const NO_WOOD: u32 = u32::MAX;

/// Fragments of one view.
#[derive(Debug)]
pub struct Layers {
    order: PixelOrder,
    pixels: Pixels,
    stacks: Vec<Fragment>,
    /// For each polygon, the number of pixels in which it is frontmost, and directly behind.
    seen: Vec<[u32; 2]>,
    /// Number of leaves, which is also the background's row; the wood's row is the next.
    leaves: u32,
    /// Frontmost polygon of each pixel at full detail, or the row
    /// [`outline::beyond`](super::outline::beyond); empty if references are not kept.
    reference: Vec<u32>,
    /// Frontmost fragments once more; `None` if references are not kept.
    occlusion: Option<Occlusion>,
    /// Changes recorded since this list was last cleared.
    pub changes: Vec<Change>,
}

/// Marks a slot that is no stack's first.
const NO_OWNER: u32 = u32::MAX;
/// Free slots behind all stacks, as a fraction of the fragments, once the stacks are packed. With
/// more, they are packed less often and take more memory.
const SPARE: f64 = 0.125;

impl Layers {
    /// Sorts captured coverage into the fragments of each pixel. `wood_depth` holds the depth of
    /// the wood that is not captured, or [`NO_WOOD`], for each pixel, row by row.
    ///
    /// `depth(coverage)` returns the depth of an entry and `leaf_of(triangle)` the leaf of a
    /// triangle, or `leaves + 1` for the wood, where `leaves` is the length of `covered`. Fragments
    /// behind the wood are dropped, since nothing ever uncovers them. Adds the number of pixels
    /// that each leaf covers, including pixels behind the wood, to its entry in `covered`.
    pub fn new(
        wood_depth: &[u32],
        coverage: &[Coverage],
        depth: impl Fn(Coverage) -> u32,
        leaf_of: impl Fn(u32) -> u32,
        covered: &mut [u32],
    ) -> Self {
        let leaves = covered.len() as u32;
        let wood_row = leaves + 1;
        let pixels = wood_depth.len();
        let order = PixelOrder::new(pixels.isqrt() as u32);
        let mut wood_depth = order.arranged(wood_depth);
        let mut starts = vec![0_u32; pixels + 1];
        for entry in coverage {
            let index = order.index_of(entry.pixel) as usize;
            if leaf_of(entry.triangle) == wood_row {
                wood_depth[index] = depth(*entry).min(wood_depth[index]);
            } else {
                starts[index + 1] += 1;
            }
        }
        for pixel in 0..pixels {
            starts[pixel + 1] += starts[pixel] + u32::from(wood_depth[pixel] != NO_WOOD);
        }
        let fragments = starts[pixels] as usize;
        let mut stacks = Vec::with_capacity(fragments + (fragments as f64 * SPARE) as usize);
        stacks.resize(fragments, Fragment::default());
        let mut ends = starts[..pixels].to_vec();
        for (end, &depth) in ends.iter_mut().zip(&wood_depth).filter(|(_, depth)| **depth != NO_WOOD) {
            stacks[*end as usize] = Fragment::new(depth, wood_row);
            *end += 1;
        }
        for entry in coverage {
            let (leaf, end) = (leaf_of(entry.triangle), &mut ends[order.index_of(entry.pixel) as usize]);
            if leaf != wood_row {
                stacks[*end as usize] = Fragment::new(depth(*entry), leaf);
                *end += 1;
            }
        }
        let mut seen = vec![[0; 2]; leaves as usize + 2];
        let mut records = Pixels::new(pixels, leaves);
        for at in 0..pixels {
            if starts[at] == starts[at + 1] {
                seen[leaves as usize].iter_mut().for_each(|count| *count += 1);
                continue;
            }
            let stack = &mut stacks[starts[at] as usize..starts[at + 1] as usize];
            let len = sorted(stack, leaves, covered);
            let nearest = |place| len.checked_sub(place).map(|at| stack[at]);
            let pair = pair(nearest(1), nearest(2), leaves);
            (0..2).for_each(|place| seen[pair[place] as usize][place] += 1);
            let pixel = records.get_mut(at as u32);
            (pixel.pair, pixel.start) = (pair, starts[at]);
            pixel.set(len as u32, (stack.len() - len) as u32);
        }
        Self {
            order,
            pixels: records,
            stacks,
            seen,
            leaves,
            reference: Vec::new(),
            occlusion: None,
            changes: Vec::new(),
        }
    }

    /// Keeps `full` as the reference: for every pixel of the same view, row by row, the frontmost
    /// polygon at full detail, or the row [`outline::beyond`](super::outline::beyond).
    pub fn keep_reference(&mut self, full: &[u32]) {
        self.reference = self.order.arranged(full);
        let mut occlusion = Occlusion::new(self.pixels.count());
        for index in 0..self.pixels.count() as u32 {
            let front = self.nearest(index, 0);
            occlusion.set(index, front.depth(), front.row());
        }
        self.occlusion = Some(occlusion);
    }

    /// Returns the frontmost polygon of every pixel, row by row.
    pub fn front_rows(&self) -> Vec<u32> {
        let numbers = 0..self.pixels.count() as u32;
        numbers.map(|number| self.pixels.get(self.order.index_of(number)).pair[0]).collect()
    }

    /// Iterates over the reference and the (front, second) pair of every pixel. Returns `None` if
    /// references are not kept.
    pub fn references(&self) -> Option<impl Iterator<Item = (u32, [u32; 2])> + '_> {
        (!self.reference.is_empty()).then(|| self.reference.iter().copied().zip(self.fronts()))
    }

    /// Whether `leaf` at `depth` is nearer than the frontmost fragment of a pixel for `place` 0,
    /// than the one behind it for 1.
    pub fn is_before(&self, index: u32, place: u32, depth: u32, leaf: u32) -> bool {
        Fragment::new(depth, leaf) < self.nearest(index, place)
    }

    /// Frontmost polygon of a pixel.
    pub fn front(&self, index: u32) -> u32 {
        self.pixels.get(index).pair[0]
    }

    /// Polygon directly behind the frontmost one of a pixel.
    pub fn second(&self, index: u32) -> u32 {
        self.pixels.get(index).pair[1]
    }

    /// Reference of a pixel. References must be kept.
    pub fn reference(&self, index: u32) -> u32 {
        self.reference[index as usize]
    }

    /// Numbers of pixels in which `leaf` is frontmost, and directly behind the frontmost polygon.
    pub fn seen(&self, leaf: u32) -> [u32; 2] {
        self.seen[leaf as usize]
    }

    /// Frontmost fragment of a pixel for `place` 0, the one behind it for 1: the background's if
    /// there is none.
    fn nearest(&self, index: u32, place: u32) -> Fragment {
        let pixel = self.pixels.get(index);
        match pixel.len().checked_sub(1 + place) {
            Some(at) => self.stacks[(pixel.start + at) as usize],
            None => Fragment::new(NO_WOOD, self.leaves),
        }
    }

    /// Updates the [occlusion](Self::occlusion) data.
    pub fn refresh(&mut self) {
        self.occlusion.iter_mut().for_each(Occlusion::refresh);
    }

    /// Frontmost fragments, laid out for judging; `None` if references are not kept.
    pub fn occlusion(&self) -> Option<&Occlusion> {
        self.occlusion.as_ref()
    }

    /// Iterates over the (front, second) pairs of all pixels.
    pub fn fronts(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.pixels.iter().map(|pixel| pixel.pair)
    }

    /// Removes a leaf that was just marked dead from a pixel, unless it is no longer seen in any.
    pub fn remove(&mut self, leaf: u32, index: u32, dead: &[AtomicBool]) {
        if self.seen(leaf) == [0; 2] {
            return;
        }
        let from = self.pixels.get(index).pair;
        if from.contains(&leaf) {
            self.settle(index, dead);
            self.record(index, from, leaf);
        }
    }

    /// Replaces a leaf's footprint at one scale with that at another, touching only the pixels
    /// where they differ.
    pub fn regrow(&mut self, leaf: u32, footprints: &Footprints, dead: &[AtomicBool]) {
        footprints.for_each_difference(|index, is_covered, depth| {
            let from = self.pixels.get(index).pair;
            if is_covered {
                self.take(index, leaf, dead);
            }
            if let Some(depth) = depth {
                self.insert(index, Fragment::new(depth, leaf), dead);
            }
            self.record(index, from, leaf);
        });
    }

    /// Records the change of a pixel of `leaf`, merging it with the previous change if both are the
    /// same.
    fn record(&mut self, index: u32, from: [u32; 2], leaf: u32) {
        let to = self.pixels.get(index).pair;
        if self.occlusion.is_some() && (from[0] != to[0] || to[0] == leaf) {
            let front = self.nearest(index, 0);
            self.occlusion.iter_mut().for_each(|occlusion| occlusion.set(index, front.depth(), front.row()));
        }
        if from == to {
            return;
        }
        for place in 0..2 {
            self.seen[from[place] as usize][place] -= 1;
            self.seen[to[place] as usize][place] += 1;
        }
        let reference = self.reference.get(index as usize).copied().unwrap_or(self.leaves);
        match self.changes.last_mut() {
            Some(last) if last.from == from && last.to == to && last.reference == reference => last.count += 1,
            _ => self.changes.push(Change { from, to, reference, count: 1 }),
        }
    }

    /// Drops the dead fragments above the two nearest live ones and names those two in the record.
    /// `dead` may be empty if no leaf is dead.
    fn settle(&mut self, index: u32, dead: &[AtomicBool]) {
        let pixel = self.pixels.get_mut(index);
        let len = pixel.len() as usize;
        let stack = &mut self.stacks[pixel.start as usize..][..len];
        let live_below = |stack: &[Fragment], end: usize| stack[..end].iter().rposition(|&at| !is_dead(dead, at));
        let Some(front) = live_below(stack, len) else {
            pixel.pair = [self.leaves; 2];
            return pixel.set_len(0);
        };
        let second = live_below(stack, front);
        pixel.pair = pair(Some(stack[front]), second.map(|second| stack[second]), self.leaves);
        let kept = second.map_or(0, |second| second + 1);
        stack[kept] = stack[front];
        if kept + 1 < len {
            pixel.set_len(kept as u32 + 1);
        }
    }

    /// Removes a live leaf from a pixel; does nothing if it was behind the wood.
    fn take(&mut self, index: u32, leaf: u32, dead: &[AtomicBool]) {
        let pixel = self.pixels.get_mut(index);
        let stack = &mut self.stacks[pixel.start as usize..][..pixel.len() as usize];
        let Some(at) = stack.iter().rposition(|fragment| fragment.row() == leaf) else { return };
        stack.copy_within(at + 1.., at);
        pixel.set_len(pixel.len() - 1);
        if pixel.pair.contains(&leaf) {
            self.settle(index, dead);
        }
    }

    /// Adds a fragment unless it is behind the wood.
    fn insert(&mut self, index: u32, fragment: Fragment, dead: &[AtomicBool]) {
        if self.pixels.get(index).room() == 0 {
            self.make_room(index, dead);
        }
        let pixel = self.pixels.get_mut(index);
        let len = pixel.len() as usize;
        let stack = &mut self.stacks[pixel.start as usize..][..len + 1];
        let at = stack[..len].iter().rposition(|other| *other > fragment).map_or(0, |farther| farther + 1);
        if at == 0 && len > 0 && stack[0].row() > self.leaves {
            return;
        }
        stack.copy_within(at..len, at + 1);
        stack[at] = fragment;
        pixel.set_len(len as u32 + 1);
        match len - at {
            0 => pixel.pair = [fragment.row(), pixel.pair[0]],
            1 => pixel.pair[1] = fragment.row(),
            _ => {}
        }
    }

    /// Drops the dead fragments of a full stack; if there are none, moves the stack to where it has
    /// room for some more.
    fn make_room(&mut self, index: u32, dead: &[AtomicBool]) {
        let pixel = self.pixels.get_mut(index);
        let len = pixel.len();
        let slots = pixel.start as usize..(pixel.start + len) as usize;
        let mut kept = slots.start;
        for at in slots.clone() {
            if !is_dead(dead, self.stacks[at]) {
                self.stacks[kept] = self.stacks[at];
                kept += 1;
            }
        }
        pixel.set_len((kept - slots.start) as u32);
        if pixel.room() > 0 {
            return;
        }
        let room = (len / 4 + 2).min(MAX_ROOM);
        let needed = (len + room) as usize;
        if self.stacks.capacity() - self.stacks.len() < needed {
            self.pack(needed, dead);
        }
        let pixel = self.pixels.get_mut(index);
        let slots = pixel.start as usize..(pixel.start + len) as usize;
        pixel.start = self.stacks.len() as u32;
        pixel.set(len, room);
        self.stacks.extend_from_within(slots);
        self.stacks.resize(self.stacks.len() + room as usize, Fragment::default());
    }

    /// Moves all stacks together, without gaps or dead fragments, with at least `spare` free slots
    /// behind them. Keeps the memory of dead fragments, so that stacks are packed less often as
    /// leaves become fewer.
    fn pack(&mut self, spare: usize, dead: &[AtomicBool]) {
        // For each slot that is a stack's first, the place of its pixel.
        let mut owners = vec![NO_OWNER; self.stacks.len()];
        let pixels = self.pixels.kept_mut();
        for (pixel, place) in pixels.iter_mut().zip(0..) {
            if pixel.len() > 0 {
                owners[pixel.start as usize] = place;
            } else {
                pixel.start = 0;
                pixel.set(0, 0);
            }
        }
        let mut end = 0;
        for place in owners.into_iter().filter(|place| *place != NO_OWNER) {
            let pixel = &mut pixels[place as usize];
            let (slots, start) = (pixel.start as usize..(pixel.start + pixel.len()) as usize, end);
            for at in slots {
                let fragment = self.stacks[at];
                if !is_dead(dead, fragment) {
                    self.stacks[end] = fragment;
                    end += 1;
                }
            }
            pixel.start = start as u32;
            pixel.set((end - start) as u32, 0);
        }
        self.stacks.truncate(end);
        self.stacks.reserve_exact(spare.max((end as f64 * SPARE) as usize));
    }
}

/// Returns the row of the frontmost polygon of each pixel, and the depth of the nearest wood or
/// [`NO_WOOD`]. `fragments` yields pixels, depths and rows: `leaves + 1` for the wood.
pub fn fronts(pixels: usize, fragments: impl Iterator<Item = (u32, u32, u32)>, leaves: u32) -> [Vec<u32>; 2] {
    let mut fronts = vec![Fragment::new(NO_WOOD, leaves); pixels];
    let mut wood_depth = vec![NO_WOOD; pixels];
    for (pixel, depth, row) in fragments {
        let front = &mut fronts[pixel as usize];
        *front = Fragment::new(depth, row).min(*front);
        if row == leaves + 1 {
            let nearest = &mut wood_depth[pixel as usize];
            *nearest = depth.min(*nearest);
        }
    }
    [fronts.into_iter().map(Fragment::row).collect(), wood_depth]
}

/// Whether a fragment's leaf is pruned. `dead` may be empty if no leaf is.
fn is_dead(dead: &[AtomicBool], fragment: Fragment) -> bool {
    dead.get(fragment.row() as usize).is_some_and(|dead| dead.load(Relaxed))
}

/// Rows of the frontmost fragment of a pixel and of the one behind it. Behind all leaves is the
/// background, or wood with more wood behind it.
fn pair(front: Option<Fragment>, second: Option<Fragment>, leaves: u32) -> [u32; 2] {
    let front = front.map_or(leaves, Fragment::row);
    [front, second.map_or(front.max(leaves), Fragment::row)]
}

/// Sorts the fragments of a pixel, nearest last; wood may only be the first. Keeps only the nearest
/// one of each leaf, counts the pixel as covered by that leaf, and drops fragments behind the wood.
/// Returns the number of fragments kept.
fn sorted(stack: &mut [Fragment], leaves: u32, covered: &mut [u32]) -> usize {
    let wood = stack.first().copied().filter(|bottom| bottom.row() > leaves);
    let first = usize::from(wood.is_some());
    let stack = &mut stack[first..];
    stack.sort_unstable_by_key(|fragment| (fragment.row(), fragment.0));
    let (mut kept, mut last) = (0, None);
    for at in 0..stack.len() {
        let fragment = stack[at];
        if last.replace(fragment.row()) != Some(fragment.row()) {
            covered[fragment.row() as usize] += 1;
            stack[kept] = fragment;
            kept += usize::from(wood.is_none_or(|wood| fragment < wood));
        }
    }
    stack[..kept].sort_unstable_by(|a, b| b.cmp(a));
    first + kept
}
