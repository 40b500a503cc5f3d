//! Scene files: values read, positions of plants and cameras, and error messages.
#![cfg(feature = "scene")]

use foliage_lod::{
    FoliageModel,
    effects::{FadeBy, FadeRule},
    leaf::Vertex,
    scene::{Policy, SceneFile},
    terrain::{HeightMap, Map},
};
use glam::DVec3;
use std::path::Path;

const SMALL: &str = r#"
[[models]]
name = "oak"
species = "english-oak"

[[plants]]
model = "oak"
"#;

fn read(text: &str) -> Result<SceneFile, String> {
    SceneFile::from_toml(text, Path::new("a.toml")).map_err(|error| error.to_string())
}

#[test]
fn the_samples_are_read_and_hold_what_they_say() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes");
    let sample = |name: &str| SceneFile::read(samples.join(name)).unwrap();
    let [turntable, nine, forest] = ["turntable.toml", "nine-trees.toml", "forest.toml"].map(sample);
    assert_eq!((turntable.plants.len(), nine.plants.len()), (1, 9));
    assert_eq!(forest.plants.len() + forest.scatter[0].spots().unwrap().len(), 1000);
    let meadow = SceneFile::read("data/scenes/meadow.toml").unwrap();
    assert_eq!(meadow.patch.iter().map(|patch| patch.kinds.len()).sum::<usize>(), 6);
    assert!(turntable.effects.wind.is_some() && nine.effects == Default::default());
    let fade = forest.effects.fade.unwrap();
    assert_eq!((fade.by, fade.rule, forest.effects.contrast), (FadeBy::Size, FadeRule::Window, None));
    let quarter = turntable.look_at(3.0, 1.0, 0.1, None).unwrap();
    assert!((quarter.eye - DVec3::new(22.0, 9.5, 0.0)).length() < 1e-9, "{quarter:?}");
}

#[test]
fn a_camera_goes_from_station_to_station_and_stays_at_the_ends() {
    let path = r#"
[camera]
[[camera.path]]
seconds = 1
eye = [0, 0, 0]
target = [1, 0, 0]
[[camera.path]]
seconds = 3
eye = [4, 0, 0]
target = [5, 0, 0]
"#;
    let scene = read(&format!("{SMALL}{path}")).unwrap();
    let eye = |seconds| scene.look_at(seconds, 1.0, 0.1, None).unwrap().eye.x;
    assert_eq!([-5.0, 1.0, 1.5, 2.0, 3.0, 1e9].map(eye), [0.0, 0.0, 1.0, 2.0, 4.0, 4.0]);
    assert_eq!(read(SMALL).unwrap().look_at(0.0, 1.0, 0.1, None), None);
}

#[test]
fn switches_are_true_false_or_a_table() {
    let effects = |text: &str| read(&format!("{SMALL}[effects]\n{text}")).map(|scene| scene.effects);
    assert_eq!(effects("wind = true").unwrap().wind, Some(Default::default()));
    assert_eq!(effects("wind = false").unwrap().wind, None);
    assert_eq!(effects("wind = { strength = 0.05 }").unwrap().wind.unwrap().strength, 0.05);
    let error = effects("wind = 3").unwrap_err();
    assert!(error.contains("line 9") && error.contains("true, false or a table"), "{error}");
}

#[test]
fn errors_in_a_scene_name_line_key_and_allowed_values() {
    let cases = [
        ("[effects]\nwined = true", "line 9: unknown field `wined`", "`wind`"),
        ("[effects.wind]\nstrength = 7", "line 9: effects.wind.strength is 7", "from 0 to 0.1"),
        ("[effects.fade]\nrule = \"slow\"", "line 9: unknown variant `slow`", "`trailing`"),
        ("[lod]\npolicy = \"cook\"\nnear = 3", "line 10: lod.near is 3", "cook does not use it"),
        ("[lod]\nhalf_area = 0.4", "line 9: lod.half_area is 0.4", "blend does not use it"),
        ("[lod]\nwood_error = -0.5", "line 9: lod.wood_error is -0.5", "from 0 to"),
        (
            "[lod]\npolicy = \"sizes\"\nshares = [[50, 0.1], [20, 0.3]]",
            "line 10: lod.shares is",
            "an increasing diameter",
        ),
        ("[lod]\nshares = [[50, 0.1]]", "line 9: lod.shares is", "with the policy sizes"),
        ("[sun]\nelevation = 100", "line 9: sun.elevation is 100", "from -5 to 90"),
        ("[sun]\nelevation = nan", "line 9: sun.elevation is NaN", "from -5 to 90"),
        ("[[plants]]\nmodel = \"elm\"", "line 9: plants.1.model is elm", "[\"oak\"]"),
        ("[[models]]\nname = \"oak\"\nfile = \"b.vds\"", "line 9: models.1.name is oak", "no other model has"),
        ("[[models]]\nname = \"elm\"", "models.1.name is elm, with 0 sources", "one of file and species"),
        ("[camera]\nfov = 50", "camera is placed by 0 keys", "one of eye, orbit and path"),
        ("[camera]\neye = [0, 0, 1]\nfov = 180", "line 10: camera.fov is 180", "from 1 to 170"),
        ("[[scatter]]\nmodels = [\"oak\"]\ncount = 4000000\narea = [1, 1]", "plants is 4000001", "at most 1000000"),
        ("[[patch]]\nkinds = []", "line 9: patch.0.kinds is 0", "from 1 to 4096"),
        (
            "[[patch]]\n[[patch.kinds]]\nmodel = \"elm\"\nspacing = 1\nheight = [1, 2]",
            "line 10: patch.0.kinds.0.model is elm",
            "[\"oak\"]",
        ),
        (
            "[[patch]]\n[[patch.kinds]]\nmodel = \"oak\"\nspacing = [1, 0]\nheight = [1, 2]",
            "line 11: patch.0.kinds.0.spacing is 0",
            "from 0.001",
        ),
        (
            "[[patch]]\n[[patch.kinds]]\nmodel = \"oak\"\nspacing = 1\nheight = [1, 2]\nmap = \"a.png\"",
            "patch.0.kinds.0.map is given without an area",
            "`area`",
        ),
        (
            "[[patch]]\n[[patch.kinds]]\nmodel = \"oak\"\nspacing = 1\nheight = [1, 2]\ntint = [[1, 1, 1], [1, 17, 1]]",
            "line 13: patch.0.kinds.0.tint is 17",
            "from 0 to 16",
        ),
        ("[ground]\nheights = \"h.png\"\narea = [1, 1]", "line 8: ground.relief is missing", "given with `heights`"),
        ("[ground]\nrelief = 3", "line 9: ground.relief is given", "given with `heights`"),
        ("[ground]\ncolors = \"c.png\"", "line 8: ground.area is missing", "given with `heights` or `colors`"),
        ("[ground]\narea = [0, 1]", "line 9: ground.area is 0", "from 0.001"),
        (
            "[[patch]]\n[[patch.kinds]]\nmodel = \"oak\"\nspacing = 1\nheight = [1, 2]\nblends = true",
            "line 13: patch.0.kinds.0.blends is true without a ground",
            "[ground]",
        ),
        ("[[scatter]]\nmodels = []\ncount = 1\narea = [1, 1]", "line 9: scatter.0.models is empty", "oak"),
    ];
    for (added, what, allowed) in cases {
        let error = read(&format!("{SMALL}{added}")).unwrap_err();
        assert!(error.starts_with("a.toml: ") && error.contains(what) && error.contains(allowed), "{added}\n{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    assert!(read("").unwrap_err().contains("missing field `models`"));
    assert!(read("models = []").unwrap_err().contains("models is empty"));
}

#[test]
fn numbers_of_a_rule_reach_the_rule() {
    let scene = read(&format!("{SMALL}[lod]\nwood_error = 2")).unwrap();
    assert_eq!((scene.lod.policy, scene.lod.wood_error), (Policy::Blend, Some(2.0)));
    let scene = read(&format!("{SMALL}[lod]\npolicy = \"cook\"\nstart = 5\nhalf_area = 0.25")).unwrap();
    assert_eq!((scene.lod.policy, scene.lod.start, scene.lod.half_area), (Policy::Cook, Some(5.0), Some(0.25)));
}

#[test]
fn plants_and_walkers_stand_on_the_ground() {
    let map = Map::new([2, 1], vec![0, 65535]).unwrap();
    let ground = HeightMap::new(map, [0.0; 2], [40.0, 40.0], [5.0, 25.0]).unwrap();
    let text = "[[models]]\nname = \"oak\"\nspecies = \"english-oak\"\n[[plants]]\nmodel = \"oak\"\nat = [20, 0.5, 3]\n\
        [camera]\neye = [10, 1.7, 0]\ntarget = [30, 1, 0]\n";
    let [fixed, walking] = [text.to_owned(), format!("{text}above_ground = true")].map(|text| read(&text).unwrap());
    let eyes = |ground| [&fixed, &walking].map(|scene| scene.look_at(0.0, 1.0, 0.1, ground).unwrap());
    let heights = |ground| eyes(ground).map(|look| [look.eye.y, look.target.y]);
    assert_eq!(heights(Some(&ground)), [[1.7, 1.0], [6.7, 26.0]]);
    assert_eq!(heights(None), [[1.7, 1.0]; 2]);
    let mut model = FoliageModel::default();
    let vertex = |y| Vertex { position: [0.0, y, 0.0], normal: [1.0, 0.0, 0.0], uv: [0.0; 2], color: [1.0; 4] };
    model.plant.wood.vertices = vec![vertex(0.0), vertex(3.0)];
    let y = |ground| fixed.planted(std::slice::from_ref(&model), ground).unwrap()[0].world_from_plant.translation.y;
    assert_eq!(y(Some(&ground)) - y(None), 15.0);
}
