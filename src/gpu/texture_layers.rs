//! Textures of a model as layers of one texture array, scaled to one size, with mip levels whose
//! alpha is coverage.

use crate::{
    Error, Result,
    draw::{
        mips::{Mips, SrgbTable},
        records::{LookRecord, MaterialRecord},
        shader::wrap_number,
    },
    material::{Material, Pixels},
    model::FoliageModel,
};

/// Largest side of a texture layer, in texels; larger textures are scaled down.
const MAX_LAYER_SIDE: u32 = 2048;
/// Maximum number of texels in all layers of a model: 256 MiB without mip levels.
const MAX_TEXELS: u64 = 1 << 26;

/// Cutoff of a material of which nothing is drawn: so far above any alpha that not even a soft edge
/// reaches it.
const BEYOND_REACH: f32 = 1e9;

/// Texture array of a model: a white layer, then one layer for each pair of texture and alpha
/// cutoff of its texels in use.
pub(super) struct Layers {
    size: [u32; 2],
    layers: Vec<Mips>,
    /// For each layer but the white one, whether no texel of its texture reaches the cutoff.
    is_clear: Vec<bool>,
    /// For each layer but the white one, see [`LookRecord::farther`].
    farther: Vec<f32>,
    /// Layer index of each material.
    of_material: Vec<u32>,
}

impl Layers {
    pub(super) fn new(device: &wgpu::Device, model: &FoliageModel) -> Result<Self> {
        // Pairs of a texture and the bits of its alpha cutoff, because the alpha of mip levels is
        // the fraction of texels that pass the alpha test.
        let mut uses: Vec<(usize, Option<u32>)> = Vec::new();
        let mut of_material = Vec::with_capacity(model.materials.len());
        for material in &model.materials {
            let texture = material.texture.map(|texture| texture as usize);
            of_material.push(match texture.filter(|&texture| texture < model.textures.len()) {
                None => 0,
                Some(texture) => {
                    let wanted = (texture, material.texture_cutoff().map(f32::to_bits));
                    let place = uses.iter().position(|&used| used == wanted);
                    place.unwrap_or_else(|| {
                        uses.push(wanted);
                        uses.len() - 1
                    }) as u32
                        + 1
                }
            });
        }
        let limit = u64::from(device.limits().max_texture_array_layers);
        let value = uses.len() as u64 + 1;
        if value > limit {
            let (what, fix) = ("number of texture layers".into(), "merge materials".into());
            return Err(Error::TooLarge { what, value, limit, fix });
        }
        let decoded = uses.iter().map(|&(texture, _)| model.textures[texture].decode());
        let decoded: Vec<Pixels> = decoded.collect::<Result<_>>()?;
        let size = layer_size(device, &decoded);
        let srgb = SrgbTable::new();
        let white =
            Pixels { width: size[0], height: size[1], rgba: vec![255; 4 * size[0] as usize * size[1] as usize] };
        let mut layers: Vec<Mips> = Mips::new(white, Default::default(), None, &srgb).into_iter().collect();
        let cutoffs = uses.iter().map(|(_, cutoff)| cutoff.map(f32::from_bits));
        let farther = decoded.iter().map(|pixels| farther([pixels.width, pixels.height], size)).collect();
        let is_clear = decoded.iter().zip(cutoffs).map(|(pixels, cutoff)| is_clear(pixels, cutoff)).collect();
        for (pixels, (_, cutoff)) in decoded.into_iter().zip(&uses) {
            let pixels = scaled_to(pixels, size);
            layers.extend(Mips::new(pixels, Default::default(), cutoff.map(f32::from_bits), &srgb));
        }
        Ok(Self { size, layers, is_clear, farther, of_material })
    }

    pub(super) fn material(&self, index: usize, material: &Material) -> MaterialRecord {
        let layer = self.of_material[index];
        let cutoff = match layer.checked_sub(1) {
            Some(texture) if self.is_clear[texture as usize] => BEYOND_REACH,
            Some(_) => material.texture_cutoff().unwrap_or(0.0),
            None if material.is_clear() => BEYOND_REACH,
            None => 0.0,
        };
        MaterialRecord {
            base_color: material.base_color,
            cutoff,
            layer,
            wrap: material.wrap.map(wrap_number),
            is_two_sided: material.double_sided.into(),
            padding: [0; 3],
        }
    }

    /// A look with what depends on the layers.
    pub(super) fn look(&self, look: &LookRecord) -> LookRecord {
        let layer = self.of_material[look.material as usize];
        let farther = layer.checked_sub(1).map_or(0.0, |texture| self.farther[texture as usize]);
        LookRecord { farther, ..*look }
    }

    pub(super) fn upload(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
        let [width, height] = self.size;
        let levels = self.layers.first().map_or(1, Mips::count);
        let srgb = SrgbTable::new();
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("foliage textures"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: self.layers.len() as u32 },
            mip_level_count: levels as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        for (layer, mips) in (0..).zip(&self.layers) {
            for (level, pixels) in (0..).zip(mips.premultiplied(&srgb)) {
                write_level(queue, &texture, layer, level, &pixels);
            }
        }
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
    }
}

fn write_level(queue: &wgpu::Queue, texture: &wgpu::Texture, layer: u32, mip_level: u32, pixels: &Pixels) {
    let destination = wgpu::TexelCopyTextureInfo {
        texture,
        mip_level,
        origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
        aspect: wgpu::TextureAspect::All,
    };
    let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * pixels.width), rows_per_image: None };
    let size = wgpu::Extent3d { width: pixels.width, height: pixels.height, depth_or_array_layers: 1 };
    queue.write_texture(destination, &pixels.rgba, rows, size);
}

fn is_clear(pixels: &Pixels, cutoff: Option<f32>) -> bool {
    let reaches = |cutoff: f32| pixels.rgba.iter().skip(3).step_by(4).any(|&alpha| f32::from(alpha) / 255.0 >= cutoff);
    cutoff.is_some_and(|cutoff| !reaches(cutoff))
}

/// Levels from those of a layer of size `to` to those of the texture of size `from` that is scaled
/// to it, and one more for what scaling spreads; 0 if the sizes are the same.
fn farther(from: [u32; 2], to: [u32; 2]) -> f32 {
    let [across, down] = [0, 1].map(|axis| from[axis] as f32 / to[axis] as f32);
    if from == to { 0.0 } else { across.max(down).log2() + 1.0 }
}

/// Size of all layers: the largest width and height of any texture, halved to fit the limits; 1 x 1
/// without textures.
fn layer_size(device: &wgpu::Device, textures: &[Pixels]) -> [u32; 2] {
    let limit = MAX_LAYER_SIDE.min(device.limits().max_texture_dimension_2d);
    let largest = |side: fn(&Pixels) -> u32| textures.iter().map(side).max().unwrap_or(1).clamp(1, limit);
    let mut size = [largest(|pixels| pixels.width), largest(|pixels| pixels.height)];
    while u64::from(size[0]) * u64::from(size[1]) * (textures.len() as u64 + 1) > MAX_TEXELS && size != [1, 1] {
        size = size.map(|side| (side / 2).max(1));
    }
    size
}

fn scaled_to(pixels: Pixels, [width, height]: [u32; 2]) -> Pixels {
    if [pixels.width, pixels.height] == [width, height] {
        return pixels;
    }
    let Pixels { width: from_width, height: from_height, rgba } = pixels;
    // A decoded texture has four bytes per texel.
    let image = ::image::RgbaImage::from_raw(from_width, from_height, rgba).unwrap_or_default();
    let filter = ::image::imageops::FilterType::Triangle;
    Pixels { width, height, rgba: ::image::imageops::resize(&image, width, height, filter).into_raw() }
}
