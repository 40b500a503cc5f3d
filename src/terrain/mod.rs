//! The ground under plants: heights, and triangles as fine as they are seen.
//!
//! ```text
//! Map --HeightMap--> heights, slopes                        plants stand on them
//! HeightMap, colours --Terrain--> camera --> GroundMesh     drawers draw it
//! HeightMap --Horizon--> where rays from an eye meet it      what it hides
//! ```
//!
//! The ground is a grid of right triangles. Each is halved where its longest side's middle would
//! otherwise be seen too high or too low, after P. Lindstrom and V. Pascucci, *Visualization of
//! Large Terrains Made Easy* (IEEE Visualization 2001): whether a point is drawn follows from the
//! point and the eye alone, so that neighbours agree without a search, there are no cracks, and
//! nothing is kept from frame to frame. Between the distance at which a point begins to be drawn
//! and half of it, it rises from where it was: nothing pops.
//!
//! Unlike there, the error of a point is a bound of the distance between the triangles and the
//! whole grid: its own error plus the greatest of those that follow from it.
//!
//! Beyond the map the heights of its edge go on, as plants do that stand there.

mod grid;
mod height;
mod horizon;
mod map;
mod mesh;

use crate::{Error, Result, material::Pixels};

pub use height::HeightMap;
pub use horizon::Horizon;
pub use map::Map;
pub use mesh::{ERROR_PX, GroundMesh, GroundPoint, MOST_TRIANGLES};

use grid::Grid;

/// Largest side of a drawn height map, in texels.
pub const MAX_TERRAIN_SIDE: u32 = 4096;

/// Ground that drawers draw.
#[derive(Debug, Clone)]
pub struct Terrain {
    heights: HeightMap,
    colors: Option<Pixels>,
    grid: Grid,
}

impl Terrain {
    /// Ground of one colour, the look's. O(texels); keeps up to 8 bytes for each of them.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for a map with more than [`MAX_TERRAIN_SIDE`] texels on a side.
    pub fn new(heights: HeightMap) -> Result<Self> {
        let [width, height] = heights.map().size();
        if width.max(height) > MAX_TERRAIN_SIDE {
            let (what, fix) = ("texels on a side of a height map".into(), "make the map smaller".into());
            let [value, limit] = [width.max(height), MAX_TERRAIN_SIDE].map(u64::from);
            return Err(Error::TooLarge { what, value, limit, fix });
        }
        Ok(Self { grid: Grid::new(&heights), heights, colors: None })
    }

    /// The same ground in the colours of a picture over the area of the height map, whose first row
    /// lies at the least z; alpha is ignored. Beyond the area they fade into the look's colour.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a picture without texels.
    pub fn with_colors(self, colors: Pixels) -> Result<Self> {
        let texels = u64::from(colors.width) * u64::from(colors.height);
        if texels == 0 || 4 * texels != colors.rgba.len() as u64 {
            let value = format!("{} x {} texels", colors.width, colors.height);
            return Err(Error::invalid("colors", value, "a picture with four bytes for each of its texels"));
        }
        Ok(Self { colors: Some(colors), ..self })
    }

    /// The heights.
    pub fn heights(&self) -> &HeightMap {
        &self.heights
    }

    /// Linear colour of the texel at a place, for plants that take it; `None` without colours and
    /// beyond the area.
    #[cfg(feature = "software")]
    pub fn color(&self, at: [f64; 2]) -> Option<[f32; 3]> {
        let colors = self.colors.as_ref()?;
        let (corner, sides) = (self.heights.low_corner(), self.heights.size());
        let [x, z] = [(0, colors.width), (1, colors.height)]
            .map(|(axis, texels)| ((at[axis] - corner[axis]) / sides[axis] * f64::from(texels)).floor());
        let inside = (0.0..f64::from(colors.width)).contains(&x) && (0.0..f64::from(colors.height)).contains(&z);
        let first = 4 * (z as usize * colors.width as usize + x as usize);
        inside.then(|| [0, 1, 2].map(|i| crate::srgb::linear(f32::from(colors.rgba[first + i]) / 255.0)))
    }

    /// The colours, if there are any.
    pub fn colors(&self) -> Option<&Pixels> {
        self.colors.as_ref()
    }
}
