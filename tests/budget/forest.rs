//! Forests of the embedded species, seen by a walker.

use super::oracle::{Random, error_px};
use foliage_lod::{
    extract::{REFERENCE_FOV_Y, Sight},
    model::ErrorCurve,
    scene::budget::{CookShare, Exponent, GomezShare, Item, Rule, Splitter},
};
use serde_json::Value;

/// The English oak, the birch and the pecan, simplified with the preset `balanced`: radius in
/// metres, and error curves with two and with eight counts in an octave.
struct Species {
    radius_m: f32,
    curves: [ErrorCurve; 2],
}

fn species() -> Vec<Species> {
    let all: Value = serde_json::from_str(include_str!("curves.json")).unwrap();
    let number = |value: &Value| value.as_f64().unwrap() as f32;
    let of = |one: &Value| {
        let curve = |steps: &str| {
            let corners = one[steps].as_array().unwrap().iter();
            let points = corners.map(|corner| (corner[0].as_u64().unwrap() as u32, number(&corner[1])));
            ErrorCurve::hull(number(&one["size_px"]), number(&one["size_power"]), points)
        };
        Species { radius_m: number(&one["radius"]), curves: ["two", "eight"].map(curve) }
    };
    all.as_array().unwrap().iter().map(of).collect()
}

/// Error curves as models store them.
pub fn curves() -> Vec<ErrorCurve> {
    species().into_iter().map(|species| species.curves[0].clone()).collect()
}

/// The same with more counts, to judge by.
pub fn dense_curves() -> Vec<ErrorCurve> {
    species().into_iter().map(|species| species.curves[1].clone()).collect()
}

/// Radii in metres.
fn radii() -> Vec<f32> {
    species().iter().map(|species| species.radius_m).collect()
}

/// Height of the eyes and distance between the plants in metres.
const EYE_M: f32 = 1.7;
const SPACING_M: f32 = 7.0;
/// Distance to which plants are in view.
pub const FAR_M: f32 = 3000.0;

/// A plant of a wood.
#[derive(Clone, Copy)]
pub struct Tree {
    pub kind: u32,
    pub at: [f32; 2],
}

/// A square wood of so many trees, on a shaken grid, with its near edge at z = 0.
pub fn trees(count: usize) -> Vec<Tree> {
    let side = (count as f32).sqrt().ceil() as usize;
    let mut random = Random(7);
    let tree = |i: usize| {
        let mut shaken = |at: usize| SPACING_M * (at as f32 + 0.7 * (random.unit() - 0.5));
        let at = [shaken(i % side) - 0.5 * SPACING_M * side as f32, -shaken(i / side)];
        Tree { kind: random.below(3) as u32, at }
    };
    (0..count).map(tree).collect()
}

/// The trees in the picture of a camera at (x, z) that looks along -z, turned by an angle: their
/// numbers and items.
pub fn seen(curves: &[ErrorCurve], trees: &[Tree], [x, z]: [f32; 2], turn: f32, size: [u32; 2]) -> Vec<(usize, Item)> {
    let half_width = (0.5 * REFERENCE_FOV_Y).tan() * size[0] as f32 / size[1] as f32;
    let (sin, cos) = turn.sin_cos();
    let radii = radii();
    let item = |(number, tree): (usize, &Tree)| {
        let kind = tree.kind as usize % curves.len();
        let (dx, dz) = (tree.at[0] - x, tree.at[1] - z);
        let (across, ahead) = (dx * cos + dz * sin, dx * sin - dz * cos);
        let radius = radii[kind];
        let is_in = across.abs() < ahead * half_width + radius * (1.0 + half_width) && ahead > -radius;
        let distance = (dx * dx + dz * dz + (radius - EYE_M).powi(2)).sqrt();
        let sight = Sight { distance, radius, fov_y: REFERENCE_FOV_Y, height_px: size[1] as f32 };
        (is_in && distance < FAR_M).then(|| (number, Item::seen(kind as u32, &curves[kind], &sight)))
    };
    trees.iter().enumerate().filter_map(item).collect()
}

/// Curves, and what is in view at the edge of a wood of so many trees.
pub fn woods(count: usize, size: [u32; 2]) -> (Vec<ErrorCurve>, Vec<Item>) {
    let curves = curves();
    let items = seen(&curves, &trees(count), [0.0, 15.0], 0.0, size).into_iter().map(|(_, item)| item);
    let items = items.map(|item| Item { floor: 0.0, ..item }).collect();
    (curves, items)
}

pub fn all_leaves(curves: &[ErrorCurve], items: &[Item]) -> f64 {
    items.iter().map(|item| f64::from(curves[item.curve as usize].leaves())).sum()
}

#[test]
fn the_least_error_is_well_below_that_of_every_other_rule() {
    let size = [1920, 1080];
    let cook = Rule::Cook(CookShare::of_height(1080.0));
    let gomez = Rule::Gomez(GomezShare::published(1080.0, f64::from(FAR_M)));
    let rules = [Rule::Uniform, cook, gomez, Rule::LeastError(Exponent::WORST), Rule::default()];
    for (trees, bounds) in [(831, [0.75, 0.88, 0.96]), (74_858, [0.65, 0.88, 0.96])] {
        let (curves, items) = woods(trees, size);
        let dense = dense_curves();
        println!("{} in view of {trees}", items.len());
        for (share, most) in [0.3, 0.1, 0.03].into_iter().zip(bounds) {
            let budget = share * all_leaves(&curves, &items);
            let error = |rule: Rule| {
                let mut counts = Vec::new();
                let spent = Splitter::new(&curves, rule).split(&items, budget, &mut counts);
                assert!(spent.used <= budget && spent.used > 0.998 * budget, "{rule:?}: {spent:?}");
                error_px(&dense, &items, &counts)
            };
            let least = error(Rule::LeastError(Exponent::SUM));
            let others = rules.map(error);
            let ratios = others.map(|other| least / other);
            println!("{share}: {least:.0}; of uniform, cook, gomez, equal bound, squares: {others:.0?} {ratios:.3?}");
            assert!(ratios.iter().all(|&ratio| ratio <= 1.0), "{share}: {ratios:?}");
            assert!(ratios[1] <= most && ratios[2] <= most, "{share}: {ratios:?}");
        }
    }
}
