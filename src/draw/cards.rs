//! Cards of clusters for the GPU: a record for each, texels of half a byte, and which of them are
//! drawn at an active count.
//!
//! Cards that a leaf has after as many others, its *generation*, are together, in the order in
//! which they appear as leaves go. So those that show at any count lie in a few ranges.

#[cfg(feature = "render")]
use super::records::CardRecord;
use super::records::RUN_QUADS;
#[cfg(feature = "render")]
use crate::model::{ClusterCard, Timeline, octahedral};
use crate::model::{Clusters, FoliageModel};
#[cfg(feature = "render")]
use glam::{DVec3, Vec3};
use std::cmp::Reverse;

/// Bit of [`CardRecord::leaf`] of a card that is followed by another of its leaf.
pub(super) const HAS_NEXT: u32 = 1 << 31;
/// Texels in a word.
pub(super) const TEXELS_PER_WORD: u32 = 8;

/// Records of a model's cards, and their pictures.
#[cfg(feature = "render")]
#[derive(Debug, Clone, Default)]
pub(crate) struct PackedCards {
    pub(crate) records: Vec<CardRecord>,
    pub(crate) texels: Vec<u32>,
}

/// Which cards may show.
#[derive(Debug, Clone, Default)]
pub(crate) struct CardRanges {
    generations: Vec<Generation>,
}

#[derive(Debug, Clone)]
struct Generation {
    /// Number of its first card.
    start: u32,
    /// The leaf with whose removal each card appears, from the last one.
    firsts: Vec<u32>,
    /// For each card: the least, of all up to it, of the leaf with whose removal it disappears.
    ends: Vec<u32>,
}

/// Generation of each card, what it is sorted by within that, and its number in the model, in the
/// order of the records.
fn order(clusters: &Clusters) -> Vec<(u32, Reverse<u32>, usize)> {
    let (mut generation, mut before) = (0, None);
    let mut order: Vec<_> = clusters
        .cards()
        .iter()
        .enumerate()
        .map(|(number, card)| {
            generation = if before.replace(card.leaf) == Some(card.leaf) { generation + 1 } else { 0 };
            (generation, Reverse(card.first), number)
        })
        .collect();
    order.sort_unstable();
    order
}

#[cfg(feature = "render")]
impl PackedCards {
    /// Packs the cards of a valid model. O(cards log cards + texels).
    pub(crate) fn new(model: &FoliageModel) -> Self {
        let (center, timeline) = (model.sphere().center(), Timeline::new(model));
        let mut packed = Self::default();
        for (.., number) in order(&model.clusters) {
            packed.push(&model.clusters, number, &timeline, center);
        }
        packed
    }

    fn push(&mut self, clusters: &Clusters, number: usize, timeline: &Timeline, center: DVec3) {
        let ClusterCard { leaf, size: [width, height], half_sides, normal, kept, color, .. } = clusters.cards()[number];
        let events = clusters.events(number, timeline);
        let unit = half_sides.as_flattened().iter().fold(f32::MIN_POSITIVE, |most, x| most.max(x.abs()));
        let bits = |x: f32| u32::from((x / unit * f32::from(i16::MAX)).round() as i16 as u16);
        let [x, y] = octahedral::encode(normal, 8).map(|code| u32::from(code as i8 as u8));
        let [[ax, ay, az], [bx, by, bz]] = half_sides.map(|side| side.map(bits));
        self.records.push(CardRecord {
            center: (Vec3::from(clusters.cards()[number].center).as_dvec3() - center).as_vec3().to_array(),
            leaf: leaf | if clusters.next(number).is_some() { HAS_NEXT } else { 0 },
            half_sides: [ax | ay << 16, az | bx << 16, by | bz << 16],
            unit,
            normal_kept: (x | y << 8) << 16 | (kept * 255.0).round() as u32,
            color,
            size: width | height << 8,
            first_event: events.start as u32,
            last_event: events.end as u32 - 1,
            texels: self.texels.len() as u32,
            number: number as u32,
        });
        // Rows are whole words.
        let words = clusters.texels()[clusters.texel_range(number)].chunks(TEXELS_PER_WORD as usize);
        let word = |texels: &[u8]| texels.iter().rev().fold(0, |word, texel| word << 4 | u32::from(*texel & 15));
        self.texels.extend(words.map(word));
    }
}

impl CardRanges {
    pub(super) fn new(model: &FoliageModel) -> Self {
        let (clusters, mut start, mut generations) = (&model.clusters, 0, Vec::new());
        for of_generation in order(clusters).chunk_by(|a, b| a.0 == b.0) {
            let mut least = u32::MAX;
            let end = |&(.., number): &(u32, Reverse<u32>, usize)| {
                let next = clusters.next(number).map_or(0, |next| next.first);
                least = least.min(next.max(clusters.cards()[number].leaf));
                least
            };
            let ends = of_generation.iter().map(end).collect();
            let firsts = of_generation.iter().map(|&(_, Reverse(first), _)| first).collect();
            generations.push(Generation { start, firsts, ends });
            start += of_generation.len() as u32;
        }
        Self { generations }
    }

    /// Calls `add` with each run of [`RUN_QUADS`] cards of which some may show, while leaves from
    /// `first_partial` up to `drawn` may be partly present.
    pub(super) fn runs(&self, first_partial: u32, drawn: u32, mut add: impl FnMut(u32)) {
        let mut listed = 0;
        for Generation { start, firsts, ends } in &self.generations {
            let from = ends.partition_point(|&end| end >= drawn);
            let to = firsts.partition_point(|&first| first >= first_partial);
            if from < to {
                let [from, to] = [from, to].map(|at| start + at as u32);
                // Generations may share a run.
                let runs = (from / RUN_QUADS).max(listed)..to.div_ceil(RUN_QUADS);
                listed = listed.max(runs.end);
                runs.for_each(&mut add);
            }
        }
    }
}
