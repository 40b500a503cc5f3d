//! Cards: the pieces of a leaf whose triangles join, each of which shows one picture.

/// Lowest and highest texture coordinates.
pub(crate) type Rect = [[f32; 2]; 2];

/// Most polygons of a leaf that is cut into cards. Leaves of more are meshes whose shape follows
/// what they show.
const MAX_POLYGONS: usize = 16;

/// Card of a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Card {
    /// First polygon of the card.
    pub(crate) first: usize,
    /// Rectangle of texture coordinates that the card spans.
    pub(crate) rect: Rect,
}

/// The card of each polygon of a leaf; `None` for a leaf of very many polygons. Polygons are of the
/// same card if they share a corner: the same position with the same texture coordinates. `place`
/// returns those of a vertex.
pub(crate) fn cards<const N: usize>(
    polygons: &[[u32; N]],
    place: impl Fn(u32) -> ([f32; 3], [f32; 2]),
) -> Option<Vec<Card>> {
    if polygons.len() > MAX_POLYGONS {
        return None;
    }
    let mut cards: Vec<usize> = (0..polygons.len()).collect();
    let is_same = |a: u32, b: u32| a == b || place(a) == place(b);
    for (i, polygon) in polygons.iter().enumerate() {
        for (j, other) in polygons[..i].iter().enumerate() {
            let [own, joined] = [cards[i].max(cards[j]), cards[i].min(cards[j])];
            if own != joined && polygon.iter().any(|&a| other.iter().any(|&b| is_same(a, b))) {
                cards.iter_mut().filter(|card| **card == own).for_each(|card| *card = joined);
            }
        }
    }
    let rect_of = |card: usize| {
        let own = polygons.iter().zip(&cards).filter(|(_, of)| **of == card);
        rect(own.flat_map(|(polygon, _)| polygon.iter().map(|&corner| place(corner).1)))
    };
    Some(cards.iter().map(|&first| Card { first, rect: rect_of(first) }).collect())
}

pub(crate) fn rect(uvs: impl Iterator<Item = [f32; 2]>) -> Rect {
    uvs.fold([[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]], |[low, high], uv| {
        [[low[0].min(uv[0]), low[1].min(uv[1])], [high[0].max(uv[0]), high[1].max(uv[1])]]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_share_a_corner_are_one_card() {
        // Two triangles with vertices of their own for the common edge, and one that only touches
        // them in space.
        let vertices: [([f32; 3], [f32; 2]); 9] = [
            ([0.0, 0.0, 0.0], [0.0, 0.0]),
            ([1.0, 0.0, 0.0], [1.0, 0.0]),
            ([1.0, 1.0, 0.0], [1.0, 1.0]),
            ([1.0, 1.0, 0.0], [1.0, 1.0]),
            ([0.0, 1.0, 0.0], [0.0, 1.5]),
            ([0.0, 0.0, 0.0], [0.0, 0.0]),
            ([1.0, 1.0, 0.0], [3.0, 3.0]),
            ([1.0, 1.0, 1.0], [3.0, 4.0]),
            ([1.0, 2.0, 1.0], [4.0, 4.0]),
        ];
        let place = |i: u32| vertices[i as usize];
        let first = Card { first: 0, rect: [[0.0, 0.0], [1.0, 1.5]] };
        let second = Card { first: 1, rect: [[3.0, 3.0], [4.0, 4.0]] };
        assert_eq!(cards(&[[0, 1, 2], [6, 7, 8], [3, 4, 5]], place), Some(vec![first, second, first]));
        assert!(cards(&[[0, 1, 2]; MAX_POLYGONS + 1], place).is_none());
    }
}
