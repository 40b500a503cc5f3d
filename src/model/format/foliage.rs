//! The section of leaf vertices and indices.
//!
//! Index lists that several leaves have in common are stored once, as patterns. Leaves that are
//! copies have none: they have that of their shape.

use super::{
    super::{FoliageModel, Leaf},
    fault::Decoded,
    ints::Ints,
    shapes::Sources,
    vertices::Vertices,
};
use crate::leaf::Vertex;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Index lists of all leaves but copies, and vertices of those that are no shapes either.
#[derive(Serialize, Deserialize)]
pub(super) struct Foliage<'a> {
    /// Number of patterns.
    patterns: u32,
    /// Pattern of each leaf that is no copy.
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
    pub(super) fn encode(model: &FoliageModel, sources: &Sources) -> Foliage<'static> {
        let (mut patterns, mut numbers) = (Vec::new(), HashMap::new());
        let (mut pattern, mut vertices, mut pivots) = (Vec::new(), Vec::new(), Vec::new());
        for (i, leaf) in model.leaves.iter().enumerate().filter(|(i, _)| sources.copied(*i).is_none()) {
            let list = model.indices[leaf.geometry().index_range()].iter().map(|index| index - leaf.vertices[0]);
            let own = Pattern { vertices: leaf.vertices[1] - leaf.vertices[0], indices: list.collect() };
            let next = numbers.len() as u32;
            pattern.push(*numbers.entry(own).or_insert_with_key(|pattern| {
                patterns.push((pattern.vertices, pattern.indices.clone()));
                next
            }));
            if sources.is_own(i) {
                vertices.extend_from_slice(&model.vertices[leaf.geometry().vertex_range()]);
                pivots.resize(vertices.len(), leaf.pivot);
            }
        }
        let column = |values: Vec<u32>| Ints::encode(&values);
        Foliage {
            patterns: patterns.len() as u32,
            pattern: column(pattern),
            vertex_counts: column(patterns.iter().map(|(vertices, _)| *vertices).collect()),
            index_counts: column(patterns.iter().map(|(_, indices)| indices.len() as u32).collect()),
            indices: column(patterns.into_iter().flat_map(|(_, indices)| indices).collect()),
            vertices: Vertices::encode(&vertices, |i| Some(pivots[i])),
        }
    }

    /// Decodes vertices and indices, as many as `counts` says and of them `copied` in copies, and
    /// sets the ranges of `leaves`. The vertices of shapes and copies are left at 0.
    pub(super) fn decode(
        &self,
        leaves: &mut [Leaf],
        sources: &Sources,
        [vertex_count, index_count]: [usize; 2],
        copied: [usize; 2],
    ) -> Decoded<(Vec<Vertex>, Vec<u32>)> {
        let indices = self.decode_ranges(leaves, sources, [vertex_count, index_count], copied)?;
        let own = || leaves.iter().enumerate().filter(|(i, _)| sources.is_own(*i)).map(|(_, leaf)| leaf);
        let mut places = Vec::with_capacity(own().map(|leaf| leaf.geometry().vertex_range().len()).sum());
        own().for_each(|leaf| places.extend((leaf.vertices[0]..leaf.vertices[1]).map(|vertex| (vertex, leaf.pivot))));
        let mut vertices = vec![bytemuck::Zeroable::zeroed(); vertex_count];
        let place = |i: usize| (places[i].0 as usize, Some(places[i].1));
        self.vertices.decode(places.len(), place, &mut vertices)?;
        Ok((vertices, indices))
    }

    /// Sets the ranges of `leaves` and returns their indices.
    fn decode_ranges(
        &self,
        leaves: &mut [Leaf],
        sources: &Sources,
        [vertex_count, index_count]: [usize; 2],
        copied: [usize; 2],
    ) -> Decoded<Vec<u32>> {
        let patterns = self.patterns as usize;
        let own = (0..leaves.len()).filter(|&leaf| sources.copied(leaf).is_none()).count();
        if patterns > own {
            return Err(format!("{patterns} index patterns for {own} leaves"));
        }
        let mut own = self.pattern.decode(own)?.into_iter();
        let vertex_counts = self.vertex_counts.decode(patterns)?;
        let starts = starts(&self.index_counts.decode(patterns)?, index_count.saturating_sub(copied[1]))?;
        let lists = self.indices.decode(starts[patterns])?;
        let mut indices = Vec::with_capacity(index_count);
        let mut pattern_of: Vec<u32> = Vec::with_capacity(leaves.len());
        let (mut at, mut in_copies) = ([0_usize; 2], [0_usize; 2]);
        for (i, leaf) in leaves.iter_mut().enumerate() {
            let copied = sources.copied(i);
            let number = copied.map_or_else(|| own.next().unwrap_or_default(), |of| pattern_of[of]);
            pattern_of.push(number);
            let number = number as usize;
            let Some(&vertices) = vertex_counts.get(number) else {
                return Err(format!("leaf {i} has index pattern {number} of {patterns}"));
            };
            let list = &lists[starts[number]..starts[number + 1]];
            let lengths = [vertices as usize, list.len()];
            let end = [at[0] + lengths[0], at[1] + lengths[1]];
            if end[0] > vertex_count || end[1] > index_count {
                return Err(format!("leaf {i} ends at vertex {}, index {}", end[0], end[1]));
            }
            leaf.vertices = [at[0] as u32, end[0] as u32];
            leaf.indices = [at[1] as u32, end[1] as u32];
            indices.extend(list.iter().map(|index| index.wrapping_add(at[0] as u32)));
            if copied.is_some() {
                in_copies = [in_copies[0] + lengths[0], in_copies[1] + lengths[1]];
            }
            at = end;
        }
        if at != [vertex_count, index_count] || in_copies != copied {
            return Err(format!("leaves end at vertex {}, index {}, copies have {in_copies:?}", at[0], at[1]));
        }
        Ok(indices)
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
