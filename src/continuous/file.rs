//! The container of a binary glTF, and the part of its JSON that the reader looks at.

use super::{damaged, unsupported};
use crate::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;

/// First bytes of every binary glTF.
pub(super) const MAGIC: &[u8] = b"glTF";
/// Bytes of the file's header and of a chunk's.
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
/// Most bytes of JSON, which is parsed into up to a hundred times as many. The largest error curve
/// takes 2 MB.
const MAX_JSON_BYTES: u64 = 4 << 20;
/// Extensions that change nothing that is read, or that are understood.
const KNOWN: [&str; 3] = ["KHR_mesh_quantization", "EXT_texture_webp", "MSFT_lod"];
const OF_MATERIALS: &str = "KHR_materials_";

/// A file, split.
pub(super) struct File<'a> {
    pub(super) json: Json,
    pub(super) binary: &'a [u8],
    /// Length of the file.
    pub(super) length: usize,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Json {
    scene: Option<usize>,
    scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Surface>,
    pub(super) textures: Vec<Texture>,
    pub(super) samplers: Vec<Sampler>,
    pub(super) images: Vec<Image>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    extensions_required: Vec<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Scene {
    nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) mesh: Option<usize>,
    pub(super) children: Vec<usize>,
    // In boxes, since most nodes of a file that was made to fill the memory have none.
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
    pub(super) extras: Option<Box<Extras>>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Extras {
    #[serde(rename = "foliageLod")]
    pub(super) foliage_lod: Option<About>,
}

/// What the node of a plant tells.
#[derive(Deserialize)]
pub(super) struct About {
    pub(super) version: u32,
    pub(super) leaves: usize,
    pub(super) curve: Option<Curve>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Curve {
    pub(super) size_px: f32,
    pub(super) size_power: f32,
    pub(super) leaves: Vec<u32>,
    pub(super) errors_px: Vec<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    pub(super) mode: Option<u32>,
    extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Surface {
    pub(super) name: String,
    pub(super) pbr_metallic_roughness: Pbr,
    pub(super) alpha_mode: Option<String>,
    pub(super) alpha_cutoff: Option<f32>,
    pub(super) double_sided: bool,
    pub(super) extras: Option<SurfaceExtras>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SurfaceExtras {
    pub(super) alpha_cutoff: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Pbr {
    pub(super) base_color_factor: Option<[f32; 4]>,
    pub(super) base_color_texture: Option<TextureUse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureUse {
    pub(super) index: usize,
    #[serde(default)]
    pub(super) tex_coord: u32,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) source: Option<usize>,
    pub(super) sampler: Option<usize>,
    pub(super) extensions: TextureExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    pub(super) webp: Option<Source>,
}

#[derive(Deserialize)]
pub(super) struct Source {
    pub(super) source: usize,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Sampler {
    pub(super) wrap_s: Option<u32>,
    pub(super) wrap_t: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Image {
    pub(super) name: String,
    pub(super) buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    #[serde(default)]
    extensions: BTreeMap<String, serde::de::IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Buffer {
    uri: Option<serde::de::IgnoredAny>,
}

impl<'a> File<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self> {
        let (text, binary) = chunks(bytes)?;
        super::limit("the length of the JSON in bytes", text.len() as u64, MAX_JSON_BYTES)?;
        let json: Json =
            serde_json::from_slice(text).map_err(|error| damaged(format!("its JSON is wrong: {error}")))?;
        if let Some(name) = json.extensions_required.iter().find(|name| !is_known(name)) {
            return Err(needs(name));
        }
        if json.buffers.first().is_some_and(|buffer| buffer.uri.is_some()) {
            return Err(Error::unreadable("model", "its data lies in another file", "pack it into one .glb"));
        }
        Ok(Self { json, binary, length: bytes.len() })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, number: usize) -> Result<&'a [u8]> {
        let view = self.json.buffer_views.get(number).ok_or_else(|| damaged(format!("there is no view {number}")))?;
        if let Some(name) = view.extensions.keys().next() {
            return Err(needs(name));
        }
        if view.buffer != 0 {
            return Err(Error::unreadable("model", "its data lies in several buffers", "pack it into one .glb"));
        }
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| self.binary.get(view.byte_offset..end));
        bytes.ok_or_else(|| damaged(format!("view {number} reaches beyond the file")))
    }

    /// The nodes that the scene starts from.
    pub(super) fn roots(&self) -> &[usize] {
        self.json.scenes.get(self.json.scene.unwrap_or(0)).map_or(&[], |scene| &scene.nodes)
    }
}

impl Primitive {
    /// Checks that it is a plain list of triangles.
    pub(super) fn check(&self) -> Result<()> {
        if let Some(name) = self.extensions.keys().find(|name| !name.starts_with(OF_MATERIALS)) {
            return Err(needs(name));
        }
        match self.mode {
            None | Some(4) => Ok(()),
            Some(mode) => Err(unsupported(format!("a primitive of mode {mode}"), "export triangles")),
        }
    }
}

fn is_known(extension: &str) -> bool {
    KNOWN.contains(&extension) || extension.starts_with(OF_MATERIALS)
}

/// The error for an extension that is not understood.
pub(super) fn needs(extension: &str) -> Error {
    // Names are those of the file: a message is one plain line.
    let feature = format!("the extension \"{}\"", extension.escape_debug());
    let is_packed = extension.contains("draco") || extension.contains("meshopt");
    let fix = if is_packed { "decompress the file: `gltf-transform copy IN OUT`" } else { super::AGAIN };
    unsupported(feature, fix)
}

/// The JSON and the binary chunk. Other chunks are skipped.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8])> {
    if !bytes.starts_with(MAGIC) {
        return Err(damaged("is no binary glTF (.glb)"));
    }
    let early = || damaged("ends early");
    let version = word(bytes, 4).ok_or_else(early)?;
    if version != 2 {
        return Err(unsupported(format!("glTF version {version}"), super::AGAIN));
    }
    let length = word(bytes, 8).ok_or_else(early)? as usize;
    let mut rest = bytes.get(HEADER_BYTES..length).ok_or_else(early)?;
    let (mut json, mut binary): (Option<&[u8]>, &[u8]) = (None, &[]);
    while !rest.is_empty() {
        let length = word(rest, 0).ok_or_else(early)? as usize;
        let kind = rest.get(4..CHUNK_HEADER_BYTES).ok_or_else(early)?;
        let body = &rest[CHUNK_HEADER_BYTES..];
        let chunk = body.get(..length).ok_or_else(early)?;
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_empty() => binary = chunk,
            _ => {}
        }
        rest = &body[length..];
    }
    Ok((json.ok_or_else(|| damaged("has no JSON"))?, binary))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
}
