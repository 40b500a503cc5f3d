//! Checks the numbered invariants of [`FoliageModel`].

use super::{FoliageModel, Growth, NO_LEAF};
use crate::{
    Error, Result,
    plant::{Broken, Checked, check},
};

impl FoliageModel {
    /// Checks every numbered invariant of the type. O(model).
    ///
    /// # Errors
    /// [`Error::InvalidModel`] with the number of the first invariant that is broken.
    pub fn validate(&self) -> Result<()> {
        self.check_all().map_err(|Broken { invariant, what }| Error::InvalidModel { invariant, what })
    }

    fn check_all(&self) -> Checked {
        self.parts().validate(self.leaves.iter().map(super::Leaf::geometry))?;
        self.check_first_leaf()?;
        self.check_targets()?;
        self.check_scales()?;
        self.check_errors()?;
        self.check_reach()?;
        let tone = self.growth.tone;
        check(14, (0.0..=Growth::MAX_TONE).contains(&tone), || format!("tone is {tone}"))?;
        self.impostor.as_ref().map_or(Ok(()), super::Impostor::check)?;
        self.wood_order.as_ref().map_or(Ok(()), |order| order.check(&self.wood))?;
        self.curve.as_ref().map_or(Ok(()), |curve| curve.check(self.leaves.len()))?;
        self.clusters.check(self)
    }

    fn check_first_leaf(&self) -> Checked {
        check(7, !self.leaves.is_empty(), || "0 leaves".into())?;
        let first = &self.leaves[0];
        let is_root = first.leaf_to_split == NO_LEAF && first.scale == 1.0 && first.error == 0.0;
        check(8, is_root, || format!("leaf 0 is {first:?}"))
    }

    fn check_targets(&self) -> Checked {
        for (i, leaf) in self.leaves.iter().enumerate() {
            let [split, collapse] = [leaf.leaf_to_split, leaf.leaf_to_collapse];
            check(8, split == collapse, || format!("leaf {i} splits leaf {split} but collapses leaf {collapse}"))?;
            check(9, i == 0 || (split as usize) < i, || format!("leaf {i} has target {split}"))?;
        }
        Ok(())
    }

    fn check_scales(&self) -> Checked {
        let broken = self.leaves.iter().position(|leaf| !(leaf.scale > 0.0 && leaf.scale <= self.max_scale));
        check(10, broken.is_none(), || {
            let i = broken.unwrap_or_default();
            format!("leaf {i} has scale {} of at most {}", self.leaves[i].scale, self.max_scale)
        })?;
        let largest = self.leaves.iter().map(|leaf| leaf.scale).fold(0.0, f32::max);
        let published = self.max_scale.is_finite() && self.max_scale == largest;
        check(10, published, || format!("max_scale is {} but the largest scale {largest}", self.max_scale))
    }

    fn check_errors(&self) -> Checked {
        let broken = self.leaves.iter().position(|leaf| !(leaf.error >= 0.0 && leaf.error.is_finite()));
        check(11, broken.is_none(), || {
            let i = broken.unwrap_or_default();
            format!("leaf {i} has error {}", self.leaves[i].error)
        })
    }

    fn check_reach(&self) -> Checked {
        let reach = self.enlarged_aabb();
        let finite = reach.min.iter().chain(&reach.max).all(|x| x.is_finite());
        check(12, finite, || format!("leaves enlarged by at most {} reach {reach:?}", self.max_scale))
    }
}

/// Small valid plants and models for the tests in this folder.
#[cfg(test)]
pub(super) mod samples {
    use super::super::{FoliageModel, Prune, Recipe};
    use crate::{
        Plant,
        leaf::Vertex,
        material::{Material, Texture, TextureFormat},
        plant::WoodPart,
    };

    fn vertex(position: [f32; 3]) -> Vertex {
        Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2], color: [1.0; 4] }
    }

    /// A plant of `leaves` stacked quads, leaf i at height i, and one triangle of wood.
    pub fn plant(leaves: usize) -> Plant {
        let material = |name: &str, texture| Material { name: name.into(), texture, ..Material::default() };
        let mut plant = Plant {
            name: "sample".into(),
            materials: vec![material("leaf", Some(0)), material("bark", None)],
            textures: vec![Texture { name: "t".into(), format: TextureFormat::Png, bytes: vec![1, 2, 3] }],
            ..Plant::default()
        };
        for i in 0..leaves {
            let y = i as f32;
            let corners = [[-0.5, y, 0.0], [0.5, y, 0.0], [0.5, y + 1.0, 0.0], [-0.5, y + 1.0, 0.0]].map(vertex);
            plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], [0.0, y, 0.0], 0);
        }
        plant.wood.vertices = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 1.0, 0.0]].map(vertex).to_vec();
        plant.wood.indices = vec![0, 1, 2];
        plant.wood.parts = vec![WoodPart { indices: [0, 3], material: 1 }];
        plant
    }

    /// The model of `plant(leaves)`: even leaves are pruned first, from the top down, then odd ones
    /// in the same way, each enlarging the highest odd leaf that remains.
    pub fn model(leaves: u32) -> FoliageModel {
        let even = (0..leaves).rev().filter(|i| i % 2 == 0);
        let odd = (0..leaves).rev().filter(|i| i % 2 == 1);
        let order: Vec<u32> = even.chain(odd).collect();
        let mut scale = 1.0;
        let prunes: Vec<Prune> = (0..order.len() - 1)
            .map(|step| {
                let target = order[step + 1..].iter().copied().filter(|i| i % 2 == 1).max().unwrap_or(0);
                scale *= 1.25;
                Prune { leaf: order[step], target, target_scale: scale, error: 0.5 * step as f32 }
            })
            .collect();
        FoliageModel::assemble(&plant(leaves as usize), &prunes, Recipe::default()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the invariant that `validate` reports after `break_it` is applied to a valid model
    /// of four leaves.
    fn broken_by(break_it: impl FnOnce(&mut FoliageModel)) -> u8 {
        let mut model = samples::model(4);
        model.validate().unwrap();
        break_it(&mut model);
        match model.validate() {
            Err(Error::InvalidModel { invariant, .. }) => invariant,
            other => panic!("expected a broken invariant, got {other:?}"),
        }
    }

    #[test]
    fn invariant_1_leaves_lie_one_after_another() {
        assert_eq!(broken_by(|m| m.leaves[1].vertices[0] += 1), 1);
        assert_eq!(broken_by(|m| m.leaves[3].indices[1] += 3), 1);
        assert_eq!(broken_by(|m| m.leaves.swap(1, 2)), 1);
        assert_eq!(broken_by(|m| m.vertices.extend_from_within(..1)), 1);
    }

    #[test]
    fn invariant_2_leaves_have_triangles_within_their_vertices() {
        assert_eq!(broken_by(|m| m.indices[6] = 0), 2);
    }

    #[test]
    fn invariant_3_numbers_are_finite() {
        assert_eq!(broken_by(|m| m.vertices[2].position[1] = f32::NAN), 3);
        assert_eq!(broken_by(|m| m.leaves[2].pivot[0] = f32::INFINITY), 3);
        assert_eq!(broken_by(|m| m.wood.vertices[0].uv[0] = f32::NAN), 3);
        assert_eq!(broken_by(|m| m.materials[0].alpha_cutoff = f32::NAN), 3);
    }

    #[test]
    fn invariant_4_materials_and_textures_exist() {
        assert_eq!(broken_by(|m| m.leaves[0].material = 2), 4);
        assert_eq!(broken_by(|m| m.wood.parts[0].material = 2), 4);
        assert_eq!(broken_by(|m| m.textures.clear()), 4);
    }

    #[test]
    fn invariant_5_wood_parts_cover_the_wood() {
        assert_eq!(broken_by(|m| m.wood.parts.clear()), 5);
        assert_eq!(broken_by(|m| m.wood.indices[0] = 3), 5);
    }

    #[test]
    fn invariant_6_counts_stay_within_their_limits() {
        let model = samples::model(1);
        let too_many = (0..crate::plant::MAX_LEAVES + 1).map(|_| model.leaves[0].geometry());
        assert!(matches!(model.parts().validate(too_many), Err(Broken { invariant: 6, .. })));
    }

    #[test]
    fn invariant_7_there_is_a_leaf() {
        let empty = FoliageModel { max_scale: 1.0, ..FoliageModel::default() };
        assert!(matches!(empty.validate(), Err(Error::InvalidModel { invariant: 7, .. })));
    }

    #[test]
    fn invariant_8_split_equals_collapse_and_leaf_0_has_no_target() {
        assert_eq!(broken_by(|m| m.leaves[2].leaf_to_split = 0), 8);
        assert_eq!(broken_by(|m| m.leaves[0].scale = 0.5), 8);
        assert_eq!(broken_by(|m| m.leaves[0].error = 1.0), 8);
        assert_eq!(broken_by(|m| (m.leaves[0].leaf_to_split, m.leaves[0].leaf_to_collapse) = (0, 0)), 8);
    }

    #[test]
    fn invariant_9_targets_come_first() {
        for target in [2, 3, NO_LEAF] {
            assert_eq!(broken_by(|m| (m.leaves[2].leaf_to_split, m.leaves[2].leaf_to_collapse) = (target, target)), 9);
        }
    }

    #[test]
    fn invariant_10_the_largest_scale_is_max_scale() {
        for scale in [0.0, -1.0, 100.0, f32::NAN] {
            assert_eq!(broken_by(|m| m.leaves[1].scale = scale), 10);
        }
        for max_scale in [100.0, 1.0, f32::INFINITY, f32::NAN] {
            assert_eq!(broken_by(|m| m.max_scale = max_scale), 10);
        }
    }

    #[test]
    fn invariant_11_errors_are_finite_and_not_negative() {
        for error in [-1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(broken_by(|m| m.leaves[1].error = error), 11);
        }
    }

    #[test]
    fn invariant_12_enlarged_leaves_stay_finite() {
        assert_eq!(broken_by(|m| m.vertices.iter_mut().for_each(|v| v.position[0] = f32::MAX)), 12);
    }

    #[test]
    fn invariant_16_the_order_of_the_wood_belongs_to_it() {
        let order = crate::wood::WoodOrder::default();
        assert_eq!(broken_by(|m| m.wood_order = Some(order)), 16);
    }

    #[test]
    fn enlarged_bounds_contain_every_leaf_at_every_active_count() {
        let model = samples::model(9);
        let (aabb, sphere) = (model.enlarged_aabb(), model.enlarged_sphere());
        let timeline = crate::model::Timeline::new(&model);
        for n in 0..=9 {
            for (i, leaf) in model.leaves.iter().enumerate().take(n as usize) {
                for vertex in &model.vertices[leaf.geometry().vertex_range()] {
                    let point = super::super::scaled(vertex.position, leaf.pivot, timeline.scale(i as u32, n));
                    let mut grown = aabb;
                    grown.add(point);
                    assert_eq!(grown, aabb);
                    let distance = glam::Vec3::from(point).as_dvec3().distance(sphere.center());
                    assert!(distance <= sphere.radius * (1.0 + 1e-6), "leaf {i} at {n}");
                }
            }
        }
    }
}
