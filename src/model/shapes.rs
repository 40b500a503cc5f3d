//! Finds leaves that have the same shape up to a turn, a size and a place.
//!
//! Leaves are compared in drawing order. The first one of a shape is the shape, its numbers rounded
//! more finely than those of other leaves; a later one is a copy if its vertices, rebuilt
//! from the shape and from a turn and a size that are rounded too, are as close to the plant's as
//! rounding them would be. Vertices must be in the same order, with the same indices and texture
//! coordinates; colours may differ if each leaf has one.
//!
//! Leaves that could be equal are found by two sums of the distances of their vertices from the
//! centre, relative to the leaf's size: turns, sizes and places do not change them.
//!
//! Limits: a leaf whose vertices all lie on a line has no shape. At most [`MAX_TRIED`] shapes are
//! tried for a leaf.

use super::{
    FoliageModel,
    copies::{LeafCopy, Turn, has_one_color},
    grid::{self, EXPONENTS, exponent_below},
    octahedral::{self, FINE_NORMAL_BITS},
};
use crate::leaf::Vertex;
use glam::{DMat3, DQuat, DVec3, Vec3};
use std::collections::HashMap;

/// Steps of pivots, and of the few shapes, are so many times halved.
const FINER_PIVOTS: i16 = 3;
const FINER_SHAPES: i16 = 6;
/// Half a step of a turn or a size moves no vertex of nine leaves of ten by more than this share of
/// the allowed error.
const TURN_SHARE: f64 = 0.25;
const SIZE_SHARE: f64 = 0.125;
/// Most shapes that are tried for a leaf.
const MAX_TRIED: usize = 32;
/// Copies that a shape must have: fewer do not make up for its finer numbers.
const FEWEST_COPIES: u32 = 4;
/// Share of the leaves that must be copies, as a divisor.
const SHARE: usize = 4;
/// Cells of a sum of distances.
const CELLS: f64 = 1024.0;
/// Farthest vertex from the axis through the centre, relative to the leaf's size, of a leaf on a
/// line.
const NARROWEST: f64 = 1e-3;

/// Leaves of a model with shared shapes.
pub(super) struct Shared {
    /// Vertices of all leaves.
    pub(super) vertices: Vec<Vertex>,
    /// Pivots of all leaves.
    pub(super) pivots: Vec<[f32; 3]>,
    /// The copies.
    pub(super) copies: Vec<LeafCopy>,
}

/// Finds the shapes that leaves of a rounded model share. `vertices` and `pivots` are those of the
/// exact model, `exponent` is that of the steps of positions. Returns `None` if hardly any leaf is
/// a copy.
pub(super) fn find(
    model: &FoliageModel,
    vertices: Vec<Vertex>,
    pivots: Vec<[f32; 3]>,
    exponent: i16,
) -> Option<Shared> {
    let search = Search { model, vertices: &vertices, pivots: &pivots, steps: Steps::of(model, exponent) };
    let (shapes, mut copies) = search.run();
    let mut uses: HashMap<u32, u32> = HashMap::new();
    copies.iter().for_each(|copy| *uses.entry(copy.of).or_default() += 1);
    copies.retain(|copy| uses[&copy.of] >= FEWEST_COPIES);
    if copies.len() * SHARE < model.leaves.len() {
        return None;
    }
    let mut shared = Shared {
        vertices: model.vertices.clone(),
        pivots: model.leaves.iter().map(|leaf| leaf.pivot).collect(),
        copies,
    };
    let range = |leaf: u32| model.leaves[leaf as usize].geometry().vertex_range();
    for shape in shapes.iter().filter(|shape| uses.get(&shape.leaf).is_some_and(|&uses| uses >= FEWEST_COPIES)) {
        shared.vertices[range(shape.leaf)].copy_from_slice(&shape.vertices);
        shared.pivots[shape.leaf as usize] = shape.pivot;
    }
    for copy in &shared.copies {
        let color = model.vertices[range(copy.leaf).start].color;
        let pivot = search.steps.pivot(pivots[copy.leaf as usize]);
        let rebuilt: Vec<Vertex> =
            copy.vertices(&shared.vertices[range(copy.of)], [shared.pivots[copy.of as usize], pivot], color).collect();
        shared.vertices[range(copy.leaf)].copy_from_slice(&rebuilt);
        shared.pivots[copy.leaf as usize] = pivot;
    }
    Some(shared)
}

/// Steps of rounded numbers as exponents of 2, and the largest errors that are allowed.
struct Steps {
    pivot: i16,
    shape: i16,
    turn: i16,
    size: i16,
    position: f64,
    normal_rad: f64,
}

impl Steps {
    fn of(model: &FoliageModel, exponent: i16) -> Self {
        let position = f64::from(model.precision.position);
        let largest =
            model.vertices.iter().flat_map(|vertex| vertex.position).fold(0.0_f32, |most, x| most.max(x.abs()));
        let mut reaches: Vec<f64> = model
            .leaves
            .iter()
            .map(|leaf| {
                let distance = |vertex: &Vertex| f64::from(Vec3::from(vertex.position).distance(leaf.pivot.into()));
                model.vertices[leaf.geometry().vertex_range()].iter().map(distance).fold(0.0, f64::max)
            })
            .collect();
        let at = reaches.len() * 9 / 10;
        let reach = *reaches.select_nth_unstable_by(at, f64::total_cmp).1;
        // Three components are off by half a step each; angles are twice as large.
        let turn = exponent_below(TURN_SHARE * position / (reach * 3.0_f64.sqrt()));
        let size = exponent_below(2.0 * SIZE_SHARE * position / reach);
        let finest = exponent_below(f64::from(largest)).saturating_sub(22).max(*EXPONENTS.start());
        Self {
            pivot: (exponent - FINER_PIVOTS).max(finest),
            shape: (exponent - FINER_SHAPES).max(finest),
            turn: turn.clamp(-23, -1),
            size: size.clamp(-23, -1),
            position,
            normal_rad: f64::from(model.precision.normal_rad),
        }
    }

    fn pivot(&self, point: [f32; 3]) -> [f32; 3] {
        point.map(|x| rounded(x.into(), self.pivot))
    }
}

/// Rounds to a multiple of 2^exponent.
fn rounded(number: f64, exponent: i16) -> f32 {
    grid::value(grid::nearest(number * grid::power(-exponent)), exponent)
}

/// The first leaf of a shape, rounded finely.
struct Shape {
    leaf: u32,
    vertices: Vec<Vertex>,
    pivot: [f32; 3],
    frame: Frame,
}

/// Where a leaf is, how large, and how it is turned.
struct Frame {
    center: DVec3,
    /// Root of the sum of squares of the distances from the centre.
    size: f64,
    /// Vertices that tell how it is turned: the one farthest from the centre, and the one farthest
    /// from the axis through both.
    corners: [usize; 2],
    axes: DMat3,
}

impl Frame {
    fn of(vertices: &[Vertex]) -> Option<Self> {
        let (center, size) = spread(vertices);
        let offset = |i: usize| position(&vertices[i]) - center;
        let farthest =
            |distance: &dyn Fn(usize) -> f64| (0..vertices.len()).max_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let first = farthest(&|i| offset(i).length_squared())?;
        let along = offset(first).try_normalize()?;
        let second = farthest(&|i| offset(i).reject_from_normalized(along).length_squared())?;
        if offset(second).reject_from_normalized(along).length() < NARROWEST * size {
            return None;
        }
        let corners = [first, second];
        Some(Self { center, size, corners, axes: axes(vertices, center, corners)? })
    }
}

/// Orthogonal axes of a leaf given by two of its vertices.
fn axes(vertices: &[Vertex], center: DVec3, [first, second]: [usize; 2]) -> Option<DMat3> {
    let along = (position(&vertices[first]) - center).try_normalize()?;
    let across = (position(&vertices[second]) - center).reject_from_normalized(along).try_normalize()?;
    Some(DMat3::from_cols(along, across, along.cross(across)))
}

fn position(vertex: &Vertex) -> DVec3 {
    Vec3::from(vertex.position).as_dvec3()
}

/// The centre of the vertices, and the root of the sum of squares of their distances from it.
fn spread(vertices: &[Vertex]) -> (DVec3, f64) {
    let center = vertices.iter().map(position).sum::<DVec3>() / vertices.len() as f64;
    let squares: f64 = vertices.iter().map(|vertex| position(vertex).distance_squared(center)).sum();
    (center, squares.sqrt())
}

/// Two weighted sums of the distances from the centre, which leaves of the same shape share.
fn signature(vertices: &[Vertex]) -> Option<[i32; 2]> {
    let (center, size) = spread(vertices);
    let root = (vertices.len() as f64).sqrt();
    let sums = [0.618_034, 0.754_878].map(|step| {
        let weighted =
            |(i, vertex): (usize, &Vertex)| (0.5 + (step * i as f64).fract()) * position(vertex).distance(center);
        vertices.iter().enumerate().map(weighted).sum::<f64>() / (size * root)
    });
    sums.iter().all(|sum| sum.is_finite()).then(|| sums.map(|sum| (sum * CELLS) as i32))
}

struct Search<'a> {
    model: &'a FoliageModel,
    vertices: &'a [Vertex],
    pivots: &'a [[f32; 3]],
    steps: Steps,
}

impl Search<'_> {
    /// All shapes, with copies or without, and all copies.
    fn run(&self) -> (Vec<Shape>, Vec<LeafCopy>) {
        let (mut shapes, mut copies) = (Vec::new(), Vec::new());
        let mut kinds = HashMap::new();
        let mut cells: HashMap<(usize, [i32; 2]), Vec<usize>> = HashMap::new();
        for leaf in 0..self.model.leaves.len() {
            let vertices = &self.vertices[self.model.leaves[leaf].geometry().vertex_range()];
            let Some([x, y]) = signature(vertices) else { continue };
            let next = kinds.len();
            let kind = *kinds.entry(self.kind(leaf)).or_insert(next);
            let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
            let near = around.filter_map(|cell| cells.get(&(kind, cell))).flatten().take(MAX_TRIED);
            match near.copied().find_map(|shape| self.copy(&shapes[shape], leaf as u32)) {
                Some(copy) => copies.push(copy),
                None => {
                    let Some(shape) = self.shape(leaf) else { continue };
                    cells.entry((kind, [x, y])).or_default().push(shapes.len());
                    shapes.push(shape);
                }
            }
        }
        (shapes, copies)
    }

    /// What leaves of the same shape have in common bit for bit.
    fn kind(&self, leaf: usize) -> Vec<u32> {
        let geometry = self.model.leaves[leaf].geometry();
        let vertices = &self.model.vertices[geometry.vertex_range()];
        let colors = vertices.iter().flat_map(|vertex| vertex.color).take(match has_one_color(vertices) {
            true => 0,
            false => usize::MAX,
        });
        let numbers = vertices.iter().flat_map(|vertex| vertex.uv).chain(colors).map(f32::to_bits);
        let indices = self.model.indices[geometry.index_range()].iter().map(|index| index - geometry.vertices[0]);
        std::iter::once(vertices.len() as u32).chain(indices).chain(numbers).collect()
    }

    fn shape(&self, leaf: usize) -> Option<Shape> {
        let range = self.model.leaves[leaf].geometry().vertex_range();
        let fine = |(coarse, exact): (&Vertex, &Vertex)| Vertex {
            position: exact.position.map(|x| rounded(x.into(), self.steps.shape)),
            normal: octahedral::decode(octahedral::encode(exact.normal, FINE_NORMAL_BITS), FINE_NORMAL_BITS),
            ..*coarse
        };
        let vertices: Vec<Vertex> =
            self.model.vertices[range.clone()].iter().zip(&self.vertices[range]).map(fine).collect();
        let frame = Frame::of(&vertices)?;
        Some(Shape { leaf: leaf as u32, vertices, pivot: self.steps.pivot(self.pivots[leaf]), frame })
    }

    /// The leaf as a copy of the shape, if it is close enough to one.
    fn copy(&self, shape: &Shape, leaf: u32) -> Option<LeafCopy> {
        let vertices = &self.vertices[self.model.leaves[leaf as usize].geometry().vertex_range()];
        let (center, size) = spread(vertices);
        let rotation = axes(vertices, center, shape.frame.corners)? * shape.frame.axes.transpose();
        let size = rounded(size / shape.frame.size, self.steps.size);
        let turn = Turn::rounded(DQuat::from_mat3(&rotation), |component| rounded(component, self.steps.turn));
        let copy = LeafCopy { leaf, of: shape.leaf, turn, size, shift: [0.0; 3] };
        let pivot = self.steps.pivot(self.pivots[leaf as usize]);
        let [from, to] = [shape.pivot, pivot].map(|pivot| Vec3::from(pivot).as_dvec3());
        let shift = center - to - rotation * (shape.frame.center - from) * f64::from(size);
        let shift = shift.to_array().map(|x| rounded(x, self.steps.pivot));
        let shifts = [[0.0; 3], shift].map(|shift| LeafCopy { shift, ..copy });
        shifts.into_iter().find(|copy| size > 0.0 && self.holds(copy, shape, pivot, vertices))
    }

    /// Whether the copy is as close to the exact vertices as is allowed.
    fn holds(&self, copy: &LeafCopy, shape: &Shape, pivot: [f32; 3], exact: &[Vertex]) -> bool {
        let rebuilt = copy.vertices(&shape.vertices, [shape.pivot, pivot], [0.0; 4]);
        rebuilt.zip(exact).all(|(rebuilt, exact)| {
            let off = (position(&rebuilt) - position(exact)).abs().max_element();
            let [normal, wanted] = [&rebuilt, exact].map(|vertex| Vec3::from(vertex.normal).as_dvec3());
            off <= self.steps.position && normal.distance(wanted.normalize_or_zero()) <= self.steps.normal_rad
        })
    }
}
