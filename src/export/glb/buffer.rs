//! The binary part of a GLB: arrays, and the bufferViews and accessors that describe them.

use crate::{
    Result,
    bounds::Aabb,
    material::{Texture, TextureFormat, encode},
};
use serde_json::{Value, json};

/// Component types.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
/// bufferView targets.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Maximum number of vertices with 16-bit indices: 65535 is the primitive restart value.
const MAX_SHORT_VERTICES: usize = 65_535;

/// The bytes of the buffer, and the JSON that describes them.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends positions; their accessor includes their bounds. Returns the accessor index.
    pub fn positions(&mut self, positions: impl Iterator<Item = [f32; 3]> + Clone) -> usize {
        let bounds = Aabb::of_points(positions.clone());
        let accessor = self.floats("VEC3", positions);
        self.accessors[accessor]["min"] = json!(bounds.min);
        self.accessors[accessor]["max"] = json!(bounds.max);
        accessor
    }

    /// Appends vectors of floats; returns the accessor index.
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

    /// Appends indices below `vertices`, in 16 bits if they fit; returns the accessor index.
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

    /// Appends an image; returns its JSON.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) for a damaged WebP texture.
    pub fn image(&mut self, texture: &Texture) -> Result<Value> {
        let start = self.bytes.len();
        let mime = match texture.format {
            TextureFormat::Png => "image/png",
            TextureFormat::Jpeg => "image/jpeg",
            TextureFormat::Webp => "image/png",
        };
        match texture.format {
            TextureFormat::Webp => {
                let pixels = texture.decode()?;
                let size = [pixels.width, pixels.height];
                self.bytes.extend(encode::png(&texture.name, image::ColorType::Rgba8, size, &pixels.rgba)?);
            }
            TextureFormat::Png | TextureFormat::Jpeg => self.bytes.extend(&texture.bytes),
        }
        let view = self.view(start, None);
        let mut image = json!({ "bufferView": view, "mimeType": mime });
        if !texture.name.is_empty() {
            image["name"] = json!(texture.name);
        }
        Ok(image)
    }

    /// Adds the buffer, views and accessors, if there are any, to `document`; returns it and the
    /// bytes.
    pub fn into_parts(self, mut document: Value) -> (Value, Vec<u8>) {
        if self.bytes.is_empty() {
            return (document, self.bytes);
        }
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        (document, self.bytes)
    }

    /// Adds a bufferView of the bytes from `start` on, and pads to the next multiple of 4.
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
