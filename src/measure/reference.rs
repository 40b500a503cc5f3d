//! Reference pictures of the full plant.

use super::{
    held_out,
    metrics::{Comparison, Quality},
};
use crate::{
    LookAt, Plant, Result,
    bounds::Aabb,
    software::{Background, DrawList, DrawOptions, Image, Painter, Toning},
};
use rayon::prelude::*;

/// Pictures of a full plant from the held-out views, at one size.
pub struct Reference {
    cameras: Vec<LookAt>,
    crown: Aabb,
    side: u32,
    full: Vec<Image>,
}

impl Reference {
    /// Draws `plant` from all held-out views, `side` pixels on a side.
    ///
    /// # Errors
    /// Same as [`Painter::new`] and [`Painter::draw`].
    pub fn new(plant: &Plant, side: u32) -> Result<Self> {
        let cameras = held_out::cameras(&plant.sphere());
        let list = DrawList::of_plant(plant);
        let painter = Painter::new(&plant.materials, &plant.textures)?;
        let full = pictures(&painter, &list, &cameras, side, measured(None))?;
        Ok(Self { cameras, crown: list.crown, side, full })
    }

    /// Mean quality over the views of a reduced plant: `list`, drawn with the materials of
    /// `painter`. Lighting uses the full plant's crown.
    ///
    /// # Errors
    /// Same as [`Painter::draw`].
    pub fn quality(&self, painter: &Painter<'_>, list: DrawList<'_>, tone: Option<Toning>) -> Result<Quality> {
        let list = DrawList { crown: self.crown, ..list };
        let reduced = pictures(painter, &list, &self.cameras, self.side, measured(tone))?;
        let pairs = self.full.par_iter().zip(&reduced);
        let sums: Vec<Comparison> =
            pairs.map(|(full, reduced)| Comparison::of(full, reduced)).collect::<Result<_>>()?;
        Ok(sums.into_iter().fold(Comparison::default(), Comparison::plus).quality())
    }
}

/// Draws a square picture of `list`, `side` pixels on a side, from each camera, in parallel.
///
/// # Errors
/// Same as [`Painter::draw`].
pub fn pictures(
    painter: &Painter<'_>,
    list: &DrawList<'_>,
    cameras: &[LookAt],
    side: u32,
    options: DrawOptions,
) -> Result<Vec<Image>> {
    cameras.par_iter().map(|camera| painter.draw(list, &camera.camera(side), [side; 2], &options)).collect()
}

/// Options for measured pictures, whose alpha is their coverage.
pub fn measured(tone: Option<Toning>) -> DrawOptions {
    DrawOptions { background: Background::Transparent, tone, ..DrawOptions::default() }
}
