//! The section of leaf vertices and indices.
//!
//! Index lists that several leaves have in common are stored once, as patterns.

use super::{
    super::Leaf,
    fault::Decoded,
    ints::{Ints, Packing},
    vertices::Vertices,
};
use crate::leaf::Vertex;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Vertices and index lists of all leaves.
#[derive(Serialize, Deserialize)]
pub(super) struct Foliage<'a> {
    /// Number of patterns.
    patterns: u32,
    /// Pattern of each leaf.
    #[serde(borrow)]
    pattern: Ints<'a>,
    /// Numbers of vertices and of indices of each pattern.
    vertex_counts: Ints<'a>,
    index_counts: Ints<'a>,
    /// Indices of all patterns, relative to the leaf's first vertex.
    indices: Ints<'a>,
    /// Vertices, each predicted at the leaf's pivot.
    vertices: Vertices<'a>,
}

/// An index list, relative to the first of `vertices`.
#[derive(PartialEq, Eq, Hash)]
struct Pattern {
    vertices: u32,
    indices: Vec<u32>,
}

impl Foliage<'_> {
    pub(super) fn encode(leaves: &[Leaf], vertices: &[Vertex], indices: &[u32], packing: Packing) -> Foliage<'static> {
        let (mut patterns, mut numbers) = (Vec::new(), HashMap::new());
        let pattern: Vec<u32> = leaves
            .iter()
            .map(|leaf| {
                let list = indices[leaf.geometry().index_range()].iter().map(|index| index - leaf.vertices[0]);
                let pattern = Pattern { vertices: leaf.vertices[1] - leaf.vertices[0], indices: list.collect() };
                let next = numbers.len() as u32;
                match packing {
                    Packing::Loose => patterns.push((pattern.vertices, pattern.indices)),
                    Packing::Tight => {
                        return *numbers.entry(pattern).or_insert_with_key(|pattern| {
                            patterns.push((pattern.vertices, pattern.indices.clone()));
                            next
                        });
                    }
                }
                patterns.len() as u32 - 1
            })
            .collect();
        let column = |values: Vec<u32>| Ints::encode(&values, packing);
        let pivots: Vec<[f32; 3]> =
            leaves.iter().flat_map(|leaf| leaf.geometry().vertex_range().map(|_| leaf.pivot)).collect();
        Foliage {
            patterns: patterns.len() as u32,
            pattern: column(pattern),
            vertex_counts: column(patterns.iter().map(|(vertices, _)| *vertices).collect()),
            index_counts: column(patterns.iter().map(|(_, indices)| indices.len() as u32).collect()),
            indices: column(patterns.into_iter().flat_map(|(_, indices)| indices).collect()),
            vertices: Vertices::encode(vertices, |i| Some(pivots[i]), packing),
        }
    }

    /// Decodes vertices and indices, as many as `counts` says, and sets the ranges of `leaves`.
    pub(super) fn decode(
        &self,
        leaves: &mut [Leaf],
        [vertex_count, index_count]: [usize; 2],
    ) -> Decoded<(Vec<Vertex>, Vec<u32>)> {
        let patterns = self.patterns as usize;
        if patterns > leaves.len() {
            return Err(format!("{patterns} index patterns for {} leaves", leaves.len()));
        }
        let pattern = self.pattern.decode(leaves.len())?;
        let vertex_counts = self.vertex_counts.decode(patterns)?;
        let starts = starts(&self.index_counts.decode(patterns)?, index_count)?;
        let lists = self.indices.decode(starts[patterns])?;
        let mut pivots = Vec::with_capacity(vertex_count);
        let mut indices = Vec::with_capacity(index_count);
        let (mut first_vertex, mut first_index) = (0_usize, 0_usize);
        for (i, (leaf, &pattern)) in leaves.iter_mut().zip(&pattern).enumerate() {
            let pattern = pattern as usize;
            let Some(&own) = vertex_counts.get(pattern) else {
                return Err(format!("leaf {i} has index pattern {pattern} of {patterns}"));
            };
            let list = &lists[starts[pattern]..starts[pattern + 1]];
            let [next_vertex, next_index] = [first_vertex + own as usize, first_index + list.len()];
            if next_vertex > vertex_count || next_index > index_count {
                return Err(format!("leaf {i} ends at vertex {next_vertex}, index {next_index}"));
            }
            leaf.vertices = [first_vertex as u32, next_vertex as u32];
            leaf.indices = [first_index as u32, next_index as u32];
            pivots.resize(next_vertex, leaf.pivot);
            indices.extend(list.iter().map(|index| index.wrapping_add(first_vertex as u32)));
            (first_vertex, first_index) = (next_vertex, next_index);
        }
        if (first_vertex, first_index) != (vertex_count, index_count) {
            return Err(format!("leaves end at vertex {first_vertex}, index {first_index}"));
        }
        let mut vertices = vec![bytemuck::Zeroable::zeroed(); vertex_count];
        self.vertices.decode(&mut vertices, |i| Some(pivots[i]))?;
        Ok((vertices, indices))
    }
}

/// Sums of `counts` before each of them and after the last, at most `limit`.
fn starts(counts: &[u32], limit: usize) -> Decoded<Vec<usize>> {
    let mut sums = vec![0];
    for &count in counts {
        let sum = sums[sums.len() - 1] + count as usize;
        if sum > limit {
            return Err(format!("patterns of {sum} indices, more than {limit}"));
        }
        sums.push(sum);
    }
    Ok(sums)
}
