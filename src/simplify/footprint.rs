//! The pixels that one leaf covers in one view at one scale, with their depths.

use super::{
    enlarge::Growth,
    layers::Layers,
    prune::Scene,
    raster::cover,
    shapes::Shapes,
    views::{ScreenPoint, ViewSet},
};

/// A worker that rasterises one leaf at a time and answers which pixels it covered.
#[derive(Debug, Clone)]
pub struct Footprint {
    /// (pixel, depth), each pixel once with the depth of the leaf's nearest triangle there.
    pub fragments: Vec<(u32, u32)>,
    /// For each pixel of the view, where its fragment would be in `fragments`; stale entries are told by the pixel there.
    slots: Vec<u32>,
    projected: Vec<Option<ScreenPoint>>,
}

impl Footprint {
    /// A worker for views of `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self { fragments: Vec::new(), slots: vec![0; pixels], projected: Vec::new() }
    }

    /// Rasterises leaf `leaf` at `scale` in view `view`, replacing what was there.
    pub fn rasterise(&mut self, scene: Scene<'_>, view: usize, leaf: u32, scale: f32) {
        self.rasterise_where(scene, view, leaf, scale, |_, _| true);
    }

    /// As [`rasterise`](Self::rasterise), keeping only those (pixel, depth) that are `wanted`.
    pub fn rasterise_where(
        &mut self,
        Scene { shapes, views, masks, .. }: Scene<'_>,
        view: usize,
        leaf: u32,
        scale: f32,
        wanted: impl Fn(u32, u32) -> bool,
    ) {
        self.fragments.clear();
        let camera = &views.views[view];
        let shape = &shapes.shapes[leaf as usize];
        let mut projected = std::mem::take(&mut self.projected);
        shapes.project(views, camera, shape, scale, &mut projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &projected) else { continue };
            let mut planes = None;
            cover(views.resolution, corners.map(|corner| (corner.x, corner.y)), |y, first, last| {
                let (alpha, depth) = planes.get_or_insert_with(|| {
                    let alpha = shapes.alpha_test(shape, triangle, &corners);
                    (alpha, shapes.depth_plane(views, camera, shape, triangle, scale))
                });
                let alpha = alpha.row(masks, y);
                for x in first..=last {
                    let (pixel, depth) = ((y * i64::from(views.resolution) + x) as u32, depth.depth(x, y));
                    if wanted(pixel, depth) && alpha.is_none_or(|alpha| alpha.covers(x)) {
                        self.add(pixel, depth);
                    }
                }
            });
        }
        self.projected = projected;
    }

    /// Whether a leaf that changes from one scale to another comes before all that is in front in a view, at least perhaps.
    pub fn may_show(&mut self, scene: Scene<'_>, view: usize, growth: Growth, layers: &Layers) -> bool {
        let shape = &scene.shapes.shapes[growth.target as usize];
        [growth.from, growth.to].into_iter().any(|scale| {
            let camera = &scene.views.views[view];
            let extent = scene.shapes.extent(scene.views, camera, shape, scale, &mut self.projected);
            extent.is_none_or(|extent| !layers.hides(&extent))
        })
    }

    /// Lists the pixels within the leaf's triangles instead, whatever its alpha: some it does not cover, some twice, and
    /// all with depth 0.
    pub fn outline(&mut self, shapes: &Shapes, views: &ViewSet, view: usize, leaf: u32, scale: f32) {
        self.fragments.clear();
        let shape = &shapes.shapes[leaf as usize];
        shapes.project(views, &views.views[view], shape, scale, &mut self.projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &self.projected) else { continue };
            cover(views.resolution, corners.map(|corner| (corner.x, corner.y)), |y, first, last| {
                let row = y * i64::from(views.resolution);
                self.fragments.extend((first..=last).map(|x| ((row + x) as u32, 0)));
            });
        }
    }

    /// The depth at `pixel`, if the leaf covers it.
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
