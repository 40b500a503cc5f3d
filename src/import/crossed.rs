//! Merges cards that cross at one centre into one leaf.
//!
//! Two cards of one material cross if their centres lie within 5 % of the smaller size. In a dense
//! crown this also happens by chance (10 pairs among the 7,769 single cards of a birch), so two
//! further conditions apply: at least half of the cards of the material have such a partner, and
//! the distance is at most twice the distance within which nearly all of them find theirs. A tool
//! that crosses its cards exactly is thus held to its own precision.

use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Maximum distance of the centres of crossing cards, as a fraction of the smaller size.
const SAME_CENTER: f64 = 0.05;
/// Centres closer than this fraction are considered equal, to allow for rounding of positions.
const ROUNDING: f64 = 0.005;
/// Quantile of partner distances that measures how precisely the cards of a material cross.
const NEARLY_ALL: f64 = 0.95;
/// Maximum size ratio of crossing cards.
const SAME_SIZE: f64 = 2.0;
/// Maximum number of cards per leaf.
const MAX_CARDS: usize = 8;
/// Maximum number of earlier cards that a card is compared with: bounds the time for many cards at
/// one point, which would be quadratic.
const MAX_COMPARED: usize = 64;

/// A piece, reduced to what the crossing test needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Card {
    /// Mean of its distinct positions.
    pub(super) center: DVec3,
    /// Twice the distance from its centre to the farthest position.
    pub(super) size: f64,
    /// Material index; only cards of one material cross.
    pub(super) material: u32,
}

/// The group number of each card, in the order of the first cards. Cost: O(n log n).
pub(super) fn groups(cards: &[Card]) -> Vec<usize> {
    let pairs = near_pairs(cards);
    let reach_of = reaches(cards, &pairs);
    let mut groups = Clusters::new(cards.len());
    for &(distance, [a, b]) in &pairs {
        let is_crossing = reach_of.get(&cards[a].material).is_some_and(|reach| distance <= *reach);
        if is_crossing && groups.size(a) + groups.size(b) <= MAX_CARDS {
            groups.join(a, b);
        }
    }
    let mut number_of: HashMap<usize, usize> = HashMap::new();
    (0..cards.len())
        .map(|card| {
            let next = number_of.len();
            *number_of.entry(groups.find(card)).or_insert(next)
        })
        .collect()
}

/// Pairs of cards that may cross, closest first.
fn near_pairs(cards: &[Card]) -> Vec<(f64, [usize; 2])> {
    let mut filed: HashMap<Cell, Vec<usize>> = HashMap::new();
    let mut pairs = Vec::new();
    for (i, card) in cards.iter().enumerate() {
        let near = cells_about(card).filter_map(|cell| filed.get(&cell)).flatten().take(MAX_COMPARED);
        pairs.extend(near.filter_map(|&other| Some((distance(&cards[other], card)?, [other, i]))));
        filed.entry(cell(card.center, level(card))).or_default().push(i);
    }
    pairs.sort_by(|(a, cards_a), (b, cards_b)| a.total_cmp(b).then(cards_a.cmp(cards_b)));
    pairs
}

/// Distance between two centres, relative to the smaller size; `None` if the cards cannot cross.
fn distance(a: &Card, b: &Card) -> Option<f64> {
    let [lesser, greater] = [a.size.min(b.size), a.size.max(b.size)];
    let distance = a.center.distance(b.center);
    let cross = a.material == b.material && greater <= lesser * SAME_SIZE && distance <= lesser * SAME_CENTER;
    cross.then(|| if distance > 0.0 { distance / lesser } else { 0.0 })
}

/// For each material whose cards cross, the maximum relative distance of centres that count as one.
/// `pairs` is sorted by distance.
fn reaches(cards: &[Card], pairs: &[(f64, [usize; 2])]) -> BTreeMap<u32, f64> {
    let mut nearest = vec![f64::INFINITY; cards.len()];
    for &(distance, pair) in pairs {
        pair.into_iter().for_each(|card| nearest[card] = nearest[card].min(distance));
    }
    let mut nearest_of: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for (card, nearest) in cards.iter().zip(nearest) {
        nearest_of.entry(card.material).or_default().push(nearest);
    }
    let reach = |mut nearest: Vec<f64>| {
        nearest.sort_by(f64::total_cmp);
        let within = |part: f64| nearest[((nearest.len() - 1) as f64 * part) as usize];
        within(0.5).is_finite().then(|| (2.0 * within(NEARLY_ALL)).clamp(ROUNDING, SAME_CENTER))
    };
    nearest_of.into_iter().filter_map(|(material, nearest)| Some((material, reach(nearest)?))).collect()
}

/// Cell of the grid of one level.
type Cell = ([i64; 3], i32);

/// Cards of level `l` are between 2^(l-1) and 2^l in size.
fn level(card: &Card) -> i32 {
    libm::log2(card.size.max(f64::MIN_POSITIVE)).ceil() as i32
}

/// Maximum distance from the centre of a card to that of a crossing card of `level`.
fn reach(level: i32) -> f64 {
    libm::exp2(level.into()) * SAME_CENTER
}

/// Cells are twice as wide as the reach: crossing cards lie in at most two along each axis.
fn cell(point: DVec3, level: i32) -> Cell {
    (point.to_array().map(|value| (value / (2.0 * reach(level))).floor() as i64), level)
}

/// The cells that may contain a card that crosses `card`.
fn cells_about(card: &Card) -> impl Iterator<Item = Cell> + use<> {
    let own = level(card);
    let center = card.center;
    (own - 1..=own + 1).flat_map(move |level| {
        let reach = reach(level.min(own));
        let [([x, y, z], _), ([to_x, to_y, to_z], _)] = [cell(center - reach, level), cell(center + reach, level)];
        let plane = (x..=to_x).flat_map(move |x| (y..=to_y).map(move |y| [x, y]));
        plane.flat_map(move |[x, y]| (z..=to_z).map(move |z| ([x, y, z], level)))
    })
}

/// Disjoint sets (union-find) with sizes; the least member identifies its set.
struct Clusters {
    parent: Vec<usize>,
    sizes: Vec<usize>,
}

impl Clusters {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).collect(), sizes: vec![1; count] }
    }

    fn find(&mut self, mut member: usize) -> usize {
        while self.parent[member] != member {
            self.parent[member] = self.parent[self.parent[member]];
            member = self.parent[member];
        }
        member
    }

    fn size(&mut self, member: usize) -> usize {
        let set = self.find(member);
        self.sizes[set]
    }

    fn join(&mut self, a: usize, b: usize) {
        let [a, b] = [self.find(a), self.find(b)];
        if a != b {
            self.parent[a.max(b)] = a.min(b);
            self.sizes[a.min(b)] += self.sizes[a.max(b)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn card(x: f64, size: f64) -> Card {
        Card { center: DVec3::new(x, 0.0, 0.0), size, material: 0 }
    }

    #[test]
    fn three_cards_at_one_centre_are_one_leaf() {
        assert_eq!(groups(&[card(0.0, 1.0), card(5.0, 1.0), card(0.04, 1.0), card(-0.04, 1.1)]), [0, 1, 0, 0]);
    }

    #[test]
    fn beyond_five_percent_they_stay_apart() {
        assert_eq!(groups(&[card(0.0, 1.0), card(0.051, 1.0)]), [0, 1]);
        assert_eq!(groups(&[card(0.0, 1.0), card(0.0, 2.1)]), [0, 1]);
        let other = Card { material: 1, ..card(0.0, 1.0) };
        assert_eq!(groups(&[card(0.0, 1.0), other]), [0, 1]);
    }

    #[test]
    fn two_pairs_that_meet_by_chance_stay_two_leaves() {
        let pairs = [0.0, 0.02, 5.0, 9.0].map(|x| [card(x, 1.0), card(x, 1.0)]);
        assert_eq!(groups(pairs.as_flattened()), [0, 0, 1, 1, 2, 2, 3, 3]);
    }

    #[test]
    fn single_cards_that_meet_by_chance_stay_single() {
        let cards = [0.0, 1.0, 1.01, 2.0, 3.0].map(|x| card(x, 1.0));
        assert_eq!(groups(&cards), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn many_cards_at_one_point_take_linear_time() {
        let count = 20_000;
        let group_of = groups(&vec![card(1.0, 1.0); count]);
        assert!(group_of[count - 1] + 1 >= count / MAX_CARDS);
    }

    #[test]
    fn the_grid_misses_no_neighbour() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        for _ in 0..2000 {
            let mut near = |center: DVec3, reach: f64| Card {
                center: center + (DVec3::new(random(), random(), random()) - 0.5) * reach,
                size: 0.5 + random(),
                material: 0,
            };
            let a = near(DVec3::ZERO, 1.0);
            let b = near(a.center, 0.1);
            assert_eq!(groups(&[a, b])[1] == 0, distance(&a, &b).is_some(), "{a:?} {b:?}");
        }
    }
}
