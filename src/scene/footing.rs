//! How a model stands on the ground.

use super::{
    patch::{MOST_GROWTH, PatchPlant},
    scatter::Spot,
};
use crate::{bounds::Sphere, model::FoliageModel};
use glam::{DAffine3, DQuat, DVec3};

/// Foot and size of a model: the centre of the bottom face of its bounding box is put on the spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footing {
    /// Centre of the bottom face of its bounding box, in plant space.
    foot: DVec3,
    /// Height of its bounding box, in its own units.
    height: f64,
    scale: f64,
}

impl Footing {
    /// Footing of a model that is to be `height` tall in the scene's units; `None` keeps its own
    /// height. O(vertices).
    pub fn new(model: &FoliageModel, height: Option<f64>) -> Self {
        let bounds = model.aabb();
        let own = f64::from(bounds.size().y);
        let foot = DVec3::new(bounds.center().x, f64::from(bounds.min[1]), bounds.center().z);
        let scale = height.filter(|_| own > 0.0).map_or(1.0, |wanted| wanted / own);
        Self { foot, height: own, scale }
    }

    /// Transform from the plant's space to the scene's on a spot.
    pub fn world_from_plant(&self, spot: &Spot) -> DAffine3 {
        self.transform(DVec3::splat(self.scale * spot.scale), spot.turn, spot.at)
    }

    /// Transform from the plant's space to the scene's for a plant of a patch, whose height and
    /// width are the patch's.
    pub fn world_from_patch(&self, plant: &PatchPlant) -> DAffine3 {
        let scale = if self.height > 0.0 { f64::from(plant.height) / self.height } else { 1.0 };
        let wide = scale * f64::from(plant.ratio);
        self.transform(DVec3::new(wide, scale, wide), plant.turn.into(), plant.at)
    }

    /// Sphere around all that `reach` holds, in plant space, of a plant that grows from its foot as
    /// those of patches do where they [thin out](super::patch::Seen).
    pub fn grown(&self, reach: &Sphere) -> Sphere {
        let radius = MOST_GROWTH * reach.radius + (MOST_GROWTH - 1.0) * reach.center().distance(self.foot);
        Sphere { radius, ..*reach }
    }

    fn transform(&self, scale: DVec3, turn: f64, at: DVec3) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(scale, DQuat::from_rotation_y(turn), at)
            * DAffine3::from_translation(-self.foot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    #[test]
    fn a_grown_plant_is_within_its_sphere() {
        let footing = Footing { foot: DVec3::new(1.0, -2.0, 0.5), height: 6.0, scale: 1.0 };
        let reach = Sphere { center: [1.5, 1.0, 0.0], radius: 3.0 };
        let grown = footing.grown(&reach);
        for growth in [0.0, 0.5, 1.0, 1.7, MOST_GROWTH] {
            let sized = DAffine3::from_translation(footing.foot)
                * DAffine3::from_scale(DVec3::splat(growth))
                * DAffine3::from_translation(-footing.foot);
            let Sphere { center, radius } = reach.transformed(&sized);
            assert!(grown.center().distance(center.into()) + radius <= grown.radius + 1e-9, "{growth}");
        }
    }
}
