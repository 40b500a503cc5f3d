//! A GLB (binary glTF 2.0) under construction, following the Khronos specification.
//!
//! There is one buffer, and one bufferView per array, each starting at a multiple of 4 bytes.
//! Unused materials and textures are omitted.

use super::buffer::Buffer;
use crate::{
    Error, Result,
    material::{AlphaMode, Material, Texture, Wrap},
};
use serde_json::{Value, json};

/// First word of a GLB file: "glTF".
const MAGIC: u32 = 0x4654_6C67;
/// Container version.
const VERSION: u32 = 2;
/// Chunk types "JSON" and "BIN\0".
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;
/// Sampler filters: linear; linear between linear mipmaps.
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// The JSON under construction, with the materials and textures that are in use.
pub(super) struct Document<'a> {
    materials: &'a [Material],
    textures: &'a [Texture],
    pub(super) buffer: Buffer,
    pub(super) json: Value,
    /// Index of the glTF material of each material, once it is written.
    written: Vec<Option<usize>>,
    /// Texture and wrap modes of each glTF texture, in order of first use.
    used: Vec<(u32, [Wrap; 2])>,
}

impl<'a> Document<'a> {
    pub(super) fn new(materials: &'a [Material], textures: &'a [Texture]) -> Self {
        let generator = concat!("foliage-lod ", env!("CARGO_PKG_VERSION"));
        let json = json!({
            "asset": { "version": "2.0", "generator": generator },
        });
        let written = vec![None; materials.len()];
        Self { materials, textures, buffer: Buffer::default(), json, written, used: Vec::new() }
    }

    pub(super) fn is_textured(&self, material: u32) -> bool {
        self.materials[material as usize].texture.is_some()
    }

    /// The glTF index of a material, which is written on first use.
    pub(super) fn material(&mut self, index: u32) -> usize {
        if let Some(known) = self.written[index as usize] {
            return known;
        }
        let material = &self.materials[index as usize];
        let mut pbr = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.9 });
        if material.base_color != [1.0; 4] {
            pbr["baseColorFactor"] = json!(material.base_color);
        }
        if let Some(texture) = material.texture {
            pbr["baseColorTexture"] = json!({ "index": self.texture(texture, material.wrap) });
        }
        let written = push(&mut self.json["materials"], material_json(material, pbr));
        self.written[index as usize] = Some(written);
        written
    }

    fn texture(&mut self, texture: u32, wrap: [Wrap; 2]) -> usize {
        let known = self.used.iter().position(|&used| used == (texture, wrap));
        known.unwrap_or_else(|| {
            self.used.push((texture, wrap));
            self.used.len() - 1
        })
    }

    /// Writes the images, samplers and textures in use.
    fn add_textures(&mut self) -> Result<()> {
        let (mut images, mut samplers): (Vec<u32>, Vec<[Wrap; 2]>) = (Vec::new(), Vec::new());
        for (texture, wrap) in std::mem::take(&mut self.used) {
            let source = position_or_push(&mut images, texture);
            let sampler = position_or_push(&mut samplers, wrap);
            push(&mut self.json["textures"], json!({ "source": source, "sampler": sampler }));
        }
        for image in images {
            let json = self.buffer.image(&self.textures[image as usize])?;
            push(&mut self.json["images"], json);
        }
        for [u, v] in samplers {
            let sampler = json!({
                "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": wrap_code(u), "wrapT": wrap_code(v),
            });
            push(&mut self.json["samplers"], sampler);
        }
        Ok(())
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable) for a damaged WebP texture, [`TooLarge`](Error::TooLarge)
    /// above 4 GiB.
    pub(super) fn finish(mut self) -> Result<Vec<u8>> {
        self.add_textures()?;
        let (json, bin) = self.buffer.into_parts(self.json);
        container(&json, bin)
    }
}

/// Writes the header and the two chunks; JSON is padded with spaces, binary data with zeros.
fn container(json: &Value, mut bin: Vec<u8>) -> Result<Vec<u8>> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + if bin.is_empty() { 0 } else { 8 + bin.len() };
    let total = u32::try_from(length).map_err(|_| Error::TooLarge {
        what: "the size of the GLB in bytes".into(),
        value: length as u64,
        limit: u64::from(u32::MAX),
        fix: "use fewer leaves or smaller textures".into(),
    })?;
    let mut bytes = Vec::with_capacity(length);
    let word = |bytes: &mut Vec<u8>, value: u32| bytes.extend(value.to_le_bytes());
    for value in [MAGIC, VERSION, total, text.len() as u32, JSON_CHUNK] {
        word(&mut bytes, value);
    }
    bytes.extend(text);
    if bin.is_empty() {
        return Ok(bytes);
    }
    word(&mut bytes, bin.len() as u32);
    word(&mut bytes, BIN_CHUNK);
    bytes.extend(bin);
    Ok(bytes)
}

fn material_json(material: &Material, pbr: Value) -> Value {
    let mut json = json!({ "pbrMetallicRoughness": pbr });
    if !material.name.is_empty() {
        json["name"] = json!(material.name);
    }
    match material.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask => {
            json["alphaMode"] = json!("MASK");
            json["alphaCutoff"] = json!(material.alpha_cutoff);
        }
        AlphaMode::Blend => {
            json["alphaMode"] = json!("BLEND");
            // glTF has a cutoff for `MASK` alone.
            if material.alpha_cutoff != Material::default().alpha_cutoff {
                json["extras"] = json!({ "alphaCutoff": material.alpha_cutoff });
            }
        }
    }
    if material.double_sided {
        json["doubleSided"] = json!(true);
    }
    json
}

/// glTF constant of a wrap mode.
fn wrap_code(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    }
}

/// Appends to a JSON array, which is created if missing; returns the index of the item.
pub(super) fn push(array: &mut Value, item: Value) -> usize {
    if array.is_null() {
        *array = json!([]);
    }
    array.as_array_mut().map_or(0, |items| {
        items.push(item);
        items.len() - 1
    })
}

pub(super) fn position_or_push<T: PartialEq>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}
