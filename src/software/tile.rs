//! Draws one tile of the picture: finds the visible triangle of each sample, then the colour of
//! each pixel.
//!
//! Each pixel has sixteen samples. Triangles are drawn nearest first, so that a pixel whose samples
//! are all nearer is skipped early; a masked texture is sampled only where the triangle is nearer.
//! Colour is computed once for each triangle visible in a pixel, at the centroid of its visible
//! samples.

use super::{
    alpha_test::{AlphaTest, Cutout, Plane, shown},
    ground::PlacedGround,
    light::Light,
    project::{GROUND, Projected, ScreenTriangle},
    samples::{SAMPLES, indices, sample_px, sample_steps},
    sprite::Sprite,
    toning::Toning,
};
use crate::{
    draw::{
        handover::far_samples,
        mips::{Mips, SrgbTable},
        tint::Tint,
    },
    edge::{Edge, SUBPIXEL, twice_area},
    material::Material,
    stochastic::contrast::toned,
};
use glam::{Vec2, Vec3};

/// Side of a tile in pixels: its samples fit into a core's second-level cache.
pub(super) const TILE_PX: u32 = 32;
const NO_OWNER: u32 = u32::MAX;
/// Bit of the owners that are sprites.
const SPRITE: u32 = 1 << 31;

/// Input shared by all tiles.
pub(super) struct Scene<'a> {
    pub(super) projected: &'a Projected<'a>,
    pub(super) materials: &'a [Material],
    pub(super) mips: &'a [Option<Mips>],
    pub(super) srgb: &'a SrgbTable,
    /// One per plant, as in `tones`.
    pub(super) lights: &'a [Light],
    pub(super) tones: &'a [Option<Toning>],
    pub(super) tints: &'a [Tint],
    /// Share of each plant's samples that are left to its impostor.
    pub(super) far: &'a [f32],
    pub(super) sprites: &'a [Sprite<'a>],
    pub(super) ground: Option<&'a PlacedGround<'a>>,
    pub(super) is_orthographic: bool,
    /// Whether each sample is shaded on its own: the middle of several may lie on a texel that none
    /// of them shows.
    pub(super) full_textures: bool,
}

/// Depth and visible triangle of each sample of a tile.
pub(super) struct Tile {
    /// Top left pixel.
    origin: [i64; 2],
    nearness: Vec<[f32; SAMPLES]>,
    owner: Vec<[u32; SAMPLES]>,
    /// Smallest `nearness` of each pixel's samples.
    farthest: Vec<f32>,
}

/// An edge function, and how far each sample's value is from its pixel's.
struct SampledEdge {
    edge: Edge,
    per_sample: [i64; SAMPLES],
}

impl Tile {
    /// Creates an empty tile whose top left pixel is `origin`.
    pub(super) fn new(origin: [u32; 2]) -> Self {
        let pixels = (TILE_PX * TILE_PX) as usize;
        Self {
            origin: origin.map(i64::from),
            nearness: vec![[0.0; SAMPLES]; pixels],
            owner: vec![[NO_OWNER; SAMPLES]; pixels],
            farthest: vec![0.0; pixels],
        }
    }

    /// Draws triangle `index` into the samples where it is the nearest so far.
    pub(super) fn add(&mut self, index: u32, scene: &Scene<'_>) {
        let triangle = &scene.projected.triangles[index as usize];
        if scene.materials.get(triangle.material as usize).is_some_and(Material::is_clear) {
            return;
        }
        let Some([x_range, y_range]) = self.bounds(triangle, scene) else { return };
        let is_hidden = |y: i64| {
            let row = &self.farthest[(y * TILE_PX as i64) as usize..];
            row[x_range.start as usize..x_range.end as usize].iter().all(|&farthest| triangle.nearest <= farthest)
        };
        if y_range.clone().all(is_hidden) {
            return;
        }
        let edges = self.edges(triangle, scene);
        let depth = self.plane(triangle, scene, |corner| corner.nearness as f64);
        let mask = self.alpha_test(triangle, scene);
        let trim = mask.as_ref().zip(triangle.outline).map(|(mask, outline)| mask.trim(outline, &depth));
        let far = scene.far.get(triangle.plant as usize).copied().unwrap_or(0.0);
        for y in y_range {
            for x in x_range.clone() {
                let pixel = (y * TILE_PX as i64 + x) as usize;
                if triangle.nearest <= self.farthest[pixel] || trim.as_ref().is_some_and(|trim| trim.misses([x, y])) {
                    continue;
                }
                let mut covered = coverage(&edges, x, y) & triangle.samples;
                if far > 0.0 {
                    covered &= !far_samples(self.global([x, y]).map(|at| at as i32), far, SAMPLES as u32);
                }
                if covered != 0 {
                    covered = self.closer(pixel, covered, &depth, triangle.nearest, [x, y]);
                    let kept = mask.as_ref().map_or(covered, |mask| mask.passing(covered, &depth, [x, y]));
                    self.write(pixel, kept, index, &depth, triangle.nearest, [x, y]);
                }
            }
        }
    }

    /// Draws sprite `index` into the samples where it is the nearest so far.
    pub(super) fn add_sprite(&mut self, index: u32, scene: &Scene<'_>) {
        let sprite = &scene.sprites[index as usize];
        let [columns, rows] = [0, 1].map(|axis| {
            let [first, end] = sprite.bounds[axis].map(|at| (at - self.origin[axis]).clamp(0, TILE_PX as i64));
            first..end
        });
        for y in rows {
            for x in columns.clone() {
                let pixel = (y * TILE_PX as i64 + x) as usize;
                let Some(seen) = sprite.seen(self.global([x, y]), scene.srgb) else { continue };
                for s in indices(seen.samples) {
                    if seen.nearness > self.nearness[pixel][s] {
                        self.nearness[pixel][s] = seen.nearness;
                        self.owner[pixel][s] = SPRITE | index;
                    }
                }
                self.farthest[pixel] = self.nearness[pixel].iter().copied().fold(f32::INFINITY, f32::min);
            }
        }
    }

    /// A pixel of the tile, in the picture.
    fn global(&self, at: [i64; 2]) -> [i64; 2] {
        [0, 1].map(|axis| self.origin[axis] + at[axis])
    }

    /// Columns and rows of the tile that the triangle's bounding box touches, relative to the
    /// tile's origin; `None` if there are none.
    fn bounds(&self, triangle: &ScreenTriangle<'_>, scene: &Scene<'_>) -> Option<[std::ops::Range<i64>; 2]> {
        let corners = triangle.corners.map(|corner| scene.projected.corners[corner as usize].at);
        let range = |axis: usize| {
            let values = corners.map(|corner| corner[axis]);
            let [min, max] = [values.into_iter().min().unwrap_or(0), values.into_iter().max().unwrap_or(0)];
            let first = min.div_euclid(SUBPIXEL) - self.origin[axis];
            let last = max.div_euclid(SUBPIXEL) - self.origin[axis];
            first.max(0)..(last + 1).min(TILE_PX as i64)
        };
        let ranges = [range(0), range(1)];
        ranges.iter().all(|range| !range.is_empty()).then_some(ranges)
    }

    fn edges(&self, triangle: &ScreenTriangle<'_>, scene: &Scene<'_>) -> [SampledEdge; 3] {
        let corners = triangle.corners.map(|corner| scene.projected.corners[corner as usize].at);
        let [a, b, c] = corners.map(|corner| [0, 1].map(|axis| corner[axis] - self.origin[axis] * SUBPIXEL));
        [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)].map(SampledEdge::new)
    }

    fn plane(
        &self,
        triangle: &ScreenTriangle<'_>,
        scene: &Scene<'_>,
        value: impl Fn(&super::project::Corner) -> f64,
    ) -> Plane {
        let corners = triangle.corners.map(|corner| &scene.projected.corners[corner as usize]);
        let [a, b, c] = corners
            .map(|corner| [0, 1].map(|axis| (corner.at[axis] - self.origin[axis] * SUBPIXEL) as f64 / SUBPIXEL as f64));
        let [va, vb, vc] = corners.map(value);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let dx = ((vb - va) * (c[1] - a[1]) - (vc - va) * (b[1] - a[1])) / area;
        let dy = ((vc - va) * (b[0] - a[0]) - (vb - va) * (c[0] - a[0])) / area;
        Plane { at_origin: va - dx * a[0] - dy * a[1], per_px: [dx, dy] }
    }

    fn cutout<'a>(triangle: &ScreenTriangle<'a>, scene: &Scene<'a>) -> Option<Cutout<'a>> {
        if let Some(picture) = triangle.picture {
            return Some(Cutout::Picture(picture));
        }
        let cutoff = scene.materials.get(triangle.material as usize)?.texture_cutoff()?;
        let mips = scene.mips.get(triangle.material as usize)?.as_ref()?;
        let ScreenTriangle { level, leaf, tiling, .. } = *triangle;
        Some(Cutout::Texture { mips, level, cutoff, first_threshold: leaf.unwrap_or_default() >> 28, tiling })
    }

    fn alpha_test<'a>(&self, triangle: &ScreenTriangle<'a>, scene: &Scene<'a>) -> Option<AlphaTest<'a>> {
        Some(AlphaTest {
            cutout: Self::cutout(triangle, scene)?,
            is_orthographic: scene.is_orthographic,
            u: self.plane(triangle, scene, |corner| corner.uv[0] as f64 * corner.inverse_w as f64),
            v: self.plane(triangle, scene, |corner| corner.uv[1] as f64 * corner.inverse_w as f64),
        })
    }

    /// Mask of the samples in `covered` at which the triangle is nearer than all triangles so far.
    fn closer(&self, pixel: usize, covered: u32, depth: &Plane, nearest: f32, at: [i64; 2]) -> u32 {
        let seen = &self.nearness[pixel];
        indices(covered).filter(|&s| depth_at(depth, nearest, at, s) > seen[s]).fold(0, |closer, s| closer | 1 << s)
    }

    fn write(&mut self, pixel: usize, kept: u32, index: u32, depth: &Plane, nearest: f32, at: [i64; 2]) {
        if kept == 0 {
            return;
        }
        let seen = &mut self.nearness[pixel];
        for s in indices(kept) {
            seen[s] = depth_at(depth, nearest, at, s);
            self.owner[pixel][s] = index;
        }
        self.farthest[pixel] = seen.iter().copied().fold(f32::INFINITY, f32::min);
    }

    /// Linear colour and covered fraction of pixel (x, y) of the tile; the colour is already
    /// weighted by the fraction.
    pub(super) fn resolve(&self, x: u32, y: u32, scene: &Scene<'_>) -> (Vec3, f32) {
        let (mut color, mut count) = (Vec3::ZERO, 0);
        for (owner, same) in self.owners(x, y, scene) {
            color += self.shade(owner, same, [x as i64, y as i64], scene) * same.count_ones() as f32;
            count += same.count_ones();
        }
        (color / SAMPLES as f32, count as f32 / SAMPLES as f32)
    }

    /// Sum of what the samples of pixel (x, y) of the tile show, without light.
    pub(super) fn surfaces(&self, x: u32, y: u32, scene: &Scene<'_>) -> Surfaces {
        let mut sum = Surfaces::default();
        for (owner, same) in self.owners(x, y, scene) {
            let shown = self.shown(owner, same, [x as i64, y as i64], scene);
            let flip = if shown.two_sided && shown.normal.dot(shown.from_eye) > 0.0 { -1.0 } else { 1.0 };
            let count = same.count_ones() as f32;
            let depths = indices(same).map(|s| self.nearness[(y * TILE_PX + x) as usize][s]);
            sum.add(&Surfaces {
                albedo: shown.albedo * count,
                normal: (shown.normal * flip).normalize_or_zero() * count,
                depth: depths.sum(),
                leaves: if shown.is_leaf { count } else { 0.0 },
                samples: count,
            });
        }
        sum
    }

    /// Owners of the samples of a pixel, each with the mask of those to shade together.
    fn owners(&self, x: u32, y: u32, scene: &Scene<'_>) -> impl Iterator<Item = (u32, u32)> {
        let owners = &self.owner[(y * TILE_PX + x) as usize];
        let mut open: u32 = (0..SAMPLES).filter(|&s| owners[s] != NO_OWNER).fold(0, |open, s| open | 1 << s);
        let full_textures = scene.full_textures;
        std::iter::from_fn(move || {
            let first = (open != 0).then(|| open.trailing_zeros() as usize)?;
            let owner = owners[first];
            let alike = if full_textures { open & open.wrapping_neg() } else { open };
            let same = indices(alike).filter(|&s| owners[s] == owner).fold(0, |same, s| same | 1 << s);
            open &= !same;
            Some((owner, same))
        })
    }

    fn shade(&self, owner: u32, at_samples: u32, at: [i64; 2], scene: &Scene<'_>) -> Vec3 {
        if owner & SPRITE != 0 {
            let sprite = &scene.sprites[(owner & !SPRITE) as usize];
            return sprite.seen(self.global(at), scene.srgb).map_or(Vec3::ZERO, |seen| sprite.shade(&seen));
        }
        let Shown { albedo, normal, from_eye, is_leaf, two_sided } = self.shown(owner, at_samples, at, scene);
        let triangle = &scene.projected.triangles[owner as usize];
        if triangle.plant == GROUND {
            let color = |ground: &PlacedGround<'_>| self.ground(triangle, from_eye, at, scene, ground);
            return scene.ground.map_or(Vec3::ZERO, color);
        }
        let light = &scene.lights[triangle.plant as usize];
        let color = light.reflected(albedo, normal, from_eye, is_leaf, two_sided);
        let toned = match scene.tones[triangle.plant as usize] {
            Some(tone) if is_leaf => toned(color.into(), tone.mean, triangle.kept).into(),
            _ => color,
        };
        scene.tints[triangle.plant as usize].of(toned)
    }

    /// Colour of the ground in a pixel.
    fn ground(
        &self,
        triangle: &ScreenTriangle<'_>,
        from_eye: Vec3,
        at: [i64; 2],
        scene: &Scene<'_>,
        ground: &PlacedGround<'_>,
    ) -> Vec3 {
        let over_w = |axis: usize| {
            self.plane(triangle, scene, |corner| f64::from(corner.uv[axis]) * f64::from(corner.inverse_w))
        };
        let [u, v] = [over_w(0), over_w(1)];
        let w = self.plane(triangle, scene, |corner| f64::from(corner.inverse_w));
        let uv = |right: f64, down: f64| {
            let [x, y] = [at[0] as f64 + 0.5 + right, at[1] as f64 + 0.5 + down];
            Vec2::new(u.at(x, y), v.at(x, y)) / w.at(x, y).max(f32::MIN_POSITIVE)
        };
        let middle = uv(0.0, 0.0);
        ground.color(middle, [uv(1.0, 0.0) - middle, uv(0.0, 1.0) - middle], from_eye, scene.srgb)
    }

    /// What a triangle shows in the middle of some samples of a pixel.
    fn shown(&self, owner: u32, at_samples: u32, at: [i64; 2], scene: &Scene<'_>) -> Shown {
        let triangle = &scene.projected.triangles[owner as usize];
        let corners = triangle.corners.map(|corner| &scene.projected.corners[corner as usize]);
        let [a, b, c] = corners.map(|corner| corner.at);
        let middle = [0, 1].map(|axis| {
            let sum: i64 = indices(at_samples).map(|s| sample_steps(s)[axis]).sum();
            (self.origin[axis] + at[axis]) * SUBPIXEL + sum / at_samples.count_ones() as i64
        });
        let opposite = [twice_area(b, c, middle), twice_area(c, a, middle), twice_area(a, b, middle)];
        let weights: [f32; 3] = std::array::from_fn(|i| opposite[i].max(0) as f32 * corners[i].inverse_w);
        let total = weights.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        let weights = weights.map(|weight| weight / total);
        let mix = |value: &dyn Fn(usize) -> Vec3| (0..3).map(|i| value(i) * weights[i]).sum::<Vec3>();
        let uv = mix(&|i| Vec3::new(corners[i].uv[0], corners[i].uv[1], 0.0));
        let factor = mix(&|i| Vec3::from(corners[i].color));
        let texel = scene.mips.get(triangle.material as usize).and_then(Option::as_ref);
        let uv = shown([uv.x, uv.y], triangle.tiling);
        let texel = texel.map_or(Vec3::ONE, |mips| mips.color(triangle.level, uv, scene.srgb).into());
        let material = scene.materials.get(triangle.material as usize);
        let base = material.map_or(Vec3::ONE, |m| Vec3::new(m.base_color[0], m.base_color[1], m.base_color[2]));
        let is_leaf = triangle.leaf.is_some();
        Shown {
            albedo: base * texel * factor,
            normal: mix(&|i| corners[i].normal),
            from_eye: mix(&|i| corners[i].from_eye),
            is_leaf,
            two_sided: is_leaf || material.is_some_and(|material| material.double_sided),
        }
    }
}

/// What one triangle shows in a pixel.
struct Shown {
    /// Linear colour without light.
    albedo: Vec3,
    normal: Vec3,
    from_eye: Vec3,
    is_leaf: bool,
    two_sided: bool,
}

/// Sum of what samples show, without light.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Surfaces {
    pub(super) albedo: Vec3,
    /// Unit normals, turned towards the eye.
    pub(super) normal: Vec3,
    /// Depth as of [`Corner::nearness`](super::project::Corner::nearness).
    pub(super) depth: f32,
    pub(super) leaves: f32,
    /// Number of samples.
    pub(super) samples: f32,
}

impl Surfaces {
    pub(super) fn add(&mut self, other: &Self) {
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.depth += other.depth;
        self.leaves += other.leaves;
        self.samples += other.samples;
    }
}

impl SampledEdge {
    fn new(edge: Edge) -> Self {
        let per_step = edge.per_px.map(|per_px| per_px / SUBPIXEL);
        let per_sample = std::array::from_fn(|sample| {
            let [x, y] = sample_steps(sample);
            per_step[0] * x + per_step[1] * y
        });
        Self { edge, per_sample }
    }
}

/// Bit `s` is set where sample `s` of pixel (x, y) lies inside all three edges.
fn coverage(edges: &[SampledEdge; 3], x: i64, y: i64) -> u32 {
    let corner = edges.each_ref().map(|edge| edge.edge.at(x, y));
    let mut covered = 0;
    for s in 0..SAMPLES {
        let distances = [0, 1, 2].map(|i| corner[i] + edges[i].per_sample[s]);
        let any_negative = distances[0] | distances[1] | distances[2];
        covered |= u32::from(any_negative >= 0) << s;
    }
    covered
}

fn depth_at(depth: &Plane, nearest: f32, at: [i64; 2], sample: usize) -> f32 {
    let [x, y] = sample_px(at, sample);
    depth.at(x, y).min(nearest)
}
