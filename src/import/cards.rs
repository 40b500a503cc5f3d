//! Separates cards that were joined at their edges: strips and fans of quads, each with the whole
//! picture of a leaf.
//!
//! Welded positions make one piece of them, which is no sheet or has too many triangles. Texture
//! coordinates show where one card ends: they differ between the two sides of an edge, or turn back
//! at it, or the edge lies on the border of the repeating texture. A piece is cut at such edges if
//! that makes every part of it a sheet whose rectangle of the texture recurs in the mesh, and if
//! the parts are cards rather than the faces of a branch: their texture has holes, or they do not
//! close a ring.
//!
//! Only what is cut out by alpha is looked at, and only pieces that are not shaped like a leaf, or
//! everything in a part that would be wood. A part that is read as leaves stays as it is.
//!
//! Limits: cards that cross along a line through their middles stay one leaf.

use super::{
    Verdict,
    foliage::{self, Judgement},
    pieces::Sets,
    source::{Mesh, Source},
    textures,
};
use crate::material::{AlphaMode, Material, Pixels};
use glam::Vec2;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Texture coordinates this close to a whole number lie on the border of the texture.
const ON_BORDER: f32 = 1e-4;
/// Steps per unit in which rectangles of the texture are compared.
const STEPS: f32 = 128.0;
/// Minimum fraction of a card's texels that are holes.
const HOLES: f32 = 0.05;
/// Texels sampled along each side of a card's rectangle.
const SAMPLES: u16 = 24;

/// A rectangle of the texture, relative to the tile in which it starts, in [`STEPS`]: minimum and
/// maximum.
type Rectangle = [[i32; 2]; 2];

/// Separates joined cards in `pieces`, the pieces of each mesh; returns whether there are any.
/// `judgements` are the parts' without it; `may_separate` says which parts may be foliage.
pub(super) fn separate(
    source: &Source,
    pieces: &mut [Vec<Vec<u32>>],
    judgements: &[Judgement],
    may_separate: impl Fn(usize) -> bool,
) -> bool {
    let mut done = BTreeSet::new();
    let mut any = false;
    for (index, (part, judgement)) in source.parts.iter().zip(judgements).enumerate() {
        let mesh = &source.meshes[part.mesh];
        let is_wood = judgement.verdict == Verdict::Wood;
        let is_cut = source.stated_alpha[mesh.material] != AlphaMode::Opaque;
        if !is_cut || !may_separate(index) || !done.insert(part.mesh) {
            continue;
        }
        if let Some(separated) = separated(source, mesh, &pieces[part.mesh], is_wood) {
            pieces[part.mesh] = separated;
            any = true;
        }
    }
    any
}

/// The pieces of a mesh with its joined cards separated, or `None` if there are none. Pieces shaped
/// like a leaf stay whole unless `cut_all` is set.
fn separated(source: &Source, mesh: &Mesh, pieces: &[Vec<u32>], cut_all: bool) -> Option<Vec<Vec<u32>>> {
    let candidates = pieces.iter().map(|piece| {
        let may_cut = cut_all || !foliage::is_leaf(mesh, piece);
        if may_cut { cards(mesh, piece) } else { vec![piece.clone()] }
    });
    let candidates: Vec<Vec<Vec<u32>>> = candidates.collect();
    if candidates.iter().all(|cards| cards.len() < 2) {
        return None;
    }
    let mut counts: BTreeMap<Rectangle, usize> = BTreeMap::new();
    for rectangle in candidates.iter().flatten().filter_map(|card| rectangle(mesh, card)) {
        *counts.entry(rectangle).or_default() += 1;
    }
    let recurs = |card: &Vec<u32>| rectangle(mesh, card).is_some_and(|rectangle| counts[&rectangle] > 1);
    let mut picture = Picture::new(source, mesh);
    let mut are_cards = |cards: &[Vec<u32>]| {
        cards.len() > 1
            && cards.iter().all(|card| recurs(card) && foliage::is_leaf(mesh, card))
            && (!closes_a_ring(mesh, cards) || cards.iter().all(|card| picture.has_holes(mesh, card)))
    };
    let is_cut: Vec<bool> = candidates.iter().map(|cards| are_cards(cards)).collect();
    let kept = pieces.iter().zip(candidates).zip(&is_cut);
    let kept = kept.flat_map(|((piece, cards), is_cut)| if *is_cut { cards } else { vec![piece.clone()] });
    let mut kept: Vec<Vec<u32>> = kept.collect();
    kept.sort_unstable_by_key(|piece| piece.first().copied());
    is_cut.contains(&true).then_some(kept)
}

/// The triangles of a piece, cut at the edges where texture coordinates show the end of a card.
fn cards(mesh: &Mesh, piece: &[u32]) -> Vec<Vec<u32>> {
    let mut sets = Sets::new(piece.len());
    let sides = sides(mesh, piece);
    for edge in sides.chunk_by(|a, b| a.edge == b.edge) {
        let [left, right] = edge.split_at(edge.partition_point(|side| !side.is_right)).into();
        for (a, b) in left.first().into_iter().flat_map(|a| right.iter().map(move |b| (a, b))) {
            sets.join(a.triangle, b.triangle);
        }
        for (a, b) in right.first().into_iter().flat_map(|b| left.iter().map(move |a| (a, b))) {
            sets.join(a.triangle, b.triangle);
        }
    }
    let members = sets.members(0..piece.len() as u32);
    members.into_iter().map(|card| card.into_iter().map(|member| piece[member as usize]).collect()).collect()
}

/// One side of an edge: the triangle there, by its number within the piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Its ends, as numbers of distinct positions with texture coordinates.
    edge: [u32; 2],
    /// Side of the edge, in the texture, on which the triangle lies.
    is_right: bool,
    triangle: u32,
}

/// The sides of all edges that may join triangles of one card, by edge.
fn sides(mesh: &Mesh, piece: &[u32]) -> Vec<Side> {
    let mut number_of: HashMap<[u32; 5], u32> = HashMap::new();
    let mut sides = Vec::new();
    for (triangle, &number) in (0..).zip(piece) {
        let corners = mesh.corners(number).map(|corner| &mesh.vertices[corner as usize]);
        let ends = corners.map(|corner| {
            let ([x, y, z], [u, v]) = (corner.position, corner.uv);
            let next = number_of.len() as u32;
            *number_of.entry([x, y, z, u, v].map(|value| (value + 0.0).to_bits())).or_insert(next)
        });
        let uv = corners.map(|corner| Vec2::from(corner.uv));
        for [mut a, mut b, c] in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            if ends[a] > ends[b] {
                (a, b) = (b, a);
            }
            let turn = (uv[b] - uv[a]).perp_dot(uv[c] - uv[a]);
            if turn != 0.0 && !is_border(uv[a], uv[b]) {
                sides.push(Side { edge: [ends[a], ends[b]], is_right: turn < 0.0, triangle });
            }
        }
    }
    sides.sort_unstable();
    sides
}

/// Whether an edge lies on the border of the texture, or of one of its repetitions.
fn is_border(a: Vec2, b: Vec2) -> bool {
    let lies = |a: f32, b: f32| (a - b).abs() < ON_BORDER && (a - a.round()).abs() < ON_BORDER;
    lies(a.x, b.x) || lies(a.y, b.y)
}

/// The corners of the smallest rectangle around the texture coordinates of a card.
fn corners(mesh: &Mesh, card: &[u32]) -> [Vec2; 2] {
    let uvs = card.iter().flat_map(|&triangle| mesh.corners(triangle)).map(|corner| mesh.vertices[corner as usize].uv);
    let nothing = [Vec2::INFINITY, Vec2::NEG_INFINITY];
    uvs.map(Vec2::from).fold(nothing, |[min, max], uv| [min.min(uv), max.max(uv)])
}

/// The rectangle of the texture that a card shows; `None` if that has no area.
fn rectangle(mesh: &Mesh, card: &[u32]) -> Option<Rectangle> {
    let [min, max] = corners(mesh, card);
    let tile = (min + ON_BORDER).floor();
    let rectangle = [min, max].map(|corner| ((corner - tile) * STEPS).round().as_ivec2().to_array());
    let [from, to] = rectangle;
    (from[0] < to[0] && from[1] < to[1]).then_some(rectangle)
}

/// Whether each card has two neighbours, as the faces of a tube or box have: at least as many pairs
/// of cards as cards share an edge that no third card has.
fn closes_a_ring(mesh: &Mesh, cards: &[Vec<u32>]) -> bool {
    let bits = |corner: u32| mesh.vertices[corner as usize].position.map(|value| (value + 0.0).to_bits());
    let mut edges: Vec<([[u32; 3]; 2], usize)> = Vec::new();
    for (card, &triangle) in cards.iter().enumerate().flat_map(|(i, card)| card.iter().map(move |t| (i, t))) {
        let [a, b, c] = mesh.corners(triangle).map(bits);
        edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], card)));
    }
    edges.sort_unstable();
    edges.dedup();
    let of_two = edges.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() == 2);
    let pairs: BTreeSet<[usize; 2]> = of_two.map(|edge| [edge[0].1, edge[1].1]).collect();
    pairs.len() >= cards.len()
}

/// The texture of a mesh, decoded when it is first needed.
struct Picture<'a> {
    source: &'a Source,
    material: &'a Material,
    pixels: Option<Option<Pixels>>,
}

impl<'a> Picture<'a> {
    fn new(source: &'a Source, mesh: &Mesh) -> Self {
        Self { source, material: &source.materials[mesh.material], pixels: None }
    }

    /// Whether the alpha test cuts holes into what the card shows of the texture.
    fn has_holes(&mut self, mesh: &Mesh, card: &[u32]) -> bool {
        let Self { source, material, pixels } = self;
        let texture = || source.textures[material.texture? as usize].decode().ok();
        let Some(pixels) = pixels.get_or_insert_with(texture) else { return false };
        let [min, max] = corners(mesh, card);
        let steps = || (0..SAMPLES).map(|step| (f32::from(step) + 0.5) / f32::from(SAMPLES));
        let places = steps().flat_map(|x| steps().map(move |y| min + (max - min) * Vec2::new(x, y)));
        let holes = places.filter(|&place| !material.covers(textures::alpha(pixels, material.wrap, place))).count();
        holes as f32 >= HOLES * f32::from(SAMPLES) * f32::from(SAMPLES)
    }
}
