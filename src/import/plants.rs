//! Several plants in one file.

use super::{
    Warning, WarningKind,
    foliage::Judgement,
    source::{Source, around, listed},
};
use glam::DVec3;
use std::ops::Range;

/// Minimum number of leaves of a plant.
const MIN_LEAVES: usize = 4;
/// Maximum height of the base of a plant above the lowest one, as a fraction of the tallest. Higher
/// subtrees are branches.
const STANDING: f64 = 0.25;
/// Maximum part of the smaller footprint that plants without wood may share. Leaf clusters of one
/// plant share more.
const SHARED: f64 = 0.5;
/// Maximum number of plants that are compared with each other.
const MAX_PLANTS: usize = 64;

/// A subtree that may be a plant.
struct Candidate<'a> {
    name: &'a str,
    has_wood: bool,
    bounds: [DVec3; 2],
}

/// A warning if more than one of the subtrees stands on its own.
pub(super) fn several<'a>(source: &'a Source, judgements: &[Judgement]) -> Option<Warning> {
    if source.plants.len() < 2 {
        return None;
    }
    let boxes = source.boxes();
    let of = |(name, parts): &'a (String, Range<usize>)| {
        let bounds = boxes[parts.clone()].iter().copied().flatten().reduce(around)?;
        candidate(source, judgements, parts).map(|has_wood| Candidate { name, has_wood, bounds })
    };
    let candidates = source.plants.iter().filter_map(of);
    let mut candidates: Vec<Candidate> = candidates.take(MAX_PLANTS).collect();
    // Leaves without wood beside wood of other subtrees are a part of one plant.
    if judgements.iter().any(|judgement| judgement.is_leaf.contains(&false)) {
        candidates.retain(|candidate| candidate.has_wood);
    } else if !candidates.iter().enumerate().all(|(i, one)| candidates[..i].iter().all(|other| are_apart(one, other))) {
        return None;
    }
    let lowest = candidates.iter().map(|candidate| candidate.bounds[0].y).fold(f64::INFINITY, f64::min);
    let tallest = candidates.iter().map(|Candidate { bounds: [low, high], .. }| high.y - low.y).fold(0.0, f64::max);
    candidates.retain(|candidate| candidate.bounds[0].y <= lowest + tallest * STANDING);
    let names: Vec<&str> = candidates.iter().map(|candidate| candidate.name).collect();
    let message = format!("{} plants stand in the file and are read as one: {}", names.len(), listed(&names));
    let warning = || Warning::new(WarningKind::SeveralPlants, message, "to have one of them, name it in `plant`");
    (names.len() > 1).then(warning)
}

/// Whether some parts have wood; `None` if they have too few leaves for a plant.
fn candidate(source: &Source, judgements: &[Judgement], parts: &Range<usize>) -> Option<bool> {
    let count = |part: usize, leaves: bool| {
        let pieces = judgements[part].is_leaf.iter().filter(|is_leaf| **is_leaf == leaves).count();
        pieces * source.parts[part].places.len()
    };
    let leaves: usize = parts.clone().map(|part| count(part, true)).sum();
    let wood: usize = parts.clone().map(|part| count(part, false)).sum();
    (leaves >= MIN_LEAVES).then_some(wood > 0)
}

/// Whether the footprints of two plants overlap by little.
fn are_apart(one: &Candidate, other: &Candidate) -> bool {
    let area = |[low, high]: [DVec3; 2]| (high.x - low.x).max(0.0) * (high.z - low.z).max(0.0);
    let shared = [one.bounds[0].max(other.bounds[0]), one.bounds[1].min(other.bounds[1])];
    area(shared) <= SHARED * area(one.bounds).min(area(other.bounds))
}
