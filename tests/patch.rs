//! Foliage patches: shares, independence of order, editing, distances, tiles on demand, `.fol`.
#![cfg(feature = "scene")]

use foliage_lod::scene::patch::{
    FOOT, FolFile, HeightMap, Map, Patch, PatchEntry, PatchPlant, Placing, PlantKind, Scratch, Spacing, TileKey,
    TileOptions, Tiles,
};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

fn kind(spacing: f64, density: f32) -> PlantKind {
    PlantKind { density, ..PlantKind::new("oak", spacing, [1.0, 2.0]) }
}

fn entry(kinds: Vec<PlantKind>, side: f64) -> PatchEntry {
    PatchEntry { area: Some([side; 2]), seed: 5, cells: 32, ..PatchEntry::new(kinds) }
}

fn unmapped(entry: &PatchEntry) -> Patch {
    entry.patch(vec![None; entry.kinds.len()], None).unwrap()
}

/// Keys of the tiles of a layer that an area of `side` has.
fn keys(patch: &Patch, layer: u16, side: f64) -> Vec<TileKey> {
    let tiles = (side / patch.tile_size(layer.into())[0]).ceil() as i32;
    (0..tiles * tiles).map(|i| TileKey { layer, at: [i % tiles, i / tiles] }).collect()
}

fn plants_of(patch: &Patch, keys: &[TileKey]) -> Vec<PatchPlant> {
    let (mut scratch, mut plants) = (Scratch::default(), Vec::new());
    let tile = |key: &TileKey| {
        patch.tile(*key, &mut scratch, &mut plants);
        plants.clone()
    };
    keys.iter().flat_map(tile).collect()
}

fn all_plants(patch: &Patch, side: f64) -> Vec<PatchPlant> {
    let layers = 0..patch.layers() as u16;
    layers.flat_map(|layer| plants_of(patch, &keys(patch, layer, side))).collect()
}

#[test]
fn every_kind_has_the_share_that_its_density_and_map_say() {
    // Five overlapping maps that sum to at most one; 1,000,000 cells.
    let side = 1000.0;
    let ramp = |from: f64, to: f64| {
        let texel = |i: usize| (65535.0 * (from + (to - from) * (i % 64) as f64 / 63.0)).round() as u16;
        Map::new([64, 64], (0..64 * 64).map(texel).collect()).unwrap()
    };
    let ramps = [(0.0, 1.0), (1.0, 0.0), (0.3, 0.9), (0.9, 0.1), (0.5, 0.5)];
    let densities = [0.3, 0.25, 0.2, 0.15, 0.1];
    for placing in [Placing::Jitter, Placing::BlueNoise] {
        let entry = PatchEntry { placing, ..entry(densities.map(|density| kind(1.0, density)).to_vec(), side) };
        let patch = entry.patch(ramps.map(|(from, to)| Some(ramp(from, to))).to_vec(), None).unwrap();
        let plants = all_plants(&patch, side);
        let (mut chi_squared, cells) = (0.0, 1e6);
        for (number, (from, to)) in (0_u16..).zip(ramps) {
            let expected = f64::from(densities[usize::from(number)]) * 0.5 * (from + to);
            let share = plants.iter().filter(|plant| plant.kind == number).count() as f64 / cells;
            assert!((share - expected).abs() < 0.002, "{placing:?} kind {number}: {share} for {expected}");
            chi_squared += (share - expected).powi(2) * cells / expected;
        }
        // The 0.999 quantile of chi squared with 5 degrees of freedom.
        assert!(chi_squared < 20.5, "{placing:?}: {chi_squared}");
    }
}

#[test]
fn maps_that_sum_to_more_than_one_share_every_point() {
    let entry = entry(vec![kind(1.0, 1.0), kind(1.0, 1.0), kind(1.0, 0.5)], 300.0);
    let plants = all_plants(&unmapped(&entry), 300.0);
    assert_eq!(plants.len(), 90_000);
    for (number, expected) in [(0, 0.4), (1, 0.4), (2, 0.2)] {
        let share = plants.iter().filter(|plant| plant.kind == number).count() as f64 / 90_000.0;
        assert!((share - expected).abs() < 0.006, "kind {number}: {share}");
    }
}

#[test]
fn tiles_are_the_same_in_any_order_and_on_any_number_of_threads() {
    let kinds = vec![PlantKind { keeps_away: 4.0, ..kind(7.0, 0.7) }, kind(1.5, 0.8), kind(0.5, 0.9)];
    let patch = unmapped(&entry(kinds, 200.0));
    let keys: Vec<TileKey> = (0..3).flat_map(|layer| keys(&patch, layer, 200.0)).collect();
    let forward: Vec<Vec<PatchPlant>> = keys.iter().map(|&key| plants_of(&patch, &[key])).collect();
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let made: Vec<Vec<PatchPlant>> =
            pool.install(|| keys.par_iter().rev().map(|&key| plants_of(&patch, &[key])).collect());
        assert!(made.iter().rev().eq(&forward), "{threads} threads");
    }
}

#[test]
fn the_plants_of_a_patch_never_change() {
    let kinds = vec![PlantKind { keeps_away: 2.0, ..kind(5.0, 0.5) }, kind(1.0, 0.5)];
    let plants = all_plants(&unmapped(&entry(kinds, 50.0)), 50.0);
    let bits = |plant: &PatchPlant| {
        let values = [plant.turn, plant.height, plant.ratio].map(f32::to_bits);
        let places = [plant.at.x, plant.at.z].map(f64::to_bits).map(|bits| (bits ^ bits >> 32) as u32);
        values.into_iter().chain(places).chain([plant.seed, plant.kind.into(), plant.rank.into()])
    };
    let hash =
        plants.iter().flat_map(bits).fold(0_u32, |hash, bits| hash.rotate_left(5) ^ bits.wrapping_mul(0x9E37_79B9));
    assert_eq!((plants.len(), hash), (1006, 1_647_073_697));
}

#[test]
fn painting_a_disc_changes_nothing_farther_away_and_no_other_kind() {
    let (side, texels) = (200.0, 100_u32);
    let entry = entry(vec![kind(1.0, 0.4), kind(1.0, 0.4)], side);
    let white = || Some(Map::new([texels; 2], vec![65535; (texels * texels) as usize]).unwrap());
    let before = entry.patch(vec![white(), white()], None).unwrap();
    let mut painted = before.clone();
    let radius = 10.0;
    let at = |i: usize| (i as f64 + 0.5) * side / f64::from(texels) - 100.0;
    let map = painted.map_mut(0).unwrap().texels_mut();
    for (i, texel) in map.iter_mut().enumerate() {
        if at(i % texels as usize).hypot(at(i / texels as usize)) < radius {
            *texel = 0;
        }
    }
    let (before, after) = (all_plants(&before, side), all_plants(&painted, side));
    let is_far = |plant: &&PatchPlant| plant.at.x.hypot(plant.at.z) > radius + 2.0 * side / f64::from(texels);
    assert!(before.iter().filter(is_far).eq(after.iter().filter(is_far)));
    let is_other = |plant: &&PatchPlant| plant.kind == 1;
    assert!(before.iter().filter(is_other).eq(after.iter().filter(is_other)), "the other kind stays");
    assert!(before.len() - after.len() > 80, "{} of {}", after.len(), before.len());
    assert!(!after.iter().any(|plant| plant.kind == 0 && plant.at.x.hypot(plant.at.z) < radius - 3.0));
}

#[test]
fn a_kind_without_density_leaves_the_others_where_they_are() {
    let kinds = |density| vec![kind(1.0, 0.3), kind(1.0, 0.3), kind(1.0, 0.3), kind(2.5, density)];
    let all = all_plants(&unmapped(&entry(kinds(0.5), 100.0)), 100.0);
    let fewer = all_plants(&unmapped(&entry(kinds(0.0), 100.0)), 100.0);
    assert!(all.iter().filter(|plant| plant.kind != 3).eq(&fewer));
    let map = || Some(Map::new([1, 1], vec![0]).unwrap());
    let without = entry(kinds(0.5), 100.0).patch(vec![None, map(), None, None], None).unwrap();
    assert!(all.iter().filter(|plant| plant.kind != 1).eq(&all_plants(&without, 100.0)));
}

#[test]
fn plants_keep_their_distances_across_the_borders_of_tiles() {
    let kinds = vec![
        PlantKind { keeps_away: 3.0, jitter: 0.3, ..kind(8.0, 0.8) },
        PlantKind { keeps_away: 1.0, jitter: 0.25, ..kind(2.0, 0.7) },
        PlantKind { jitter: 0.2, ..kind(0.5, 0.9) },
    ];
    let side = 48.0;
    let plants = all_plants(&unmapped(&PatchEntry { cells: 8, ..entry(kinds.clone(), side) }), side);
    assert!(plants.len() > 1000);
    for (i, a) in plants.iter().enumerate() {
        for b in &plants[..i] {
            let apart = (a.at.x - b.at.x).hypot(a.at.z - b.at.z);
            let (a, b) = (&kinds[usize::from(a.kind)], &kinds[usize::from(b.kind)]);
            let least = match a.spacing == b.spacing {
                true => a.spacing.each()[0] * f64::from(1.0 - 2.0 * a.jitter),
                false => a.keeps_away.max(b.keeps_away),
            };
            assert!(apart >= least - 1e-9, "{apart} of {least}");
        }
    }
    // The same plants, whatever the tiles.
    let other = all_plants(&unmapped(&PatchEntry { cells: 31, ..entry(kinds, side) }), side);
    let sorted = |mut plants: Vec<PatchPlant>| {
        plants.sort_by_key(|plant| (plant.kind, plant.seed));
        plants
    };
    assert_eq!(sorted(plants), sorted(other));
}

#[test]
fn density_is_the_same_at_the_borders_of_tiles_as_inside() {
    let patch = unmapped(&PatchEntry { cells: 16, ..entry(vec![kind(1.0, 0.5)], 800.0) });
    let plants = all_plants(&patch, 800.0);
    let is_near = |plant: &&PatchPlant| {
        let from_border = |at: f64| ((at + 400.0) / 16.0).fract() * 16.0;
        [plant.at.x, plant.at.z].into_iter().map(from_border).any(|at| !(1.0..15.0).contains(&at))
    };
    let near = plants.iter().filter(is_near).count() as f64;
    let (share, expected) = (near / plants.len() as f64, 1.0 - (14.0 / 16.0_f64).powi(2));
    assert!((share / expected - 1.0).abs() < 0.02, "{share} of {expected}");
}

#[test]
fn thinning_by_rank_is_a_prefix_and_evenly_spread_with_blue_noise() {
    let spread = |placing| {
        let patch = unmapped(&PatchEntry { placing, ..entry(vec![kind(1.0, 0.8)], 256.0) });
        let plants = all_plants(&patch, 256.0);
        let kept: Vec<&PatchPlant> = plants.iter().filter(|plant| plant.rank < 1 << 14).collect();
        let share = kept.len() as f64 / plants.len() as f64;
        assert!((share - 0.25).abs() < 0.01, "{placing:?}: {share}");
        // Variance of the numbers in squares of 16 x 16, over that of random points.
        let mut counts = [0.0_f64; 256];
        for plant in &kept {
            let square = |at: f64| ((at + 128.0) / 16.0) as usize;
            counts[square(plant.at.z) * 16 + square(plant.at.x)] += 1.0;
        }
        let mean = kept.len() as f64 / 256.0;
        counts.iter().map(|count| (count - mean).powi(2)).sum::<f64>() / 256.0 / mean
    };
    let (random, even) = (spread(Placing::Jitter), spread(Placing::BlueNoise));
    assert!(even < 0.3 * random, "{even} against {random}");
}

#[test]
fn slopes_and_altitudes_bound_what_grows() {
    // A ramp that rises by 45 degrees in its right half.
    let heights = (0..128).map(|x| if x < 64 { 0 } else { (x - 64) * 1000 }).map(|height| height as u16).collect();
    let ground = HeightMap::new(Map::new([128, 1], heights).unwrap(), [-64.0; 2], [128.0; 2], [0.0, 65.535]).unwrap();
    let kinds = vec![
        PlantKind { slope: [0.0, 30.0], ..kind(1.0, 0.5) },
        PlantKind { slope: [30.0, 90.0], altitude: [10.0, 20.0], ..kind(1.0, 0.5) },
    ];
    let entry = entry(kinds, 128.0);
    let plants = all_plants(&entry.patch(vec![None; 2], Some(ground.clone())).unwrap(), 128.0);
    assert!(plants.iter().all(|plant| plant.at.y == ground.height([plant.at.x, plant.at.z])));
    // Half a texel from the ramp's upper end it is flat again.
    assert!(plants.iter().filter(|plant| plant.kind == 0).all(|plant| plant.at.x < 2.0 || plant.at.x > 62.0));
    assert!(plants.iter().filter(|plant| plant.kind == 1).all(|plant| (10.0..=20.0).contains(&plant.at.y)));
    assert!([0, 1].iter().all(|&number| plants.iter().filter(|plant| plant.kind == number).count() > 400));
}

#[test]
fn tiles_follow_the_eye_within_their_bounds() {
    let kinds =
        vec![PlantKind { reach: Some(60.0), ..kind(4.0, 0.5) }, PlantKind { reach: Some(15.0), ..kind(0.5, 0.5) }];
    let patch = unmapped(&PatchEntry { area: None, cells: 8, ..PatchEntry::new(kinds) });
    let options = TileOptions { most_tiles: 400, cells_per_update: 512 };
    let mut tiles = Tiles::new(patch.clone(), options);
    tiles.complete(DVec3::ZERO);
    for step in 0..2000 {
        let eye = DVec3::new(f64::from(step) * 0.17, 2.0, f64::from(step) * -0.05);
        let counts = tiles.update(eye);
        assert!(counts.made <= 8 && counts.kept <= 400 && counts.over == 0, "{counts:?}");
        let near = tiles.tiles().iter().filter(|tile| tile.key.layer == 1).flat_map(|tile| &tile.plants);
        assert!(near.clone().count() > 900);
    }
    // The same plants as without the walk.
    let eye = DVec3::new(340.0, 0.0, -100.0);
    tiles.complete(eye);
    let mut fresh = Tiles::new(patch.clone(), options);
    fresh.complete(eye);
    for tile in fresh.tiles() {
        let walked = tiles.tiles().iter().find(|other| other.key == tile.key).unwrap();
        assert_eq!(walked.plants, tile.plants);
        assert_eq!(plants_of(&patch, &[tile.key]), tile.plants);
    }
    assert_eq!(tiles.update(DVec3::NAN).made, 0);
}

#[test]
fn too_many_tiles_are_counted_and_the_nearest_are_kept() {
    let patch = unmapped(&PatchEntry {
        area: None,
        cells: 8,
        ..PatchEntry::new(vec![PlantKind { reach: Some(500.0), ..kind(1.0, 0.5) }])
    });
    let mut tiles = Tiles::new(patch, TileOptions { most_tiles: 50, cells_per_update: 1024 });
    tiles.complete(DVec3::ZERO);
    let counts = tiles.update(DVec3::ZERO);
    assert!(counts.kept == 50 && counts.over > 0, "{counts:?}");
    assert!(tiles.tiles().iter().all(|tile| tile.key.at.iter().all(|at| (-6..6).contains(at))));
    tiles.complete(DVec3::new(800.0, 0.0, 0.0));
    assert!(
        tiles.tiles().iter().all(|tile| (90..110).contains(&tile.key.at[0])),
        "the nearest have replaced the others"
    );
}

#[test]
fn a_warm_walk_does_not_allocate_and_its_memory_is_bounded() {
    let kinds =
        vec![PlantKind { reach: Some(40.0), ..kind(2.0, 0.5) }, PlantKind { reach: Some(10.0), ..kind(0.5, 0.7) }];
    let patch = unmapped(&PatchEntry { area: None, cells: 8, ..PatchEntry::new(kinds) });
    let mut tiles = Tiles::new(patch, TileOptions { most_tiles: 300, cells_per_update: 1024 });
    let eye = |step: u32| DVec3::new(f64::from(step) * 0.17, 0.0, f64::from(step % 100) * 0.1);
    let mut walk = |steps: std::ops::Range<u32>| {
        for step in steps {
            tiles.update(eye(step));
        }
    };
    walk(0..3000);
    let allocated = allocation_counter::measure(|| walk(3000..6000));
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn a_million_tiles_are_visited_in_the_memory_of_those_within_reach() {
    let kinds = vec![PlantKind { reach: Some(20.0), ..kind(1.0, 0.7) }];
    let patch = unmapped(&PatchEntry { area: None, cells: 1, ..PatchEntry::new(kinds) });
    let mut tiles = Tiles::new(patch, TileOptions { most_tiles: 2000, cells_per_update: 4096 });
    let mut made = 0;
    let mut walk = |steps: std::ops::Range<u32>| {
        for step in steps {
            let counts = tiles.update(DVec3::new(f64::from(step), 0.0, f64::from(step) * 0.5));
            assert!(counts.kept <= 2000 && counts.over == 0, "{counts:?}");
            made += counts.made;
        }
    };
    walk(0..1000);
    let allocated = allocation_counter::measure(|| walk(1000..22_000));
    assert_eq!(allocated.count_total, 0);
    assert!(made > 1_000_000, "{made} tiles");
}

#[test]
fn far_away_fast_and_odd_eyes_are_survived() {
    let patch = unmapped(&PatchEntry {
        area: None,
        cells: 8,
        ..PatchEntry::new(vec![PlantKind { reach: Some(20.0), ..kind(1.0, 0.5) }])
    });
    let mut tiles = Tiles::new(patch, TileOptions { most_tiles: 100, cells_per_update: 256 });
    for eye in [1e7, -1e7, 3e9, -1e300, 1e300].map(|at| DVec3::new(at, 0.0, -at)) {
        for _ in 0..40 {
            assert!(tiles.update(eye).made <= 4);
        }
        let is_near = |plant: &PatchPlant| (plant.at.x - eye.x).abs() < 60.0;
        assert!(tiles.tiles().iter().flat_map(|tile| &tile.plants).all(is_near));
    }
    // Faster than tiles can be made: nothing piles up.
    for step in 0..500 {
        let counts = tiles.update(DVec3::new(f64::from(step) * 100.0, 0.0, 0.0));
        assert!(counts.kept <= 100 && counts.pending > 0, "{counts:?}");
    }
    // On the corner of four tiles.
    tiles.complete(DVec3::new(80.0, 0.0, 160.0));
    assert!(tiles.tiles().len() >= 4);
}

#[test]
fn repainting_makes_the_tiles_that_it_touches_anew() {
    let entry = PatchEntry { cells: 8, ..entry(vec![PlantKind { reach: Some(100.0), ..kind(1.0, 0.5) }], 64.0) };
    let map = Map::new([64, 64], vec![65535; 64 * 64]).unwrap();
    let mut tiles = Tiles::new(entry.patch(vec![Some(map)], None).unwrap(), TileOptions::default());
    tiles.complete(DVec3::ZERO);
    let all = tiles.tiles().len();
    tiles.repaint([-3.0, -3.0], [-1.0, -1.0], |patch| {
        let texels = patch.map_mut(0).unwrap().texels_mut();
        (29..31).for_each(|z| texels[z * 64 + 29..z * 64 + 31].fill(0));
    });
    assert_eq!(all - tiles.tiles().len(), 4);
    let counts = tiles.complete(DVec3::ZERO);
    assert_eq!(counts.made, 4);
    let plants = tiles.tiles().iter().flat_map(|tile| &tile.plants);
    let mut in_hole = plants.filter(|plant| (plant.at.x + 2.0).abs() < 0.5 && (plant.at.z + 2.0).abs() < 0.5);
    assert!(in_hole.next().is_none());
}

#[test]
fn odd_maps_and_spacings_are_honoured_or_refused() {
    let black = Map::new([1, 1], vec![0]).unwrap();
    let one = entry(vec![kind(1.0, 1.0)], 10.0);
    assert!(all_plants(&one.patch(vec![Some(black)], None).unwrap(), 10.0).is_empty());
    let wide = Map::new([300, 2], vec![65535; 600]).unwrap();
    assert_eq!(all_plants(&one.patch(vec![Some(wide)], None).unwrap(), 10.0).len(), 100);
    // A spacing larger than the area: at most one plant, and it lies inside.
    let sparse = all_plants(&unmapped(&entry(vec![kind(40.0, 1.0)], 10.0)), 10.0);
    assert!(sparse.len() <= 1 && sparse.iter().all(|plant| plant.at.x.abs() <= 5.0));
    for (spacing, what) in [(0.0, "spacing"), (-1.0, "spacing"), (f64::NAN, "spacing")] {
        let error = entry(vec![kind(spacing, 1.0)], 10.0).patch(vec![None], None).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    let endless = PatchEntry { area: None, ..one.clone() };
    assert!(endless.patch(vec![Some(Map::new([1, 1], vec![1]).unwrap())], None).is_err());
    assert!(one.patch(vec![], None).is_err());
    let mut mapped = endless;
    mapped.kinds[0].map = Some("map.png".into());
    assert!(mapped.check(str::to_owned).unwrap_err().to_string().contains("area"));
}

/// Five kinds as in the sample: two grasses, a bush, and two trees with a map of their own.
const FIVE_KINDS: &str = "
; A patch of five kinds.
[Foliage_DX11]
material = MeadowAndTrees
HeightTexture = hills.dds
widthInPlants = 128
heightInPlants = 128
widthInPatches = 8
heightInPatches = 8
heightScale = 300.0   ; feet
heightOffset = -20
heightTextureWorldWidth = 3100
heightTextureWorldHeight = 3100
worldWidth = 3072
worldHeight = 3072
wind = 3

[plant 1]
billboardColorTexture = grass_color.dds
billboardProbabilityTexture = meadow.dds
farFadeStart = 400
farFadeEnd = 700
sizeMin = 1
sizeMax = 2
plantSpacingWidth = 3
plantSpacingHeight = 3

[plant 2]
billboardColorTexture = flower.dds
farFadeStart = 400
farFadeEnd = 900
plantSpacingWidth = 9
plantSpacingHeight = 9
WIDTHRATIOMAX = 1.5

[plant 3]
billboardColorTexture = bush.dds
billboardProbabilityTexture = $Undefined
plantSpacingWidth = 20
plantSpacingHeight = 25
positionRandomScale = 0.25
glitter = yes

[plant 4]
assetSet = elm.set
billboardColorTexture = elm.dds
billboardProbabilityTexture = trees.dds
3DFarClipDistance = 400
nearFadeStart = 200
nearFadeEnd = 100
farFadeStart = 2000
farFadeEnd = 8000
sizeMin = 27
sizeMax = 27
widthRatioMin = 1
plantSpacingWidth = 37
plantSpacingHeight = 37
offsetX = -1

[plant 5]
assetSet = beech.set
billboardProbabilityTexture = trees.dds
sizeMin = 29.5
sizeMax = 31
widthRatioMin = 1
plantSpacingWidth = 43
plantSpacingHeight = 43
";

#[test]
fn fol_files_are_read_with_their_units_and_unknown_keys_are_told_with_their_lines() {
    let fol = FolFile::parse(FIVE_KINDS, Path::new("five.fol"), FOOT).unwrap();
    let names: Vec<&str> = fol.entry.kinds.iter().map(|kind| &kind.model[..]).collect();
    assert_eq!(names, ["grass_color", "flower", "bush", "elm", "beech"]);
    let feet =
        |value: f64, expected: f64| assert!((value - expected * FOOT).abs() < 1e-5, "{value} for {expected} feet");
    feet(fol.entry.area.unwrap()[0], 8.0 * 128.0 * 3.0);
    feet(fol.ground.heights[1], 280.0);
    feet(fol.entry.kinds[2].spacing.each()[1], 25.0);
    feet(f64::from(fol.entry.kinds[4].height[1]), 31.0);
    feet(fol.entry.kinds[0].reach(), 700.0);
    feet(fol.plants[3].near_fade.unwrap()[0], 200.0);
    assert_eq!(fol.entry.kinds[1].ratio, [0.5, 1.5]);
    assert_eq!(fol.ground.texture.as_deref(), Some("hills.dds"));
    assert_eq!(fol.plants[3].textures[2].as_deref(), Some("trees.dds"));
    assert_eq!(
        (&fol.plants[2].textures[2], &fol.plants[2].far_fade, &fol.plants[4].textures[0]),
        (&None, &None, &None)
    );
    let line = |text: &str| 1 + FIVE_KINDS.lines().position(|line| line == text).unwrap();
    let told = |key: &str, text: &str| format!("line {}: {key:?} is left out", line(text));
    assert_eq!(fol.warnings.len(), 2, "{:?}", fol.warnings);
    assert!(fol.warnings.iter().any(|warning| warning.starts_with(&told("wind", "wind = 3"))));
    assert!(fol.warnings.iter().any(|warning| warning.starts_with(&told("glitter", "glitter = yes"))));
    // It grows.
    let patch = unmapped(&fol.entry);
    assert_eq!(patch.layers(), 5);
    assert!((0..5).all(|layer| !plants_of(&patch, &keys(&patch, layer, fol.entry.area.unwrap()[0])[..1]).is_empty()));
    assert_eq!(fol.entry.kinds[2].spacing, Spacing::Each([20.0 * FOOT, 25.0 * FOOT]));
}

#[test]
fn broken_fol_files_are_refused_with_the_line() {
    for (text, told) in [
        ("[plant 1]\n", "no block [Foliage_DX11]"),
        ("[Foliage_DX11]\n", "no block [plant 1]"),
        ("[Foliage_DX11]\n\nwidthInPlants = many\n", "line 3: widthInPlants is \"many\""),
        ("[Foliage_DX11]\n[plant 1]\nsizeMin = nan\n", "line 3: sizeMin is \"nan\""),
        ("[Foliage_DX11]\nwhat is this\n", "line 2 is \"what is this\""),
        (
            "[Foliage_DX11]\n[plant 1]\nplantSpacingWidth = 0\n",
            "[plant 1] plantSpacingWidth or plantSpacingHeight is 0",
        ),
        ("[Foliage_DX11]\n[plant 1]\nsizeMin = 9\nsizeMax = 3\n", "[plant 1] sizeMin or sizeMax is"),
    ] {
        let error = FolFile::parse(text, Path::new("x.fol"), 1.0).unwrap_err().to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
    let fol = FolFile::parse("a = 1\n[Foliage_DX11]\n[plant 1]\n[plant 3]\n", Path::new("x.fol"), 1.0).unwrap();
    assert_eq!(fol.entry.kinds.len(), 1);
    assert!(fol.warnings.iter().any(|warning| warning.contains("[plant 3]")), "{:?}", fol.warnings);
    assert!(fol.warnings.iter().any(|warning| warning.starts_with("line 1")), "{:?}", fol.warnings);
}
