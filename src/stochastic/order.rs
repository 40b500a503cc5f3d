//! Random leaf order, as a model without enlargement, and the visible share of one leaf.

use crate::{
    Plant, Result,
    model::{FoliageModel, Prune, Recipe},
    random::Random,
    simplify::{
        capture::{Captured, capture},
        fragments::FragmentSource,
        masks::Masks,
        prune::count_areas,
        shapes::Shapes,
        views::ViewSet,
    },
};

/// Side of the views in which areas are measured, in pixels. Fine enough that even a small leaf
/// covers a pixel in some view.
const RESOLUTION: u32 = 256;
/// Number of views: one at each vertex of a dodecahedron.
const VIEWS: u32 = 20;

/// A plant ready for stochastic pruning.
#[derive(Debug, Clone, PartialEq)]
pub struct Stochastic {
    /// The plant with its leaves in seeded order; pruning a leaf does not enlarge another.
    pub model: FoliageModel,
    /// r, 0 to 1: mean unoccluded area of one leaf, summed over all views, divided by the visible
    /// area of the plant's foliage.
    pub visible_share: f64,
}

impl Stochastic {
    /// Shuffles the leaves of `plant` with `seed` and measures r in the fragments of `source`.
    ///
    /// # Errors
    /// Same as [`visible_share`] and [`shuffled`].
    pub fn new(plant: &Plant, seed: u64, source: &mut dyn FragmentSource) -> Result<Self> {
        Ok(Self { model: shuffled(plant, seed)?, visible_share: visible_share(plant, source)? })
    }
}

/// Fisher-Yates shuffle of the leaf indices `0..leaves`. The same `seed` gives the same order.
pub fn order(leaves: u32, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..leaves).collect();
    let mut random = Random::new(seed);
    for last in (1..order.len()).rev() {
        // The modulo bias is below 2^-40 for any plant.
        let other = (random.bits() % (last as u64 + 1)) as usize;
        order.swap(last, other);
    }
    order
}

/// Builds the plant's model with its leaves in seeded order, without enlargement.
///
/// # Errors
/// Same as [`FoliageModel::assemble`], which refuses a plant without leaves.
pub fn shuffled(plant: &Plant, seed: u64) -> Result<FoliageModel> {
    let order = order(plant.leaves.len() as u32, seed);
    let prune = |&leaf: &u32| Prune { leaf, target: order[0], target_scale: 1.0, error: 0.0 };
    let prunes: Vec<Prune> = order.iter().skip(1).rev().map(prune).collect();
    let recipe = Recipe {
        preset: "stochastic".into(),
        criterion: "random".into(),
        compensate: "none".into(),
        resolution: RESOLUTION,
        views: VIEWS,
        background: true,
        intrinsic: 0.0,
        raster: "cpu".into(),
        adapter: None,
    };
    FoliageModel::assemble(plant, &prunes, recipe)
}

/// Measures r of [`Stochastic`]; 0 if no leaf is visible in any view.
///
/// # Errors
/// Same as `source`, and [`Unreadable`](crate::Error::Unreadable) for a texture that cannot be
/// decoded.
pub fn visible_share(plant: &Plant, source: &mut dyn FragmentSource) -> Result<f64> {
    let leaves = plant.leaves.len();
    let views = ViewSet::new(plant.sphere(), RESOLUTION, VIEWS)?;
    let masks = Masks::new(plant)?;
    let shapes = Shapes::new(plant, &views, &masks, 1.0);
    source.prepare(&masks.masks)?;
    let Captured { layers, covered, .. } = capture(&shapes, &views, source, |_| true)?;
    let areas = count_areas(&layers.iter().collect::<Vec<_>>(), leaves);
    let visible: u64 = (0..leaves).map(|leaf| u64::from(areas.total(leaf))).sum();
    let alone = covered.iter().map(|&pixels| u64::from(pixels)).sum::<u64>() as f64 / leaves.max(1) as f64;
    Ok(if visible > 0 { (alone / visible as f64).min(1.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{leaf::Vertex, material::Material, simplify::raster::CpuFragments};

    /// Unit squares in a row in the plane z = 0, with gaps between them.
    fn squares(count: u32) -> Plant {
        let mut plant = Plant { materials: vec![Material::default()], ..Plant::default() };
        for i in 0..count {
            let x = i as f32 * 1.5;
            let corners = [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]].map(|[x, y]| Vertex {
                position: [x, y, 0.0],
                normal: [0.0, 0.0, 1.0],
                uv: [0.0; 2],
                color: [1.0; 4],
            });
            plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], [x, 0.0, 0.0], 0);
        }
        plant
    }

    #[test]
    fn an_order_holds_every_leaf_once_and_depends_on_the_seed_alone() {
        for leaves in [0, 1, 2, 1000] {
            let mut sorted = order(leaves, 7);
            sorted.sort_unstable();
            assert_eq!(sorted, (0..leaves).collect::<Vec<_>>());
        }
        assert_eq!(order(1000, 7), order(1000, 7));
        assert_ne!(order(1000, 7), order(1000, 8));
    }

    #[test]
    fn every_place_is_as_likely() {
        let mut sums = [0_u32; 5];
        (0..4000).for_each(|seed| sums[order(5, seed)[0] as usize] += 1);
        assert!(sums.iter().all(|&sum| (700..900).contains(&sum)), "{sums:?}");
    }

    #[test]
    fn equal_leaves_that_do_not_hide_each_other_each_show_their_part() {
        let mut source = CpuFragments::new();
        for count in [1, 2, 4] {
            let r = visible_share(&squares(count), &mut source).unwrap();
            assert!((r * f64::from(count) - 1.0).abs() < 0.02, "{count} leaves: {r}");
        }
    }

    #[test]
    fn a_leaf_behind_another_shows_more_than_its_part() {
        let mut plant = squares(2);
        for vertex in &mut plant.vertices[4..] {
            vertex.position[0] -= 1.5;
            vertex.position[2] = 1e-3;
        }
        let r = visible_share(&plant, &mut CpuFragments::new()).unwrap();
        assert!((r - 1.0).abs() < 0.02, "each covers about all that is seen: {r}");
    }

    #[test]
    fn a_shuffled_model_enlarges_nothing() {
        let model = shuffled(&squares(30), 3).unwrap();
        assert_eq!((model.leaves.len(), model.max_scale), (30, 1.0));
        assert_ne!(model.vertices[0], squares(30).vertices[0]);
    }
}
