//! Builds a model from the steps of a simplification: sorts the leaves into drawing order and
//! renumbers their targets to match.

use super::{Clusters, FoliageModel, Growth, Leaf, NO_LEAF, Precision, Recipe};
use crate::{
    Error, Plant, Result,
    leaf::{LeafGeometry, Vertex},
    plant::PlantOf,
};

/// One step of a simplification: the pruned leaf and the new scale of its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prune {
    /// Index of the pruned leaf in the plant.
    pub leaf: u32,
    /// Index of its target in the plant.
    pub target: u32,
    /// The target's linear scale from this step on; the same as before if it was not enlarged.
    pub target_scale: f32,
    /// Error at which the leaf was pruned.
    pub error: f32,
}

impl FoliageModel {
    /// Builds the model of `plant` from `prunes`, the steps in the order in which leaves were
    /// pruned. The first leaf pruned is drawn last, and the one leaf that remains becomes leaf 0.
    /// Materials, textures, outlines and wood are copied from the plant.
    ///
    /// `prunes` holds one step for every leaf except the one that remains. O(plant).
    ///
    /// # Errors
    /// [`Error::InvalidModel`] if a leaf is pruned twice or not at all, if a target was pruned
    /// before the leaf that names it, or if [`validate`](FoliageModel::validate) rejects the
    /// result.
    pub fn assemble(plant: &Plant, prunes: &[Prune], recipe: Recipe) -> Result<Self> {
        let rank = drawing_rank(plant.leaves.len(), prunes)?;
        let mut model = Self {
            plant: PlantOf {
                name: plant.name.clone(),
                vertices: Vec::with_capacity(plant.vertices.len()),
                indices: Vec::with_capacity(plant.indices.len()),
                leaves: Vec::with_capacity(plant.leaves.len()),
                wood: plant.wood.clone(),
                materials: plant.materials.clone(),
                textures: plant.textures.clone(),
                outlines: plant.outlines.clone(),
            },
            recipe,
            max_scale: prunes.iter().map(|prune| prune.target_scale).fold(1.0, f32::max),
            precision: Precision::EXACT,
            growth: Growth::default(),
            copies: Vec::new(),
            impostor: None,
            wood_order: None,
            curve: None,
            clusters: Clusters::default(),
        };
        if let Some(survivor) = rank.iter().position(|&rank| rank == 0) {
            model.push(plant, survivor, NO_LEAF, 1.0, 0.0);
        }
        for prune in prunes.iter().rev() {
            let target = rank.get(prune.target as usize).copied().unwrap_or(NO_LEAF);
            model.push(plant, prune.leaf as usize, target, prune.target_scale, prune.error);
        }
        model.validate()?;
        Ok(model)
    }

    /// Appends leaf `source` of `plant` as the next one in drawing order.
    fn push(&mut self, plant: &Plant, source: usize, target: u32, scale: f32, error: f32) {
        let LeafGeometry { vertices: [from, to], pivot, material, .. } = plant.leaves[source];
        let model = &mut self.plant;
        let first_vertex = model.vertices.len() as u32;
        let first_index = model.indices.len() as u32;
        let vertices: &[Vertex] = plant.vertices.get(from as usize..to as usize).unwrap_or_default();
        let indices = plant.indices.get(plant.leaves[source].index_range()).unwrap_or_default();
        model.vertices.extend_from_slice(vertices);
        model.indices.extend(indices.iter().map(|index| index.wrapping_sub(from).wrapping_add(first_vertex)));
        model.leaves.push(Leaf {
            vertices: [first_vertex, model.vertices.len() as u32],
            indices: [first_index, model.indices.len() as u32],
            pivot,
            material,
            leaf_to_split: target,
            leaf_to_collapse: target,
            scale,
            error,
        });
    }
}

/// Position of each leaf of the plant in drawing order.
fn drawing_rank(leaves: usize, prunes: &[Prune]) -> Result<Vec<u32>> {
    if prunes.len() + 1 != leaves {
        return Err(broken(7, format!("{} prunes for {leaves} leaves", prunes.len())));
    }
    let mut rank = vec![0; leaves];
    for (step, prune) in prunes.iter().enumerate() {
        match rank.get_mut(prune.leaf as usize) {
            Some(free @ 0) => *free = (leaves - 1 - step) as u32,
            Some(_) => return Err(broken(9, format!("leaf {} is pruned twice", prune.leaf))),
            None => return Err(broken(9, format!("leaf {} is pruned, of {leaves}", prune.leaf))),
        }
    }
    Ok(rank)
}

fn broken(invariant: u8, what: String) -> Error {
    Error::InvalidModel { invariant, what }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::validate::samples;

    #[test]
    fn the_last_survivor_is_drawn_first_and_the_first_pruned_last() {
        let model = samples::model(4);
        let heights: Vec<f32> = model.leaves.iter().map(|leaf| leaf.pivot[1]).collect();
        assert_eq!(heights, [1.0, 3.0, 0.0, 2.0]);
        let targets: Vec<u32> = model.leaves.iter().map(|leaf| leaf.leaf_to_split).collect();
        assert_eq!(targets, [NO_LEAF, 0, 1, 1]);
    }

    #[test]
    fn every_leaf_keeps_its_own_vertices_through_the_reordering() {
        let (plant, model) = (samples::plant(4), samples::model(4));
        for leaf in &model.leaves {
            let source = &plant.leaves[leaf.pivot[1] as usize];
            assert_eq!(model.vertices[leaf.geometry().vertex_range()], plant.vertices[source.vertex_range()]);
            let local = |indices: &[u32], first: u32| indices.iter().map(|i| i - first).collect::<Vec<_>>();
            assert_eq!(
                local(&model.indices[leaf.geometry().index_range()], leaf.vertices[0]),
                local(&plant.indices[source.index_range()], source.vertices[0])
            );
        }
    }

    #[test]
    fn a_leaf_pruned_twice_or_a_target_already_gone_is_refused() {
        let plant = samples::plant(3);
        let step = |leaf, target| Prune { leaf, target, target_scale: 1.0, error: 0.0 };
        let assembled = |prunes: &[Prune]| FoliageModel::assemble(&plant, prunes, Recipe::default());
        assert!(assembled(&[step(0, 1), step(1, 2)]).is_ok());
        for wrong in [
            vec![step(0, 1), step(0, 2)],
            vec![step(0, 1), step(1, 0)],
            vec![step(0, 0), step(1, 2)],
            vec![step(0, 9), step(1, 2)],
            vec![step(9, 1), step(1, 2)],
            vec![step(0, 1)],
            vec![],
        ] {
            assert!(matches!(assembled(&wrong), Err(Error::InvalidModel { .. })), "{wrong:?}");
        }
    }

    #[test]
    fn one_leaf_needs_no_prune() {
        let model = FoliageModel::assemble(&samples::plant(1), &[], Recipe::default()).unwrap();
        assert_eq!((model.leaves.len(), model.max_scale), (1, 1.0));
    }
}
