//! The binary part of a GLB: arrays with their bufferViews and accessors.

use crate::{
    Result,
    bounds::Aabb,
    material::{Texture, TextureFormat},
};
use serde_json::{Value, json};

/// Component types.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
/// bufferView targets.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// 16-bit indices serve up to here: 65535 restarts primitives.
const MAX_SHORT_VERTICES: usize = 65_535;

/// Bytes, and the JSON that describes them.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends positions, whose accessor carries their bounds; gives the accessor.
    pub fn positions(&mut self, positions: impl Iterator<Item = [f32; 3]> + Clone) -> usize {
        let bounds = Aabb::of_points(positions.clone());
        let accessor = self.floats("VEC3", positions);
        self.accessors[accessor]["min"] = json!(bounds.min);
        self.accessors[accessor]["max"] = json!(bounds.max);
        accessor
    }

    /// Appends vectors of floats; gives the accessor.
    pub fn floats<const N: usize>(&mut self, shape: &str, vectors: impl Iterator<Item = [f32; N]>) -> usize {
        let start = self.bytes.len();
        let mut count = 0;
        for vector in vectors {
            vector.iter().for_each(|value| self.bytes.extend(value.to_le_bytes()));
            count += 1;
        }
        let view = self.view(start, Some(ARRAY_BUFFER));
        self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": shape }))
    }

    /// Appends indices below `vertices`, in 16 bits where they fit; gives the accessor.
    pub fn indices(&mut self, indices: &[u32], vertices: usize) -> usize {
        let start = self.bytes.len();
        let component = if vertices <= MAX_SHORT_VERTICES {
            indices.iter().for_each(|&index| self.bytes.extend((index as u16).to_le_bytes()));
            UNSIGNED_SHORT
        } else {
            indices.iter().for_each(|index| self.bytes.extend(index.to_le_bytes()));
            UNSIGNED_INT
        };
        let view = self.view(start, Some(ELEMENT_ARRAY_BUFFER));
        self.accessor(
            json!({ "bufferView": view, "componentType": component, "count": indices.len(), "type": "SCALAR" }),
        )
    }

    /// Appends an image; gives its JSON.
    ///
    /// # Errors
    /// A damaged WebP texture.
    pub fn image(&mut self, texture: &Texture) -> Result<Value> {
        let start = self.bytes.len();
        let mime = match texture.format {
            TextureFormat::Png => "image/png",
            TextureFormat::Jpeg => "image/jpeg",
            TextureFormat::Webp => "image/png",
        };
        match texture.format {
            TextureFormat::Webp => self.bytes.extend(crate::grow::paint::png(&texture.name, &texture.decode()?)?),
            TextureFormat::Png | TextureFormat::Jpeg => self.bytes.extend(&texture.bytes),
        }
        let view = self.view(start, None);
        let mut image = json!({ "bufferView": view, "mimeType": mime });
        if !texture.name.is_empty() {
            image["name"] = json!(texture.name);
        }
        Ok(image)
    }

    /// Adds buffer, views and accessors to the document, unless there are none; gives it and the bytes.
    pub fn into_parts(self, mut document: Value) -> (Value, Vec<u8>) {
        if self.bytes.is_empty() {
            return (document, self.bytes);
        }
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        (document, self.bytes)
    }

    /// Describes the bytes from `start` on, and pads to the next multiple of 4.
    fn view(&mut self, start: usize, target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}
