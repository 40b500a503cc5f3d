//! Which plants grow where: every part of a patch, on its own and in any order.

use super::{
    hash::{Stream, draw, unit},
    kind::{Placing, PlantKind},
    layer::{Found, Layer},
};
use crate::terrain::{HeightMap, Map};
use glam::DVec3;
use std::ops::Range;

/// A patch with its maps and its ground.
///
/// Its plants follow from its numbers, cell by cell: each part of it can be made alone, in any
/// order, on any thread and on any machine, to the same bit.
#[derive(Debug, Clone)]
pub struct Patch {
    kinds: Vec<PlantKind>,
    maps: Vec<Option<Map>>,
    ground: Option<HeightMap>,
    layers: Vec<Layer>,
    limits: Vec<Limits>,
    /// Corner of the area with the least x and z; the origin of the cells.
    corner: [f64; 2],
    area: Option<[f64; 2]>,
    cells: u32,
}

/// Where a patch lies and how its cells are made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Centre of the area.
    pub(super) at: [f64; 2],
    pub(super) area: Option<[f64; 2]>,
    pub(super) seed: u32,
    pub(super) cells: u32,
    pub(super) placing: Placing,
}

/// Slopes on which a kind grows, as squares of their tangents.
#[derive(Debug, Clone, Copy)]
struct Limits {
    slope_squared: [f64; 2],
}

/// Number of a tile: a square of cells of the kinds of one spacing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TileKey {
    /// Number of the spacing: 0 for the largest.
    pub layer: u16,
    /// Column and row among the tiles of that spacing; 0 begins at the area's corner.
    pub at: [i32; 2],
}

/// A plant of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchPlant {
    /// Position of its foot.
    pub at: DVec3,
    /// Rotation about the vertical, in radians.
    pub turn: f32,
    /// Height.
    pub height: f32,
    /// Width over the width that the model has at its height.
    pub ratio: f32,
    /// Colour factor (linear).
    pub tint: [f32; 3],
    /// Index among the patch's kinds.
    pub kind: u16,
    /// Place in the order in which the plants of its kind become fewer, over 65536: those of ranks
    /// below a share are that share of them, whatever the share.
    pub rank: u16,
    /// Its own random number.
    pub seed: u32,
}

/// Memory for [`Patch::tile`].
#[derive(Debug, Default)]
pub struct Scratch {
    /// Feet of plants of larger kinds, with the radius around each that they keep free.
    larger: Vec<[f64; 3]>,
}

impl Patch {
    pub(super) fn new(layout: Layout, kinds: &[PlantKind], maps: Vec<Option<Map>>, ground: Option<HeightMap>) -> Self {
        let tangent_squared = |degrees: f32| squared(libm::tan(f64::from(degrees).to_radians()));
        let limits = |kind: &PlantKind| {
            let [least, greatest] = kind.slope;
            let greatest = if greatest >= 90.0 { f64::INFINITY } else { tangent_squared(greatest) };
            Limits { slope_squared: [tangent_squared(least), greatest] }
        };
        let Layout { at, area, seed, cells, placing } = layout;
        let half = area.unwrap_or_default().map(|side| 0.5 * side);
        Self {
            layers: Layer::all(kinds, seed, placing),
            limits: kinds.iter().map(limits).collect(),
            kinds: kinds.to_vec(),
            maps,
            ground,
            corner: [0, 1].map(|axis| at[axis] - half[axis]),
            area,
            cells,
        }
    }

    /// The kinds, as given.
    pub fn kinds(&self) -> &[PlantKind] {
        &self.kinds
    }

    /// Number of different spacings.
    pub fn layers(&self) -> usize {
        self.layers.len()
    }

    /// Cells along a side of a tile.
    pub fn cells(&self) -> u32 {
        self.cells
    }

    /// Number of plants that hardly a tile of a spacing exceeds: six standard deviations above the
    /// mean.
    pub(super) fn most_plants(&self, layer: usize) -> usize {
        let cells = f64::from(self.cells * self.cells);
        let mean = cells * self.layers[layer].density;
        (mean + 6.0 * mean.sqrt() + 1.0).min(cells) as usize
    }

    /// Distance beyond which no plant of a spacing is made.
    pub fn reach(&self, layer: usize) -> f64 {
        self.layers[layer].reach
    }

    /// Ground that the plants stand on; `None` is a plane at height 0.
    pub fn ground(&self) -> Option<&HeightMap> {
        self.ground.as_ref()
    }

    /// Map of a kind, to be painted; see [`Tiles::repaint`](super::Tiles::repaint).
    pub fn map_mut(&mut self, kind: usize) -> Option<&mut Map> {
        self.maps.get_mut(kind)?.as_mut()
    }

    /// Side lengths of the tiles of a spacing along x and z.
    pub fn tile_size(&self, layer: usize) -> [f64; 2] {
        self.layers[layer].spacing.map(|spacing| spacing * f64::from(self.cells))
    }

    /// Corner of a tile with the least x and z. The feet of its plants lie between it and the
    /// opposite corner.
    pub fn tile_corner(&self, key: TileKey) -> [f64; 2] {
        let size = self.tile_size(key.layer.into());
        [0, 1].map(|axis| self.corner[axis] + f64::from(key.at[axis]) * size[axis])
    }

    /// Columns and rows of tiles that may lie within reach of an eye: not many more than `most`.
    pub(super) fn tiles_within(&self, layer: usize, eye: DVec3, most: u32) -> [Range<i32>; 2] {
        let (size, reach) = (self.tile_size(layer), self.reach(layer));
        // A ring of more tiles than there is room for.
        let most = f64::from(most).sqrt() + 1.0;
        [0, 1].map(|axis| {
            let (at, reach) = ([eye.x, eye.z][axis] - self.corner[axis], reach.min(most * size[axis]));
            let end = self.area.map_or(i32::MAX, |area| (area[axis] / size[axis]).ceil() as i32);
            let least = if self.area.is_some() { 0 } else { i32::MIN };
            let tile = |at: f64| (at / size[axis]).floor() as i32;
            tile(at - reach).max(least)..tile(at + reach).saturating_add(1).min(end)
        })
    }

    /// Greatest distance from a painted place at which plants change: texels reach over their
    /// neighbours, and a plant that comes or goes keeps away those of smaller spacing.
    pub(super) fn influence(&self) -> f64 {
        let texel =
            |map: &Map, area: [f64; 2]| (0..2).map(|axis| area[axis] / f64::from(map.size()[axis])).fold(0.0, f64::max);
        let texels = self.maps.iter().flatten().map(|map| texel(map, self.area.unwrap_or_default()));
        texels.fold(0.0, f64::max) + self.layers.iter().map(|layer| layer.keeps_away).sum::<f64>()
    }

    /// Replaces `plants` by those of a tile: none outside the area. Costs O(cells).
    pub fn tile(&self, key: TileKey, scratch: &mut Scratch, plants: &mut Vec<PatchPlant>) {
        plants.clear();
        self.rows(key, 0..self.cells, scratch, plants);
    }

    /// Appends the plants of some rows of a tile's cells to `plants`.
    pub(super) fn rows(&self, key: TileKey, rows: Range<u32>, scratch: &mut Scratch, plants: &mut Vec<PatchPlant>) {
        let Some(layer) = self.layers.get(usize::from(key.layer)) else { return };
        let first = key.at.map(|at| at.saturating_mul(self.cells as i32));
        let columns = first[0]..first[0].saturating_add(self.cells as i32);
        let rows = first[1].saturating_add(rows.start as i32)..first[1].saturating_add(rows.end as i32);
        let corner = |cell: [i32; 2]| [0, 1].map(|axis| f64::from(cell[axis]) * layer.spacing[axis]);
        let (low, high) = (corner([columns.start, rows.start]), corner([columns.end, rows.end]));
        if !self.may_hold(low, high) {
            return;
        }
        self.list_larger(key.layer.into(), low, high, &mut scratch.larger);
        for z in rows {
            for x in columns.clone() {
                let found = self.grows(layer, [x, z]).filter(|found| is_free(&scratch.larger, found.at));
                plants.extend(found.map(|found| self.plant(layer, [x, z], found)));
            }
        }
    }

    /// Whether the area has a part in common with a rectangle relative to its corner.
    fn may_hold(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        self.area.is_none_or(|area| (0..2).all(|axis| high[axis] > 0.0 && low[axis] < area[axis]))
    }

    /// Lists plants of larger spacing than that of `layer` that keep others away from a rectangle,
    /// the largest first, since these keep away others as well.
    fn list_larger(&self, layer: usize, low: [f64; 2], high: [f64; 2], larger: &mut Vec<[f64; 3]>) {
        larger.clear();
        let larger_layers = &self.layers[..layer];
        for (i, layer) in larger_layers.iter().enumerate() {
            let reach: f64 = larger_layers[i..].iter().map(|layer| layer.keeps_away).sum();
            if layer.keeps_away == 0.0 {
                continue;
            }
            let [columns, rows] = layer.cells(low.map(|at| at - reach), high.map(|at| at + reach));
            let even_larger = larger.len();
            for z in rows {
                for x in columns.clone() {
                    let Some(found) = self.grows(layer, [x, z]) else { continue };
                    let radius = self.kinds[usize::from(found.kind)].keeps_away;
                    if radius > 0.0 && is_free(&larger[..even_larger], found.at) {
                        larger.push([found.at[0], found.at[1], radius]);
                    }
                }
            }
        }
    }

    /// What grows in a cell if no larger plant keeps it away.
    fn grows(&self, layer: &Layer, cell: [i32; 2]) -> Option<Found> {
        let share = |kind: u16, at: [f64; 2]| match (&self.maps[usize::from(kind)], self.area) {
            (Some(map), Some(area)) => map.share([at[0] / area[0], at[1] / area[1]]),
            _ => 1 << 32,
        };
        let found = layer.found(cell, share)?;
        let is_inside = self.area.is_none_or(|area| (0..2).all(|axis| (0.0..area[axis]).contains(&found.at[axis])));
        (is_inside && self.suits(found)).then_some(found)
    }

    /// Whether the ground suits a plant.
    fn suits(&self, Found { kind, at, .. }: Found) -> bool {
        let (kind, limits) = (&self.kinds[usize::from(kind)], &self.limits[usize::from(kind)]);
        let Some(ground) = &self.ground else { return limits.slope_squared[0] == 0.0 };
        let at = self.in_world(at);
        let [low, high] = kind.altitude;
        let [least, greatest] = limits.slope_squared;
        let is_any_slope = least == 0.0 && greatest == f64::INFINITY;
        (low..=high).contains(&ground.height(at))
            && (is_any_slope || (least..=greatest).contains(&ground.slope_squared(at)))
    }

    fn in_world(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.corner[axis] + at[axis])
    }

    fn plant(&self, layer: &Layer, cell: [i32; 2], Found { kind, at, rank }: Found) -> PatchPlant {
        let number = kind;
        let kind = &self.kinds[usize::from(kind)];
        let between = |[low, high]: [f32; 2], stream| low + (high - low) * unit(layer.seed, cell, stream);
        let [x, z] = self.in_world(at);
        let height = self.ground.as_ref().map_or(0.0, |ground| ground.height([x, z]));
        let tinted = unit(layer.seed, cell, Stream::Tint);
        let [dark, light] = kind.tint;
        PatchPlant {
            at: DVec3::new(x, height, z),
            turn: between(kind.turn, Stream::Turn).to_radians(),
            height: between(kind.height, Stream::Height),
            ratio: between(kind.ratio, Stream::Width),
            tint: [0, 1, 2].map(|channel| dark[channel] + (light[channel] - dark[channel]) * tinted),
            kind: number,
            rank,
            seed: draw(layer.seed, cell, Stream::Seed),
        }
    }
}

pub(super) fn squared(value: f64) -> f64 {
    value * value
}

/// Whether a place is outside the radii of all `larger` plants.
fn is_free(larger: &[[f64; 3]], at: [f64; 2]) -> bool {
    larger.iter().all(|&[x, z, radius]| squared(x - at[0]) + squared(z - at[1]) >= radius * radius)
}
