//! From a texture's encoded bytes to its texels, within memory that those bytes account for.
//!
//! A few hundred bytes can encode 8192 x 8192 texels of one colour. What decoding would hold is told from the image's head
//! and refused beyond [`bound`] before it is allocated. Within it is a PNG of 4096 x 4096 texels with 8 bits a channel
//! from about 60 kilobytes on (one of a single colour) and any JPEG in one scan; a JPEG in several scans and a WebP from two
//! megabytes on.

use super::{MAX_TEXTURE_SIDE, Pixels, Texture, TextureFormat};
use crate::{Error, Result};
use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// Bytes that decoding may hold for each encoded byte, and for any image.
const BOUND: [u64; 2] = [64, 64 * MEGABYTE];
/// Bytes that a decoder holds for any image. Measured: 160,000.
const DECODER_BYTES: u64 = 400_000;
/// Most bytes of what an image holds aside, such as a colour profile: they grow by doubling. The texels do not count.
const MAX_ASIDE_BYTES: u64 = 16 * MEGABYTE;
/// Bytes in a megabyte.
const MEGABYTE: u64 = 1_000_000;
/// Bytes that the decoders hold for a texel beside what they give: of a JPEG in several scans the coefficients of up to four
/// components, of a WebP luma, chroma, alpha and colour (measured).
const SCANS_TEXEL_BYTES: u64 = 8;
const WEBP_TEXEL_BYTES: u64 = 7;
/// Second byte of the markers that start a progressive frame and a scan of a JPEG; the first is 0xff, which no other data
/// of a scan holds before them.
const PROGRESSIVE: u8 = 0xc2;
const SCAN: u8 = 0xda;

impl Texture {
    /// Decodes the image.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable), with the texture's name as the path, when the bytes are damaged, and when the image
    /// is larger than [`MAX_TEXTURE_SIDE`] on a side or takes more memory than 64 bytes for each of its own and 64 MB.
    pub fn decode(&self) -> Result<Pixels> {
        let unreadable = |reason: String| {
            let fix = "export the image again as PNG with 8 bits a channel, at most 8192 on a side";
            Error::unreadable(format!("texture {:?}", self.name), reason.replace('\n', " "), fix)
        };
        let failed = |error: image::ImageError| unreadable(error.to_string());
        let decoder = self.decoder().map_err(failed)?;
        let held = self.held_bytes(&decoder);
        let bound = bound(self.bytes.len() as u64);
        if held > bound {
            let (width, height) = decoder.dimensions();
            let sizes = format!("decodes to {width} x {height} texels in {} MB", held / MEGABYTE);
            return Err(unreadable(format!(
                "{sizes}, its {} bytes account for {}",
                self.bytes.len(),
                bound / MEGABYTE
            )));
        }
        decoded(decoder).map_err(failed)
    }

    /// Bytes that [`decoded`] holds at once.
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

    /// Whether a JPEG is kept until its last scan: a progressive one, or one of several scans.
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
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_TEXTURE_SIDE);
        limits.max_image_height = Some(MAX_TEXTURE_SIDE);
        limits.max_alloc = Some(MAX_ASIDE_BYTES);
        let mut reader = ImageReader::with_format(Cursor::new(&self.bytes), format);
        reader.limits(limits);
        reader.into_decoder()
    }
}

/// Bytes that decoding of `length` bytes may hold.
fn bound(length: u64) -> u64 {
    BOUND[0] * length + BOUND[1]
}

/// Channels of 8 bits each; `None` for wider ones.
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

/// Texels of `channels` bytes at the front of `rgba` become texels of four, from the last to the first.
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
