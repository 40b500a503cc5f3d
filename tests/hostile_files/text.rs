//! Species and scenes.

use super::survive_reading;
use crate::mutate::{Random, damage_text};
use foliage_lod::grow::Species;
use std::path::Path;

pub const SPECIES: [&str; 3] = [
    include_str!("../../data/species/english-oak.toml"),
    include_str!("../../data/species/carya-illinoinensis.toml"),
    include_str!("../../data/species/betula-populifolia.toml"),
];
const SPECIES_WORDS: &str = "= [leaf] [[levels]] # \" ''' \"🌳\nä\" ä true [0,300,-1] { 0x7fffffffffffffff 180.0 \"flame\" \
    1979-05-27T07:32:00Z levels";

#[test]
fn damaged_species_are_refused_or_sound() {
    let make = |random: &mut Random| damage_text(random.pick(&SPECIES), SPECIES_WORDS, random);
    survive_reading("species", &["accepted", "unreadable"], make, |text| {
        let species = Species::from_toml(&String::from_utf8_lossy(text), Path::new("hostile.toml"))?;
        species.validate().expect("an accepted species is valid");
        Ok(())
    });
}

#[cfg(feature = "scene")]
const SCENES: [&str; 5] = [
    include_str!("../../data/scenes/turntable.toml"),
    include_str!("../../data/scenes/nine-trees.toml"),
    include_str!("../../data/scenes/forest.toml"),
    include_str!("../../data/scenes/meadow.toml"),
    include_str!("../../data/scenes/landscape.toml"),
];
#[cfg(feature = "scene")]
const SCENE_WORDS: &str = "= [lod] [effects.wind] [[plants]] [[scatter]] [[patch]] [[patch.kinds]] keeps_away spacing # \" ''' \"oak\\n\" ä true false [0,1e300,-1] nan inf \
    99999999999 [ground] heights = \"a.png\" relief = 3 above_ground = true policy = \"sizes\" shares = [[1,1]] [camera] path eye = [0,0,0]";

#[cfg(feature = "scene")]
#[test]
fn damaged_scenes_are_refused_or_place_their_plants() {
    use foliage_lod::{
        scene::{
            SceneFile,
            patch::{Scratch, TileKey},
        },
        terrain::HeightMap,
    };
    let make = |random: &mut Random| damage_text(random.pick(&SCENES), SCENE_WORDS, random);
    survive_reading("scenes", &["accepted", "unreadable"], make, |text| {
        let scene = SceneFile::from_toml(&String::from_utf8_lossy(text), Path::new("hostile.toml"))?;
        scene.effects.check().expect("accepted effects are in range");
        for seconds in [-1e300, 0.0, 7.5, 1e300] {
            let level = HeightMap::level(5.0).expect("a small height");
            let look = scene.look_at(seconds, 1.0, 0.1, Some(&level));
            let is_finite = look.is_none_or(|look| look.eye.is_finite() && look.target.is_finite());
            assert!(is_finite, "{seconds}: {look:?}");
        }
        for scatter in scene.scatter.iter().filter(|scatter| scatter.count <= 2000) {
            // Too many plants for the area is an error; placed plants have a finite transform.
            let spots = scatter.spots().unwrap_or_default();
            assert!(spots.iter().all(|spot| spot.at.is_finite() && spot.scale > 0.0 && spot.turn.is_finite()));
        }
        for patch in scene.patch.iter().filter(|patch| patch.cells <= 128) {
            let made = patch.patch(vec![None; patch.kinds.len()], None).expect("accepted patches grow");
            let mut plants = Vec::new();
            for layer in 0..made.layers() as u16 {
                made.tile(TileKey { layer, at: [0, 0] }, &mut Scratch::default(), &mut plants);
                assert!(
                    plants.iter().all(|plant| plant.at.is_finite() && plant.height > 0.0 && plant.turn.is_finite())
                );
            }
        }
        Ok(())
    });
}
