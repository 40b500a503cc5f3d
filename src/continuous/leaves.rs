//! Leaves: primitives whose vertices tell their leaf, put into drawing order.

use super::{AGAIN, arrays::Arrays, damaged, file::Primitive, limit, place::Place};
use crate::{
    Error, FoliageModel, Result,
    bounds::Aabb,
    leaf::Vertex,
    model::{Leaf, NO_LEAF},
    plant::{MAX_ELEMENTS, MAX_LEAVES},
};
use bytemuck::Zeroable;

/// How far a pivot may lie beside the leaves, as a part of the longest side of the box around them:
/// it is where a leaf is attached.
const BESIDE: f32 = 0.25;

/// What each vertex of a leaf tells of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Told {
    target: f32,
    scale: f32,
    pivot: [f32; 3],
}

/// The leaves of one primitive.
pub(super) struct Part {
    material: u32,
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    /// Number of the leaf of each vertex, and what is told of it.
    numbers: Vec<u32>,
    told: Vec<Told>,
}

/// A leaf as it is found: its primitive, what is told of it, and how much it has.
#[derive(Clone, Copy)]
struct Found {
    part: usize,
    told: Told,
    vertices: u32,
    indices: u32,
}

impl Part {
    pub(super) fn new(
        arrays: &mut Arrays<'_>,
        primitive: &Primitive,
        place: &Place,
        material: u32,
        vertices: Vec<Vertex>,
        indices: Vec<u32>,
    ) -> Result<Self> {
        if arrays.are_pivots_left_behind(primitive) {
            return Err(stale());
        }
        let numbers = attribute::<1>(arrays, primitive, "_LEAF", vertices.len())?;
        let targets = attribute::<1>(arrays, primitive, "_TARGET", vertices.len())?;
        let scales = attribute::<1>(arrays, primitive, "_SCALE", vertices.len())?;
        let pivots = attribute::<3>(arrays, primitive, "_PIVOT", vertices.len())?;
        let told = targets.iter().zip(&scales).zip(&pivots);
        let told = told.map(|((&[target], &[scale]), &pivot)| Told { target, scale, pivot: place.point(pivot) });
        let is_number = |[leaf]: &[f32; 1]| leaf.fract() == 0.0 && (0.0..MAX_LEAVES as f32).contains(leaf);
        if let Some([leaf]) = numbers.iter().find(|leaf| !is_number(leaf)) {
            let reason = format!("_LEAF is {leaf}, no whole number below {MAX_LEAVES}");
            return Err(Error::unreadable("model", reason, "leave _LEAF as it is where a tool quantises attributes"));
        }
        let told = told.collect();
        Ok(Self { material, vertices, indices, numbers: numbers.iter().map(|[leaf]| *leaf as u32).collect(), told })
    }

    /// The leaf of each triangle.
    fn of_triangles(&self) -> impl Iterator<Item = (u32, &[u32])> {
        self.indices.chunks_exact(3).map(|corners| (self.numbers[corners[0] as usize], corners))
    }
}

/// An attribute that every vertex of a leaf has.
fn attribute<const N: usize>(
    arrays: &mut Arrays<'_>,
    primitive: &Primitive,
    name: &str,
    vertices: usize,
) -> Result<Vec<[f32; N]>> {
    match arrays.vectors::<N>(primitive, name)? {
        Some(found) if found.len() == vertices => Ok(found),
        Some(found) => Err(damaged(format!("{name} has {} values for {vertices} vertices", found.len()))),
        None => Err(Error::unreadable(
            "model",
            format!("leaves lack {name}"),
            "keep custom attributes where a tool drops them",
        )),
    }
}

fn stale() -> Error {
    let reason = "pivots lie far beside the leaves: a tool has quantised POSITION and left _PIVOT behind";
    Error::unreadable("model", reason, "quantise all but POSITION, or let `foliage-lod export` do it")
}

/// Adds all leaves to a model that has none. O(vertices + indices).
pub(super) fn add(model: &mut FoliageModel, parts: &[Part], leaves: usize) -> Result<()> {
    let total = |of: fn(&Part) -> usize| parts.iter().map(of).sum::<usize>();
    let [vertices, indices] = [total(|part| part.vertices.len()), total(|part| part.indices.len())];
    limit("the number of vertices", vertices as u64, MAX_ELEMENTS as u64)?;
    limit("the number of indices", indices as u64, MAX_ELEMENTS as u64)?;
    let found = found(parts, leaves)?;
    check_pivots(parts, &found)?;
    model.plant.leaves = records(parts, &found)?;
    model.max_scale = model.leaves.iter().map(|leaf| leaf.scale).fold(1.0, f32::max);
    let mut next: Vec<[u32; 2]> = model.leaves.iter().map(|leaf| [leaf.vertices[0], leaf.indices[0]]).collect();
    model.plant.vertices = vec![Vertex::zeroed(); vertices];
    model.plant.indices = vec![0; indices];
    let mut new_numbers = Vec::new();
    for part in parts {
        new_numbers.clear();
        for (vertex, &leaf) in part.vertices.iter().zip(&part.numbers) {
            let [at, _] = &mut next[leaf as usize];
            model.plant.vertices[*at as usize] = *vertex;
            new_numbers.push(*at);
            *at += 1;
        }
        for (leaf, corners) in part.of_triangles() {
            let [_, at] = &mut next[leaf as usize];
            for &corner in corners {
                model.plant.indices[*at as usize] = new_numbers[corner as usize];
                *at += 1;
            }
        }
    }
    Ok(())
}

/// Every leaf, by its number.
fn found(parts: &[Part], leaves: usize) -> Result<Vec<Found>> {
    let vertices: usize = parts.iter().map(|part| part.vertices.len()).sum();
    let missing = |leaf: usize| damaged(format!("leaf {leaf} of {leaves} is missing"));
    if leaves > vertices {
        return Err(missing(vertices));
    }
    let mut found: Vec<Option<Found>> = vec![None; leaves];
    for (number, part) in parts.iter().enumerate() {
        for (&leaf, &told) in part.numbers.iter().zip(&part.told) {
            let place = found.get_mut(leaf as usize);
            let place = place.ok_or_else(|| damaged(format!("there is a leaf {leaf}, of {leaves}")))?;
            let known = place.get_or_insert(Found { part: number, told, vertices: 0, indices: 0 });
            if known.part != number || known.told != told {
                return Err(damaged(format!("the vertices of leaf {leaf} differ in what they tell of it")));
            }
            known.vertices += 1;
        }
        for (leaf, corners) in part.of_triangles() {
            if corners.iter().any(|&corner| part.numbers[corner as usize] != leaf) {
                let reason = format!("a triangle of leaf {leaf} has corners of others: a tool has merged vertices");
                return Err(Error::unreadable("model", reason, "weld with _LEAF kept apart"));
            }
            if let Some(Some(found)) = found.get_mut(leaf as usize) {
                found.indices += 3;
            }
        }
    }
    found.into_iter().enumerate().map(|(leaf, found)| found.ok_or_else(|| missing(leaf))).collect()
}

/// Checks that pivots are in the space of positions.
fn check_pivots(parts: &[Part], found: &[Found]) -> Result<()> {
    let around = Aabb::of_points(parts.iter().flat_map(|part| &part.vertices).map(|vertex| vertex.position));
    let beside = BESIDE * around.size().max_element();
    let is_near = |found: &Found| {
        let mut axes = found.told.pivot.iter().zip(around.min.iter().zip(&around.max));
        axes.all(|(&at, (&low, &high))| at >= low - beside && at <= high + beside)
    };
    if found.iter().all(is_near) { Ok(()) } else { Err(stale()) }
}

/// The records of the leaves, which lie one after the other.
fn records(parts: &[Part], found: &[Found]) -> Result<Vec<Leaf>> {
    let [mut vertex, mut index] = [0, 0];
    let record = |(number, found): (usize, &Found)| {
        let Told { target, scale, pivot } = found.told;
        let target = match number {
            0 if target == -1.0 => NO_LEAF,
            // Whole numbers below that of the leaf are exact.
            _ if target.fract() == 0.0 && (0.0..number as f32).contains(&target) => target as u32,
            _ => return Err(Error::unreadable("model", format!("leaf {number} has target {target}"), AGAIN)),
        };
        let [first_vertex, first_index] = [vertex, index];
        vertex += found.vertices;
        index += found.indices;
        Ok(Leaf {
            vertices: [first_vertex, vertex],
            indices: [first_index, index],
            pivot,
            material: parts[found.part].material,
            leaf_to_split: target,
            leaf_to_collapse: target,
            scale: if number == 0 { 1.0 } else { scale },
            error: 0.0,
        })
    };
    found.iter().enumerate().map(record).collect()
}
