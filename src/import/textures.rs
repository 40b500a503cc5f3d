//! Turns images into textures. The format is detected from the first bytes, and each image is
//! decoded once to check that it is valid. TGA and KTX2 are converted to PNG.

use super::{alpha_range::AlphaRange, fault::Fault, foreign, ktx2};
use crate::{
    Error,
    material::{Pixels, Texture, TextureFormat, Wrap, bound, decode_tga, encode},
};
use glam::Vec2;
use std::path::Path;

/// Why an image cannot be used, and what to do about it.
#[derive(Debug)]
pub(super) struct Unusable {
    pub(super) reason: String,
    pub(super) fix: String,
}

impl From<String> for Unusable {
    fn from(reason: String) -> Self {
        Self { reason, fix: String::new() }
    }
}

/// The reason and the fix of `fault`, which occurred in a file that the one at `path` refers to.
pub(super) fn unusable(fault: Fault, path: &Path) -> Unusable {
    match fault.at(path) {
        Error::Unreadable { reason, fix, .. } => Unusable { reason, fix },
        Error::Unsupported { feature, fix, .. } => Unusable { reason: format!("{feature} is not supported"), fix },
        Error::Io { path: missing, source } => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let reason = format!("{}: {source}", missing.display());
            Unusable { reason, fix: format!("put the file into the folder {}", folder.display()) }
        }
        other => other.to_string().into(),
    }
}

/// The reason why an AVIF image is not read.
pub(super) const AVIF: &str = "it is an AVIF image";
/// Suggested fix for images in a format that is not read.
const CONVERT: &str = "convert it to PNG and refer to that";

/// The texture in `bytes` and the range of its alpha.
pub(super) fn texture(name: &str, bytes: &[u8]) -> Result<(Texture, AlphaRange), Unusable> {
    if let Some(format) = format_of(bytes) {
        let texture = Texture { name: name.to_owned(), format, bytes: bytes.to_vec() };
        let pixels = texture.decode().map_err(|error| error.to_string())?;
        return Ok((texture, AlphaRange::of(&pixels)));
    }
    let pixels = if bytes.starts_with(ktx2::MAGIC) {
        ktx2::decode(bytes, bound(bytes.len() as u64))
    } else if is_tga(name, bytes) {
        decode_tga(bytes)
    } else {
        return Err(unknown(bytes));
    };
    let reason = |reason| Unusable { reason, fix: CONVERT.to_owned() };
    of_pixels(name, &pixels.map_err(reason)?)
}

/// The pixels as a PNG, and the range of their alpha.
pub(super) fn of_pixels(name: &str, pixels: &Pixels) -> Result<(Texture, AlphaRange), Unusable> {
    let size = [pixels.width, pixels.height];
    let bytes = encode::png(name, image::ColorType::Rgba8, size, &pixels.rgba).map_err(|error| error.to_string())?;
    Ok((Texture { name: name.to_owned(), format: TextureFormat::Png, bytes }, AlphaRange::of(pixels)))
}

/// Alpha of the texel at a texture coordinate.
pub(super) fn alpha(pixels: &Pixels, wrap: [Wrap; 2], uv: Vec2) -> u8 {
    let index = |coordinate: f32, size: u32, wrap: Wrap| {
        let inside = match wrap {
            Wrap::Clamp => coordinate.clamp(0.0, 1.0),
            Wrap::Repeat => coordinate - coordinate.floor(),
            Wrap::Mirror => 1.0 - (coordinate * 0.5 - (coordinate * 0.5).floor()).mul_add(2.0, -1.0).abs(),
        };
        ((inside * size as f32) as u32).min(size.saturating_sub(1)) as usize
    };
    let [x, y] = [index(uv.x, pixels.width, wrap[0]), index(uv.y, pixels.height, wrap[1])];
    pixels.rgba.get((y * pixels.width as usize + x) * 4 + 3).copied().unwrap_or(255)
}

/// Detects the format from the first bytes, because the type declared in a file is often wrong.
fn format_of(bytes: &[u8]) -> Option<TextureFormat> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some(TextureFormat::Png),
        [0xff, 0xd8, 0xff, ..] => Some(TextureFormat::Jpeg),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(TextureFormat::Webp),
        _ => None,
    }
}

/// Last bytes of a TGA file, if its writer follows version 2 of the format.
const TGA_END: &[u8] = b"TRUEVISION-XFILE.\0";

/// Whether the header can be that of a TGA file, which has no first bytes of its own, and the name
/// or the end says so.
fn is_tga(name: &str, bytes: &[u8]) -> bool {
    let is_named = name.get(name.len().saturating_sub(4)..).is_some_and(|end| end.eq_ignore_ascii_case(".tga"));
    let has_header = matches!(bytes, [_, 0 | 1, 1..=3 | 9..=11, _, _, _, _, _, _, _, _, _, _, _, _, _, 8..=32, _, ..]);
    has_header && (is_named || bytes.ends_with(TGA_END))
}

/// The reason why `bytes` are not a texture.
fn unknown(bytes: &[u8]) -> Unusable {
    if let Some((what, fix)) = foreign::pointer(bytes) {
        return Unusable { reason: what, fix: fix.to_owned() };
    }
    let format = match bytes {
        [b'D', b'D', b'S', b' ', ..] => "it is a DDS image",
        [b'B', b'M', ..] => "it is a BMP image",
        [b'G', b'I', b'F', b'8', ..] => "it is a GIF image",
        [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => "it is a TIFF image",
        [b'8', b'B', b'P', b'S', ..] => "it is a PSD image",
        [0x76, 0x2f, 0x31, 0x01, ..] => "it is an EXR image",
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', b'f', ..] => AVIF,
        [0xab, b'K', b'T', b'X', b' ', b'1', b'1', ..] => "it is a KTX image of version 1",
        _ => "it is not a picture",
    };
    Unusable { reason: format!("{format}; PNG, JPEG, WebP, TGA and KTX2 are read"), fix: CONVERT.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_images_are_no_textures() {
        assert!(texture("a", b"\x89PNG\r\n\x1a\n").is_err());
        assert!(texture("a", b"DDS and more").unwrap_err().reason.contains("a DDS image"));
        assert!(texture("a", b"").is_err());
        assert!(texture("a.tga", &[0; 40]).is_err());
        assert!(
            texture("a", b"version https://git-lfs.github.com/spec/v1\nsize 7\n").unwrap_err().fix.contains("git lfs")
        );
    }

    #[test]
    fn damaged_ktx2_is_refused_before_it_is_decoded() {
        let mut bytes = ktx2::MAGIC.to_vec();
        bytes.resize(400, 0);
        assert!(texture("a", &bytes).unwrap_err().reason.contains("0 x 0"), "no size");
        bytes[20..24].copy_from_slice(&4u32.to_le_bytes());
        bytes[24..28].copy_from_slice(&4u32.to_le_bytes());
        bytes[36] = 1;
        bytes[48..52].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(texture("a", &bytes).unwrap_err().reason.contains("damaged"));
        for length in 0..bytes.len() {
            assert!(texture("a", &bytes[..length]).is_err());
        }
    }
}
