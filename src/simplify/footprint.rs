//! Pixels that one leaf covers in one view at one scale, with their depths.

use super::{
    raster::cover,
    scene::Scene,
    shapes::Shapes,
    views::{ScreenPoint, ViewSet},
};

/// Rasterises one leaf at a time and looks up the pixels it covers. Reuses its memory.
#[derive(Debug, Clone)]
pub struct Footprint {
    /// (pixel, depth) pairs, each pixel once, with the depth of the leaf's nearest triangle there.
    pub fragments: Vec<(u32, u32)>,
    /// For each pixel of the view, the index of its entry in `fragments`. An index is stale if that
    /// entry belongs to another pixel.
    slots: Vec<u32>,
    projected: Vec<Option<ScreenPoint>>,
}

impl Footprint {
    /// Creates a footprint for views of `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self { fragments: Vec::new(), slots: vec![0; pixels], projected: Vec::new() }
    }

    /// Rasterises leaf `leaf` at `scale` in view `view`, replacing the previous footprint.
    pub fn rasterise(&mut self, scene: Scene<'_>, view: usize, leaf: u32, scale: f32) {
        let Scene { shapes, views, masks, .. } = scene;
        self.fragments.clear();
        let camera = &views.views[view];
        let shape = &shapes.shapes[leaf as usize];
        let tiling = scene.tiling(shape, scale);
        let mut projected = std::mem::take(&mut self.projected);
        shapes.project(views, camera, shape, scale, &mut projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &projected) else { continue };
            let mut planes = None;
            cover(views.resolution, corners.map(|corner| [corner.x, corner.y]), |y, first, last| {
                let (alpha, depth) = planes.get_or_insert_with(|| {
                    let alpha = shapes.alpha_test(shape, triangle, &corners);
                    (alpha, shapes.depth_plane(views, camera, shape, triangle, scale))
                });
                let alpha = alpha.row(masks, tiling.as_ref(), y);
                for x in first..=last {
                    if alpha.is_none_or(|alpha| alpha.covers(x)) {
                        self.add((y * i64::from(views.resolution) + x) as u32, depth.depth(x, y));
                    }
                }
            });
        }
        self.projected = projected;
    }

    /// Lists the pixels inside the leaf's triangles instead, ignoring alpha. Includes pixels that
    /// the leaf does not cover, may include a pixel twice, and has depth 0 everywhere.
    /// [`depth_at`](Self::depth_at) is not valid for an outline.
    pub fn outline(&mut self, shapes: &Shapes, views: &ViewSet, view: usize, leaf: u32, scale: f32) {
        self.fragments.clear();
        let shape = &shapes.shapes[leaf as usize];
        shapes.project(views, &views.views[view], shape, scale, &mut self.projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &self.projected) else { continue };
            cover(views.resolution, corners.map(|corner| [corner.x, corner.y]), |y, first, last| {
                let row = y * i64::from(views.resolution);
                self.fragments.extend((first..=last).map(|x| ((row + x) as u32, 0)));
            });
        }
    }

    /// Returns the depth at `pixel`, or `None` if the leaf does not cover it.
    pub fn depth_at(&self, pixel: u32) -> Option<u32> {
        let &(covered, depth) = self.fragments.get(self.slots[pixel as usize] as usize)?;
        (covered == pixel).then_some(depth)
    }

    fn add(&mut self, pixel: u32, depth: u32) {
        let slot = &mut self.slots[pixel as usize];
        match self.fragments.get_mut(*slot as usize) {
            Some((covered, nearest)) if *covered == pixel => *nearest = depth.min(*nearest),
            _ => {
                *slot = self.fragments.len() as u32;
                self.fragments.push((pixel, depth));
            }
        }
    }
}
