//! Cards of clusters at one active count, as leaves whose pictures lie in one texture.

use crate::{
    FoliageModel, Plant, Result,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture, TextureFormat, Wrap, encode},
    model::{ShownCluster, Timeline, Transition},
};

/// Empty texels around each picture, so that smaller mip levels do not mix them.
const MARGIN: u32 = 2;
/// Alpha from which on a texel is drawn.
const CUTOFF: f32 = 0.5;

/// The scales of a model's first `leaves` leaves, 0 for one whose card is drawn, and the cards that
/// are.
pub(super) fn scales(model: &FoliageModel, leaves: u32) -> (Vec<f32>, Vec<(usize, ShownCluster)>) {
    let timeline = Timeline::with_cards(model);
    let transition = Transition::new(f64::from(leaves), 1.0, model.leaves.len() as u32);
    let cards = 0..model.clusters.cards().len();
    let shown = cards.filter_map(|card| Some((card, model.clusters.shown(card, &timeline, &transition)?)));
    ((0..leaves).map(|leaf| timeline.scale(leaf, leaves)).collect(), shown.collect())
}

/// Adds cards as leaves of a material of their own.
///
/// # Errors
/// [`TooLarge`](crate::Error::TooLarge) for a texture that cannot be written.
pub(super) fn push_cards(plant: &mut Plant, model: &FoliageModel, cards: &[(usize, ShownCluster)]) -> Result<()> {
    let size = |card: usize| model.clusters.cards()[card].size;
    let (places, [width, height]) = packed(cards.iter().map(|&(card, _)| size(card)).collect());
    let mut rgba = [255, 255, 255, 0].repeat(width as usize * height as usize);
    let material = plant.materials.len() as u32;
    for (&(card, shown), at) in cards.iter().zip(places) {
        let [columns, rows] = size(card);
        let texels = &model.clusters.texels()[model.clusters.texel_range(card)];
        for (texel, place) in texels.iter().zip(0..) {
            // The lowest row comes first, and the last one of a texture.
            let [x, y] = [place % columns, rows - 1 - place / columns];
            if shown.shows(card as u32, *texel, [x, place / columns]) {
                rgba[4 * ((at[1] + y) as usize * width as usize + (at[0] + x) as usize) + 3] = 255;
            }
        }
        let corners = model.clusters.corners(card).map(|corner| {
            let [u, v] = corner.uv;
            let texel = [at[0] as f32 + u * columns as f32, at[1] as f32 + (1.0 - v) * rows as f32];
            Vertex { uv: [texel[0] / width as f32, texel[1] / height as f32], ..corner }
        });
        plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], model.clusters.cards()[card].center, material);
    }
    let bytes = encode::png(&model.name, image::ColorType::Rgba8, [width, height], &rgba)?;
    let texture = Some(plant.textures.len() as u32);
    plant.textures.push(Texture { name: "clusters".into(), format: TextureFormat::Png, bytes });
    plant.materials.push(Material {
        name: "clusters".into(),
        texture,
        wrap: [Wrap::Clamp; 2],
        alpha_mode: AlphaMode::Mask,
        alpha_cutoff: CUTOFF,
        double_sided: true,
        ..Material::default()
    });
    Ok(())
}

/// Places of pictures in a texture, row by row from the highest ones on, and its size.
fn packed(sizes: Vec<[u32; 2]>) -> (Vec<[u32; 2]>, [u32; 2]) {
    let framed = |size: [u32; 2]| size.map(|side| side + 2 * MARGIN);
    let area: u64 = sizes.iter().map(|&size| framed(size).into_iter().map(u64::from).product::<u64>()).sum();
    let widest = sizes.iter().map(|&size| framed(size)[0]).max().unwrap_or(1);
    let width = (area.isqrt() as u32).max(widest).next_power_of_two();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(sizes[i][1]), i));
    let (mut places, mut at, mut row) = (vec![[0; 2]; sizes.len()], [0, 0], 0);
    for i in order {
        let [columns, rows] = framed(sizes[i]);
        if at[0] + columns > width {
            at = [0, at[1] + row];
            row = 0;
        }
        places[i] = at.map(|at| at + MARGIN);
        (at[0], row) = (at[0] + columns, row.max(rows));
    }
    (places, [width, (at[1] + row).next_multiple_of(4).max(4)])
}
