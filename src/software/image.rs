//! A finished picture: 8-bit sRGB pixels, which can be written as PNG.

use crate::{Error, Result, file, material::encode};
use std::path::Path;

/// Maximum width and height of a drawn picture, in pixels; a sheet of several may be wider.
pub const MAX_IMAGE_SIDE: u32 = 16384;

/// Picture in sRGB with straight alpha, 8 bits per channel, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, rgba: [u8; 4]) -> Self {
        Self { width, height, rgba: rgba.repeat(width as usize * height as usize) }
    }

    /// Returns the four bytes of pixel (x, y), or `None` outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 4]> {
        let inside = x < self.width && y < self.height;
        let at = 4 * (y as usize * self.width as usize + x as usize);
        inside.then(|| self.rgba.get(at..at + 4)?.try_into().ok()).flatten()
    }

    /// Copies `other` with its top left corner at (x, y); pixels outside this picture are left out.
    pub fn paste(&mut self, other: &Image, x: u32, y: u32) {
        let width = other.width.min(self.width.saturating_sub(x)) as usize;
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let from = 4 * (row as usize * other.width as usize);
            let to = 4 * ((y + row) as usize * self.width as usize + x as usize);
            self.rgba[to..to + 4 * width].copy_from_slice(&other.rgba[from..from + 4 * width]);
        }
    }

    /// Places pictures in one row, tops aligned, with `gap_px` white pixels between them. The
    /// result is empty if there are none.
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

    /// Writes a PNG file, whole or not at all, through a temporary file in the same folder.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder or file cannot be written; otherwise as for
    /// [`encode_png`](Self::encode_png).
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<()> {
        file::write_whole(path, &self.encode_png()?)
    }

    /// Encodes the picture as a PNG file.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a picture without pixels or with the wrong number of bytes.
    pub fn encode_png(&self) -> Result<Vec<u8>> {
        let bytes = 4 * self.width as usize * self.height as usize;
        if bytes == 0 || bytes != self.rgba.len() {
            let value = format!("{} x {} with {} bytes", self.width, self.height, self.rgba.len());
            return Err(Error::invalid("picture size", value, "at least 1 x 1 with four bytes a pixel"));
        }
        encode::png("picture", ::image::ColorType::Rgba8, [self.width, self.height], &self.rgba)
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
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a temporary file was left behind");
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
