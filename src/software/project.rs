//! Transforms parts from plant space to triangles on the screen: scaling about the pivot, wind,
//! projection, clipping by the near and far planes.

use super::{
    list::{Part, Picture, Placed},
    options::DrawOptions,
    riders::Riders,
    samples::SAMPLES,
    toning::Toning,
};
use crate::{
    Camera, Depth,
    draw::mips::Mips,
    edge::{SUBPIXEL, twice_area},
    effects::{Limbs, wind::Sway},
    leaf::Vertex,
    plant::{Outline, Tiling, at_level},
    terrain::GroundPoint,
    wood::facing,
};
use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};

/// Limit of a corner's screen coordinates, in steps. Farther corners are clamped to it, which
/// distorts triangles that pass close to the eye.
const FARTHEST_STEP: f64 = (1 << 29) as f64;

/// Number of the plant that the ground's triangles have.
pub(super) const GROUND: u32 = u32::MAX;
/// Number of planes by which the ground is clipped: near, far and the sides.
const PLANES: usize = 6;
/// Distance of the side planes from the picture's middle, in half pictures.
const SIDES: f64 = 1.5;

/// A corner of a triangle after projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Position in steps from the picture's top left corner, y downwards.
    pub(super) at: [i64; 2],
    /// 1 / w.
    pub(super) inverse_w: f32,
    /// Depth that is affine on the screen and greater for nearer points: 1 / w, or reversed depth
    /// under an orthographic projection.
    pub(super) nearness: f32,
    pub(super) uv: [f32; 2],
    pub(super) normal: Vec3,
    /// Position relative to the eye, in plant space.
    pub(super) from_eye: Vec3,
    pub(super) color: [f32; 3],
}

/// A triangle on the screen; its corners are ordered so that edge functions are positive inside.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScreenTriangle<'a> {
    pub(super) corners: [u32; 3],
    pub(super) material: u32,
    /// Index of its plant, or [`GROUND`].
    pub(super) plant: u32,
    /// Mip level.
    pub(super) level: u8,
    /// Seed of its leaf, or `None` for wood.
    pub(super) leaf: Option<u32>,
    /// Fraction of its colour's distance from the mean that is kept.
    pub(super) kept: f32,
    /// Mask of the samples of a pixel that it may cover, one bit per sample.
    pub(super) samples: u32,
    /// Largest nearness of its corners.
    pub(super) nearest: f32,
    /// Outline outside which its texture covers nothing at this level.
    pub(super) outline: Option<&'a Outline>,
    /// The pictures that it shows, if there are several.
    pub(super) tiling: Option<Tiling>,
    /// The picture of a cluster that it shows, in place of its material.
    pub(super) picture: Option<Picture<'a>>,
}

/// Clipped triangles of all plants, on the screen.
#[derive(Default)]
pub(super) struct Projected<'a> {
    pub(super) corners: Vec<Corner>,
    pub(super) triangles: Vec<ScreenTriangle<'a>>,
}

/// Projects every triangle of `plants` and of the `ground`. Triangles outside the near and far
/// planes, or without area on the screen, are left out.
pub(super) fn project<'a>(
    plants: &[Placed<'a>],
    ground: &[GroundPoint],
    mips: &[Option<Mips>],
    camera: &Camera,
    size: [u32; 2],
    options: &DrawOptions,
) -> Projected<'a> {
    let mut projector = Projector {
        plant: 0,
        sway: None,
        limbs: None,
        seed: None,
        toning: None,
        kept: 1.0,
        clip_from_plant: camera.clip_from_world,
        eye: camera.eye,
        depth: camera.depth,
        is_orthographic: camera.is_orthographic(),
        size: size.map(f64::from),
        full_textures: options.full_textures,
        out: Projected::default(),
    };
    for (number, plant) in (0..).zip(plants) {
        projector.enter(number, plant, camera);
        projector.toning = plant.tone.or(options.tone);
        for part in plant.list.parts.iter().chain(plant.wood).filter(|part| options.wood || part.leaf.is_some()) {
            let mips = mips.get(part.material as usize).and_then(Option::as_ref);
            projector.part(part, mips);
        }
    }
    projector.clip_from_plant = camera.clip_from_world * DMat4::from_translation(camera.eye);
    projector.ground(ground);
    projector.out
}

/// A vertex in clip space, before the perspective division.
#[derive(Clone, Copy)]
struct Point {
    clip: DVec4,
    /// Where its depth is taken from: of a widened vertex, what it is without that.
    deep: DVec4,
    from_eye: Vec3,
    vertex: Vertex,
}

/// A vertex in the wind, in plant space.
struct Moved {
    at: DVec3,
    /// How far it is widened, if it is.
    widened: Option<Vec3>,
    /// Of a vertex of a ribbon, along its centre line and as long as half of its width.
    across: Vec3,
    normal: Vec3,
}

struct Projector<'a> {
    /// Index of the plant being projected; `sway`, `limbs`, `clip_from_plant` and `eye` belong to
    /// it.
    plant: u32,
    sway: Option<Sway>,
    limbs: Option<(&'a Limbs, &'a Riders)>,
    /// Seed of the leaf being projected; `None` for wood.
    seed: Option<u32>,
    /// Tone of the plant's leaves, and what the leaf being projected keeps.
    toning: Option<Toning>,
    kept: f32,
    clip_from_plant: DMat4,
    /// Position of the eye in plant space.
    eye: DVec3,
    depth: Depth,
    is_orthographic: bool,
    size: [f64; 2],
    full_textures: bool,
    out: Projected<'a>,
}

impl<'a> Projector<'a> {
    /// Starts plant `number`: the following parts belong to it.
    fn enter(&mut self, number: u32, plant: &Placed<'a>, camera: &Camera) {
        self.plant = number;
        self.clip_from_plant = camera.clip_from_world * plant.world_from_plant;
        self.eye = plant.world_from_plant.inverse().transform_point3(camera.eye);
        (self.sway, self.limbs) = (plant.sway, plant.limbs);
    }

    fn part(&mut self, part: &Part<'a>, mips: Option<&Mips>) {
        self.seed = part.leaf.map(|_| part.seed);
        self.kept = self.toning.map_or(1.0, |toning| match part.picture {
            Some(picture) if toning.tone > 0.0 => picture.kept(),
            _ => toning.kept_at(part.scale),
        });
        for triangle in part.indices.chunks_exact(3) {
            let point = |i: usize| {
                let index = triangle[i] as usize;
                part.vertices.get(index).map(|vertex| self.point(part, index, vertex))
            };
            if let (Some(a), Some(b), Some(c)) = (point(0), point(1), point(2)) {
                self.triangle([a, b, c], part, mips);
            }
        }
    }

    fn point(&self, part: &Part<'_>, index: usize, vertex: &Vertex) -> Point {
        let pivot = Vec3::from(part.pivot).as_dvec3();
        let offset = (Vec3::from(vertex.position).as_dvec3() - pivot) * part.scale as f64;
        let Moved { mut at, widened, across, mut normal } = self.swayed(part, index, pivot, offset, vertex);
        if across != Vec3::ZERO {
            let (side, round) = facing(across, (self.eye - at).as_vec3());
            (at, normal) = (at + side.as_dvec3(), round);
        }
        let clip = self.clip_from_plant * at.extend(1.0);
        let deep = widened.map_or(clip, |widened| self.clip_from_plant * (at - widened.as_dvec3()).extend(1.0));
        let vertex = Vertex { normal: normal.to_array(), ..*vertex };
        Point { clip, deep, from_eye: (at - self.eye).as_vec3(), vertex }
    }

    /// Applies the wind to a vertex.
    fn swayed(&self, part: &Part<'_>, index: usize, pivot: DVec3, offset: DVec3, vertex: &Vertex) -> Moved {
        let rest = pivot + offset;
        let still = Moved {
            at: rest,
            widened: part.widened.get(index).copied(),
            across: part.across.get(index).copied().unwrap_or_default(),
            normal: vertex.normal.into(),
        };
        let Some(sway) = &self.sway else { return still };
        let Some(leaf) = part.leaf else {
            let Some((limbs, riders)) = self.limbs else {
                return Moved { at: rest + sway.offset(rest.as_vec3()).as_dvec3(), ..still };
            };
            let blown = riders.blown(index, limbs, sway);
            let outwards = blown.widened - still.widened.unwrap_or_default();
            let at = rest + (blown.shift + outwards).as_dvec3();
            let widened = still.widened.map(|_| blown.widened);
            return Moved { at, widened, across: blown.across, normal: blown.normal };
        };
        let turn = sway.turn(leaf);
        let (turned, normal) = (pivot + turn.as_dquat() * offset, turn * still.normal);
        let Some((limbs, _)) = self.limbs else {
            return Moved { at: turned + sway.offset(pivot.as_vec3()).as_dvec3(), normal, ..still };
        };
        let carry = limbs.on_leaf(leaf, sway);
        Moved { at: turned + carry.offset(turned.as_vec3()).as_dvec3(), normal: carry.turned(normal), ..still }
    }

    fn triangle(&mut self, points: [Point; 3], part: &Part<'a>, mips: Option<&Mips>) {
        if points.iter().all(|point| self.between_planes(point).iter().all(|&distance| distance >= 0.0)) {
            return self.emit(points, part, mips);
        }
        let polygon = self.clip_by(0, &points);
        let polygon = self.clip_by(1, &polygon);
        self.fan(&polygon, part, mips);
    }

    /// Adds a convex polygon.
    fn fan(&mut self, polygon: &[Point], part: &Part<'a>, mips: Option<&Mips>) {
        let Some((first, rest)) = polygon.split_first() else { return };
        for pair in rest.windows(2) {
            self.emit([*first, pair[0], pair[1]], part, mips);
        }
    }

    /// Adds the triangles of the ground, whose corners may be far outside the picture.
    fn ground(&mut self, points: &[GroundPoint]) {
        let part = Part::of_wood(&[], &[], u32::MAX);
        (self.plant, self.seed, self.kept) = (GROUND, None, 1.0);
        for triangle in points.as_chunks::<3>().0 {
            let corners = triangle.map(|GroundPoint { from_eye, uv }| {
                let from_eye = Vec3::from(from_eye);
                let vertex = Vertex { position: from_eye.to_array(), normal: [0.0; 3], uv, color: [1.0; 4] };
                let clip = self.clip_from_plant * from_eye.as_dvec3().extend(1.0);
                Point { clip, deep: clip, from_eye, vertex }
            });
            let beyond = |plane| corners.iter().filter(|corner| self.before_plane(plane, corner) < 0.0).count();
            let counts: [usize; PLANES] = std::array::from_fn(beyond);
            if counts.contains(&3) {
                continue;
            }
            let cut = (0..PLANES).filter(|&plane| counts[plane] > 0);
            let polygon = cut.fold(corners.to_vec(), |polygon, plane| self.clip_by(plane, &polygon));
            self.fan(&polygon, &part, None);
        }
    }

    /// Signed distances of a point from the near and the far plane.
    fn between_planes(&self, point: &Point) -> [f64; 2] {
        Camera::between_planes(self.depth, point.clip)
    }

    /// Signed distance of a point from a plane: 0 is the near plane, 1 the far plane, others are
    /// outside the picture's sides.
    fn before_plane(&self, plane: usize, point: &Point) -> f64 {
        let DVec4 { x, y, w, .. } = point.clip;
        match plane {
            0 | 1 => self.between_planes(point)[plane],
            2 => SIDES * w - x,
            3 => SIDES * w + x,
            4 => SIDES * w - y,
            _ => SIDES * w + y,
        }
    }

    /// Clips a convex polygon by a plane.
    fn clip_by(&self, plane: usize, points: &[Point]) -> Vec<Point> {
        let mut kept = Vec::with_capacity(points.len() + 1);
        for (i, a) in points.iter().enumerate() {
            let b = &points[(i + 1) % points.len()];
            let [distance_a, distance_b] = [a, b].map(|point| self.before_plane(plane, point));
            if distance_a >= 0.0 {
                kept.push(*a);
            }
            if (distance_a >= 0.0) != (distance_b >= 0.0) {
                kept.push(between(a, b, distance_a / (distance_a - distance_b)));
            }
        }
        kept
    }

    fn emit(&mut self, points: [Point; 3], part: &Part<'a>, mips: Option<&Mips>) {
        let Some(mut corners) = points.map(|point| self.corner(&point)).into_iter().collect::<Option<Vec<_>>>() else {
            return;
        };
        let twice_area = twice_area(corners[0].at, corners[1].at, corners[2].at);
        if twice_area == 0 {
            return;
        }
        if twice_area < 0 {
            corners.swap(1, 2);
        }
        let first = self.out.corners.len() as u32;
        let nearest = corners.iter().map(|corner| corner.nearness).fold(0.0, f32::max);
        let tiling = part.tiles.and_then(|tiles| tiles.at(part.scale));
        let pictures = tiling.map_or(1.0, |_| part.scale * part.scale);
        let level = |mips| level(mips, &corners, twice_area.unsigned_abs(), pictures);
        let level = mips.filter(|_| !self.full_textures).map_or(0, level);
        self.out.corners.extend(corners);
        self.out.triangles.push(ScreenTriangle {
            corners: [first, first + 1, first + 2],
            material: part.material,
            plant: self.plant,
            level,
            leaf: self.seed,
            kept: self.kept,
            samples: part.samples(),
            nearest,
            outline: if tiling.is_none() { at_level(part.outlines, level) } else { None },
            tiling,
            picture: part.picture,
        });
    }

    /// Projects a point to the screen; `None` if its position there is not finite.
    fn corner(&self, point: &Point) -> Option<Corner> {
        let Point { clip, deep, .. } = point;
        let x = (clip.x / clip.w * 0.5 + 0.5) * self.size[0] * SUBPIXEL as f64;
        let y = (0.5 - clip.y / clip.w * 0.5) * self.size[1] * SUBPIXEL as f64;
        let step = |value: f64| value.clamp(-FARTHEST_STEP, FARTHEST_STEP).round() as i64;
        let [r, g, b, _] = point.vertex.color;
        (x.is_finite() && y.is_finite()).then(|| Corner {
            at: [step(x), step(y)],
            inverse_w: (1.0 / clip.w) as f32,
            nearness: match (self.is_orthographic, self.depth) {
                (false, _) => (1.0 / deep.w) as f32,
                (true, Depth::Reversed) => (deep.z / deep.w) as f32,
                (true, Depth::Standard) => (1.0 - deep.z / deep.w) as f32,
            },
            uv: point.vertex.uv,
            normal: Vec3::from(point.vertex.normal),
            from_eye: point.from_eye,
            color: [r, g, b],
        })
    }
}

/// Mip level whose texels are about as large as one sample, a sixteenth of a pixel, if the texture
/// is repeated so many times.
fn level(mips: &Mips, corners: &[Corner], twice_area_steps: u64, pictures: f32) -> u8 {
    let [width, height] = mips.full_size();
    let at = |i: usize| Vec2::new(corners[i].uv[0] * width, corners[i].uv[1] * height);
    let [a, b, c] = [at(0), at(1), at(2)];
    let twice_area_texels = (b - a).perp_dot(c - a).abs() * pictures;
    let twice_area_samples = twice_area_steps as f32 * SAMPLES as f32 / (SUBPIXEL * SUBPIXEL) as f32;
    let across = (a.max(b).max(c) - a.min(b).min(c)).min_element();
    mips.level_for(twice_area_texels / twice_area_samples, across)
}

fn between(a: &Point, b: &Point, t: f64) -> Point {
    let [from, to]: [[f32; 12]; 2] = [bytemuck::cast(a.vertex), bytemuck::cast(b.vertex)];
    let mixed: [f32; 12] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * t as f32);
    Point {
        clip: a.clip.lerp(b.clip, t),
        deep: a.deep.lerp(b.deep, t),
        from_eye: a.from_eye.lerp(b.from_eye, t as f32),
        vertex: bytemuck::cast(mixed),
    }
}
