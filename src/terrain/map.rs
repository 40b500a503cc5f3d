//! Maps of shares or heights over an area.

use crate::{Error, Result};

/// Largest number of texels of a map.
const MOST_TEXELS: u64 = 1 << 28;
/// Bits of the weights between texels.
#[cfg(feature = "scene")]
const WEIGHT_BITS: u32 = 8;

/// A grid of values from 0 to 65535 over an area: the first row lies at the least z, the first
/// texel of a row at the least x.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Map {
    size: [u32; 2],
    texels: Vec<u16>,
}

#[cfg(feature = "scene")]
/// Texels around a point, and how near it is to the second ones, from 0 to 256.
struct Around {
    texels: [[u16; 2]; 2],
    weights: [u32; 2],
}

impl Map {
    /// A map of `width` x `height` texels, row by row.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for no texels, more than 2^28, or a number other than the
    /// sides say.
    pub fn new([width, height]: [u32; 2], texels: Vec<u16>) -> Result<Self> {
        let count = u64::from(width) * u64::from(height);
        if count != texels.len() as u64 || !(1..=MOST_TEXELS).contains(&count) {
            let value = format!("{width} x {height} texels, {} given", texels.len());
            return Err(Error::invalid("map", value, "as many texels as its sides say, 1 to 2^28"));
        }
        Ok(Self { size: [width, height], texels })
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Texels, row by row.
    pub fn texels(&self) -> &[u16] {
        &self.texels
    }

    /// Texels, row by row, to be painted. Tiles of patches must then be made again.
    pub fn texels_mut(&mut self) -> &mut [u16] {
        &mut self.texels
    }

    /// Share of 2^32 at a place, as fractions of the sides from 0 to 1. Texels lie in the middle of
    /// their cells; between them the share is bilinear in steps of 1/256, in integers alone.
    #[cfg(feature = "scene")]
    pub(crate) fn share(&self, at: [f64; 2]) -> u64 {
        let Around { texels, weights: [x, z] } = self.around(at);
        let row = |[a, b]: [u16; 2]| u32::from(a) * ((1 << WEIGHT_BITS) - x) + u32::from(b) * x;
        let [near, far] = texels.map(row).map(u64::from);
        let sum = near * u64::from((1 << WEIGHT_BITS) - z) + far * u64::from(z);
        let white = u64::from(u16::MAX) << (2 * WEIGHT_BITS);
        (sum << 32) / white
    }

    /// Value at a place, from 0 to 1, bilinear between texels.
    pub(super) fn value(&self, at: [f64; 2]) -> f64 {
        let [(x0, x1, x), (z0, z1, z)] = [0, 1].map(|axis| self.texel(at, axis));
        let of = |x: u32, z: u32| f64::from(self.texels[(z * self.size[0] + x) as usize]);
        let row = |z: u32| of(x0, z) * (1.0 - x) + of(x1, z) * x;
        (row(z0) * (1.0 - z) + row(z1) * z) / f64::from(u16::MAX)
    }

    #[cfg(feature = "scene")]
    fn around(&self, at: [f64; 2]) -> Around {
        let [(x0, x1, x), (z0, z1, z)] = [0, 1].map(|axis| self.texel(at, axis));
        let of = |x: u32, z: u32| self.texels[(z as usize) * self.size[0] as usize + x as usize];
        let weight = |share: f64| (share * f64::from(1 << WEIGHT_BITS)) as u32;
        Around { texels: [[of(x0, z0), of(x1, z0)], [of(x0, z1), of(x1, z1)]], weights: [weight(x), weight(z)] }
    }

    /// The two texels beside a place along an axis, and how near it is to the second.
    fn texel(&self, at: [f64; 2], axis: usize) -> (u32, u32, f64) {
        let last = f64::from(self.size[axis] - 1);
        let exact = (at[axis] * f64::from(self.size[axis]) - 0.5).clamp(0.0, last);
        // The place is not negative, so this rounds down.
        let first = exact as u32;
        (first, (first + 1).min(self.size[axis] - 1), exact - f64::from(first))
    }
}

/// Reads maps from image files.
#[cfg(feature = "textures")]
mod decode {
    use super::*;
    use std::path::Path;

    impl Map {
        /// Reads a PNG, JPEG, TGA or WebP: its luminance in 8 or 16 bits, as stored, without gamma.
        ///
        /// # Errors
        /// [`Error::Io`]; [`Error::Unreadable`] for a file that is no such picture.
        pub fn read(path: impl AsRef<Path>) -> Result<Self> {
            let path = path.as_ref();
            let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
            let unreadable = |reason: String| {
                Error::unreadable(path, reason.replace('\n', " "), "save the map as a PNG with 8 or 16 bits")
            };
            let format = image::ImageFormat::from_path(path).map_err(|error| unreadable(error.to_string()))?;
            let grey = crate::material::decode_grey(&bytes, format).map_err(unreadable)?;
            let size = [grey.width(), grey.height()];
            Self::new(size, grey.into_raw())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "scene")]
    #[test]
    fn shares_are_exact_at_texels_and_bilinear_between_them() {
        let map = Map::new([2, 2], vec![0, 65535, 65535, 0]).unwrap();
        assert_eq!(map.share([0.25, 0.25]), 0);
        assert_eq!(map.share([0.75, 0.25]), 1 << 32);
        assert_eq!(map.share([0.5, 0.5]), 1 << 31);
        assert_eq!(map.share([-3.0, 9.0]), 1 << 32, "places outside take the nearest texel");
        assert_eq!(map.share([f64::NAN, 0.0]), 0);
        assert!((map.value([0.375, 0.25]) - 0.25).abs() < 1e-12);
        for white in [Map::new([1, 1], vec![65535]), Map::new([3, 1], vec![65535; 3])] {
            assert_eq!(white.unwrap().share([0.4, 0.6]), 1 << 32);
        }
    }

    #[test]
    fn sides_that_do_not_fit_the_texels_are_refused() {
        assert!(Map::new([0, 4], vec![]).is_err() && Map::new([2, 2], vec![0; 3]).is_err());
        assert!(Map::new([u32::MAX, u32::MAX], vec![0; 1]).is_err());
    }
}
