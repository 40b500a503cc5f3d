//! The height of the ground under plants.

use super::map::Map;
use crate::{Result, error::check_range};

/// Ground whose height is a map over an area; beyond it the nearest height of the edge continues.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    map: Map,
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
        Ok(Self { map, low_corner, size, height })
    }

    /// Height at a place, bilinear between texels.
    pub fn height(&self, [x, z]: [f64; 2]) -> f64 {
        let share = self.map.value(self.place([x, z]));
        self.height[0] + (self.height[1] - self.height[0]) * share
    }

    /// Square of the tangent of the slope at a place, over a texel around it.
    pub fn slope_squared(&self, [x, z]: [f64; 2]) -> f64 {
        let half = [0, 1].map(|axis| 0.5 * self.size[axis] / f64::from(self.map.size()[axis]));
        let along = (self.height([x + half[0], z]) - self.height([x - half[0], z])) / (2.0 * half[0]);
        let across = (self.height([x, z + half[1]]) - self.height([x, z - half[1]])) / (2.0 * half[1]);
        along * along + across * across
    }

    /// Least and greatest height.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.height;
        [a.min(b), a.max(b)]
    }

    fn place(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at[axis] - self.low_corner[axis]) / self.size[axis])
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
        }
        assert_eq!(ground.slope_squared([900.0, 5.0]), 0.0);
        assert!(HeightMap::new(Map::new([1, 1], vec![0]).unwrap(), [0.0; 2], [0.0, 1.0], [0.0, 1.0]).is_err());
    }
}
