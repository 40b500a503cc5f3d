//! The height of the ground under plants.

use super::map::Map;
use crate::{Result, error::check_range};
use std::sync::Arc;

/// Ground whose height is a map over an area; beyond it the nearest height of the edge continues.
/// Copies share the map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    map: Arc<Map>,
    low_corner: [f64; 2],
    size: [f64; 2],
    height: [f64; 2],
}

impl HeightMap {
    /// Ground over the area of `size` whose corner with the least x and z is `low_corner`: at
    /// `height[0]` where the map is black, at `height[1]` where it is white.
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for sides that are not above 0, and
    /// for numbers beyond 1e9.
    pub fn new(map: Map, low_corner: [f64; 2], size: [f64; 2], height: [f64; 2]) -> Result<Self> {
        size.iter().try_for_each(|&side| check_range("ground.area", side, 1e-6..=1e9))?;
        low_corner.iter().try_for_each(|&at| check_range("ground.at", at, -1e9..=1e9))?;
        height.iter().try_for_each(|&height| check_range("ground.heights", height, -1e9..=1e9))?;
        Ok(Self { map: Arc::new(map), low_corner, size, height })
    }

    /// Level ground at a height.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn level(height: f64) -> Result<Self> {
        Self::new(Map::new([1, 1], vec![0])?, [0.0; 2], [1.0; 2], [height; 2])
    }

    /// The map.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Corner of the area with the least x and z.
    pub fn low_corner(&self) -> [f64; 2] {
        self.low_corner
    }

    /// Side lengths of the area.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// Height at a place, bilinear between texels.
    pub fn height(&self, [x, z]: [f64; 2]) -> f64 {
        self.height_at([0, 1].map(|axis| ([x, z][axis] - self.low_corner[axis]) / self.size[axis]))
    }

    /// Height at fractions of the area's sides.
    pub(super) fn height_at(&self, share: [f64; 2]) -> f64 {
        self.height[0] + (self.height[1] - self.height[0]) * self.map.value(share)
    }

    /// Square of the tangent of the slope at a place, over a texel around it.
    pub fn slope_squared(&self, at: [f64; 2]) -> f64 {
        let [along, across] = self.gradient(at);
        along * along + across * across
    }

    /// Rise per length along x and along z, over a texel around a place.
    pub fn gradient(&self, [x, z]: [f64; 2]) -> [f64; 2] {
        let half = [0, 1].map(|axis| 0.5 * self.size[axis] / f64::from(self.map.size()[axis]));
        let along = (self.height([x + half[0], z]) - self.height([x - half[0], z])) / (2.0 * half[0]);
        let across = (self.height([x, z + half[1]]) - self.height([x, z - half[1]])) / (2.0 * half[1]);
        [along, across]
    }

    /// Whether the height is the same everywhere. O(texels).
    pub fn is_level(&self) -> bool {
        let texels = self.map.texels();
        self.height[0] == self.height[1] || texels.iter().all(|texel| *texel == texels[0])
    }

    /// Least and greatest height.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.height;
        [a.min(b), a.max(b)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_its_slope_everywhere_inside() {
        let map = Map::new([64, 1], (0..64).map(|i| (i * 1000) as u16).collect()).unwrap();
        let ground = HeightMap::new(map, [-32.0, 0.0], [64.0, 10.0], [5.0, 5.0 + 65.535]).unwrap();
        assert!((ground.height([-31.5, 3.0]) - 5.0).abs() < 1e-9);
        assert!((ground.height([-30.5, -90.0]) - 6.0).abs() < 1e-9);
        for x in [-20.3, 0.0, 17.9] {
            assert!((ground.slope_squared([x, 5.0]) - 1.0).abs() < 1e-9);
            let [along, across] = ground.gradient([x, 5.0]);
            assert!((along - 1.0).abs() < 1e-9 && across == 0.0);
        }
        assert_eq!(ground.slope_squared([900.0, 5.0]), 0.0);
        assert!(HeightMap::new(Map::new([1, 1], vec![0]).unwrap(), [0.0; 2], [0.0, 1.0], [0.0, 1.0]).is_err());
        assert_eq!(HeightMap::level(3.0).unwrap().height([1e6, -7.0]), 3.0);
    }
}
