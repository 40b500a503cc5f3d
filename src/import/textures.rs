//! Turns images into textures. The format is detected from the first bytes, and each image is
//! decoded once to check that it is valid.

use crate::material::{Texture, TextureFormat};

/// The texture in `bytes`, or the reason why it cannot be used.
pub(super) fn texture(name: &str, bytes: &[u8]) -> Result<Texture, String> {
    let format = format_of(bytes).ok_or("it is neither PNG, JPEG nor WebP")?;
    let texture = Texture { name: name.to_owned(), format, bytes: bytes.to_vec() };
    texture.decode().map_err(|error| error.to_string())?;
    Ok(texture)
}

/// Returns true if some texel of `texture` has an alpha below 128.
pub(super) fn has_holes(texture: &Texture) -> bool {
    texture.format != TextureFormat::Jpeg
        && texture.decode().is_ok_and(|pixels| pixels.rgba.chunks_exact(4).any(|texel| texel[3] < 128))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_images_are_no_textures() {
        assert!(texture("a", b"\x89PNG\r\n\x1a\n").is_err());
        assert!(texture("a", b"\xabKTX 20\xbb").unwrap_err().contains("neither"));
        assert!(texture("a", b"").is_err());
    }
}
