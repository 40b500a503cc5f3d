//! Finds the order in which wood loses detail.

use super::{
    collapse::{Collapsed, collapse},
    cut::Cut,
    measure::{stem_widths, stems},
    mesh::{Lists, Mesh},
    order::{MAX_SLIDES, StemLink, WoodOrder},
    parents::parents,
    patch::Patch,
    thin::thresholds,
};
use crate::plant::Wood;
use rayon::prelude::*;
use std::{cmp::Reverse, collections::BinaryHeap};

/// The stems of valid wood, each after its parent, and the stem of each triangle. O(n log n) for
/// wood of tubes.
pub fn cut(wood: &Wood) -> (Vec<StemLink>, Vec<u32>) {
    let mesh = Mesh::new(wood);
    let cut = Cut::new(&mesh);
    let WoodOrder { stems, triangle_stems, .. } = linked(&cut, &parents(&mesh, &cut));
    (stems, triangle_stems)
}

impl WoodOrder {
    /// Finds the stems of valid wood and the order in which it loses detail. O(n log n) for wood of
    /// tubes. The result does not depend on the number of threads.
    pub fn new(wood: &Wood) -> Self {
        let mesh = Mesh::new(wood);
        let cut = Cut::new(&mesh);
        let mut order = linked(&cut, &parents(&mesh, &cut));
        let widths = stem_widths(wood, &order.triangle_stems, order.stems.len());
        let ends = thresholds(&order.stems, &widths);
        let collapsed = collapse_all(wood, &mesh, &order, &widths, &ends);
        order.parents = (0..wood.vertices.len() as u32).collect();
        order.thresholds = vec![f32::INFINITY; wood.vertices.len()];
        let users = users(&mesh, &order.triangle_stems);
        let mut slides = Slides { mesh: &mesh, owned: vec![Vec::new(); mesh.points.len()], depths: Vec::new(), order };
        slides.depths = vec![0; wood.vertices.len()];
        for (stem, of_stem) in collapsed.iter().enumerate() {
            slides.add(of_stem, &users, stem as u32, ends[stem]);
        }
        let mut order = slides.order;
        order.balance(wood, &widths, &ends);
        order
    }
}

/// Stems in an order in which each comes after its parent and, as far as that allows, in the order
/// of their first triangles.
fn linked(cut: &Cut, parents: &[Option<u32>]) -> WoodOrder {
    let count = cut.arms.len();
    let mut first = vec![u32::MAX; count];
    for (triangle, &stem) in (0..).zip(&cut.of_triangle) {
        first[stem as usize] = first[stem as usize].min(triangle);
    }
    let children = (0..).zip(parents).filter_map(|(child, parent)| Some(((*parent)?, child)));
    let children = Lists::new(count, children);
    let roots = (0..count as u32).filter(|&stem| parents[stem as usize].is_none());
    let mut next: BinaryHeap<_> = roots.map(|stem| Reverse((first[stem as usize], stem))).collect();
    let mut number = vec![0; count];
    let mut stems: Vec<StemLink> = Vec::with_capacity(count);
    while let Some(Reverse((_, stem))) = next.pop() {
        number[stem as usize] = stems.len() as u32;
        let parent = parents[stem as usize].map(|parent| number[parent as usize]);
        let level = parent.map_or(0, |parent| stems[parent as usize].level.saturating_add(1));
        stems.push(StemLink { parent, level });
        next.extend(children.of(stem).iter().map(|&child| Reverse((first[child as usize], child))));
    }
    let triangle_stems = cut.of_triangle.iter().map(|&stem| number[stem as usize]).collect();
    WoodOrder { stems, triangle_stems, ..WoodOrder::default() }
}

/// The first and the last stem at each point.
fn users(mesh: &Mesh, triangle_stems: &[u32]) -> Vec<[u32; 2]> {
    let mut users = vec![[u32::MAX, 0]; mesh.points.len()];
    for (corners, &stem) in mesh.triangles.iter().zip(triangle_stems) {
        for &point in corners {
            let [first, last] = users[point as usize];
            users[point as usize] = [first.min(stem), last.max(stem)];
        }
    }
    users
}

/// Collapses each stem by itself.
fn collapse_all(wood: &Wood, mesh: &Mesh, order: &WoodOrder, widths: &[f32], ends: &[f32]) -> Vec<Collapsed> {
    let users = users(mesh, &order.triangle_stems);
    let triangles = Lists::new(order.stems.len(), order.triangle_stems.iter().copied().zip(0..));
    let measured = stems(wood, order);
    let of_stem = |stem: usize| {
        let patch = Patch::new(wood, mesh, triangles.of(stem as u32), stem as u32, &users);
        collapse(patch, widths[stem], &measured[stem], ends[stem])
    };
    (0..order.stems.len()).into_par_iter().map(of_stem).collect()
}

/// Joins what was found for each stem.
struct Slides<'a> {
    mesh: &'a Mesh,
    /// Of each point, the vertices of the stem that it belongs to.
    owned: Vec<Vec<u32>>,
    /// Number of parents that follow each vertex.
    depths: Vec<u32>,
    order: WoodOrder,
}

impl Slides<'_> {
    /// Adds a stem that goes at `end`. Stems whose points it shares come first.
    fn add(&mut self, of_stem: &Collapsed, users: &[[u32; 2]], stem: u32, end: f32) {
        of_stem.left.iter().filter(|left| left.is_locked).for_each(|left| self.follow(left.vertex));
        if end < f32::INFINITY {
            // It shrinks to a point that stays with the stem that it grows on, if it shares one.
            let foot = of_stem.left.iter().find(|left| left.is_locked).or(of_stem.left.first());
            if let Some(foot) = foot.map(|foot| foot.vertex) {
                let others = of_stem.left.iter().filter(|left| !left.is_locked && left.vertex != foot);
                others.for_each(|left| self.slide(left.vertex, foot, end));
            }
        }
        // The last ones first: their targets are known by then.
        of_stem.slides.iter().rev().for_each(|&(vertex, target, threshold)| self.slide(vertex, target, threshold));
        let vertices = of_stem.left.iter().map(|left| left.vertex).chain(of_stem.slides.iter().map(|slide| slide.0));
        for vertex in vertices {
            let point = self.mesh.of_vertex[vertex as usize] as usize;
            if users[point][0] == stem {
                self.owned[point].push(vertex);
            }
        }
    }

    /// Lets a vertex slide to where `target` is at that error.
    fn slide(&mut self, vertex: u32, target: u32, threshold: f32) {
        let (mut target, mut threshold) = (target, threshold);
        let WoodOrder { parents, thresholds, .. } = &mut self.order;
        while thresholds[target as usize] < threshold || self.depths[target as usize] >= MAX_SLIDES {
            threshold = threshold.max(thresholds[target as usize]);
            target = parents[target as usize];
        }
        parents[vertex as usize] = target;
        thresholds[vertex as usize] = threshold;
        self.depths[vertex as usize] = self.depths[target as usize] + 1;
    }

    /// Lets a vertex slide as another one at the same point does, that belongs to the stem below.
    fn follow(&mut self, vertex: u32) {
        let of_below = &self.owned[self.mesh.of_vertex[vertex as usize] as usize];
        if of_below.contains(&vertex) {
            return;
        }
        let Some(&other) = of_below.first() else { return };
        if self.order.parents[other as usize] != other {
            self.order.parents[vertex as usize] = self.order.parents[other as usize];
            self.order.thresholds[vertex as usize] = self.order.thresholds[other as usize];
            self.depths[vertex as usize] = self.depths[other as usize];
        }
    }
}
