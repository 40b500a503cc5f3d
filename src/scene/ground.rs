//! The ground, as scene files give it.

use super::check::wrong_if;
use crate::{Result, error::check_range};
use serde::Deserialize;
use std::path::PathBuf;

/// A level ground without end, or heights and colours over an area.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GroundEntry {
    /// Linear colour, each channel from 0 to 1; where there are `colors`, of what is beyond them.
    pub color: [f32; 3],
    /// Height, or the least one.
    pub height: f64,
    /// Distance at which a third of the light of the ground and of plants arrives; by default large
    /// compared to the plants.
    pub haze: Option<f64>,
    /// Map of the heights over `area`, relative to the scene file: black is at `height`, white is
    /// `relief` above it. The first row lies at the least z; beyond the area its edge continues.
    pub heights: Option<PathBuf>,
    /// See `heights`.
    pub relief: Option<f64>,
    /// Picture of the ground over `area`, relative to the scene file.
    pub colors: Option<PathBuf>,
    /// Side lengths of the area along x and z.
    pub area: Option<[f64; 2]>,
    /// Centre of the area, as x and z.
    pub at: [f64; 2],
}

impl Default for GroundEntry {
    /// Grass at height 0.
    fn default() -> Self {
        Self {
            color: [0.10, 0.15, 0.05],
            height: 0.0,
            haze: None,
            heights: None,
            relief: None,
            colors: None,
            area: None,
            at: [0.0; 2],
        }
    }
}

impl GroundEntry {
    /// Whether there are heights or colours.
    pub fn has_maps(&self) -> bool {
        self.heights.is_some() || self.colors.is_some()
    }

    pub(super) fn check(&self) -> Result<()> {
        self.color.iter().try_for_each(|&channel| check_range("ground.color", channel, 0.0..=1.0))?;
        check_range("ground.height", self.height, -1e9..=1e9)?;
        check_range("ground.haze", self.haze.unwrap_or(1.0), 1e-6..=1e12)?;
        check_range("ground.relief", self.relief.unwrap_or(0.0), 0.0..=1e9)?;
        self.area.iter().flatten().try_for_each(|&side| check_range("ground.area", side, 1e-3..=1e9))?;
        self.at.iter().try_for_each(|&at| check_range("ground.at", at, -1e9..=1e9))?;
        let told = |is_given: bool| if is_given { "given" } else { "missing" };
        let both = "given with `heights` and with no others";
        wrong_if(self.relief.is_some() != self.heights.is_some(), "ground.relief", told(self.relief.is_some()), both)?;
        let allowed = "given with `heights` or `colors` and with no others";
        wrong_if(self.area.is_some() != self.has_maps(), "ground.area", told(self.area.is_some()), allowed)
    }
}

#[cfg(feature = "textures")]
mod read {
    use super::GroundEntry;
    use crate::{
        Result,
        material::Pixels,
        terrain::{HeightMap, Map, Terrain},
    };
    use std::path::Path;

    impl GroundEntry {
        /// Reads the heights, whose path is relative to `folder`; level ground without them.
        ///
        /// # Errors
        /// Those of [`Map::read`] and of [`HeightMap::new`].
        pub fn read_heights(&self, folder: &Path) -> Result<HeightMap> {
            let (map, relief) = match &self.heights {
                Some(path) => (Map::read(folder.join(path))?, self.relief.unwrap_or(0.0)),
                None => (Map::new([1, 1], vec![0])?, 0.0),
            };
            let area = self.area.unwrap_or([1.0; 2]);
            let corner = [0, 1].map(|axis| self.at[axis] - 0.5 * area[axis]);
            HeightMap::new(map, corner, area, [self.height, self.height + relief])
        }

        /// The ground to draw over `heights`, with its colours; `None` without any maps.
        ///
        /// # Errors
        /// Those of [`Terrain::new`] and of [`Pixels::read`].
        pub fn terrain(&self, heights: &HeightMap, folder: &Path) -> Result<Option<Terrain>> {
            if !self.has_maps() {
                return Ok(None);
            }
            let terrain = Terrain::new(heights.clone())?;
            Ok(Some(match &self.colors {
                Some(path) => terrain.with_colors(Pixels::read(folder.join(path))?)?,
                None => terrain,
            }))
        }
    }
}
