//! Pictures of clusters: where leaves hardly hide each other, a leaf that stands for several is
//! drawn as a card that shows all of them, small and at their places.
//!
//! A texel of such a picture names the *step* at which it shows. The leaf that stands for the
//! others takes part in *events* (see [`Timeline`]): at each, another leaf is gone, with those that
//! it stood for. What the card shows from the first event on has step 0; what the k-th event after
//! that adds has step k. So each leaf shows once it is gone as geometry, at any active count, and
//! nothing is stored for a count. A card is left for the next one of the same leaf where the leaf
//! stands for about four times as many.

use super::{FoliageModel, Timeline, Transition};
use crate::{
    hash::hash,
    leaf::Vertex,
    plant::{Checked, check},
};
use glam::Vec3;
use std::ops::Range;

/// Texel that shows nothing; steps are below it, so that a texel takes half a byte.
pub const EMPTY: u8 = 15;
/// Most texels along a side of a picture, and what their number along its lower side is a multiple
/// of.
pub const PICTURE_SIDES: [u32; 2] = [64, 8];

/// A card with the picture of a cluster of leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterCard {
    /// The leaf that stands for the cluster.
    pub leaf: u32,
    /// The leaf with whose removal the card takes the place of `leaf`, or of its card before.
    pub first: u32,
    /// Texels along the lower and the left side of its picture.
    pub size: [u32; 2],
    /// Middle of the card.
    pub center: [f32; 3],
    /// From the middle to the middle of its right side, and of its upper side.
    pub half_sides: [[f32; 3]; 2],
    /// Unit normal that it is lit with: the mean of the leaves'.
    pub normal: [f32; 3],
    /// Length of that mean, from 0 to 1: 1 if all leaves face one way. With tone, the share of its
    /// shaded colour's distance from the plant's mean that the card keeps.
    pub kept: f32,
    /// Linear colour of the leaves, from 0.
    pub color: [f32; 3],
}

/// The cards of a model, and their pictures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clusters {
    cards: Vec<ClusterCard>,
    texels: Vec<u8>,
    /// First texel of each card, and the end of the last one.
    starts: Vec<usize>,
    corners: Vec<[Vertex; 4]>,
}

/// How much of a card shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownCluster {
    /// Share of its texels that may show, above 0: below 1 while it appears or disappears.
    pub share: f32,
    /// Texels of steps up to this one show, and of the next one the fractional part.
    pub step: f32,
}

impl ShownCluster {
    /// Whether a texel shows: column and row in the picture of the card with this number.
    #[inline]
    pub fn shows(&self, number: u32, texel: u8, at: [u32; 2]) -> bool {
        if texel == EMPTY {
            return false;
        }
        let late = f32::from(texel) - self.step;
        let of = |way: u32| hash([at[0] as i32, at[1] as i32, (2 * number + way) as i32]);
        (late <= 0.0 || late < of(0)) && (self.share >= 1.0 || of(1) < self.share)
    }
}

impl Clusters {
    /// Collects cards and the texels of their pictures, one after another, row by row from the
    /// lowest one. Cards are in the order of their leaves, those of one leaf from the first that is
    /// drawn as leaves go.
    pub fn new(cards: Vec<ClusterCard>, texels: Vec<u8>) -> Self {
        if cards.is_empty() {
            return Self { texels, ..Self::default() };
        }
        let sizes = cards.iter().map(|card| (card.size[0] as usize).saturating_mul(card.size[1] as usize));
        let ends = sizes.scan(0_usize, |end, size| {
            *end = end.saturating_add(size);
            Some(*end)
        });
        let starts = std::iter::once(0).chain(ends).collect();
        let corners = cards.iter().map(corners).collect();
        Self { cards, texels, starts, corners }
    }

    /// The cards.
    pub fn cards(&self) -> &[ClusterCard] {
        &self.cards
    }

    /// Texels of all pictures: the step from which on each shows, or [`EMPTY`].
    pub fn texels(&self) -> &[u8] {
        &self.texels
    }

    /// Places of a card's texels in [`texels`](Self::texels).
    pub fn texel_range(&self, card: usize) -> Range<usize> {
        self.starts[card]..self.starts[card + 1]
    }

    /// Whether a card covers a place, in texture coordinates from 0 to 1, with what shows of it.
    pub fn covers(&self, card: usize, shown: &ShownCluster, uv: [f32; 2]) -> bool {
        let size = self.cards[card].size;
        let place = |axis: usize| ((uv[axis] * size[axis] as f32) as u32).min(size[axis].saturating_sub(1));
        let at = [place(0), place(1)];
        let texel = self.starts[card] + (at[1] as usize * size[0] as usize + at[0] as usize);
        shown.shows(card as u32, self.texels.get(texel).copied().unwrap_or(EMPTY), at)
    }

    /// Corners of a card: lower left, lower right, upper right, upper left, with texture
    /// coordinates from 0 to 1.
    pub fn corners(&self, card: usize) -> &[Vertex; 4] {
        &self.corners[card]
    }

    /// The card that takes the place of this one.
    pub fn next(&self, card: usize) -> Option<&ClusterCard> {
        self.cards.get(card + 1).filter(|next| next.leaf == self.cards[card].leaf)
    }

    /// Positions of a card's events in the lists of a timeline of the same model: the first is the
    /// last, with which the card appears.
    pub fn events(&self, card: usize, timeline: &Timeline) -> Range<usize> {
        let ClusterCard { leaf, first, .. } = self.cards[card];
        let [start, end] = [leaf, leaf + 1].map(|at| timeline.starts()[at as usize] as usize);
        let after = |leaf: u32| start + timeline.events()[start..end].partition_point(|&event| event <= leaf);
        self.next(card).map_or(start, |next| after(next.first))..after(first)
    }

    /// How much of a card shows during a transition; `None` if nothing does. `timeline` must be
    /// built from the same model. O(log events of the leaf + its events within the window).
    pub fn shown(&self, card: usize, timeline: &Timeline, transition: &Transition) -> Option<ShownCluster> {
        let ClusterCard { leaf, first, .. } = self.cards[card];
        let next = self.next(card).map_or(1.0, |next| transition.presence(next.first));
        let share = (1.0 - transition.presence(first)) * transition.presence(leaf) * next;
        if share <= 0.0 {
            return None;
        }
        let Range { start, end } = self.events(card, timeline);
        // Without the one with which it appears.
        let events = &timeline.events()[start..end - 1];
        let gone = events.partition_point(|&event| event < transition.drawn());
        let partial = events[..gone].iter().rev().map(|&event| 1.0 - transition.presence(event));
        let partial: f32 = partial.take_while(|gone| *gone > 0.0).sum();
        Some(ShownCluster { share, step: (events.len() - gone) as f32 + partial })
    }

    /// Invariant 18.
    pub(super) fn check(&self, model: &FoliageModel) -> Checked {
        if self.cards.is_empty() && self.texels.is_empty() {
            return Ok(());
        }
        let held = |number: usize| format!("card {number} is {:?}", self.cards[number]);
        let timeline = Timeline::new(model);
        for (number, card) in self.cards.iter().enumerate() {
            let is_event =
                model.leaves.get(card.first as usize).is_some_and(|first| first.target() == Some(card.leaf as usize));
            check(18, is_event, || format!("{}, whose `first` does not stand by its leaf", held(number)))?;
            let follows = number == 0 || {
                let before = &self.cards[number - 1];
                before.leaf < card.leaf || before.leaf == card.leaf && before.first > card.first
            };
            check(18, follows, || format!("{}, out of order", held(number)))?;
            let [most, multiple] = PICTURE_SIDES;
            let is_size = card.size.iter().all(|side| (1..=most).contains(side)) && card.size[0] % multiple == 0;
            check(18, is_size, || held(number))?;
            let places = [card.center, card.half_sides[0], card.half_sides[1], card.normal];
            let is_finite = places.as_flattened().iter().all(|x| x.is_finite());
            let is_colored = card.color.iter().all(|&c| c.is_finite() && c >= 0.0);
            check(18, is_finite && is_colored && (0.0..=1.0).contains(&card.kept), || held(number))?;
            check(18, self.events(number, &timeline).len() <= EMPTY.into(), || {
                format!("{}, with too many events", held(number))
            })?;
        }
        let end = self.starts.last().copied().unwrap_or_default();
        check(18, end == self.texels.len(), || format!("{} texels of pictures of {end}", self.texels.len()))
    }
}

/// Corners of a card.
fn corners(card: &ClusterCard) -> [Vertex; 4] {
    let [right, up] = card.half_sides.map(Vec3::from);
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|uv: [f32; 2]| {
        let [x, y] = uv.map(|at| 2.0 * at - 1.0);
        let [r, g, b] = card.color;
        let position = (Vec3::from(card.center) + right * x + up * y).to_array();
        Vertex { position, normal: card.normal, uv, color: [r, g, b, 1.0] }
    })
}
