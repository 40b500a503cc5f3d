//! glTF materials: the properties that foliage needs, and how their textures are mapped.

use super::{
    Warning, WarningKind,
    alpha_range::AlphaRange,
    buffers::Buffers,
    extensions,
    fault::Fault,
    source::name,
    textures::{self, Unusable, unusable},
    uri,
};
use crate::material::{AlphaMode, Material, Texture, Wrap};
use ::gltf::json::{
    self, Root, extensions::texture::TextureTransform, material::AlphaMode as JsonAlphaMode, texture::WrappingMode,
    validation::Checked,
};
use glam::{Mat2, Vec2};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// A material and the texture coordinates it uses.
#[derive(Debug, Default)]
pub(super) struct Surface {
    pub(super) material: Material,
    /// `n` of the `TEXCOORD_n` that the base colour uses.
    pub(super) uv_set: u32,
    /// `KHR_texture_transform`, to be applied to the coordinates.
    pub(super) uv_transform: Option<UvTransform>,
    /// The alpha mode that the file specifies, even if the texture it needs is missing.
    pub(super) stated_alpha: AlphaMode,
}

/// `uv * scale`, rotated, then translated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvTransform {
    linear: Mat2,
    offset: Vec2,
}

impl UvTransform {
    fn new(transform: &TextureTransform) -> Self {
        let (sin, cos) = libm::sincosf(transform.rotation.0);
        // Counter-clockwise as seen on the image, where v points down.
        let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        let linear = rotation * Mat2::from_diagonal(Vec2::from(transform.scale.0));
        Self { linear, offset: Vec2::from(transform.offset.0) }
    }

    /// The coordinates at which the texture is sampled.
    pub(super) fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        (self.linear * Vec2::from(uv) + self.offset).to_array()
    }
}

/// Location of the bytes of an image.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ImagePlace<'a> {
    View(usize),
    Data(&'a str),
    File(PathBuf),
    Nowhere,
}

/// Materials of one file while they are being read.
pub(super) struct Materials<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    path: &'a Path,
    /// Texture index of each image that was requested, `None` if it cannot be used; and the same by
    /// the location of its bytes.
    images: BTreeMap<usize, Option<u32>>,
    places: BTreeMap<ImagePlace<'a>, Option<u32>>,
    /// Bytes of buffers that images may still cover: each covers its own, unless views overlap.
    bytes_left: u64,
    /// Textures in the order in which materials refer to them.
    pub(super) textures: Vec<Texture>,
    /// The range of each texture's alpha.
    pub(super) alpha_ranges: Vec<AlphaRange>,
    /// Anything that was ignored.
    pub(super) warnings: Vec<Warning>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers<'a>, path: &'a Path) -> Self {
        let bytes_left = buffers.total_bytes();
        Self {
            root,
            buffers,
            path,
            images: BTreeMap::new(),
            places: BTreeMap::new(),
            bytes_left,
            textures: Vec::new(),
            alpha_ranges: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Reads every material of the file; the default material comes last.
    pub(super) fn read(&mut self) -> Result<Vec<Surface>, Fault> {
        let root = self.root;
        let mut surfaces =
            root.materials.iter().map(|material| self.surface(material)).collect::<Result<Vec<_>, _>>()?;
        surfaces.push(Surface::default());
        Ok(surfaces)
    }

    fn surface(&mut self, source: &json::Material) -> Result<Surface, Fault> {
        let alpha_mode = match source.alpha_mode {
            Checked::Valid(JsonAlphaMode::Mask) => AlphaMode::Mask,
            Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        let (base_color, texture) = base(source);
        let mut surface = Surface {
            material: Material {
                name: name(source.name.as_deref()),
                base_color: base_color.map(|factor| if factor.is_finite() { factor } else { 1.0 }),
                alpha_mode,
                alpha_cutoff: source
                    .alpha_cutoff
                    .map(|cutoff| cutoff.0)
                    .filter(|cutoff| cutoff.is_finite())
                    .unwrap_or(0.5),
                double_sided: source.double_sided,
                ..Material::default()
            },
            stated_alpha: alpha_mode,
            ..Surface::default()
        };
        if let Some(info) = texture {
            self.lay_on(info, &mut surface)?;
        }
        Ok(surface)
    }

    fn lay_on(&mut self, info: &json::texture::Info, surface: &mut Surface) -> Result<(), Fault> {
        let root = self.root;
        let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        surface.uv_set = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        surface.uv_transform = transform.map(UvTransform::new);
        let texture = root.textures.get(info.index.value()).ok_or_else(|| {
            Fault::broken(format!("texture {} is referenced and {} exist", info.index.value(), root.textures.len()))
        })?;
        surface.material.wrap = self.wrap(texture);
        surface.material.texture = self.texture(info.index.value(), texture);
        if surface.material.texture.is_none() {
            surface.material.alpha_mode = AlphaMode::Opaque;
        }
        Ok(())
    }

    fn wrap(&self, texture: &json::Texture) -> [Wrap; 2] {
        let sampler = texture.sampler.and_then(|sampler| self.root.samplers.get(sampler.value()));
        let wrap = |mode: Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        sampler.map_or([Wrap::Repeat; 2], |sampler| [wrap(sampler.wrap_s), wrap(sampler.wrap_t)])
    }

    /// The index of texture `index`, which has been decoded once as a check; a warning and `None`
    /// if it cannot be used.
    fn texture(&mut self, index: usize, texture: &json::Texture) -> Option<u32> {
        let Some(image) = self.image_of(texture) else {
            let message = format!("texture {index} is ignored and its materials are opaque: it has no image");
            self.warnings.push(Warning::new(WarningKind::Texture, message, "export it with a PNG or JPEG image"));
            return None;
        };
        if let Some(&known) = self.images.get(&image) {
            return known;
        }
        let place = self.place(image);
        let index = match self.places.get(&place) {
            Some(&known) => known,
            None => self.kept(image),
        };
        self.images.insert(image, index);
        self.places.insert(place, index);
        index
    }

    /// The image of a texture: WebP if there is one, else the plain image, else one in a format
    /// that only some programs read.
    fn image_of(&self, texture: &json::Texture) -> Option<usize> {
        let of = |extension: &str| {
            let others = &texture.extensions.as_ref()?.others;
            Some(others.get(extension)?.get("source")?.as_u64()? as usize)
        };
        let plain = Some(texture.source.value()).filter(|source| *source < self.root.images.len());
        let others = ["KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];
        of("EXT_texture_webp").or(plain).or_else(|| others.into_iter().find_map(of))
    }

    fn place(&self, index: usize) -> ImagePlace<'a> {
        let Some(image) = self.root.images.get(index) else { return ImagePlace::Nowhere };
        match (image.buffer_view, &image.uri) {
            (Some(view), _) => ImagePlace::View(view.value()),
            (None, Some(uri)) if uri::is_data(uri) => ImagePlace::Data(uri),
            (None, Some(uri)) => ImagePlace::File(uri::file_of(uri, self.path)),
            (None, None) => ImagePlace::Nowhere,
        }
    }

    fn kept(&mut self, image: usize) -> Option<u32> {
        match self.image(image) {
            Ok((texture, alpha_range)) => {
                self.textures.push(texture);
                self.alpha_ranges.push(alpha_range);
                Some(self.textures.len() as u32 - 1)
            }
            Err(Unusable { reason, fix }) => {
                let message = format!("image {image} is ignored and its materials are opaque: {reason}");
                let fix = if reason.contains(textures::AVIF) { extensions::CONVERT_AVIF.to_owned() } else { fix };
                self.warnings.push(Warning::new(WarningKind::Texture, message, fix));
                None
            }
        }
    }

    fn image(&mut self, index: usize) -> Result<(Texture, AlphaRange), Unusable> {
        let image = self.root.images.get(index).ok_or_else(|| format!("{} images exist", self.root.images.len()))?;
        let given = image.name.as_deref().or(image.uri.as_deref().filter(|uri| !uri.starts_with("data:")));
        let name = &name(given);
        let text = |fault: Fault| unusable(fault, self.path);
        match (image.buffer_view, &image.uri) {
            (Some(view), _) => {
                let bytes = self.buffers.view(view).map_err(text)?.bytes;
                let left = self.bytes_left.checked_sub(bytes.len() as u64);
                self.bytes_left = left.ok_or_else(|| "its buffer view overlaps those of other images".to_owned())?;
                textures::texture(name, bytes)
            }
            (None, Some(uri)) => textures::texture(name, &uri::read(uri, self.path).map_err(text)?),
            (None, None) => Err("it has neither a buffer view nor a URI".to_owned().into()),
        }
    }
}

/// Base colour and its texture, from the metallic-roughness model or else from the older
/// specular-glossiness extension.
fn base(source: &json::Material) -> ([f32; 4], Option<&json::texture::Info>) {
    let pbr = &source.pbr_metallic_roughness;
    let extension = source.extensions.as_ref().and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
    match extension {
        Some(older) if pbr.base_color_texture.is_none() => (older.diffuse_factor.0, older.diffuse_texture.as_ref()),
        _ => (pbr.base_color_factor.0, pbr.base_color_texture.as_ref()),
    }
}
