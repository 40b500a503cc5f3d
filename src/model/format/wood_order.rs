//! The section of the order in which the wood loses detail.

use super::{fault::Decoded, ints::Ints, stream::Stream};
use crate::wood::{SWELLS, StemLink, Swell, WoodOrder};
use serde::{Deserialize, Serialize};

/// Memory that a stem, a vertex and a triangle take while they are read: their columns, and what is
/// made of them.
const STEM_BYTES: u64 = 64;
const VERTEX_BYTES: u64 = 28;
const TRIANGLE_BYTES: u64 = 12;
/// Upper bits of a threshold; the others are 0.
const SHORT: u32 = 16;

/// An order whose numbers are columns.
#[derive(Serialize, Deserialize)]
pub(super) struct PackedWoodOrder<'a> {
    stems: u32,
    /// Of each stem: how far before it its parent is; 0 for a trunk.
    #[serde(borrow)]
    links: Ints<'a>,
    triangle_stems: Ints<'a>,
    /// Of each vertex: its parent's number less its own.
    parents: Ints<'a>,
    /// Upper halves of the thresholds.
    thresholds: Ints<'a>,
    /// Swells of all stems at the first ratio, then at each other less those at the one before.
    swells: Stream<'a>,
}

impl PackedWoodOrder<'_> {
    pub(super) fn encode(order: &WoodOrder) -> PackedWoodOrder<'static> {
        let links = (0..).zip(&order.stems).map(|(stem, link)| link.parent.map_or(0, |parent| stem - parent));
        let parents = (0_u32..).zip(&order.parents).map(|(vertex, parent)| parent.wrapping_sub(vertex));
        let thresholds = order.thresholds.iter().map(|threshold| threshold.to_bits() >> SHORT);
        let before = |swell: &Swell, ratio: usize| if ratio == 0 { 0 } else { swell[ratio - 1] };
        let step = |swell: &Swell, ratio: usize| swell[ratio].wrapping_sub(before(swell, ratio));
        let swells = (0..SWELLS).flat_map(|ratio| order.swells.iter().map(move |swell| step(swell, ratio)));
        PackedWoodOrder {
            stems: order.stems.len() as u32,
            links: Ints::encode(&links.collect::<Vec<u32>>()),
            triangle_stems: Ints::encode(&order.triangle_stems),
            parents: Ints::encode(&parents.collect::<Vec<_>>()),
            thresholds: Ints::encode(&thresholds.collect::<Vec<_>>()),
            swells: Stream::deflated(swells.collect()),
        }
    }

    /// Memory that reading the order of wood with so many vertices and triangles takes, in bytes.
    pub(super) fn memory(&self, [vertices, triangles]: [u64; 2]) -> u64 {
        let of_wood = VERTEX_BYTES.saturating_mul(vertices).saturating_add(TRIANGLE_BYTES.saturating_mul(triangles));
        of_wood.saturating_add(STEM_BYTES * u64::from(self.stems))
    }

    /// Decodes the order of wood with so many vertices and triangles. Whether it fits the wood is
    /// left to the model's validation.
    pub(super) fn decode(&self, [vertices, triangles]: [usize; 2]) -> Decoded<WoodOrder> {
        let count = self.stems as usize;
        let mut stems: Vec<StemLink> = Vec::with_capacity(count);
        for before in self.links.decode(count)? {
            let stem = stems.len() as u32;
            let Some(parent) = stem.checked_sub(before) else {
                return Err(format!("stem {stem} grows on one {before} before it"));
            };
            let parent = (before > 0).then_some(parent);
            let level = parent.map_or(0, |parent| stems[parent as usize].level.saturating_add(1));
            stems.push(StemLink { parent, level });
        }
        let mut parents = self.parents.decode(vertices)?;
        (0..).zip(&mut parents).for_each(|(vertex, parent)| *parent = parent.wrapping_add(vertex));
        let thresholds = self.thresholds.decode(vertices)?;
        if let Some(long) = thresholds.iter().find(|&&upper| upper >> SHORT != 0) {
            return Err(format!("a threshold of {long:#x}"));
        }
        let columns = self.swells.unpack(count * SWELLS)?;
        let swell = |stem: usize| -> Swell {
            let mut value = 0_u8;
            std::array::from_fn(|ratio| {
                value = value.wrapping_add(columns[ratio * count + stem]);
                value
            })
        };
        Ok(WoodOrder {
            swells: (0..count).map(swell).collect(),
            boosts: None,
            stems,
            triangle_stems: self.triangle_stems.decode(triangles)?,
            parents,
            thresholds: thresholds.into_iter().map(|upper| f32::from_bits(upper << SHORT)).collect(),
        })
    }
}
