//! Pictures of plants and models, drawn on the CPU: no adapter, no driver, the same bytes for any number of threads.
//!
//! What is drawn is a [`DrawList`]: parts of leaves and wood, each leaf with its linear scale about its pivot. A
//! [`Painter`] holds a plant's decoded textures and draws any number of lists, one or many to a picture; [`draw_plant`]
//! and [`draw_model`] are the short way. Sixteen samples a pixel, alpha tested at each, textures filtered with levels that
//! keep their coverage.
//!
//! Cost: grows with covered samples; 20,000 masked leaves at 512 x 512 took 2 s on two busy cores, built for development.

mod project;
mod tile;

use super::{
    camera::Camera,
    image::{Image, MAX_IMAGE_SIDE},
    light::{self, Light},
    mips::{Mips, SrgbTable, srgb_from_linear},
};
use crate::{
    Error, Plant, Result,
    bounds::Aabb,
    leaf::Vertex,
    material::{Material, Texture},
    model::{FoliageModel, Timeline, Transition},
    plant::Wood,
};
use glam::{DAffine3, DVec3};
use project::{Projected, STEPS_PER_PIXEL, project};
use rayon::prelude::*;
use tile::{Scene, TILE_PX, Tile};

/// What lies behind the plant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Background {
    /// A soft gradient from ground to sky.
    #[default]
    Sky,
    /// One sRGB colour.
    Color([u8; 3]),
    /// Nothing: alpha is the share of each pixel that is covered.
    Transparent,
}

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawOptions {
    /// What lies behind the plant.
    pub background: Background,
    /// Trunk and branches are drawn.
    pub wood: bool,
    /// Shaded colours of leaves are drawn to a mean.
    pub tone: Option<Tone>,
}

/// How leaves keep less of their contrast (see [`contrast`](crate::stochastic::contrast)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Share of a colour's distance from the mean that stays: 0 to 1.
    pub kept: f32,
    /// Mean shaded colour of the leaves, linear.
    pub mean: [f32; 3],
}

impl Default for DrawOptions {
    fn default() -> Self {
        Self { background: Background::Sky, wood: true, tone: None }
    }
}

/// Triangles of one material, scaled about a pivot.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// What `indices` count in.
    pub vertices: &'a [Vertex],
    /// Three per triangle.
    pub indices: &'a [u32],
    /// Index into the materials.
    pub material: u32,
    /// The point that stays in place.
    pub pivot: [f32; 3],
    /// Linear factor; 1 leaves the part as it is.
    pub scale: f32,
    /// Leaves are lit on both sides and let light through.
    pub is_leaf: bool,
}

/// What is drawn.
#[derive(Debug, Clone)]
pub struct DrawList<'a> {
    /// Leaves and wood, in any order.
    pub parts: Vec<Part<'a>>,
    /// Box around all leaves that the plant has, drawn or not: light fades towards its middle.
    pub crown: Aabb,
}

impl<'a> DrawList<'a> {
    /// A plant's wood and all of its leaves.
    pub fn of_plant(plant: &'a Plant) -> Self {
        let mut list = Self::of_wood(&plant.wood, &plant.vertices);
        list.parts.extend(plant.leaves.iter().map(|leaf| Part {
            vertices: &plant.vertices,
            indices: &plant.indices[leaf.index_range()],
            material: leaf.material,
            pivot: leaf.pivot,
            scale: 1.0,
            is_leaf: true,
        }));
        list
    }

    /// A model's wood and its first `active_count` leaves, each at the scale it is drawn with at that count.
    pub fn of_model(model: &'a FoliageModel, active_count: usize) -> Self {
        Self::of_scaled(model, drawn_scales(model, active_count))
    }

    /// As [`of_model`](Self::of_model) while leaves come and go. `timeline` is that of `model`.
    pub fn between(model: &'a FoliageModel, timeline: &Timeline, transition: &Transition) -> Self {
        let drawn = transition.drawn().min(timeline.leaves());
        Self::of_scaled(model, (0..drawn).map(|leaf| timeline.scale_at(leaf, transition)))
    }

    fn of_scaled(model: &'a FoliageModel, scales: impl IntoIterator<Item = f32>) -> Self {
        let mut list = Self::of_wood(&model.wood, &model.vertices);
        list.parts.extend(model.leaves.iter().zip(scales).map(|(leaf, scale)| Part {
            vertices: &model.vertices,
            indices: model.indices.get(leaf.indices[0] as usize..leaf.indices[1] as usize).unwrap_or_default(),
            material: leaf.material,
            pivot: leaf.pivot,
            scale,
            is_leaf: true,
        }));
        list
    }

    fn of_wood(wood: &'a Wood, leaf_vertices: &[Vertex]) -> Self {
        let part = |part: &crate::plant::WoodPart| Part {
            vertices: &wood.vertices,
            indices: wood.indices.get(part.indices[0] as usize..part.indices[1] as usize).unwrap_or_default(),
            material: part.material,
            pivot: [0.0; 3],
            scale: 1.0,
            is_leaf: false,
        };
        let crown = Aabb::of_points(leaf_vertices.iter().map(|vertex| vertex.position));
        Self { parts: wood.parts.iter().map(part).collect(), crown }
    }
}

/// The scale of each of the first `active_count` leaves: collapse from the whole model down to that count.
fn drawn_scales(model: &FoliageModel, active_count: usize) -> Vec<f32> {
    let mut drawn = vec![1.0; model.leaves.len()];
    for pruned in model.leaves.iter().skip(active_count).rev() {
        if let Some(target) = drawn.get_mut(pruned.leaf_to_collapse as usize) {
            *target = pruned.scale;
        }
    }
    drawn.truncate(active_count);
    drawn
}

/// A draw list somewhere in the world.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// What stands there.
    pub list: &'a DrawList<'a>,
    /// Where. Under uneven scaling the light is a little off.
    pub world_from_plant: DAffine3,
}

impl Placed<'_> {
    fn is_sound(&self) -> bool {
        self.world_from_plant.is_finite() && self.world_from_plant.inverse().is_finite()
    }

    fn light(&self, eye: DVec3) -> Light {
        let plant_from_world = self.world_from_plant.inverse();
        Light::new(&self.list.crown, plant_from_world.transform_point3(eye)).turned(&plant_from_world)
    }
}

/// Draws the parts of one plant or model; keeps its decoded textures between pictures.
pub struct Painter<'a> {
    materials: &'a [Material],
    /// One for each material that has a texture.
    mips: Vec<Option<Mips>>,
    srgb: SrgbTable,
}

impl<'a> Painter<'a> {
    /// Decodes the textures that the materials name.
    ///
    /// # Errors
    /// What [`Texture::decode`] gives for a damaged texture.
    pub fn new(materials: &'a [Material], textures: &[Texture]) -> Result<Self> {
        let srgb = SrgbTable::new();
        let mips = |material: &Material| {
            let texture = material.texture.and_then(|texture| textures.get(texture as usize));
            let pixels = texture.map(Texture::decode).transpose()?;
            Ok(pixels.and_then(|pixels| Mips::new(pixels, material.wrap, material.cutoff(), &srgb)))
        };
        Ok(Self { materials, mips: materials.iter().map(mips).collect::<Result<_>>()?, srgb })
    }

    /// Draws `list` as `camera` sees it; the picture's shape should be the camera's aspect.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] when a side of `size` is 0 or above [`MAX_IMAGE_SIDE`].
    pub fn draw(&self, list: &DrawList<'_>, camera: &Camera, size: [u32; 2], options: &DrawOptions) -> Result<Image> {
        self.draw_placed(&[Placed { list, world_from_plant: DAffine3::IDENTITY }], camera, size, options)
    }

    /// Draws several plants, all of this painter's materials. A plant whose transform is not finite or not invertible is
    /// left out. Takes about 300 bytes for each triangle in front of the camera.
    ///
    /// # Errors
    /// Those of [`draw`](Self::draw).
    pub fn draw_placed(
        &self,
        plants: &[Placed<'_>],
        camera: &Camera,
        size: [u32; 2],
        options: &DrawOptions,
    ) -> Result<Image> {
        check_size(size)?;
        let plants: Vec<_> = plants.iter().filter(|plant| plant.is_sound()).copied().collect();
        let projected = project(&plants, &self.mips, camera, size, options.wood);
        let lights: Vec<_> = plants.iter().map(|plant| plant.light(camera.eye)).collect();
        let scene = Scene {
            projected: &projected,
            materials: self.materials,
            mips: &self.mips,
            srgb: &self.srgb,
            lights: &lights,
            tone: options.tone,
        };
        let columns = size[0].div_ceil(TILE_PX);
        let bins = bin(&projected, size, columns);
        let tiles: Vec<Vec<[u8; 4]>> = bins
            .into_par_iter()
            .enumerate()
            .map(|(i, bin)| {
                let origin = [i as u32 % columns * TILE_PX, i as u32 / columns * TILE_PX];
                paint_tile(origin, bin, &scene, size[1], options.background)
            })
            .collect();
        Ok(assemble(&tiles, columns, size))
    }
}

/// Draws a whole plant.
///
/// # Errors
/// Those of [`Painter::new`] and [`Painter::draw`].
pub fn draw_plant(plant: &Plant, camera: &Camera, size: [u32; 2], options: &DrawOptions) -> Result<Image> {
    Painter::new(&plant.materials, &plant.textures)?.draw(&DrawList::of_plant(plant), camera, size, options)
}

/// Draws a model's wood and its first `active_count` leaves.
///
/// # Errors
/// Those of [`Painter::new`] and [`Painter::draw`].
pub fn draw_model(
    model: &FoliageModel,
    active_count: usize,
    camera: &Camera,
    size: [u32; 2],
    options: &DrawOptions,
) -> Result<Image> {
    let list = DrawList::of_model(model, active_count);
    Painter::new(&model.materials, &model.textures)?.draw(&list, camera, size, options)
}

fn check_size(size: [u32; 2]) -> Result<()> {
    if size.iter().all(|side| (1..=MAX_IMAGE_SIDE).contains(side)) {
        return Ok(());
    }
    Err(Error::InvalidOption {
        option: "--size",
        value: format!("{}x{}", size[0], size[1]),
        allowed: format!("1 to {MAX_IMAGE_SIDE} pixels on a side"),
    })
}

/// For each tile the triangles whose box touches it.
fn bin(projected: &Projected, size: [u32; 2], columns: u32) -> Vec<Vec<u32>> {
    let rows = size[1].div_ceil(TILE_PX);
    let mut bins = vec![Vec::new(); columns as usize * rows as usize];
    let tile_steps = STEPS_PER_PIXEL * TILE_PX as i64;
    for (index, triangle) in projected.triangles.iter().enumerate() {
        let corners = triangle.corners.map(|corner| projected.corners[corner as usize].at);
        let range = |axis: usize, count: u32| {
            let tiles = corners.map(|corner| corner[axis].div_euclid(tile_steps));
            let [min, max] = [tiles.into_iter().min().unwrap_or(0), tiles.into_iter().max().unwrap_or(0)];
            min.max(0)..=max.min(count as i64 - 1)
        };
        for row in range(1, rows) {
            for column in range(0, columns) {
                bins[row as usize * columns as usize + column as usize].push(index as u32);
            }
        }
    }
    bins
}

fn paint_tile(
    origin: [u32; 2],
    mut triangles: Vec<u32>,
    scene: &Scene<'_>,
    height: u32,
    background: Background,
) -> Vec<[u8; 4]> {
    let nearest = |index: u32| scene.projected.triangles[index as usize].nearest;
    triangles.sort_unstable_by(|&a, &b| nearest(b).total_cmp(&nearest(a)).then(a.cmp(&b)));
    let mut tile = Tile::new(origin);
    for index in triangles {
        tile.add(index, scene);
    }
    let mut pixels = Vec::with_capacity((TILE_PX * TILE_PX) as usize);
    for y in 0..TILE_PX {
        let behind = light::backdrop(1.0 - ((origin[1] + y) as f32 + 0.5) / height as f32);
        pixels.extend((0..TILE_PX).map(|x| {
            let (color, share) = tile.resolve(x, y, scene);
            finished(color, share, behind, background, scene.srgb)
        }));
    }
    pixels
}

/// The sRGB pixel of a colour already weighted by the `share` of the pixel that it covers.
fn finished(color: glam::Vec3, share: f32, sky: glam::Vec3, background: Background, srgb: &SrgbTable) -> [u8; 4] {
    let (linear, alpha) = match background {
        Background::Sky => (color + sky * (1.0 - share), 255),
        Background::Color(behind) => (color + srgb.color(behind) * (1.0 - share), 255),
        Background::Transparent => (color / share.max(f32::MIN_POSITIVE), (share * 255.0 + 0.5) as u8),
    };
    let [r, g, b] = linear.to_array().map(srgb_from_linear);
    [r, g, b, alpha]
}

fn assemble(tiles: &[Vec<[u8; 4]>], columns: u32, [width, height]: [u32; 2]) -> Image {
    let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
    for y in 0..height {
        for column in 0..columns {
            let tile = &tiles[(y / TILE_PX * columns + column) as usize];
            let first = (y % TILE_PX * TILE_PX) as usize;
            let count = TILE_PX.min(width - column * TILE_PX) as usize;
            rgba.extend_from_slice(tile[first..first + count].as_flattened());
        }
    }
    Image { width, height, rgba }
}
