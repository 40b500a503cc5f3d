//! PNG encoding of texels.

use crate::{Error, Result};
use image::{ColorType, ImageFormat};

/// Encodes 8-bit texels, rows from the top, as a PNG; `name` is the image's name in messages.
///
/// # Errors
/// [`Unreadable`](Error::Unreadable), in practice never: the PNG is written to memory.
pub(crate) fn png(name: &str, color: ColorType, [width, height]: [u32; 2], texels: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut bytes, texels, width, height, color, ImageFormat::Png)
        .map_err(|error| Error::unreadable(name, error.to_string(), "supply the image as PNG or JPEG"))?;
    Ok(bytes.into_inner())
}
