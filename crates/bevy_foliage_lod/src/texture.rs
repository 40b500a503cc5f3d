//! Textures with mip levels whose alpha is coverage.

use bevy::{
    asset::RenderAssetUsages,
    color::{Color, ColorToComponents, LinearRgba},
    image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    math::Vec3A,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use foliage_lod::{
    draw::mip_levels,
    material::{Material, Pixels, Wrap},
};

/// The image of a material's texture, with all mip levels.
pub(crate) fn image(pixels: Pixels, material: &Material) -> Image {
    let levels = mip_levels(pixels, material);
    let [width, height] = levels.first().map_or([1, 1], |full| [full.width, full.height]);
    let mut data: Vec<u8> = levels.iter().flat_map(|level| &level.rgba).copied().collect();
    if data.is_empty() {
        data = vec![255; 4];
    }
    let mut image = Image::new_uninit(
        Extent3d { width, height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.data = Some(data);
    image.texture_descriptor.mip_level_count = levels.len().max(1) as u32;
    let [u, v] = material.wrap.map(|wrap| match wrap {
        Wrap::Repeat => ImageAddressMode::Repeat,
        Wrap::Mirror => ImageAddressMode::MirrorRepeat,
        Wrap::Clamp => ImageAddressMode::ClampToEdge,
    });
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: u,
        address_mode_v: v,
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        ..ImageSamplerDescriptor::default()
    });
    image
}

/// Mean linear colour of the texels that pass the alpha test.
pub(crate) fn mean(pixels: &Pixels, cutoff: Option<f32>) -> Vec3A {
    let least = cutoff.unwrap_or(0.0) * 255.0;
    let (mut sum, mut count) = (Vec3A::ZERO, 0.0);
    for texel in pixels.rgba.as_chunks::<4>().0.iter().filter(|texel| f32::from(texel[3]) >= least) {
        let linear = LinearRgba::from(Color::srgb_u8(texel[0], texel[1], texel[2]));
        sum += Vec3A::from_array(linear.to_f32_array_no_alpha());
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { Vec3A::ONE }
}
