//! Draws lists of parts, all with one set of materials, into a picture.

use super::{
    ground::PlacedGround,
    image::{Image, MAX_IMAGE_SIDE},
    landscape::{self, ray_through},
    light,
    list::{DrawList, Placed},
    options::{Background, DrawOptions},
    project::project,
    sprite::{PlacedImpostor, Sprite},
    tile::{Scene, Surfaces, TILE_PX, Tile},
    toning::Toning,
};
use crate::{
    Camera, Error, LookAt, Plant, Result,
    bounds::Sphere,
    draw::{
        landscape::Rays,
        light::Lighting,
        mips::{Mips, SrgbTable, srgb_from_linear},
    },
    edge::SUBPIXEL,
    material::{Material, Texture},
    model::FoliageModel,
    srgb::linear_bytes,
};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;

/// Contents of a picture.
#[derive(Clone, Copy, Default)]
pub(super) struct Contents<'a> {
    pub(super) plants: &'a [Placed<'a>],
    pub(super) impostors: &'a [PlacedImpostor<'a>],
    pub(super) ground: Option<&'a PlacedGround<'a>>,
}

/// Draws parts of plants; keeps the decoded textures of their materials between pictures.
pub struct Painter<'a> {
    materials: Cow<'a, [Material]>,
    /// Parallel to `materials`; `None` for a material without a texture.
    mips: Vec<Option<Mips>>,
    srgb: SrgbTable,
}

impl<'a> Painter<'a> {
    /// Decodes the textures of the materials.
    ///
    /// # Errors
    /// Same as [`Texture::decode`], for a damaged texture.
    pub fn new(materials: &'a [Material], textures: &[Texture]) -> Result<Self> {
        let srgb = SrgbTable::new();
        Ok(Self { materials: Cow::Borrowed(materials), mips: decoded(materials, textures, &srgb)?, srgb })
    }

    /// Adds materials, and returns the index of the first one.
    pub(super) fn add(&mut self, materials: &[Material], textures: &[Texture]) -> Result<u32> {
        let first = self.materials.len() as u32;
        self.mips.extend(decoded(materials, textures, &self.srgb)?);
        self.materials.to_mut().extend_from_slice(materials);
        Ok(first)
    }

    /// Draws `list` as seen by `camera`. `size` is the width and height in pixels; their ratio
    /// should be the camera's aspect ratio.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if a side of `size` is 0 or above [`MAX_IMAGE_SIDE`], if
    /// [`Camera::check`] fails, or for an orthographic camera with [`Background::Landscape`].
    pub fn draw(&self, list: &DrawList<'_>, camera: &Camera, size: [u32; 2], options: &DrawOptions) -> Result<Image> {
        self.draw_placed(&[Placed::new(list, DAffine3::IDENTITY)], camera, size, options)
    }

    /// Draws several plants, all with this painter's materials. A plant whose transform is not
    /// finite or not invertible is skipped. Takes about 300 bytes of memory for each triangle in
    /// front of the camera.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub fn draw_placed(
        &self,
        plants: &[Placed<'_>],
        camera: &Camera,
        size: [u32; 2],
        options: &DrawOptions,
    ) -> Result<Image> {
        self.draw_all(&Contents { plants, ..Contents::default() }, camera, size, options)
    }

    /// Same as [`draw_placed`](Self::draw_placed), with all that there is.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub(super) fn draw_all(
        &self,
        contents: &Contents<'_>,
        camera: &Camera,
        size: [u32; 2],
        options: &DrawOptions,
    ) -> Result<Image> {
        let rays = match options.background {
            Background::Landscape(_) => Some(Rays::new(camera)?),
            _ => None,
        };
        let behind = Behind { size, rays, eye_height: camera.eye.y };
        let pixels = self.pixels(contents, camera, size, options, |tile, at, pixel, scene| {
            let (color, share) = tile.resolve(at[0], at[1], scene);
            let sky = behind.color(pixel, options.background);
            finished(color, share, sky, options.background, scene.srgb)
        })?;
        Ok(Image { width: size[0], height: size[1], rgba: pixels.into_flattened() })
    }

    /// Sums of what each pixel's samples show, without light, rows from the top.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub(super) fn surfaces(&self, list: &DrawList<'_>, camera: &Camera, size: [u32; 2]) -> Result<Vec<Surfaces>> {
        let placed = [Placed::new(list, DAffine3::IDENTITY)];
        let options = DrawOptions::default();
        let contents = Contents { plants: &placed, ..Contents::default() };
        self.pixels(&contents, camera, size, &options, |tile, [x, y], _, scene| tile.surfaces(x, y, scene))
    }

    /// Rasterises everything and returns what `finish` makes of each pixel, rows from the top. It
    /// gets the tile, the pixel's place in it and in the picture.
    fn pixels<T: Copy + Send>(
        &self,
        contents: &Contents<'_>,
        camera: &Camera,
        size: [u32; 2],
        options: &DrawOptions,
        finish: impl Fn(&Tile, [u32; 2], [u32; 2], &Scene<'_>) -> T + Sync,
    ) -> Result<Vec<T>> {
        check_size(size)?;
        camera.check()?;
        let plants: Vec<_> = contents.plants.iter().filter(|plant| plant.is_sound()).copied().collect();
        let ground = contents.ground.map_or(&[][..], |ground| &ground.mesh.points);
        let projected = project(&plants, ground, &self.mips, camera, size, options);
        let lights: Vec<_> = plants.iter().map(|plant| plant.light(camera.eye, &options.lighting)).collect();
        let tones: Vec<_> = plants.iter().map(|plant| plant.tone.or(options.tone)).collect();
        let tints: Vec<_> = plants.iter().map(|plant| plant.tint).collect();
        let far: Vec<f32> = plants.iter().map(|plant| plant.far).collect();
        let sprites: Vec<Sprite<'_>> = contents
            .impostors
            .iter()
            .filter_map(|placed| Sprite::new(placed, camera, size, &options.lighting))
            .collect();
        let scene = Scene {
            projected: &projected,
            materials: &self.materials,
            mips: &self.mips,
            srgb: &self.srgb,
            lights: &lights,
            tones: &tones,
            tints: &tints,
            far: &far,
            sprites: &sprites,
            ground: contents.ground,
            is_orthographic: camera.is_orthographic(),
            full_textures: options.full_textures,
        };
        let columns = size[0].div_ceil(TILE_PX);
        let bins = bin(&scene, size, columns);
        let tiles: Vec<Vec<T>> = bins
            .into_par_iter()
            .enumerate()
            .map(|(i, bin)| {
                let origin = [i as u32 % columns * TILE_PX, i as u32 / columns * TILE_PX];
                let tile = rasterised(origin, bin, &scene);
                let places = (0..TILE_PX).flat_map(|y| (0..TILE_PX).map(move |x| [x, y]));
                places.map(|at| finish(&tile, at, [origin[0] + at[0], origin[1] + at[1]], &scene)).collect()
            })
            .collect();
        Ok(assemble(&tiles, columns, size))
    }
}

/// Mip chains of the materials' textures.
fn decoded(materials: &[Material], textures: &[Texture], srgb: &SrgbTable) -> Result<Vec<Option<Mips>>> {
    let mips = |material: &Material| {
        let texture = material.texture.and_then(|texture| textures.get(texture as usize));
        let pixels = texture.map(Texture::decode).transpose()?;
        Ok(pixels.and_then(|pixels| Mips::new(pixels, material.wrap, material.texture_cutoff(), srgb)))
    };
    materials.iter().map(mips).collect()
}

/// Draws a whole plant.
///
/// # Errors
/// Same as [`Painter::new`] and [`Painter::draw`].
pub fn draw_plant(plant: &Plant, camera: &Camera, size: [u32; 2], options: &DrawOptions) -> Result<Image> {
    Painter::new(&plant.materials, &plant.textures)?.draw(&DrawList::of_plant(plant), camera, size, options)
}

/// Draws a model's wood and its first `active_count` leaves, with the model's tone unless `options`
/// has another one, such as [`Toning::NONE`].
///
/// # Errors
/// Same as [`Painter::new`] and [`Painter::draw`].
pub fn draw_model(
    model: &FoliageModel,
    active_count: usize,
    camera: &Camera,
    size: [u32; 2],
    options: &DrawOptions,
) -> Result<Image> {
    let list = DrawList::of_model(model, active_count);
    let tone = match options.tone {
        None if active_count < model.leaves.len() => model_toning(model, &options.lighting)?,
        given => given,
    };
    let options = &DrawOptions { tone, ..*options };
    Painter::new(&model.materials, &model.textures)?.draw(&list, camera, size, options)
}

/// Number of views that a mean colour is averaged over.
const MEAN_VIEWS: usize = 6;
/// Width and height of these views in pixels.
const MEAN_SIDE_PX: u32 = 96;

/// Mean shaded colour of a model's leaves over six views, linear; tone and the effect `contrast`
/// move their colours towards it.
///
/// # Errors
/// Same as [`Painter::new`].
pub fn mean_leaf_color(model: &FoliageModel, lighting: &Lighting) -> Result<[f32; 3]> {
    let list = DrawList::of_model(model, model.leaves.len());
    let options =
        DrawOptions { background: Background::Transparent, wood: false, lighting: *lighting, ..DrawOptions::default() };
    let painter = Painter::new(&model.materials, &model.textures)?;
    let pictures: Vec<Image> = around(&model.sphere())
        .map(|camera| painter.draw(&list, &camera, [MEAN_SIDE_PX; 2], &options))
        .collect::<Result<_>>()?;
    Ok(mean_color(&pictures))
}

/// The tone that a model asks for; `None` if its leaves are plainly scaled.
///
/// # Errors
/// Same as [`Painter::new`].
pub fn model_toning(model: &FoliageModel, lighting: &Lighting) -> Result<Option<Toning>> {
    let tone = model.growth.tone;
    if tone == 0.0 {
        return Ok(None);
    }
    Ok(Some(Toning { mean: mean_leaf_color(model, lighting)?, kept: 1.0, tone }))
}

/// Cameras around a sphere, slightly above its centre.
fn around(sphere: &Sphere) -> impl Iterator<Item = Camera> {
    (0..MEAN_VIEWS).map(|i| {
        let (x, z) = (std::f64::consts::TAU * i as f64 / MEAN_VIEWS as f64).sin_cos();
        LookAt::framing(sphere, DVec3::new(x, 0.3, z), std::f64::consts::FRAC_PI_4, 1.0).camera(MEAN_SIDE_PX)
    })
}

/// Mean linear colour of all pixels of the pictures, weighted by alpha.
pub fn mean_color(pictures: &[Image]) -> [f32; 3] {
    let linear = linear_bytes().map(f64::from);
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for pixel in pictures.iter().flat_map(|picture| picture.rgba.chunks_exact(4)) {
        let alpha = f64::from(pixel[3]) / 255.0;
        (0..3).for_each(|i| sum[i] += linear[pixel[i] as usize] * alpha);
        weight += alpha;
    }
    sum.map(|channel| (channel / f64::max(weight, f64::MIN_POSITIVE)) as f32)
}

pub(super) fn check_size(size: [u32; 2]) -> Result<()> {
    if size.iter().all(|side| (1..=MAX_IMAGE_SIDE).contains(side)) {
        return Ok(());
    }
    Err(Error::invalid("size", format!("{}x{}", size[0], size[1]), format!("1 to {MAX_IMAGE_SIDE} pixels on a side")))
}

/// What touches a tile by its bounding box.
#[derive(Clone, Default)]
struct Bin {
    triangles: Vec<u32>,
    sprites: Vec<u32>,
}

/// Indices, for each tile, of the triangles and sprites that touch it.
fn bin(scene: &Scene<'_>, size: [u32; 2], columns: u32) -> Vec<Bin> {
    let rows = size[1].div_ceil(TILE_PX);
    let mut bins = vec![Bin::default(); columns as usize * rows as usize];
    let tile_steps = SUBPIXEL * TILE_PX as i64;
    for (index, triangle) in scene.projected.triangles.iter().enumerate() {
        let corners = triangle.corners.map(|corner| scene.projected.corners[corner as usize].at);
        let range = |axis: usize, count: u32| {
            let tiles = corners.map(|corner| corner[axis].div_euclid(tile_steps));
            let [min, max] = [tiles.into_iter().min().unwrap_or(0), tiles.into_iter().max().unwrap_or(0)];
            min.max(0)..=max.min(count as i64 - 1)
        };
        for row in range(1, rows) {
            for column in range(0, columns) {
                bins[row as usize * columns as usize + column as usize].triangles.push(index as u32);
            }
        }
    }
    for (index, sprite) in (0..).zip(scene.sprites) {
        let [across, down] =
            sprite.bounds.map(|[first, end]| first / TILE_PX as i64..=(end - 1).div_euclid(TILE_PX as i64));
        for row in down {
            for column in across.clone() {
                bins[row as usize * columns as usize + column as usize].sprites.push(index);
            }
        }
    }
    bins
}

/// A tile with everything that touches it.
fn rasterised(origin: [u32; 2], Bin { mut triangles, sprites }: Bin, scene: &Scene<'_>) -> Tile {
    let nearest = |index: u32| scene.projected.triangles[index as usize].nearest;
    triangles.sort_unstable_by(|&a, &b| nearest(b).total_cmp(&nearest(a)).then(a.cmp(&b)));
    let mut tile = Tile::new(origin);
    triangles.into_iter().for_each(|index| tile.add(index, scene));
    sprites.into_iter().for_each(|index| tile.add_sprite(index, scene));
    tile
}

/// Evaluates the background of a picture, pixel by pixel.
struct Behind {
    size: [u32; 2],
    rays: Option<Rays>,
    eye_height: f64,
}

impl Behind {
    fn color(&self, pixel: [u32; 2], background: Background) -> Vec3 {
        let [x, y] = [0, 1].map(|axis| (pixel[axis] as f32 + 0.5) / self.size[axis] as f32);
        match background {
            Background::Sky => light::backdrop(1.0 - y),
            Background::Landscape(landscape) => self.rays.as_ref().map_or(Vec3::ZERO, |rays| {
                landscape::color(&landscape, self.eye_height, ray_through(rays, 2.0 * x - 1.0, 1.0 - 2.0 * y))
            }),
            _ => Vec3::ZERO,
        }
    }
}

/// Blends a pixel with the background and encodes it in sRGB. `color` is already weighted by
/// `share`, the covered fraction of the pixel.
fn finished(color: Vec3, share: f32, sky: Vec3, background: Background, srgb: &SrgbTable) -> [u8; 4] {
    let (linear, alpha) = match background {
        Background::Sky | Background::Landscape(_) => (color + sky * (1.0 - share), 255),
        Background::Color(behind) => (color + srgb.color(behind) * (1.0 - share), 255),
        Background::Transparent => (color / share.max(f32::MIN_POSITIVE), (share * 255.0 + 0.5) as u8),
    };
    let [r, g, b] = linear.to_array().map(srgb_from_linear);
    [r, g, b, alpha]
}

fn assemble<T: Copy>(tiles: &[Vec<T>], columns: u32, [width, height]: [u32; 2]) -> Vec<T> {
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for column in 0..columns {
            let tile = &tiles[(y / TILE_PX * columns + column) as usize];
            let first = (y % TILE_PX * TILE_PX) as usize;
            let count = TILE_PX.min(width - column * TILE_PX) as usize;
            pixels.extend_from_slice(&tile[first..first + count]);
        }
    }
    pixels
}

#[cfg(all(test, feature = "simplify"))]
mod card_area;
