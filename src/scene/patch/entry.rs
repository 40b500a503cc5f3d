//! A patch, as scene files give it.

use super::{
    field::{Layout, Patch},
    kind::{Placing, PlantKind},
};
use crate::{
    Error, Result,
    error::check_range,
    terrain::{HeightMap, Map},
};
use serde::Deserialize;

/// Most kinds of a patch.
pub const MAX_KINDS: usize = 4096;

/// Plants of some kinds over an area, or without end. Lengths are in the scene's units.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchEntry {
    /// Centre of the area, as x and z.
    #[serde(default)]
    pub at: [f64; 2],
    /// Side lengths of the area along x and z; by default the patch has no end. Maps lie over it.
    pub area: Option<[f64; 2]>,
    /// Random seed.
    #[serde(default)]
    pub seed: u32,
    /// Cells along a side of a tile, the part of the patch that is made at once: 1 to 1024.
    #[serde(default = "cells")]
    pub cells: u32,
    /// Where plants may grow.
    #[serde(default)]
    pub placing: Placing,
    /// The kinds of plants. Where several of one spacing may grow, the shares of each are what
    /// their densities and maps say, as long as these sum to at most 1.
    pub kinds: Vec<PlantKind>,
}

fn cells() -> u32 {
    128
}

impl PatchEntry {
    /// A patch without end of `kinds`.
    pub fn new(kinds: Vec<PlantKind>) -> Self {
        Self { at: [0.0; 2], area: None, seed: 0, cells: cells(), placing: Placing::default(), kinds }
    }

    /// Checks every parameter; `key(name)` is a parameter's dotted key.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first that is out of its range.
    pub fn check(&self, key: impl Fn(&str) -> String) -> Result<()> {
        self.at.iter().try_for_each(|&at| check_range(key("at"), at, -1e9..=1e9))?;
        check_range(key("cells"), self.cells, 1..=1024)?;
        check_range(key("kinds"), self.kinds.len(), 1..=MAX_KINDS)?;
        for (i, kind) in self.kinds.iter().enumerate() {
            kind.check(|name| key(&format!("kinds.{i}.{name}")))?;
            if kind.map.is_some() && self.area.is_none() {
                let name = key(&format!("kinds.{i}.map"));
                return Err(Error::invalid(name, "given without an area", "that of a patch with `area`"));
            }
        }
        let area = self.area.unwrap_or([1.0; 2]);
        area.iter().try_for_each(|&side| check_range(key("area"), side, 1e-3..=1e9))
    }

    /// The patch with a map for each kind, `None` for those without, on `ground`, or on a plane at
    /// height 0.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), and [`Error::InvalidOption`] for maps that do not fit.
    pub fn patch(&self, maps: Vec<Option<Map>>, ground: Option<HeightMap>) -> Result<Patch> {
        self.check(str::to_owned)?;
        if maps.len() != self.kinds.len() || maps.iter().flatten().next().is_some() && self.area.is_none() {
            let value = format!("{} maps for {} kinds", maps.len(), self.kinds.len());
            return Err(Error::invalid("maps", value, "one or none for each kind of a patch with an area"));
        }
        let Self { at, area, seed, cells, placing, .. } = *self;
        Ok(Patch::new(Layout { at, area, seed, cells, placing }, &self.kinds, maps, ground))
    }
}

#[cfg(feature = "textures")]
impl PatchEntry {
    /// Reads the kinds' maps, whose paths are relative to `folder`.
    ///
    /// # Errors
    /// Those of [`Map::read`].
    pub fn read_maps(&self, folder: &std::path::Path) -> Result<Vec<Option<Map>>> {
        let map = |kind: &PlantKind| kind.map.as_ref().map(|map| Map::read(folder.join(map))).transpose();
        self.kinds.iter().map(map).collect()
    }
}
