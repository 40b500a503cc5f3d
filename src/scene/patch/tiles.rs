//! Tiles of a patch on demand: made as the eye comes near, dropped behind it.

use super::field::{Patch, PatchPlant, Scratch, TileKey, squared};
use glam::DVec3;
use std::collections::HashMap;

/// Most tiles that [`Tiles`] keep.
pub const MOST_TILES: u32 = 1 << 16;

/// How much of a patch is kept, and how much is made at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileOptions {
    /// Most tiles that are kept, at most [`MOST_TILES`]: when more are within reach, the farthest
    /// are left out.
    pub most_tiles: u32,
    /// Most cells that one update looks at; a tile of more takes several updates.
    pub cells_per_update: u32,
}

impl Default for TileOptions {
    /// 4096 tiles, and 16384 cells an update: one tile of the default size, in about 2 ms.
    fn default() -> Self {
        Self { most_tiles: 4096, cells_per_update: 16_384 }
    }
}

/// What an update did, and what is left to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TileCounts {
    /// Tiles that were completed.
    pub made: u32,
    /// Tiles that were dropped.
    pub dropped: u32,
    /// Tiles within reach that are not made yet.
    pub pending: u32,
    /// Tiles within reach for which there is no room.
    pub over: u32,
    /// Tiles that are kept.
    pub kept: u32,
}

/// A tile that is made.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Its number.
    pub key: TileKey,
    /// Its plants, row by row of its cells.
    pub plants: Vec<PatchPlant>,
}

/// The tiles around an eye. Does not allocate once it has held the most plants.
#[derive(Debug)]
pub struct Tiles {
    patch: Patch,
    options: TileOptions,
    tiles: Vec<Tile>,
    /// Index in `tiles` of each tile.
    places: HashMap<TileKey, u32>,
    /// Tiles within reach, with their squared distance, nearest first.
    wanted: Vec<(f64, TileKey)>,
    /// For each spacing, lists of plants that are not in use.
    spare: Vec<Vec<Vec<PatchPlant>>>,
    /// The tile that is being made, and its next row.
    making: Option<(Tile, u32)>,
    scratch: Scratch,
}

impl Tiles {
    /// No tiles yet.
    pub fn new(patch: Patch, options: TileOptions) -> Self {
        let options = TileOptions { most_tiles: options.most_tiles.min(MOST_TILES), ..options };
        Self {
            spare: vec![Vec::new(); patch.layers()],
            patch,
            options,
            tiles: Vec::new(),
            places: HashMap::with_capacity(options.most_tiles as usize),
            wanted: Vec::new(),
            making: None,
            scratch: Scratch::default(),
        }
    }

    /// The patch.
    pub fn patch(&self) -> &Patch {
        &self.patch
    }

    /// The tiles that are made, in no order.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Drops tiles that are farther from the eye than a tile's diagonal beyond the reach of their
    /// kinds, and makes some of those within reach, the nearest first. An eye that is not finite
    /// changes nothing. Costs O(tiles within reach), and the cells of those that are made.
    pub fn update(&mut self, eye: DVec3) -> TileCounts {
        let mut counts = TileCounts::default();
        if eye.is_finite() {
            counts.dropped = self.drop_far(eye);
            self.list_wanted(eye, &mut counts);
            let mut cells = self.options.cells_per_update.max(self.patch.cells());
            while cells >= self.patch.cells() && self.make(&mut cells, &mut counts) {}
        }
        counts.pending -= counts.made.min(counts.pending);
        counts.kept = self.tiles.len() as u32;
        counts
    }

    /// Makes all tiles within reach that there is room for.
    pub fn complete(&mut self, eye: DVec3) -> TileCounts {
        let mut sum = TileCounts::default();
        loop {
            let counts = self.update(eye);
            sum = TileCounts { made: sum.made + counts.made, dropped: sum.dropped + counts.dropped, ..counts };
            if counts.pending == 0 {
                return sum;
            }
        }
    }

    /// Paints: calls `paint` with the patch, whose maps may be changed within the rectangle from
    /// `low` to `high` in x and z, and makes the tiles anew, over the next updates, whose plants
    /// may change by it. Others stay as they are.
    pub fn repaint(&mut self, low: [f64; 2], high: [f64; 2], paint: impl FnOnce(&mut Patch)) {
        paint(&mut self.patch);
        let reach = self.patch.influence();
        self.stop_making();
        for index in (0..self.tiles.len()).rev() {
            let key = self.tiles[index].key;
            let (corner, size) = (self.patch.tile_corner(key), self.patch.tile_size(key.layer.into()));
            let touches =
                |axis: usize| corner[axis] <= high[axis] + reach && corner[axis] + size[axis] >= low[axis] - reach;
            if touches(0) && touches(1) {
                self.drop_tile(index);
            }
        }
    }

    fn drop_far(&mut self, eye: DVec3) -> u32 {
        let mut dropped = 0;
        for index in (0..self.tiles.len()).rev() {
            let key = self.tiles[index].key;
            let size = self.patch.tile_size(key.layer.into());
            let limit = self.patch.reach(key.layer.into()) + (squared(size[0]) + squared(size[1])).sqrt();
            if distance_squared(&self.patch, key, eye) > limit * limit {
                self.drop_tile(index);
                dropped += 1;
            }
        }
        dropped
    }

    fn drop_tile(&mut self, index: usize) {
        let tile = self.tiles.swap_remove(index);
        self.places.remove(&tile.key);
        if let Some(moved) = self.tiles.get(index) {
            self.places.insert(moved.key, index as u32);
        }
        self.spare[usize::from(tile.key.layer)].push(tile.plants);
    }

    /// Lists tiles within reach that are missing, and makes room for those that are nearer than
    /// others.
    fn list_wanted(&mut self, eye: DVec3, counts: &mut TileCounts) {
        self.wanted.clear();
        for layer in 0..self.patch.layers() {
            let [columns, rows] = self.patch.tiles_within(layer, eye, self.options.most_tiles);
            let reach = self.patch.reach(layer);
            for z in rows {
                for x in columns.clone() {
                    let key = TileKey { layer: layer as u16, at: [x, z] };
                    let distance = distance_squared(&self.patch, key, eye);
                    if distance <= reach * reach && !self.places.contains_key(&key) {
                        self.wanted.push((distance, key));
                    }
                }
            }
        }
        self.wanted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let room = (self.options.most_tiles as usize).saturating_sub(self.tiles.len());
        if self.wanted.len() > room {
            counts.dropped += self.make_room(eye);
        }
        let room = (self.options.most_tiles as usize).saturating_sub(self.tiles.len());
        counts.over = self.wanted.len().saturating_sub(room) as u32;
        self.wanted.truncate(room);
        counts.pending = self.wanted.len() as u32;
        // A tile that is no longer wanted is not made to its end.
        let is_wanted = |key| self.wanted.iter().any(|wanted| wanted.1 == key);
        if self.making.as_ref().is_some_and(|(tile, _)| !is_wanted(tile.key)) {
            self.stop_making();
        }
    }

    fn stop_making(&mut self) {
        if let Some((tile, _)) = self.making.take() {
            self.spare[usize::from(tile.key.layer)].push(tile.plants);
        }
    }

    /// Drops the farthest tiles for which a wanted one is nearer.
    fn make_room(&mut self, eye: DVec3) -> u32 {
        let mut dropped = 0;
        let mut free = (self.options.most_tiles as usize).saturating_sub(self.tiles.len());
        while let Some(&(wanted, _)) = self.wanted.get(free) {
            let distances = self.tiles.iter().map(|tile| distance_squared(&self.patch, tile.key, eye));
            let farthest = distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((index, _)) = farthest.filter(|farthest| farthest.1 > wanted) else { break };
            self.drop_tile(index);
            (dropped, free) = (dropped + 1, free + 1);
        }
        dropped
    }

    /// Makes some rows of the next tile. Returns whether there was one.
    fn make(&mut self, cells: &mut u32, counts: &mut TileCounts) -> bool {
        let (mut tile, first) = match self.making.take() {
            Some(making) => making,
            None => {
                let next = self.wanted.iter().find(|wanted| !self.places.contains_key(&wanted.1));
                let Some(&(_, key)) = next else { return false };
                let layer = usize::from(key.layer);
                let most = || Vec::with_capacity(self.patch.most_plants(layer));
                let mut plants = self.spare[layer].pop().unwrap_or_else(most);
                plants.clear();
                (Tile { key, plants }, 0)
            }
        };
        let side = self.patch.cells();
        let end = side.min(first + *cells / side);
        self.patch.rows(tile.key, first..end, &mut self.scratch, &mut tile.plants);
        *cells -= (end - first) * side;
        if end < side {
            self.making = Some((tile, end));
            return false;
        }
        self.places.insert(tile.key, self.tiles.len() as u32);
        self.tiles.push(tile);
        counts.made += 1;
        true
    }
}

/// Square of the horizontal distance from the eye to a tile.
fn distance_squared(patch: &Patch, key: TileKey, eye: DVec3) -> f64 {
    let (corner, size) = (patch.tile_corner(key), patch.tile_size(key.layer.into()));
    let beyond = |axis: usize, at: f64| (corner[axis] - at).max(at - corner[axis] - size[axis]).max(0.0);
    squared(beyond(0, eye.x)) + squared(beyond(1, eye.z))
}
