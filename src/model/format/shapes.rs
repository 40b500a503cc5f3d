//! The section of shapes: leaves whose vertices are made from those of another leaf.
//!
//! The first leaf of a shape is the shape: its vertices are stored here. All later leaves of that
//! shape are copies, each with a turn, a size, a shift and a colour. Index lists of shapes are with
//! those of other leaves; copies have the list of their shape.

use super::{
    super::{FoliageModel, Leaf, LeafCopy, NO_LEAF, Turn},
    fault::Decoded,
    ints::Ints,
    numbers::{Form, Numbers, padded},
    vertices::Vertices,
};
use crate::leaf::Vertex;
use serde::{Deserialize, Serialize};

/// Where the vertices of each leaf come from: [`NO_LEAF`] for the section of vertices, the leaf's
/// own index for a shape, and the shape's index for a copy.
pub(super) struct Sources(Vec<u32>);

impl Sources {
    /// All leaves have vertices of their own.
    pub(super) fn own(leaves: usize) -> Self {
        Self(vec![NO_LEAF; leaves])
    }

    /// Sources of a sound model's leaves, and those of its copies that give every bit.
    pub(super) fn of(model: &FoliageModel) -> (Self, Vec<LeafCopy>) {
        let mut sources = Self::own(model.leaves.len());
        let mut copies: Vec<LeafCopy> = Vec::new();
        for copy in &model.copies {
            let is_next = copies.last().is_none_or(|last| last.leaf < copy.leaf);
            let is_free = is_next && copy.of < copy.leaf && sources.copied(copy.of as usize).is_none();
            if is_free && holds(model, copy) {
                sources.0[copy.of as usize] = copy.of;
                sources.0[copy.leaf as usize] = copy.of;
                copies.push(*copy);
            }
        }
        (sources, copies)
    }

    /// The leaf that a leaf is a copy of.
    pub(super) fn copied(&self, leaf: usize) -> Option<usize> {
        Some(self.0[leaf] as usize).filter(|&source| source < leaf)
    }

    /// Whether a leaf is neither a shape nor a copy.
    pub(super) fn is_own(&self, leaf: usize) -> bool {
        self.0[leaf] == NO_LEAF
    }

    /// Leaves that are shapes.
    fn shapes(&self) -> impl Iterator<Item = usize> {
        (0..self.0.len()).filter(|&leaf| self.0[leaf] as usize == leaf)
    }

    /// Of each leaf, 0 or one more than the number of its shape.
    fn numbers(&self) -> Vec<u32> {
        let mut numbers = vec![0; self.0.len()];
        (1..).zip(self.shapes()).for_each(|(number, leaf)| numbers[leaf] = number);
        for leaf in 0..numbers.len() {
            if let Some(of) = self.copied(leaf) {
                numbers[leaf] = numbers[of];
            }
        }
        numbers
    }

    fn of_numbers(numbers: Vec<u32>) -> Decoded<Self> {
        let mut shapes = Vec::new();
        let mut sources = numbers;
        for (leaf, source) in (0..).zip(&mut sources) {
            *source = match *source as usize {
                0 => NO_LEAF,
                number if number <= shapes.len() => shapes[number - 1],
                number if number == shapes.len() + 1 => {
                    shapes.push(leaf);
                    leaf
                }
                number => return Err(format!("leaf {leaf} has shape {number} after {}", shapes.len())),
            };
        }
        Ok(Self(sources))
    }
}

/// Whether the copy gives every bit of its leaf.
fn holds(model: &FoliageModel, copy: &LeafCopy) -> bool {
    let [Some(of), Some(leaf)] = [copy.of, copy.leaf].map(|leaf| model.leaves.get(leaf as usize)) else { return false };
    let [shape, vertices] = [of, leaf].map(|leaf| &model.vertices[leaf.geometry().vertex_range()]);
    let list = |leaf: &Leaf| {
        let first = leaf.vertices[0];
        model.indices[leaf.geometry().index_range()].iter().map(move |index| index - first)
    };
    let rebuilt = copy.vertices(shape, [of.pivot, leaf.pivot], vertices[0].color);
    shape.len() == vertices.len()
        && list(of).eq(list(leaf))
        && rebuilt.zip(vertices).all(|(rebuilt, vertex)| bytemuck::bytes_of(&rebuilt) == bytemuck::bytes_of(vertex))
}

/// Shapes and copies.
#[derive(Serialize, Deserialize)]
pub(super) struct Shapes<'a> {
    /// Numbers of vertices and of indices of all copies.
    copied: [u64; 2],
    /// Of each leaf, 0 or one more than the number of its shape.
    #[serde(borrow)]
    shapes: Ints<'a>,
    /// Turns of the copies: largest components, and the three others.
    largest: Ints<'a>,
    turns: Numbers<'a>,
    sizes: Numbers<'a>,
    shifts: Numbers<'a>,
    /// Colours of the copies of shapes that have one colour.
    colors: Numbers<'a>,
    alphas: Numbers<'a>,
    /// Vertices of the shapes, each predicted at the leaf's pivot.
    vertices: Vertices<'a>,
}

impl Shapes<'_> {
    pub(super) fn encode(model: &FoliageModel, sources: &Sources, copies: &[LeafCopy]) -> Shapes<'static> {
        let leaf = |copy: &LeafCopy| &model.leaves[copy.leaf as usize];
        let color = |copy: &LeafCopy| model.vertices[leaf(copy).vertices[0] as usize].color;
        let sum = |length: fn(&Leaf) -> usize| copies.iter().map(|copy| length(leaf(copy)) as u64).sum();
        let (mut vertices, mut pivots) = (Vec::new(), Vec::new());
        for shape in sources.shapes() {
            let leaf = &model.leaves[shape];
            vertices.extend_from_slice(&model.vertices[leaf.geometry().vertex_range()]);
            pivots.resize(vertices.len(), leaf.pivot);
        }
        let column = |width: usize, numbers: &dyn Fn(&LeafCopy) -> [f32; 4]| {
            let elements: Vec<[f32; 4]> = copies.iter().map(numbers).collect();
            let form = Form::of_numbers(elements.iter().map(|element| &element[..width]));
            Numbers::encode(form, [copies.len(), width], |i| (elements[i], None))
        };
        Shapes {
            copied: [sum(|leaf| leaf.geometry().vertex_range().len()), sum(|leaf| leaf.geometry().index_range().len())],
            shapes: Ints::encode(&sources.numbers()),
            largest: Ints::encode(&copies.iter().map(|copy| copy.turn.largest.into()).collect::<Vec<_>>()),
            turns: column(3, &|copy| padded(copy.turn.others)),
            sizes: column(1, &|copy| padded([copy.size, 0.0, 0.0])),
            shifts: column(3, &|copy| padded(copy.shift)),
            colors: column(3, &|copy| color(copy)),
            alphas: column(1, &|copy| padded([color(copy)[3], 0.0, 0.0])),
            vertices: Vertices::encode(&vertices, |i| Some(pivots[i])),
        }
    }

    /// Numbers of vertices and of indices of all copies, as the file states them.
    pub(super) fn copied(&self) -> [u64; 2] {
        self.copied
    }

    /// Sources of `leaves` leaves.
    pub(super) fn sources(&self, leaves: usize) -> Decoded<Sources> {
        Sources::of_numbers(self.shapes.decode(leaves)?)
    }

    /// Decodes the copies, and writes the vertices of shapes and copies into `vertices`, in which
    /// the leaves have their ranges.
    pub(super) fn decode(&self, leaves: &[Leaf], sources: &Sources, vertices: &mut [Vertex]) -> Decoded<Vec<LeafCopy>> {
        self.decode_shapes(leaves, sources, vertices)?;
        let pairs = (0..leaves.len()).filter_map(|leaf| Some((leaf, sources.copied(leaf)?)));
        let count = pairs.clone().count();
        let largest = self.largest.decode(count)?;
        let [turns, shifts, colors] =
            [&self.turns, &self.shifts, &self.colors].map(|numbers| numbers.decode([count, 3]));
        let (turns, shifts, colors) = (turns?, shifts?, colors?);
        let [sizes, alphas] = [&self.sizes, &self.alphas].map(|numbers| numbers.decode([count, 1]));
        let (sizes, alphas) = (sizes?, alphas?);
        let mut copies = Vec::with_capacity(count);
        for (i, (leaf, of)) in pairs.enumerate() {
            let three = |[x, y, z, _]: [f32; 4]| [x, y, z];
            let turn = Turn { largest: largest[i].min(3) as u8, others: three(turns.element(i, None)) };
            let [size, shift] = [sizes.element(i, None), shifts.element(i, None)];
            let copy = LeafCopy { leaf: leaf as u32, of: of as u32, turn, size: size[0], shift: three(shift) };
            let [red, green, blue] = three(colors.element(i, None));
            let (before, after) = vertices.split_at_mut(leaves[leaf].vertices[0] as usize);
            let shape = &before[leaves[of].geometry().vertex_range()];
            let pivots = [leaves[of].pivot, leaves[leaf].pivot];
            let rebuilt = copy.vertices(shape, pivots, [red, green, blue, alphas.element(i, None)[0]]);
            after.iter_mut().zip(rebuilt).for_each(|(vertex, rebuilt)| *vertex = rebuilt);
            copies.push(copy);
        }
        Ok(copies)
    }

    fn decode_shapes(&self, leaves: &[Leaf], sources: &Sources, vertices: &mut [Vertex]) -> Decoded<()> {
        let places = sources.shapes().flat_map(|shape| {
            let leaf = &leaves[shape];
            leaf.geometry().vertex_range().map(|vertex| (vertex, Some(leaf.pivot)))
        });
        let places: Vec<_> = places.collect();
        self.vertices.decode(places.len(), |i| places[i], vertices)
    }
}
