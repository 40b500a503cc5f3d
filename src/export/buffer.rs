//! The binary part of a GLB: arrays, and the bufferViews and accessors that describe them.

use crate::{
    Result,
    bounds::Aabb,
    material::{Texture, TextureFormat, encode},
};
use serde_json::{Value, json};

/// Component types.
const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
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

    /// Appends vectors of fractions of 65,535; with their bounds if they are positions. Returns the
    /// accessor index.
    pub fn shorts<const N: usize>(
        &mut self,
        shape: &str,
        vectors: impl Iterator<Item = [u16; N]> + Clone,
        is_position: bool,
    ) -> usize {
        let accessor =
            self.fractions(shape, UNSIGNED_SHORT, vectors.clone().map(|vector| vector.map(u16::to_le_bytes)));
        if is_position {
            let ends =
                |least: fn(u16, u16) -> u16| vectors.clone().reduce(|a, b| std::array::from_fn(|i| least(a[i], b[i])));
            self.accessors[accessor]["min"] = json!(ends(u16::min).map(|end| end.to_vec()));
            self.accessors[accessor]["max"] = json!(ends(u16::max).map(|end| end.to_vec()));
        }
        accessor
    }

    /// Appends vectors of fractions of 127, from -1 to 1; returns the accessor index.
    pub fn signed_bytes<const N: usize>(&mut self, shape: &str, vectors: impl Iterator<Item = [i8; N]>) -> usize {
        self.fractions(shape, BYTE, vectors.map(|vector| vector.map(i8::to_le_bytes)))
    }

    /// Appends vectors of fractions of 255; returns the accessor index.
    pub fn bytes<const N: usize>(&mut self, shape: &str, vectors: impl Iterator<Item = [u8; N]>) -> usize {
        self.fractions(shape, UNSIGNED_BYTE, vectors.map(|vector| vector.map(u8::to_le_bytes)))
    }

    /// Appends vectors of integers that stand for fractions, each padded to a multiple of 4 bytes.
    fn fractions<const N: usize, const B: usize>(
        &mut self,
        shape: &str,
        component: u32,
        vectors: impl Iterator<Item = [[u8; B]; N]>,
    ) -> usize {
        let start = self.bytes.len();
        let stride = (N * B).next_multiple_of(4);
        let mut count = 0;
        for vector in vectors {
            self.bytes.extend(vector.as_flattened());
            count += 1;
            self.bytes.resize(start + count * stride, 0);
        }
        let view = self.view(start, Some(ARRAY_BUFFER));
        self.views[view]["byteStride"] = json!(stride);
        self.accessor(json!({
            "bufferView": view, "componentType": component, "normalized": true, "count": count, "type": shape,
        }))
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
