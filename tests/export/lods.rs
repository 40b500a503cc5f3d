//! Levels: in one file, as crossed cards, with leaves that repeat their picture, with smaller
//! textures, and with names that are no words.

use super::{EXACT, glb::Gltf, grown};
use foliage_lod::{
    FoliageModel, LookAt, Plant,
    bounds::Aabb,
    export::{FAR_PX, GlbOptions, Level, far_cards, resized, write_continuous, write_level, write_lods},
    glam::{DVec3, Vec3},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    material::{AlphaMode, Texture, TextureFormat},
    model::Growth,
    simplify::{CpuFragments, GrowBy, Quiet, SimplifyOptions, simplify},
    software::{Background, BakeOptions, DrawOptions, Image, bake, draw_model, draw_plant, mean_color},
};
use serde_json::Value;

fn options() -> DrawOptions {
    DrawOptions { background: Background::Transparent, ..DrawOptions::default() }
}

pub fn cards(model: &FoliageModel) -> Plant {
    let options = BakeOptions { across: 4, frame_px: 128, is_whole_sphere: false };
    far_cards(model, &bake(model, &options, &mut |_| true).unwrap()).unwrap()
}

/// Pictures of a plant that is `diameter_px` large, from directions that no card was fitted to.
fn views(model: &FoliageModel, diameter_px: u32, draw: impl Fn(&foliage_lod::Camera, [u32; 2]) -> Image) -> Vec<Image> {
    let turns = (0..5).map(|view| 0.9 + 1.3 * f64::from(view));
    let directions = turns.map(|turn| DVec3::new(turn.sin(), 0.2, turn.cos()));
    directions
        .map(|towards| draw(&LookAt::framing(&model.sphere(), towards, 0.3, 1.0).camera(diameter_px), [diameter_px; 2]))
        .collect()
}

fn alphas(images: &[Image]) -> impl Iterator<Item = f64> + '_ {
    images.iter().flat_map(|image| image.rgba.iter().skip(3).step_by(4)).map(|&alpha| f64::from(alpha) / 255.0)
}

#[test]
fn cards_stand_where_the_plant_stands_cover_as_much_and_have_its_colours() {
    let sparse = grown("betula-populifolia", 300);
    for model in [grown("english-oak", 3000), sparse] {
        let cards = cards(&model);
        cards.validate().unwrap();
        let around =
            |plant: &Plant| Aabb::of_points(plant.vertices.iter().chain(&plant.wood.vertices).map(|v| v.position));
        let (own, found) = (around(&model.to_plant()), around(&cards));
        let [low, high] = [Vec3::from(own.min) - Vec3::from(found.min), Vec3::from(own.max) - Vec3::from(found.max)];
        // Four texels, but for thin twigs and for what no card shows from its side.
        let near = 0.06 * model.sphere().radius as f32;
        assert!(low.y.abs() < near && high.y.abs() < 2.0 * near, "{}: {low} {high}", model.name);
        assert!(low.abs().max_element() < 4.0 * near && high.abs().max_element() < 4.0 * near, "{low} {high}");
        for diameter_px in [FAR_PX as u32, 24] {
            let plant = views(&model, diameter_px, |camera, size| {
                draw_model(&model, model.leaves.len(), camera, size, &options()).unwrap()
            });
            let shown =
                views(&model, diameter_px, |camera, size| draw_plant(&cards, camera, size, &options()).unwrap());
            let ratio = alphas(&shown).sum::<f64>() / alphas(&plant).sum::<f64>();
            let differing = alphas(&shown).zip(alphas(&plant)).map(|(a, b)| (a - b).abs()).sum::<f64>();
            let differing = differing / alphas(&plant).sum::<f64>();
            let colors = [&plant, &shown].map(|images| Vec3::from(mean_color(images)));
            println!("{}, {diameter_px} px: {ratio:.3} covered, {differing:.3} differing, {colors:?}", model.name);
            assert!((ratio - 1.0).abs() < 0.12 && differing < 0.5, "{ratio} {differing}");
            assert!((colors[0] / colors[1] - 1.0).abs().max_element() < 0.35, "{colors:?}");
        }
    }
}

#[test]
fn one_file_shows_its_first_level_and_names_the_others() {
    let model = grown("betula-populifolia", 500);
    let mut levels: Vec<Plant> = [1.0, 0.3, 0.1].map(|lod| Level::new(&model, lod).unwrap().plant).into();
    levels.push(cards(&model));
    let plants: Vec<&Plant> = levels.iter().collect();
    for options in [EXACT, GlbOptions { z_up: true, ..GlbOptions::default() }] {
        let bytes = write_lods(&plants, &[0.3, 0.1, 0.05, 0.0], &options).unwrap();
        assert_eq!(bytes, write_lods(&plants, &[0.3, 0.1, 0.05, 0.0], &options).unwrap());
        let Gltf { json, .. } = Gltf::of(&bytes);
        let first = &json["nodes"][0];
        assert_eq!(json["scenes"], serde_json::json!([{ "nodes": [0] }]));
        assert_eq!(first["extensions"]["MSFT_lod"]["ids"], serde_json::json!([1, 2, 3]));
        assert_eq!(first["extras"]["MSFT_screencoverage"].as_array().unwrap().len(), 4);
        assert!(json["extensionsUsed"].as_array().unwrap().contains(&"MSFT_lod".into()));
        assert!(json["extensionsRequired"].as_array().is_none_or(|all| !all.contains(&"MSFT_lod".into())));
        for (node, plant) in json["nodes"].as_array().unwrap().iter().zip(&plants) {
            let mesh = &json["meshes"][node["mesh"].as_u64().unwrap() as usize];
            let indices = |part: &Value| {
                let accessor = &json["accessors"][part["indices"].as_u64().unwrap() as usize];
                accessor["count"].as_u64().unwrap() as usize
            };
            let count: usize = mesh["primitives"].as_array().unwrap().iter().map(indices).sum();
            assert_eq!(count, plant.indices.len() + plant.wood.indices.len());
        }
        // The plant's textures, and the cards' own.
        assert_eq!(json["images"].as_array().unwrap().len(), model.textures.len() + 1);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lods.glb");
        std::fs::write(&path, &bytes).unwrap();
        let back = load(&path, &ImportOptions::default()).unwrap().plant;
        assert_eq!((back.leaves.len(), back.wood.triangles()), (model.leaves.len(), model.wood.triangles()));
        let separate: usize = plants.iter().map(|plant| write_level(plant, &options).unwrap().len()).sum();
        assert!(bytes.len() < separate, "{} {separate}", bytes.len());
    }
}

#[test]
fn leaves_that_repeat_their_picture_do_so_in_levels() {
    let species = Species::embedded("english-oak").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(1500), ..GrowOptions::default() }).unwrap();
    let simplified =
        SimplifyOptions { resolution: 64, grow_by: GrowBy::Tile, tone: false, ..SimplifyOptions::balanced() };
    let mut model = simplify(&plant, &simplified, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    model.plant.wood = Default::default();
    let plain = FoliageModel { growth: Growth::default(), ..model.clone() };
    // Without mip levels, whose cut-outs are dithered by the places of corners.
    let exactly = DrawOptions { full_textures: true, ..options() };
    for leaves in [750, 200] {
        // Near enough that every picture is drawn at its own size.
        let level = Level::of_leaves(&model, leaves, 4000.0).unwrap();
        level.plant.validate().unwrap();
        assert!(level.tiled > 0 && Level::of_leaves(&plain, leaves, 4000.0).unwrap().tiled == 0);
        let own =
            views(&model, 200, |camera, size| draw_model(&model, leaves as usize, camera, size, &exactly).unwrap());
        let bytes = |images: &[Image]| images.iter().flat_map(|image| image.rgba.clone()).collect::<Vec<u8>>();
        let difference = |drawn: &Plant| {
            let shown = views(&model, 200, |camera, size| draw_plant(drawn, camera, size, &exactly).unwrap());
            let off: f64 = bytes(&own).iter().zip(bytes(&shown)).map(|(a, b)| f64::from(a.abs_diff(b))).sum();
            off / alphas(&own).sum::<f64>()
        };
        let [cut, larger] = [&level.plant, &Level::of_leaves(&plain, leaves, 4000.0).unwrap().plant].map(difference);
        // Far away, fewer and larger pictures have fewer triangles and cover as much.
        let far = Level::of_leaves(&model, leaves, 16.0).unwrap();
        let [near, fewer] = [&level, &far].map(|level| level.plant.indices.len() / 3);
        let covered = |plant: &Plant| {
            alphas(&views(&model, 64, |camera, size| draw_plant(plant, camera, size, &exactly).unwrap())).sum::<f64>()
        };
        let ratio = covered(&far.plant) / covered(&level.plant);
        println!("{leaves}: {cut:.3} off, {larger:.3} as one picture; {near} triangles, {fewer} far away, {ratio:.3}");
        assert!(cut < 0.25 * larger && fewer < near && (ratio - 1.0).abs() < 0.03, "{cut} {larger} {ratio}");
    }
}

#[test]
fn four_levels_of_an_oak_and_its_cards_take_at_most_8_mb() {
    let plant = grow(&Species::embedded("english-oak").unwrap(), &GrowOptions::default()).unwrap();
    for grow_by in [GrowBy::Scale, GrowBy::Tile] {
        let simplified = SimplifyOptions { resolution: 32, grow_by, ..SimplifyOptions::fast() };
        let mut model = simplify(&plant, &simplified, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        model.order_wood();
        let levels = [1.0, 0.33, 0.11, 0.03].map(|lod| Level::new(&model, lod).unwrap().plant);
        let bytes = |plant: &Plant| write_level(plant, &GlbOptions::default()).unwrap().len();
        let all = levels.iter().map(bytes).sum::<usize>() + bytes(&cards(&model));
        println!("{grow_by:?}: {all} bytes");
        assert!(all <= 8_000_000, "{all} bytes");
    }
}

#[test]
fn smaller_textures_let_as_much_be_drawn() {
    let model = grown("betula-populifolia", 500);
    let decoded = |texture: &Texture| texture.decode().unwrap();
    let sizes =
        |textures: &[Texture]| textures.iter().map(|t| [decoded(t).width, decoded(t).height]).collect::<Vec<_>>();
    assert_eq!(resized(&model.plant, 4096).unwrap(), model.textures);
    assert!(resized(&model.plant, 0).is_err() && resized(&model.plant, 9000).is_err());
    let textures = resized(&model.plant, 40).unwrap();
    for (new, old) in sizes(&textures).into_iter().zip(sizes(&model.textures)) {
        assert!(new.iter().all(|side| *side <= 40) && new[0] * old[1] == new[1] * old[0], "{new:?} of {old:?}");
        assert!(new.iter().zip(old).all(|(new, old)| !old.is_power_of_two() || new.is_power_of_two()));
    }
    let mask = model.materials.iter().find(|material| material.alpha_mode == AlphaMode::Mask).unwrap();
    let passing = |texture: &Texture| {
        let rgba = decoded(texture).rgba;
        let alphas = rgba.iter().skip(3).step_by(4);
        alphas.filter(|&&alpha| f32::from(alpha) >= 255.0 * mask.alpha_cutoff).count() as f64 / (rgba.len() / 4) as f64
    };
    let [before, after] = [&model.textures, &textures].map(|all| passing(&all[mask.texture.unwrap() as usize]));
    println!("{before:.3} of the texels pass, {after:.3} of the smaller ones");
    assert!((after / before - 1.0).abs() < 0.03, "{before} {after}");
    assert!(textures.iter().all(|texture| texture.format == TextureFormat::Png));
}

/// A model whose names are no words.
pub fn hostile() -> FoliageModel {
    let mut model = grown("betula-populifolia", 60);
    model.plant.name = "../../\u{1b}[31m\"oak\\\r\n\u{0}</script>\u{202e}".into();
    for (number, material) in model.plant.materials.iter_mut().enumerate() {
        material.name = format!("../{number}\"\u{7}\n");
    }
    model.plant.textures.iter_mut().for_each(|texture| texture.name = "/etc/\u{0}\"".into());
    model
}

#[test]
fn names_are_kept_whatever_they_are_and_equal_models_give_equal_bytes() {
    let model = hostile();
    let cards = cards(&model);
    let levels = [1.0, 0.2].map(|lod| Level::new(&model, lod).unwrap().plant);
    let again = Level::new(&model, 0.2).unwrap().plant;
    assert_eq!(write_level(&levels[1], &EXACT).unwrap(), write_level(&again, &EXACT).unwrap());
    assert_eq!(self::cards(&model), cards);
    let files = [
        write_continuous(&model, &EXACT).unwrap(),
        write_level(&levels[1], &EXACT).unwrap(),
        write_level(&cards, &EXACT).unwrap(),
        write_lods(&[&levels[0], &levels[1], &cards], &[0.5, 0.1, 0.0], &EXACT).unwrap(),
    ];
    for file in &files {
        let Gltf { json, .. } = Gltf::of(file);
        let name = json["nodes"][0]["name"].as_str().unwrap();
        assert!(name == model.name || name == format!("{}_LOD0", model.name), "{name:?}");
        assert!(json["images"].as_array().unwrap().iter().all(|image| image["uri"].is_null()));
    }
    let materials = &Gltf::of(&files[0]).json["materials"];
    let is_kept = |material: &Value| model.materials.iter().any(|own| material["name"] == own.name);
    assert!(materials.as_array().unwrap().iter().all(is_kept));
}
