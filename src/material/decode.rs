//! Texture decoding, with memory use bounded by the size of the encoded image.
//!
//! A few hundred bytes can encode 8192 x 8192 texels of one colour. The memory needed for decoding
//! is estimated from the image's header, and an image that exceeds [`bound`] is rejected before
//! anything is allocated. At 4096 x 4096 texels and 8 bits per channel, the bound admits a PNG from
//! about 60 kilobytes (the size of a single-colour one), any JPEG with a single scan, and a JPEG
//! with several scans or a WebP from two megabytes.

use super::{MAX_TEXTURE_SIDE, Pixels, Texture, TextureFormat};
use crate::{Error, Result};
use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// Bytes that decoding may allocate per encoded byte, and on top of that for any image.
const BOUND: [u64; 2] = [64, 64 * MEGABYTE];
/// Bytes that a decoder needs for any image. Measured: 160,000.
const DECODER_BYTES: u64 = 400_000;
/// Maximum size of auxiliary data such as a colour profile, whose buffers grow by doubling. Texels
/// are not included.
const MAX_ASIDE_BYTES: u64 = 16 * MEGABYTE;
/// Bytes in a megabyte.
const MEGABYTE: u64 = 1_000_000;
/// Bytes per texel that the decoders need on top of their output (measured): for a JPEG with
/// several scans the coefficients of up to four components, for a WebP luma, chroma, alpha and
/// colour.
const SCANS_TEXEL_BYTES: u64 = 8;
const WEBP_TEXEL_BYTES: u64 = 7;
/// Second bytes of the JPEG markers that start a progressive frame and a scan. The first byte is
/// 0xff, which never precedes these values in a scan's data.
const PROGRESSIVE: u8 = 0xc2;
const SCAN: u8 = 0xda;

impl Texture {
    /// Decodes the image.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable), with the texture's name as the path, when the bytes are
    /// damaged, when a side of the image exceeds [`MAX_TEXTURE_SIDE`], or when decoding needs more
    /// than 64 MB plus 64 bytes per encoded byte.
    pub fn decode(&self) -> Result<Pixels> {
        let unreadable = |reason: String| {
            let fix = "export the image again as PNG with 8 bits per channel, at most 8192 texels on a side";
            Error::unreadable(format!("texture {:?}", self.name), reason.replace('\n', " "), fix)
        };
        let failed = |error: image::ImageError| unreadable(error.to_string());
        let decoder = self.decoder().map_err(failed)?;
        let held = self.held_bytes(&decoder);
        let bound = bound(self.bytes.len() as u64);
        if held > bound {
            let (width, height) = decoder.dimensions();
            let sizes = format!("decoding to {width} x {height} texels needs {} MB", held / MEGABYTE);
            return Err(unreadable(format!(
                "{sizes}, but its {} bytes account for only {} MB",
                self.bytes.len(),
                bound / MEGABYTE
            )));
        }
        decoded(decoder).map_err(failed)
    }

    /// Peak memory of [`decoded`] in bytes.
    fn held_bytes(&self, decoder: &impl ImageDecoder) -> u64 {
        let (width, height) = decoder.dimensions();
        let texels = u64::from(width) * u64::from(height);
        let wide = if channels(decoder.color_type()).is_none() { decoder.total_bytes() } else { 0 };
        let inner = match self.format {
            TextureFormat::Jpeg if self.has_scans() => SCANS_TEXEL_BYTES,
            TextureFormat::Png | TextureFormat::Jpeg => 0,
            TextureFormat::Webp => WEBP_TEXEL_BYTES,
        };
        DECODER_BYTES + texels * (4 + inner) + wide
    }

    /// Whether a JPEG must be buffered until its last scan: it is progressive or has several scans.
    fn has_scans(&self) -> bool {
        let markers = |second| self.bytes.windows(2).filter(move |pair| *pair == [0xff, second]).count();
        markers(PROGRESSIVE) > 0 || markers(SCAN) > 1
    }

    fn decoder(&self) -> image::ImageResult<impl ImageDecoder + '_> {
        let format = match self.format {
            TextureFormat::Png => image::ImageFormat::Png,
            TextureFormat::Jpeg => image::ImageFormat::Jpeg,
            TextureFormat::Webp => image::ImageFormat::WebP,
        };
        limited(&self.bytes, format)
    }
}

impl Pixels {
    /// Reads a PNG, JPEG or WebP file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Unreadable`] for a file of another kind, and as
    /// [`Texture::decode`].
    pub fn read(path: impl AsRef<std::path::Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let extension = path.extension().map_or(String::new(), |end| end.to_string_lossy().to_lowercase());
        let format = match &extension[..] {
            "png" => TextureFormat::Png,
            "jpg" | "jpeg" => TextureFormat::Jpeg,
            "webp" => TextureFormat::Webp,
            _ => return Err(Error::unreadable(path, "is no .png, .jpg or .webp", "save the picture as a PNG")),
        };
        Texture { name: path.display().to_string(), format, bytes }.decode()
    }
}

/// A decoder that refuses large sides and large auxiliary data.
fn limited(bytes: &[u8], format: image::ImageFormat) -> image::ImageResult<impl ImageDecoder + '_> {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_SIDE);
    limits.max_image_height = Some(MAX_TEXTURE_SIDE);
    limits.max_alloc = Some(MAX_ASIDE_BYTES);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    reader.into_decoder()
}

/// Decodes a TGA image, which no model keeps, within the same bounds.
///
/// # Errors
/// The reason, in a few words.
#[cfg(feature = "simplify")]
pub(crate) fn decode_tga(bytes: &[u8]) -> std::result::Result<Pixels, String> {
    let failed = |error: image::ImageError| error.to_string().replace('\n', " ");
    let decoder = limited(bytes, image::ImageFormat::Tga).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let held = DECODER_BYTES + u64::from(width) * u64::from(height) * 8;
    if held > bound(bytes.len() as u64) {
        return Err(format!("decoding to {width} x {height} texels needs more memory than its size accounts for"));
    }
    decoded(decoder).map_err(failed)
}

/// Decodes the luminance of an image as stored, in 16 bits, within the same bounds.
///
/// # Errors
/// The reason, in a few words.
pub(crate) fn decode_grey(
    bytes: &[u8],
    format: image::ImageFormat,
) -> std::result::Result<image::ImageBuffer<image::Luma<u16>, Vec<u16>>, String> {
    let failed = |error: image::ImageError| error.to_string().replace('\n', " ");
    let decoder = limited(bytes, format).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    // What is decoded, what the decoder holds, and the luminance.
    let texels = u64::from(width) * u64::from(height);
    let held = DECODER_BYTES + decoder.total_bytes() + texels * (SCANS_TEXEL_BYTES + 2);
    if held > bound(bytes.len() as u64) {
        return Err(format!("decoding to {width} x {height} texels needs more memory than its size accounts for"));
    }
    Ok(DynamicImage::from_decoder(decoder).map_err(failed)?.into_luma16())
}

/// Maximum memory, in bytes, for decoding an image of `length` bytes.
pub(crate) fn bound(length: u64) -> u64 {
    BOUND[0] * length + BOUND[1]
}

/// Number of 8-bit channels; `None` if channels are wider.
fn channels(color: ColorType) -> Option<usize> {
    match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Some(color.channel_count().into()),
        _ => None,
    }
}

fn decoded(decoder: impl ImageDecoder) -> image::ImageResult<Pixels> {
    let (width, height) = decoder.dimensions();
    let Some(channels) = channels(decoder.color_type()) else {
        return Ok(Pixels { width, height, rgba: DynamicImage::from_decoder(decoder)?.into_rgba8().into_raw() });
    };
    let texels = width as usize * height as usize;
    let mut rgba = vec![0; texels * 4];
    decoder.read_image(&mut rgba[..texels * channels])?;
    spread(&mut rgba, channels);
    Ok(Pixels { width, height, rgba })
}

/// Expands the texels of `channels` bytes at the front of `rgba` to four bytes each, in place from
/// last to first.
fn spread(rgba: &mut [u8], channels: usize) {
    if channels == 4 {
        return;
    }
    for texel in (0..rgba.len() / 4).rev() {
        let from = &rgba[texel * channels..][..channels];
        let whole = match *from {
            [grey] => [grey, grey, grey, 255],
            [grey, alpha] => [grey, grey, grey, alpha],
            [red, green, blue] => [red, green, blue, 255],
            _ => continue,
        };
        rgba[texel * 4..][..4].copy_from_slice(&whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_channels_decodes_as_the_image_librarys_own_conversion_has_it() {
        let picture = image::RgbaImage::from_fn(7, 5, |x, y| {
            image::Rgba([x * 36, y * 60, x * y * 9, 255 - x * 30].map(|v| v as u8))
        });
        let picture = DynamicImage::from(picture);
        for kind in [
            DynamicImage::from(picture.to_luma8()),
            DynamicImage::from(picture.to_luma_alpha8()),
            DynamicImage::from(picture.to_rgb8()),
            picture.clone(),
            DynamicImage::from(picture.to_rgb16()),
        ] {
            let mut bytes = Cursor::new(Vec::new());
            kind.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            let texture = Texture { name: "kind".into(), format: TextureFormat::Png, bytes: bytes.into_inner() };
            assert!(texture.decode().unwrap().rgba == kind.to_rgba8().into_raw(), "{:?}", kind.color());
        }
    }
}
