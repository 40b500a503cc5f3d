//! The section of the cards of clusters.

use super::{
    super::{ClusterCard, Clusters},
    fault::Decoded,
    ints::Ints,
    numbers::{Form, Numbers, padded},
    stream::Stream,
};
use serde::{Deserialize, Serialize};

/// Memory that a card and a texel take while they are read: their columns, and what is made of
/// them.
const CARD_BYTES: u64 = 480;
const TEXEL_BYTES: u64 = 2;

/// Cards whose numbers are columns.
#[derive(Serialize, Deserialize)]
pub(super) struct PackedClusters<'a> {
    cards: u32,
    texels: u32,
    /// Of each card: its leaf less that of the card before, and how far after it `first` is.
    #[serde(borrow)]
    leaves: Ints<'a>,
    firsts: Ints<'a>,
    /// Texels along the lower side, and those along the left one times 256.
    sizes: Ints<'a>,
    centers: Numbers<'a>,
    half_sides: [Numbers<'a>; 2],
    normals: Numbers<'a>,
    /// Colours, and what is kept of them.
    colors: Numbers<'a>,
    steps: Stream<'a>,
}

impl PackedClusters<'_> {
    pub(super) fn encode(clusters: &Clusters) -> PackedClusters<'static> {
        let cards = clusters.cards();
        let column = |of: fn(&ClusterCard) -> u32| cards.iter().map(of).collect::<Vec<u32>>();
        let mut before = 0;
        let leaves: Vec<u32> = cards.iter().map(|card| card.leaf - std::mem::replace(&mut before, card.leaf)).collect();
        let three = |of: &dyn Fn(&ClusterCard) -> [f32; 3]| {
            let form = Form::of_numbers(cards.iter().map(of).collect::<Vec<_>>().iter().map(|numbers| &numbers[..]));
            Numbers::encode(form, [cards.len(), 3], |i| (padded(of(&cards[i])), None))
        };
        let color = |card: &ClusterCard| {
            let [r, g, b] = card.color;
            [r, g, b, card.kept]
        };
        let colors: Vec<[f32; 4]> = cards.iter().map(color).collect();
        let of_colors = Form::of_numbers(colors.iter().map(|numbers| &numbers[..]));
        let of_normals = Form::of_vectors(cards.iter().map(|card| card.normal));
        PackedClusters {
            cards: cards.len() as u32,
            texels: clusters.texels().len() as u32,
            leaves: Ints::encode(&leaves),
            firsts: Ints::encode(&column(|card| card.first - card.leaf)),
            sizes: Ints::encode(&column(|card| card.size[0] | card.size[1] << 8)),
            centers: three(&|card| card.center),
            half_sides: [0, 1].map(|side| three(&move |card| card.half_sides[side])),
            normals: Numbers::encode(of_normals, [cards.len(), 3], |i| (padded(cards[i].normal), None)),
            colors: Numbers::encode(of_colors, [cards.len(), 4], |i| (colors[i], None)),
            steps: Stream::deflated(clusters.texels().to_vec()),
        }
    }

    /// Memory that reading the cards takes, in bytes.
    pub(super) fn memory(&self) -> u64 {
        CARD_BYTES * u64::from(self.cards) + TEXEL_BYTES * u64::from(self.texels)
    }

    /// Decodes the cards. Whether they fit the leaves is left to the model's validation.
    pub(super) fn decode(&self) -> Decoded<Clusters> {
        let count = self.cards as usize;
        let [leaves, firsts, sizes] = [&self.leaves, &self.firsts, &self.sizes].map(|column| column.decode(count));
        let (leaves, firsts, sizes) = (leaves?, firsts?, sizes?);
        let centers = self.centers.decode([count, 3])?;
        let [rights, ups] = self.half_sides.each_ref().map(|side| side.decode([count, 3]));
        let (rights, ups) = (rights?, ups?);
        let normals = self.normals.decode([count, 3])?;
        let colors = self.colors.decode([count, 4])?;
        let mut leaf = 0_u32;
        let card = |i: usize| {
            let three = |[x, y, z, _]: [f32; 4]| [x, y, z];
            let [r, g, b, kept] = colors.element(i, None);
            leaf = leaf.wrapping_add(leaves[i]);
            ClusterCard {
                leaf,
                first: leaf.wrapping_add(firsts[i]),
                size: [sizes[i] & 255, sizes[i] >> 8],
                center: three(centers.element(i, None)),
                half_sides: [&rights, &ups].map(|side| three(side.element(i, None))),
                normal: three(normals.element(i, None)),
                kept,
                color: [r, g, b],
            }
        };
        let cards: Vec<ClusterCard> = (0..count).map(card).collect();
        Ok(Clusters::new(cards, self.steps.unpack(self.texels as usize)?.into_owned()))
    }
}
