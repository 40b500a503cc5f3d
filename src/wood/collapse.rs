//! Collapses the vertices of one stem, the least harmful first.
//!
//! A collapse that moves wood by a distance d counts with d, however thin the stem is: else curved
//! branches turn into straight ones that the twigs on them hang beside. Once all of it may be moved
//! onto the straight line from foot to tip, a stem becomes a cone, and when it is thin, one
//! triangle.

use super::{
    measure::{Stem, from_segment},
    order::shortened,
    patch::{Collapse, Patch},
};
use glam::Vec3;
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashSet},
};

/// Error, in widths of the stem, from which on it may be a single flat triangle.
const FLAT: f32 = 1.25;
/// Triangles of a stem that has a front and a back wherever it is seen from.
const ROUND: usize = 3;
/// Distance from the foot, in radii there, up to which a point belongs to the first ring.
const RING: f32 = 1.5;
/// Least error, in widths of the stem.
const LEAST: f32 = 1.0 / 1024.0;

/// Vertices that slide to others.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Collapsed {
    /// A vertex of the wood, the one that it slides to, and its threshold: in the order in which
    /// they go. Thresholds never fall.
    pub(super) slides: Vec<(u32, u32, f32)>,
    /// Vertices that are left, those nearest to the foot first.
    pub(super) left: Vec<Left>,
}

/// A vertex that is left.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Left {
    /// Index in the wood.
    pub(super) vertex: u32,
    point: u32,
    /// Whether it belongs to another stem too, which moves it.
    pub(super) is_locked: bool,
    from_foot: f32,
}

/// Bits of a threshold, number of collapses before it, and bits of the length of its edge, so that
/// of equal ones short ways go first.
type Key = (u32, u8, u32);
/// An entry of the queue, least first: its key, the collapse's ends, and the entry's version.
type Entry = Reverse<(Key, [u32; 2], u32)>;

/// Collapses the vertices of a stem of this width until the error reaches `end`.
pub(super) fn collapse(mut patch: Patch<'_>, width: f32, stem: &Stem, end: f32) -> Collapsed {
    let mut straight = straight(&patch, width, stem);
    let mut queue = Queue { width, heap: BinaryHeap::new(), versions: vec![0; patch.points() as usize] };
    let mut depths = vec![0_u8; patch.points() as usize];
    let mut is_left = vec![true; patch.points() as usize];
    if patch.left > ROUND {
        (0..patch.points()).for_each(|point| queue.push(&patch, &depths, point));
    }
    let mut collapsed = Collapsed::default();
    let mut last = 0.0_f32;
    let mut is_straight = false;
    while let Some(Reverse((key, [from, to], version))) = queue.heap.pop() {
        if !is_left[from as usize] || queue.versions[from as usize] != version {
            continue;
        }
        // What is around its target may have changed since.
        let Some((_, found)) = queue.measured(&patch, &depths, [from, to]).filter(|(now, _)| *now <= key) else {
            queue.push(&patch, &depths, from);
            continue;
        };
        let threshold = f32::from_bits(key.0).max(last);
        if threshold >= straight {
            if straighten(&patch, &is_left, &mut collapsed, stem, Straight { width, error: straight.max(last), end }) {
                is_straight = true;
                break;
            }
            straight = f32::INFINITY;
        }
        if threshold >= end {
            break;
        }
        last = threshold;
        let Collapse { to, moves, .. } = &found;
        let wedge = |wedge: u32| patch.wedges[wedge as usize];
        collapsed.slides.extend(moves.iter().map(|&[from, to]| (wedge(from), wedge(to), threshold)));
        depths[*to as usize] = depths[*to as usize].max(depths[from as usize].saturating_add(1));
        is_left[from as usize] = false;
        patch.collapse(&found);
        for point in patch.neighbors(*to).into_iter().chain([*to]) {
            queue.push(&patch, &depths, point);
        }
    }
    if straight < f32::INFINITY && !is_straight {
        straighten(&patch, &is_left, &mut collapsed, stem, Straight { width, error: straight.max(last), end });
    }
    let gone: HashSet<u32> = collapsed.slides.iter().map(|slide| slide.0).collect();
    let left = left(&patch, &is_left, stem.foot).into_iter().filter(|left| !gone.contains(&left.vertex));
    Collapsed { left: left.collect(), ..collapsed }
}

/// Error at which the stem may be a straight cone; infinite if it has no ring at its foot, or if
/// stems begin at its rings.
fn straight(patch: &Patch<'_>, width: f32, stem: &Stem) -> f32 {
    if stem.radius[0] <= 0.0 || patch.bears() {
        return f32::INFINITY;
    }
    let along = stem.tip - stem.foot;
    let beside = |point: u32| {
        let position = patch.position(point);
        let share = ((position - stem.foot).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (from_segment(position, stem.foot, stem.tip) - stem.radius[0] * (1.0 - share)).abs()
    };
    let distance = (0..patch.points()).map(beside).fold(0.0, f32::max);
    shortened(distance.max(LEAST * width).max(f32::MIN_POSITIVE))
}

/// Vertices of the points that are left, those nearest to the foot first.
fn left(patch: &Patch<'_>, is_left: &[bool], foot: Vec3) -> Vec<Left> {
    let wedges = patch.wedges_of_points().filter(|&(_, point)| is_left[point as usize]);
    let mut left: Vec<Left> = wedges
        .map(|(vertex, point)| Left {
            vertex,
            point,
            is_locked: patch.is_locked(point),
            from_foot: patch.position(point).distance(foot),
        })
        .collect();
    left.sort_by(|a, b| a.from_foot.total_cmp(&b.from_foot).then(a.vertex.cmp(&b.vertex)));
    left
}

/// When a stem becomes straight.
struct Straight {
    width: f32,
    error: f32,
    end: f32,
}

/// Makes a stem a straight cone, all between its first ring and its tip sliding to the tip, and
/// when it is thin, one flat triangle; both unless it goes before. Returns false if it has no first
/// ring.
fn straighten(patch: &Patch<'_>, is_left: &[bool], collapsed: &mut Collapsed, stem: &Stem, when: Straight) -> bool {
    let left = left(patch, is_left, stem.foot);
    let Some(tip) = left.last().filter(|tip| !tip.is_locked) else { return false };
    let is_base = |left: &Left| left.from_foot <= RING * stem.radius[0];
    let base: HashSet<u32> = left.iter().filter(|left| is_base(left)).map(|left| left.point).collect();
    if base.len() < 2 || base.contains(&tip.point) {
        return false;
    }
    let tips: Vec<u32> = left.iter().filter(|left| left.point == tip.point).map(|left| left.vertex).collect();
    let slide = |left: &Left, error| (left.vertex, patch.alike(left.vertex, &tips), error);
    let free = || left.iter().filter(|left| !left.is_locked && left.point != tip.point);
    if when.error < when.end {
        let middle = free().filter(|left| !base.contains(&left.point));
        collapsed.slides.extend(middle.map(|left| slide(left, when.error)));
    }
    // The longest side of the ring stays, and one vertex at the tip.
    let flat = when.error.max(shortened(FLAT * when.width));
    let side = patch.longest_side(|point| is_left[point as usize] && base.contains(&point));
    if let Some(side) = side.filter(|_| flat < when.end) {
        let others = free().filter(|left| base.contains(&left.point) && !side.contains(&left.point));
        collapsed.slides.extend(others.map(|left| (left.vertex, tip.vertex, flat)));
        let tips = tips.iter().filter(|&&other| other != tip.vertex);
        collapsed.slides.extend(tips.map(|&other| (other, tip.vertex, flat)));
    }
    true
}

struct Queue {
    width: f32,
    heap: BinaryHeap<Entry>,
    /// Number of times that each point was entered.
    versions: Vec<u32>,
}

impl Queue {
    /// Enters the best collapse of a point; earlier entries of it no longer count.
    fn push(&mut self, patch: &Patch<'_>, depths: &[u8], point: u32) {
        self.versions[point as usize] += 1;
        if patch.is_locked(point) {
            return;
        }
        let found = patch.neighbors(point).into_iter().filter_map(|to| {
            let (key, _) = self.measured(patch, depths, [point, to])?;
            Some((key, [point, to], self.versions[point as usize]))
        });
        if let Some(best) = found.min() {
            self.heap.push(Reverse(best));
        }
    }

    /// A collapse of one end onto the other, with its key.
    fn measured(&self, patch: &Patch<'_>, depths: &[u8], [from, to]: [u32; 2]) -> Option<(Key, Collapse)> {
        let found = patch.measured(from, to)?;
        let mut error = found.distance.max(found.added);
        if patch.left - (found.faces as usize) < ROUND {
            error = error.max(FLAT * self.width);
        }
        let error = shortened(error.max(LEAST * self.width).max(f32::MIN_POSITIVE));
        Some(((error.to_bits(), depths[from as usize], found.length.to_bits()), found))
    }
}
