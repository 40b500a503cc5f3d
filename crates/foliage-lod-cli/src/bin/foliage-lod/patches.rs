//! Plants of a scene's patches, around the camera.

use foliage_lod::{
    Result,
    bounds::Sphere,
    scene::{
        Footing, MAX_PLANTS, Planted, SceneFile,
        patch::{HeightMap, PatchEntry, PatchPlant, Seen, Tile, TileCounts, TileOptions, Tiles},
    },
};
use glam::{DAffine3, DVec3, Vec3};
use std::path::Path;

/// Most cells that the tiles of a patch have, so that their plants take at most 240 MB.
const MOST_CELLS: u32 = 4 * MAX_PLANTS;

/// The patches of a scene.
pub struct Patches {
    patches: Vec<Tiles>,
    /// For each patch and kind, its model.
    models: Vec<Vec<usize>>,
    footings: Vec<Footing>,
}

/// What a plant of a patch has beside its place.
#[derive(Clone, Copy)]
pub struct Thinning {
    /// Its own random number, the same whatever other plants there are.
    pub seed: u32,
    foot: DVec3,
    rank: u16,
    tint: Vec3,
    /// Its tint where it has the ground's colour.
    faded: Vec3,
    patch: u32,
    /// Its kind in the patch.
    kind: u16,
}

impl Patches {
    /// Reads the maps of a scene's patches, relative to `folder`, whose plants stand on `ground`.
    ///
    /// # Errors
    /// Those of maps that cannot be read.
    pub fn open(scene: &SceneFile, folder: &Path, ground: &HeightMap) -> Result<Self> {
        let tiles = |entry: &PatchEntry| {
            let own = TileOptions::default();
            let most_tiles = (MOST_CELLS / (entry.cells * entry.cells)).clamp(1, own.most_tiles);
            let patch = entry.patch(entry.read_maps(folder)?, Some(ground.clone()))?;
            Ok(Tiles::new(patch, TileOptions { most_tiles, ..own }))
        };
        let patches = scene.patch.iter().map(tiles).collect::<Result<_>>()?;
        let model = |entry: &PatchEntry| entry.kinds.iter().map(|kind| scene.model_number(&kind.model)).collect();
        Ok(Self { patches, models: scene.patch.iter().map(model).collect(), footings: Vec::new() })
    }

    /// Sets the footings of the scene's models, before anything is planted.
    pub fn stand_on(&mut self, footings: Vec<Footing>) {
        self.footings = footings;
    }

    /// Sphere for culling plants of a model, which `reach` holds at their own size.
    pub fn culled_by(&self, model: usize, reach: Sphere) -> Sphere {
        let mut kinds =
            self.patches.iter().zip(&self.models).flat_map(|(tiles, models)| models.iter().zip(tiles.patch().kinds()));
        let grows = kinds.any(|(&of, kind)| of == model && kind.thins_over > 0.0);
        if grows { self.footings[model].grown(&reach) } else { reach }
    }

    /// Transform and tint of a plant as it is shown to an eye; `None` if it is not. `is_in_view`
    /// tells whether one of its own size is.
    pub fn shown(
        &self,
        plant: &Thinning,
        world_from_plant: DAffine3,
        eye: DVec3,
        is_in_view: impl FnOnce() -> bool,
    ) -> Option<(DAffine3, Vec3)> {
        let kind = &self.patches[plant.patch as usize].patch().kinds()[usize::from(plant.kind)];
        let Seen { width, height, fade } = kind.seen(plant.rank, plant.foot.distance(eye))?;
        if [width, height] == [1.0, 1.0] {
            return is_in_view().then_some((world_from_plant, plant.tint));
        }
        let sized = DAffine3::from_scale(DVec3::new(width, height, width));
        let [to_foot, from_foot] = [plant.foot, -plant.foot].map(DAffine3::from_translation);
        let tint = plant.tint.lerp(plant.faded, fade as f32);
        Some((to_foot * sized * from_foot * world_from_plant, tint))
    }

    /// Whether plants have tints, or take the ground's colour.
    pub fn has_tints(&self) -> bool {
        let kinds = self.patches.iter().flat_map(|tiles| tiles.patch().kinds());
        kinds.into_iter().any(|kind| kind.blends || kind.tint.as_flattened().iter().any(|&factor| factor != 1.0))
    }

    /// Whether the scene has none.
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// Makes tiles around the eye: all of them if `all`, else some. Returns what was done.
    pub fn follow(&mut self, eye: DVec3, all: bool) -> TileCounts {
        let mut sum = TileCounts::default();
        for tiles in &mut self.patches {
            let counts = if all { tiles.complete(eye) } else { tiles.update(eye) };
            sum.made += counts.made;
            sum.dropped += counts.dropped;
            sum.pending += counts.pending;
            sum.over += counts.over;
            sum.kept += counts.kept;
        }
        sum
    }

    /// Appends the plants of all tiles, at most [`MAX_PLANTS`] in all; what would be more is left
    /// out. Returns how many were. `faded` is the tint with which a model has the colour of the
    /// ground at a place, if it has leaves.
    pub fn plant(
        &self,
        planted: &mut Vec<Planted>,
        thinning: &mut Vec<Thinning>,
        faded: impl Fn(usize, DVec3) -> Option<Vec3>,
    ) -> usize {
        let mut left_out = 0;
        for (patch, (tiles, models)) in (0..).zip(self.patches.iter().zip(&self.models)) {
            let kinds = tiles.patch().kinds();
            for Tile { plants, .. } in tiles.tiles() {
                let room = (MAX_PLANTS as usize).saturating_sub(planted.len());
                left_out += plants.len().saturating_sub(room);
                for plant in &plants[..room.min(plants.len())] {
                    let model = models[usize::from(plant.kind)];
                    planted.push(Planted { model, world_from_plant: self.footings[model].world_from_patch(plant) });
                    let PatchPlant { at: foot, kind, rank, seed, .. } = *plant;
                    let tint = Vec3::from(plant.tint);
                    let faded = kinds[usize::from(kind)].blends.then(|| faded(model, foot)).flatten().unwrap_or(tint);
                    thinning.push(Thinning { seed, foot, rank, tint, faded, patch, kind });
                }
            }
        }
        left_out
    }
}
