//! A finished picture: 8-bit sRGB in memory, and written as PNG.

use crate::{Error, Result, file};
use std::path::Path;

/// Greatest width and height of a picture; a sheet of several may be wider.
pub const MAX_IMAGE_SIDE: u32 = 16384;

/// sRGB colour with straight alpha, 8 bits each, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, rgba: [u8; 4]) -> Self {
        Self { width, height, rgba: rgba.repeat(width as usize * height as usize) }
    }

    /// The four bytes of pixel (x, y), or `None` outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 4]> {
        let inside = x < self.width && y < self.height;
        let at = 4 * (y as usize * self.width as usize + x as usize);
        inside.then(|| self.rgba.get(at..at + 4)?.try_into().ok()).flatten()
    }

    /// Copies `other` to (x, y); what does not fit is left out.
    pub fn paste(&mut self, other: &Image, x: u32, y: u32) {
        let width = other.width.min(self.width.saturating_sub(x)) as usize;
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let from = 4 * (row as usize * other.width as usize);
            let to = 4 * ((y + row) as usize * self.width as usize + x as usize);
            self.rgba[to..to + 4 * width].copy_from_slice(&other.rgba[from..from + 4 * width]);
        }
    }

    /// Several pictures in one row, tops aligned, `gap_px` white pixels between them; empty for none.
    pub fn side_by_side(images: &[Image], gap_px: u32) -> Self {
        let gaps = gap_px * (images.len() as u32).saturating_sub(1);
        let width = images.iter().map(|image| image.width).sum::<u32>() + gaps;
        let height = images.iter().map(|image| image.height).max().unwrap_or(0);
        let mut sheet = Self::filled(width, height, [255; 4]);
        let mut x = 0;
        for image in images {
            sheet.paste(image, x, 0);
            x += image.width + gap_px;
        }
        sheet
    }

    /// Writes a PNG: whole or not at all, through a temporary file in the same folder.
    ///
    /// # Errors
    /// [`Error::Io`] when the folder or file cannot be written; [`Error::InvalidOption`] for a picture without pixels.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<()> {
        file::write_whole(path, &self.encode_png()?)
    }

    pub(crate) fn encode_png(&self) -> Result<Vec<u8>> {
        use ::image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
        let mut png = Vec::new();
        let bytes = 4 * self.width as usize * self.height as usize;
        let encodable = bytes > 0 && bytes == self.rgba.len();
        let written = encodable.then(|| {
            PngEncoder::new(&mut png).write_image(&self.rgba, self.width, self.height, ExtendedColorType::Rgba8)
        });
        match written {
            Some(Ok(())) => Ok(png),
            _ => {
                let value = format!("{} x {} with {} bytes", self.width, self.height, self.rgba.len());
                Err(Error::invalid("picture size", value, "at least 1 x 1 with four bytes a pixel"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_png_reads_back_byte_for_byte() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let image = Image { width: 3, height: 2, rgba: (0..24).collect() };
        image.write_png(&path).unwrap();
        let read = ::image::open(&path).unwrap().into_rgba8();
        assert_eq!((read.width(), read.height(), read.into_raw()), (3, 2, image.rgba));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file stayed");
    }

    #[test]
    fn a_missing_folder_or_an_empty_picture_is_an_error_that_names_it() {
        let missing = Image::filled(1, 1, [0; 4]).write_png("no/such/folder/a.png").unwrap_err();
        assert!(missing.to_string().starts_with("no/such/folder/a.png: "), "{missing}");
        let empty = Image::filled(0, 5, [0; 4]).write_png("a.png").unwrap_err();
        assert!(empty.to_string().contains("0 x 5"), "{empty}");
    }

    #[test]
    fn side_by_side_keeps_each_picture_at_its_place() {
        let sheet = Image::side_by_side(&[Image::filled(2, 1, [1; 4]), Image::filled(1, 2, [2; 4])], 3);
        assert_eq!((sheet.width, sheet.height), (6, 2));
        assert_eq!(sheet.pixel(1, 0), Some([1; 4]));
        assert_eq!(sheet.pixel(2, 0), Some([255; 4]));
        assert_eq!(sheet.pixel(5, 1), Some([2; 4]));
        assert_eq!(sheet.pixel(6, 0), None);
    }
}
