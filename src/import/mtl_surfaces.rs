//! Materials of an OBJ file: its libraries, and their textures with the opacity of `map_d`.

use super::{
    Warning, WarningKind, alpha_cut,
    alpha_range::AlphaRange,
    mtl::{self, Channel, Map, Statement},
    opacity_map,
    source::name,
    text,
    textures::{self, Unusable, unusable},
    uri,
};
use crate::material::{AlphaMode, Material, Pixels, Texture, Wrap};
use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    path::{Path, PathBuf},
};

/// The material libraries of a file while it is being read.
pub(super) struct Libraries<'a> {
    path: &'a Path,
    /// Libraries that have been read: each counts once.
    read: BTreeSet<PathBuf>,
    /// All materials, in order.
    pub(super) statements: Vec<Statement>,
    warnings: Vec<Warning>,
}

impl<'a> Libraries<'a> {
    pub(super) fn new(path: &'a Path) -> Self {
        Self { path, read: BTreeSet::new(), statements: Vec::new(), warnings: Vec::new() }
    }

    /// Reads the libraries of an `mtllib` line; returns the index of each of their materials.
    pub(super) fn read(&mut self, line: &str) -> HashMap<String, usize> {
        let first = self.statements.len();
        let names: Vec<&str> = line.split_whitespace().collect();
        let are_several = names.len() > 1 && names.iter().all(|name| name.to_ascii_lowercase().ends_with(".mtl"));
        match are_several && !uri::file_of(line, self.path).is_file() {
            true => names.into_iter().for_each(|name| self.read_one(name)),
            false => self.read_one(line),
        }
        (first..).zip(&self.statements[first..]).map(|(i, statement)| (statement.name.clone(), i)).collect()
    }

    fn read_one(&mut self, file: &str) {
        if !self.read.insert(uri::file_of(file, self.path)) {
            return;
        }
        match uri::read(file, self.path) {
            Ok(bytes) => self.statements.extend(mtl::parse(&text::text(&bytes))),
            Err(fault) => {
                let Unusable { reason, fix } = unusable(fault, self.path);
                let message = format!("material library {file:?} is ignored: {reason}");
                self.warnings.push(Warning::new(WarningKind::Texture, message, fix));
            }
        }
    }

    /// The warnings so far; if there are none, one that names a material in `used` that no library
    /// has.
    pub(super) fn warnings_for(&self, used: BTreeSet<&str>) -> Vec<Warning> {
        let known: BTreeSet<&str> = self.statements.iter().map(|statement| statement.name.as_str()).collect();
        let missing: Vec<&str> = used.into_iter().filter(|name| !known.contains(name)).collect();
        let mut warnings = self.warnings.clone();
        if let Some((first, rest)) = missing.split_first().filter(|_| warnings.is_empty()) {
            let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
            let message =
                format!("material {:?}{more} is in no material library: its faces are white", name(Some(first)));
            let fix = "write its library's name in an mtllib line and put it in the same folder";
            warnings.push(Warning::new(WarningKind::Texture, message, fix));
        }
        warnings
    }
}

/// A material, and how its texture lies on the surface.
#[derive(Debug)]
pub(super) struct Surface {
    pub(super) material: Material,
    /// The alpha mode that the file states, even if the texture it needs is missing.
    pub(super) stated_alpha: AlphaMode,
    scale: [f32; 2],
    offset: [f32; 2],
}

impl Default for Surface {
    /// The surface of faces without a material.
    fn default() -> Self {
        let material = Material { double_sided: true, ..Material::default() };
        Self { material, stated_alpha: AlphaMode::Opaque, scale: [1.0; 2], offset: [0.0; 2] }
    }
}

impl Surface {
    /// Texture coordinates with v pointing down, as everywhere else: in OBJ it points up.
    pub(super) fn uv(&self, uv: [f32; 2]) -> [f32; 2] {
        let [u, v] = [0, 1].map(|axis| uv[axis] * self.scale[axis] + self.offset[axis]);
        if u.is_finite() && v.is_finite() { [u, 1.0 - v] } else { [0.0, 1.0] }
    }
}

/// A texture and the range of its alpha.
type Picture = (Texture, AlphaRange);

/// A picture of a material: a file, or two combined.
type Key = (Option<PathBuf>, Option<(PathBuf, Option<Channel>)>);

/// Surfaces of one file while they are being read.
pub(super) struct Surfaces<'a> {
    path: &'a Path,
    pub(super) textures: Vec<Texture>,
    /// The range of each texture's alpha.
    pub(super) alpha_ranges: Vec<AlphaRange>,
    pub(super) warnings: Vec<Warning>,
    /// Pictures that have been read, `None` if they cannot be used.
    pictures: BTreeMap<PathBuf, Option<Picture>>,
    /// Texture index of each picture or combination.
    known: BTreeMap<Key, Option<u32>>,
    /// Texels that combinations may still have: twice those of the pictures that were read. It
    /// keeps a few pictures from being combined in very many ways.
    texels_left: u64,
}

impl<'a> Surfaces<'a> {
    pub(super) fn new(path: &'a Path, warnings: Vec<Warning>) -> Self {
        Self {
            path,
            textures: Vec::new(),
            alpha_ranges: Vec::new(),
            warnings,
            pictures: BTreeMap::new(),
            known: BTreeMap::new(),
            texels_left: 0,
        }
    }

    /// The surface that a library states. OBJ has no cutoff and no culling: the cutoff is half
    /// of the largest alpha and both sides are drawn. A constant dissolve is ignored because
    /// exporters write 0 next to a texture.
    pub(super) fn surface(&mut self, from: &Statement) -> Surface {
        if !from.not_a_color.is_empty() {
            let message = format!("its colour {:?} is not numbers and is ignored", name(Some(&from.not_a_color)));
            self.warn(&from.name, &message, "write Kd with three numbers from 0 to 1");
        }
        let texture = self.texture(from);
        let alpha = texture.map(|texture| self.alpha_ranges[texture as usize]);
        let has_holes = alpha.is_some_and(AlphaRange::has_holes);
        let has_color = from.color.as_ref().is_some_and(|map| self.is_read(&map.file));
        let [r, g, b] = from.diffuse.filter(|_| !has_color).unwrap_or([1.0; 3]);
        let map = from.color.as_ref().or(from.opacity.as_ref());
        let clamp = map.is_some_and(|map| map.clamp);
        let material = Material {
            name: name(Some(&from.name)),
            base_color: [r, g, b, 1.0].map(|factor| if factor.is_finite() { factor } else { 1.0 }),
            texture,
            wrap: [if clamp { Wrap::Clamp } else { Wrap::Repeat }; 2],
            alpha_mode: if has_holes { AlphaMode::Mask } else { AlphaMode::Opaque },
            alpha_cutoff: alpha_cut::relative(alpha.map_or(1.0, |alpha| f32::from(alpha.most) / 255.0)),
            double_sided: true,
        };
        let states_alpha = has_holes || from.opacity.is_some();
        Surface {
            material,
            stated_alpha: if states_alpha { AlphaMode::Mask } else { AlphaMode::Opaque },
            scale: map.map_or([1.0; 2], |map| map.scale),
            offset: map.map_or([0.0; 2], |map| map.offset),
        }
    }

    fn warn(&mut self, from: &str, message: &str, fix: &str) {
        let message = format!("material {:?}: {message}", name(Some(from)));
        self.warnings.push(Warning::new(WarningKind::Texture, message, fix));
    }

    /// Index of the picture of a material: its colour texture, with the opacity of another.
    fn texture(&mut self, from: &Statement) -> Option<u32> {
        let [color, mask] = [&from.color, &from.opacity].map(|map| map.as_deref());
        for option in [color, mask].into_iter().flatten().flat_map(|map| &map.ignored) {
            self.warn(&from.name, &format!("the option {option:?} is ignored"), "bake it into the picture");
        }
        let file = |map: &Map| uri::file_of(&map.file, self.path);
        let color_key = color.map(file);
        let mask =
            mask.filter(|mask| color_key != Some(file(mask)) || mask.channel.is_some_and(|of| of != Channel::Alpha));
        if let (Some(color), Some(mask)) = (color, mask)
            && !color.lies_as(mask)
        {
            self.warn(&from.name, "its map_d is placed as its map_Kd", "give both the same -s, -o and -clamp");
        }
        let key = (color_key, mask.map(|mask| (file(mask), mask.channel)));
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let picture = self.picture(color, mask);
        let index = picture.map(|(texture, alpha_range)| {
            self.textures.push(texture);
            self.alpha_ranges.push(alpha_range);
            self.textures.len() as u32 - 1
        });
        self.known.insert(key, index);
        index
    }

    fn picture(&mut self, color: Option<&Map>, mask: Option<&Map>) -> Option<Picture> {
        let [color_picture, mask_picture] = [color, mask].map(|map| map.and_then(|map| self.read(&map.file)));
        let Some((mask, (mask_texture, _))) = mask.zip(mask_picture) else { return color_picture };
        let color_texture = color_picture.as_ref().map(|(texture, _)| texture);
        let combined = self.combined(color_texture, &mask_texture, mask.channel);
        combined.unwrap_or_else(|reason| {
            let message = format!("the opacity in {:?} is ignored: {reason}", mask.file);
            let fix = "save colour and opacity as one PNG with alpha and name it in map_Kd";
            self.warnings.push(Warning::new(WarningKind::Texture, message, fix));
            color_picture
        })
    }

    /// Both pictures as one, or `None` if the mask is opaque everywhere and there is no colour.
    fn combined(
        &mut self,
        color: Option<&Texture>,
        mask: &Texture,
        channel: Option<Channel>,
    ) -> Result<Option<Picture>, String> {
        let pixels = |texture: &Texture| texture.decode().map_err(|error| error.to_string());
        let white = || Ok(Pixels { width: 1, height: 1, rgba: vec![255; 4] });
        let (color_pixels, mask_pixels) = (color.map_or_else(white, pixels)?, pixels(mask)?);
        let texels = [&color_pixels, &mask_pixels].map(|of| u64::from(of.width) * u64::from(of.height));
        let needed = texels[0].max(texels[1]);
        let left = self.texels_left.checked_sub(needed);
        self.texels_left = left.ok_or("its pictures are combined in too many ways")?;
        let pixels = opacity_map::combined(&color_pixels, &mask_pixels, channel);
        let combined = textures::of_pixels(&color.unwrap_or(mask).name, &pixels);
        combined.map(Some).map_err(|unusable| unusable.reason)
    }

    fn is_read(&self, file: &str) -> bool {
        self.pictures.get(&uri::file_of(file, self.path)).is_some_and(Option::is_some)
    }

    /// The picture in a file; a warning and `None` if it cannot be used.
    fn read(&mut self, file: &str) -> Option<Picture> {
        let key = uri::file_of(file, self.path);
        if let Some(known) = self.pictures.get(&key) {
            return known.clone();
        }
        let bytes = uri::read(file, self.path).map_err(|fault| unusable(fault, self.path));
        let picture = match bytes.and_then(|bytes| textures::texture(file, &bytes)) {
            Ok(picture) => Some(picture),
            Err(Unusable { reason, fix }) => {
                let message = format!("texture {file:?} is ignored: {reason}");
                self.warnings.push(Warning::new(WarningKind::Texture, message, fix));
                None
            }
        };
        if let Some(pixels) = picture.as_ref().and_then(|(texture, _)| texture.decode().ok()) {
            self.texels_left += 2 * u64::from(pixels.width) * u64::from(pixels.height);
        }
        self.pictures.insert(key, picture.clone());
        picture
    }
}
