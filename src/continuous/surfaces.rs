//! Materials and textures.

use super::{
    damaged,
    file::{File, Sampler, Surface, TextureUse, needs},
    unsupported,
};
use crate::{
    Error, Result,
    material::{AlphaMode, Material, Texture, TextureFormat, Wrap},
};
use std::collections::BTreeMap;

/// First bytes of images, and the place of the second word of a WebP.
const PNG: &[u8] = b"\x89PNG";
const JPEG: &[u8] = b"\xff\xd8\xff";
const WEBP: [&[u8]; 2] = [b"RIFF", b"WEBP"];
const WEBP_AT: usize = 8;

/// The textures in use, and their numbers by those of their images.
#[derive(Default)]
struct Textures {
    of_images: BTreeMap<usize, u32>,
    textures: Vec<Texture>,
    bytes: usize,
}

/// All materials, with the textures that they use.
pub(super) fn surfaces(file: &File<'_>) -> Result<(Vec<Material>, Vec<Texture>)> {
    let mut textures = Textures::default();
    let materials = file.json.materials.iter().map(|surface| material(file, surface, &mut textures));
    let materials = materials.collect::<Result<Vec<Material>>>()?;
    Ok((materials, textures.textures))
}

fn material(file: &File<'_>, surface: &Surface, textures: &mut Textures) -> Result<Material> {
    let alpha_mode = match surface.alpha_mode.as_deref() {
        None | Some("OPAQUE") => AlphaMode::Opaque,
        Some("MASK") => AlphaMode::Mask,
        Some("BLEND") => AlphaMode::Blend,
        Some(_) => return Err(damaged("a material has an unknown alphaMode")),
    };
    let of_blend = surface.extras.as_ref().and_then(|extras| extras.alpha_cutoff);
    let mut material = Material {
        name: surface.name.clone(),
        base_color: surface.pbr_metallic_roughness.base_color_factor.unwrap_or([1.0; 4]),
        alpha_mode,
        alpha_cutoff: surface.alpha_cutoff.or(of_blend).unwrap_or(0.5),
        double_sided: surface.double_sided,
        ..Material::default()
    };
    if let Some(used) = &surface.pbr_metallic_roughness.base_color_texture {
        let (image, sampler) = source(file, used)?;
        material.texture = Some(textures.number(file, image)?);
        material.wrap = [sampler.wrap_s, sampler.wrap_t].map(wrap);
    }
    Ok(material)
}

/// Image and sampler of a texture.
fn source<'a>(file: &'a File<'_>, used: &TextureUse) -> Result<(usize, &'a Sampler)> {
    const PLAIN: &Sampler = &Sampler { wrap_s: None, wrap_t: None };
    if let Some(name) = used.extensions.keys().next() {
        return Err(needs(name));
    }
    if used.tex_coord != 0 {
        let feature = format!("a texture with the coordinates TEXCOORD_{}", used.tex_coord);
        return Err(unsupported(feature, super::AGAIN));
    }
    let missing = |what: &str, number: usize| damaged(format!("there is no {what} {number}"));
    let texture = file.json.textures.get(used.index).ok_or_else(|| missing("texture", used.index))?;
    let image = texture.extensions.webp.as_ref().map(|webp| webp.source).or(texture.source);
    let image = image.ok_or_else(|| unsupported("a texture without a PNG, JPEG or WebP image", super::AGAIN))?;
    let sampler =
        texture.sampler.map(|number| file.json.samplers.get(number).ok_or_else(|| missing("sampler", number)));
    Ok((image, sampler.transpose()?.unwrap_or(PLAIN)))
}

/// Wrap mode of a glTF constant.
fn wrap(code: Option<u32>) -> Wrap {
    match code {
        Some(33648) => Wrap::Mirror,
        Some(33071) => Wrap::Clamp,
        _ => Wrap::Repeat,
    }
}

impl Textures {
    /// The number of an image's texture, which is read on first use.
    fn number(&mut self, file: &File<'_>, image: usize) -> Result<u32> {
        if let Some(known) = self.of_images.get(&image) {
            return Ok(*known);
        }
        let told = file.json.images.get(image).ok_or_else(|| damaged(format!("there is no image {image}")))?;
        let Some(view) = told.buffer_view else {
            return Err(Error::unreadable("model", "an image lies in another file", "pack it into one .glb"));
        };
        let bytes = file.view(view)?;
        self.bytes += bytes.len();
        if self.bytes > file.length {
            return Err(damaged("its images share their data"));
        }
        let format = format(bytes).ok_or_else(|| damaged(format!("image {image} is no PNG, JPEG or WebP")))?;
        let number = self.textures.len() as u32;
        self.textures.push(Texture { name: told.name.clone(), format, bytes: bytes.to_vec() });
        self.of_images.insert(image, number);
        Ok(number)
    }
}

fn format(bytes: &[u8]) -> Option<TextureFormat> {
    let [riff, webp] = WEBP;
    match bytes {
        _ if bytes.starts_with(PNG) => Some(TextureFormat::Png),
        _ if bytes.starts_with(JPEG) => Some(TextureFormat::Jpeg),
        _ if bytes.starts_with(riff) && bytes.get(WEBP_AT..)?.starts_with(webp) => Some(TextureFormat::Webp),
        _ => None,
    }
}
