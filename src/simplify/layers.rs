//! Per view and pixel, the live fragments from front to back: removing or growing a leaf never renders anything again.
//!
//! Each pixel holds its two nearest fragments in its record and the deeper ones on a stack, nearest on top. A pruned leaf
//! vanishes from front and second place at once and from the stacks when they are next looked at. What happened is told
//! as [`Change`]s of (front, second) pairs, from which areas and criteria follow.

use super::{
    appearance::ViewLook,
    footprint::Footprint,
    fragments::Coverage,
    occlusion::{Extent, Farthest},
    price::Gain,
};

/// A fragment packed so that nearer is less: depth in the upper half, leaf in the lower, which also breaks ties.
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

/// `count` pixels whose frontmost and second polygons changed. Leaves count from 0, then come background and wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// (front, second) before.
    pub from: [u32; 2],
    /// (front, second) after.
    pub to: [u32; 2],
    /// What is in front there at full detail; the background where that is not kept.
    pub reference: u32,
    /// Number of pixels.
    pub count: u32,
}

#[derive(Debug, Clone, Copy)]
struct Pixel {
    front: Fragment,
    second: Fragment,
    /// First slot of the stack.
    start: u32,
    /// Fragments on the stack, dead ones included.
    len: u32,
    /// Slots of the stack.
    capacity: u32,
    /// Depth of the wood behind all leaves, or [`NO_WOOD`].
    wood_depth: u32,
}

/// Depth of the wood where there is none: the background lies behind everything.
const NO_WOOD: u32 = u32::MAX;

/// One view's fragments.
#[derive(Debug)]
pub struct Layers {
    pixels: Vec<Pixel>,
    stacks: Vec<Fragment>,
    /// Slots of stacks that moved elsewhere to grow.
    abandoned: usize,
    /// Number of leaves: the background's row; the wood's is the next.
    leaves: u32,
    /// What is in front at each pixel at full detail; empty where that is not kept.
    reference: Vec<u32>,
    /// Kept with the reference.
    farthest: Option<Farthest>,
    /// What the last calls changed, since it was last cleared.
    pub changes: Vec<Change>,
}

/// Stacks are packed anew when more than this part of their slots was abandoned.
const MAX_ABANDONED: f64 = 0.25;
/// Slots of a stack that grows for the first time.
const LEAST_CAPACITY: u32 = 4;

impl Layers {
    /// Sorts captured coverage into pixels.
    ///
    /// `depth(coverage)` is the depth of one entry and `leaf_of(triangle)` its leaf; the wood's triangles give
    /// `leaves + 1`. Fragments behind the wood are dropped: nothing ever uncovers them. Every pixel that a leaf covers, even
    /// there, is counted in its entry of `covered`.
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

    /// Keeps what is in front of every pixel of `full`, the same view at full detail, as what should be.
    pub fn keep_reference(&mut self, full: Vec<u32>) {
        self.reference = full;
        self.farthest = Some(Farthest::new(self.pixels.len()));
    }

    /// What is in front of every pixel.
    pub fn front_rows(&self) -> Vec<u32> {
        self.pixels.iter().map(|pixel| pixel.front.leaf()).collect()
    }

    /// What should be in front of every pixel, with what is in front and second; `None` where that is not kept.
    pub fn references(&self) -> Option<impl Iterator<Item = (u32, [u32; 2])> + '_> {
        (!self.reference.is_empty()).then(|| self.reference.iter().copied().zip(self.fronts()))
    }

    /// How much less the view would differ from its reference with a leaf's footprint changed from `old` to `new`, of
    /// which fragments are needed that are in front now, or would be.
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

    /// Whether a leaf's fragment would be in front.
    pub fn would_show(&self, index: u32, depth: u32, leaf: u32) -> bool {
        let Pixel { front, second, .. } = self.pixels[index as usize];
        Fragment::new(depth, leaf) < if front.leaf() == leaf { second } else { front }
    }

    /// Whether a leaf is in front.
    pub fn shows(&self, index: u32, leaf: u32) -> bool {
        self.pixels[index as usize].front.leaf() == leaf
    }

    /// Prepares [`hides`](Self::hides) after changes.
    pub fn refresh(&mut self) {
        if let Some(farthest) = &mut self.farthest {
            farthest.refresh(|pixel| self.pixels[pixel].front.depth());
        }
    }

    /// Nothing within `extent` can come to the front. False where the reference is not kept.
    pub fn hides(&self, extent: &Extent) -> bool {
        self.farthest.as_ref().is_some_and(|farthest| farthest.hides(extent))
    }

    /// (front, second) of every pixel.
    pub fn fronts(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.pixels.iter().map(|pixel| pixel.pair())
    }

    /// Takes away a leaf that was just marked dead, given its footprint or its outline.
    pub fn remove(&mut self, leaf: u32, footprint: &Footprint, dead: &[bool]) {
        for &(index, _) in &footprint.fragments {
            let from = self.pixels[index as usize].pair();
            if self.take_visible(index, leaf, dead) {
                self.record(index, from);
            }
        }
    }

    /// Replaces a leaf's footprint by another, touching only pixels in which they differ.
    pub fn regrow(&mut self, leaf: u32, old: &Footprint, new: &Footprint, dead: &[bool]) {
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

    /// Notes what became of a pixel, joining it to the change before where that was the same.
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

    /// Takes a leaf out of front or second place, if it is there, and refills from the stack.
    fn take_visible(&mut self, index: u32, leaf: u32, dead: &[bool]) -> bool {
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

    /// Takes a live leaf out of a pixel, wherever it lies; nothing happens where it lay behind the wood.
    fn take(&mut self, index: u32, leaf: u32, dead: &[bool]) {
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

    /// Adds a fragment, unless it lies behind the wood.
    fn insert(&mut self, index: u32, mut fragment: Fragment, dead: &[bool]) {
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

    /// Puts a fragment into its place on the stack.
    fn push(&mut self, index: u32, fragment: Fragment, dead: &[bool]) {
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

    /// Drops dead fragments of a full stack; where none were, moves it to twice the room.
    fn make_room(&mut self, index: u32, dead: &[bool]) {
        let pixel = &mut self.pixels[index as usize];
        let slots = pixel.start as usize..(pixel.start + pixel.len) as usize;
        let mut kept = slots.start;
        for at in slots.clone() {
            if !dead[self.stacks[at].leaf() as usize] {
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

    /// Lays all stacks one after another again.
    fn pack(&mut self, dead: &[bool]) {
        let mut packed = Vec::with_capacity(self.stacks.len() - self.abandoned);
        for pixel in &mut self.pixels {
            let start = packed.len();
            let stack = &self.stacks[pixel.start as usize..][..pixel.len as usize];
            packed.extend(stack.iter().filter(|fragment| !dead[fragment.leaf() as usize]));
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

    /// The nearest live fragment of the stack, or `bottom`. `dead` may be empty when none is.
    fn pop(&mut self, stacks: &[Fragment], dead: &[bool], bottom: Fragment) -> Fragment {
        while self.len > 0 {
            self.len -= 1;
            let fragment = stacks[(self.start + self.len) as usize];
            if !dead.get(fragment.leaf() as usize).is_some_and(|&dead| dead) {
                return fragment;
            }
        }
        bottom
    }
}

/// What lies behind all leaves: the wood, or else the background.
fn bottom(wood_depth: u32, leaves: u32) -> Fragment {
    Fragment::new(wood_depth, if wood_depth == NO_WOOD { leaves } else { leaves + 1 })
}

/// Sorts fragments with the nearest last, keeps each leaf's nearest alone and counts it as covering the pixel, drops what
/// lies behind the wood, and gives how many are left.
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
