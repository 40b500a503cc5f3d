//! Measures the area of cards on the screen, whole and within their outlines: the fragments that a
//! rasteriser makes of them, before the alpha test.

use super::{Painter, Placed};
use crate::{
    LookAt, Plant,
    edge::SUBPIXEL,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    plant::{Point, TRIM_CORNERS, clipped, turn},
    software::{
        list::DrawList,
        options::DrawOptions,
        project::{Corner, Projected, ScreenTriangle, project},
    },
};
use glam::{DAffine3, DVec3};
use std::path::PathBuf;

/// Side of the picture in pixels.
const SIDE: u32 = 512;

/// Area in pixels of a convex polygon, whichever way round.
fn area_px(corners: &[Point]) -> f64 {
    let fan = corners.get(1..).unwrap_or_default().windows(2);
    (fan.map(|pair| turn(corners[0], pair[0], pair[1])).sum::<f64>() * 0.5).abs()
}

fn on_screen(corner: &Corner) -> Point {
    corner.at.map(|steps| steps as f64 / SUBPIXEL as f64)
}

/// The part of a triangle within its outline, on the screen.
fn within_outline(triangle: &ScreenTriangle<'_>, corners: [&Corner; 3]) -> Vec<Point> {
    let whole = corners.map(on_screen);
    let Some(outline) = triangle.outline else { return whole.to_vec() };
    let [a, b, c] = corners.map(|corner| corner.uv.map(f64::from));
    let window = if turn(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] };
    let placed = |uv: Point| {
        let weights = [turn(b, c, uv), turn(c, a, uv), turn(a, b, uv)];
        let weights: [f64; 3] = std::array::from_fn(|i| weights[i] / f64::from(corners[i].inverse_w));
        let sum: f64 = weights.iter().sum();
        [0, 1].map(|axis| (0..3).map(|i| whole[i][axis] * weights[i]).sum::<f64>() / sum)
    };
    clipped(&outline.points(), &window).into_iter().map(placed).collect()
}

/// Area of all leaves of a plant that fills the picture, whole and within outlines.
fn areas_px(plant: &Plant) -> [f64; 2] {
    let painter = Painter::new(&plant.materials, &plant.textures).unwrap();
    let list = DrawList::of_plant(plant);
    let camera = LookAt::framing(&plant.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).camera(SIDE);
    let placed = [Placed::new(&list, DAffine3::IDENTITY)];
    let options = DrawOptions { wood: false, ..DrawOptions::default() };
    let Projected { corners, triangles } = project(&placed, &[], &painter.mips, &camera, [SIDE; 2], &options);
    triangles.iter().fold([0.0; 2], |[whole, left], triangle| {
        let own = triangle.corners.map(|corner| &corners[corner as usize]);
        [whole + area_px(&own.map(on_screen)), left + area_px(&within_outline(triangle, own))]
    })
}

fn tree(name: &str) -> Option<Plant> {
    if let Ok(species) = Species::embedded(name) {
        return Some(grow(&species, &GrowOptions::default()).unwrap());
    }
    let folder = std::env::var_os("FOLIAGE_TREES").map(PathBuf::from)?;
    Some(load(&folder.join(name), &ImportOptions::default()).unwrap().plant)
}

#[test]
fn cards_within_outlines_take_fewer_pixels() {
    let options = GrowOptions { leaves: Some(200), ..GrowOptions::default() };
    let mut birch = grow(&Species::embedded("betula-populifolia").unwrap(), &options).unwrap();
    let [before, same] = areas_px(&birch);
    assert!(before > 0.0 && before == same);
    birch.trim(TRIM_CORNERS).unwrap();
    let [whole, left] = areas_px(&birch);
    let share = birch.trimmed_share();
    assert!(whole == before && left / whole < 0.7 && (left / whole - share).abs() < 0.1, "{} {share}", left / whole);
}

/// `FOLIAGE_TREES=... cargo test --lib fragments_of_trees -- --ignored --nocapture`
#[test]
#[ignore = "a measurement"]
fn fragments_of_trees_before_and_after_trimming() {
    println!("| tree | card area, px | within outlines, px | left | area left without a view |");
    let others =
        ["eztree_oak_medium.glb", "CommonTree_1.glb", "seedthree_whiteoak_LOD1_merged.glb", "ftlab_keyaki.glb"];
    for name in ["english-oak", "carya-illinoinensis", "betula-populifolia"].into_iter().chain(others) {
        let Some(mut plant) = tree(name) else { continue };
        plant.trim(TRIM_CORNERS).unwrap();
        let [whole, left] = areas_px(&plant);
        let share = plant.trimmed_share();
        println!("| {name} | {whole:.0} | {left:.0} | {:.1} % | {:.1} % |", 100.0 * left / whole, 100.0 * share);
    }
}
