//! From parts in the plant's space to triangles on the screen: scaling about the pivot, projection, near clipping.

use super::{Part, Placed};
use crate::{
    effects::wind::Sway,
    leaf::Vertex,
    render::{camera::Camera, mips::Mips},
};
use glam::{DMat4, DVec3, Vec3};

/// Screen positions are whole multiples of 1/256 pixel, so that neighbours share their edge exactly.
pub(super) const STEPS_PER_PIXEL: i64 = 256;
/// Farthest a corner may lie from the picture, in steps; beyond, triangles that pass the eye closely are bent.
const FARTHEST_STEP: f64 = (1 << 29) as f64;

/// A corner after projection. `over_w` quantities are affine on the screen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Steps from the picture's top left corner, y downwards.
    pub(super) at: [i64; 2],
    /// 1 / distance along the line of sight.
    pub(super) inverse_w: f32,
    pub(super) uv: [f32; 2],
    pub(super) normal: Vec3,
    /// Plant space, from the eye.
    pub(super) from_eye: Vec3,
    pub(super) color: [f32; 3],
}

/// A triangle on the screen, its corners ordered so that its inside has positive edge functions.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScreenTriangle {
    pub(super) corners: [u32; 3],
    pub(super) material: u32,
    /// Which of the plants it belongs to.
    pub(super) plant: u32,
    /// Texture level for one sample, and for one pixel.
    pub(super) level: [u8; 2],
    pub(super) is_leaf: bool,
    /// Samples of a pixel that it may cover, one bit each.
    pub(super) samples: u32,
    /// Largest 1/w of its corners.
    pub(super) nearest: f32,
}

/// Everything of all plants that may be seen, on the screen.
#[derive(Default)]
pub(super) struct Projected {
    pub(super) corners: Vec<Corner>,
    pub(super) triangles: Vec<ScreenTriangle>,
}

/// Projects every triangle of `plants`; those behind the near plane or without area are left out.
pub(super) fn project(
    plants: &[Placed<'_>],
    mips: &[Option<Mips>],
    camera: &Camera,
    size: [u32; 2],
    wood: bool,
) -> Projected {
    let mut projector = Projector {
        plant: 0,
        sway: None,
        camera_from_plant: camera.camera_from_world(),
        clip_from_camera: camera.clip_from_camera(),
        eye: camera.eye,
        near: camera.near,
        size: size.map(f64::from),
        out: Projected::default(),
    };
    for (number, plant) in (0..).zip(plants) {
        projector.enter(number, plant, camera);
        for part in plant.list.parts.iter().filter(|part| wood || part.leaf.is_some()) {
            let mips = mips.get(part.material as usize).and_then(Option::as_ref);
            projector.part(part, mips);
        }
    }
    projector.out
}

/// A vertex in camera space, before division.
#[derive(Clone, Copy)]
struct Point {
    in_camera: DVec3,
    from_eye: Vec3,
    vertex: Vertex,
}

struct Projector {
    /// The plant being projected, and how the camera stands to it.
    plant: u32,
    sway: Option<Sway>,
    camera_from_plant: DMat4,
    clip_from_camera: DMat4,
    /// Plant space.
    eye: DVec3,
    near: f64,
    size: [f64; 2],
    out: Projected,
}

impl Projector {
    /// What follows belongs to plant `number`.
    fn enter(&mut self, number: u32, plant: &Placed<'_>, camera: &Camera) {
        self.plant = number;
        self.camera_from_plant = camera.camera_from_world() * plant.world_from_plant;
        self.eye = plant.world_from_plant.inverse().transform_point3(camera.eye);
        self.sway = plant.sway;
    }

    fn part(&mut self, part: &Part<'_>, mips: Option<&Mips>) {
        for triangle in part.indices.chunks_exact(3) {
            let point = |i: usize| part.vertices.get(triangle[i] as usize).map(|vertex| self.point(part, vertex));
            if let (Some(a), Some(b), Some(c)) = (point(0), point(1), point(2)) {
                self.triangle([a, b, c], part, mips);
            }
        }
    }

    fn point(&self, part: &Part<'_>, vertex: &Vertex) -> Point {
        let pivot = Vec3::from(part.pivot).as_dvec3();
        let offset = (Vec3::from(vertex.position).as_dvec3() - pivot) * part.scale as f64;
        let (in_plant, vertex) = self.swayed(part, pivot, offset, *vertex);
        Point {
            in_camera: self.camera_from_plant.transform_point3(in_plant),
            from_eye: (in_plant - self.eye).as_vec3(),
            vertex,
        }
    }

    /// Where the wind moves a corner and its normal.
    fn swayed(&self, part: &Part<'_>, pivot: DVec3, offset: DVec3, vertex: Vertex) -> (DVec3, Vertex) {
        let Some(sway) = &self.sway else { return (pivot + offset, vertex) };
        let Some(leaf) = part.leaf else {
            let rest = pivot + offset;
            return (rest + sway.offset(rest.as_vec3()).as_dvec3(), vertex);
        };
        let turn = sway.turn(leaf);
        let moved = pivot + sway.offset(pivot.as_vec3()).as_dvec3() + turn.as_dquat() * offset;
        (moved, Vertex { normal: (turn * Vec3::from(vertex.normal)).to_array(), ..vertex })
    }

    fn triangle(&mut self, points: [Point; 3], part: &Part<'_>, mips: Option<&Mips>) {
        if points.iter().all(|point| self.depth_beyond_near(point) >= 0.0) {
            return self.emit(points, part, mips);
        }
        let polygon = self.clip_near(points);
        let Some((first, rest)) = polygon.split_first() else { return };
        for pair in rest.windows(2) {
            self.emit([*first, pair[0], pair[1]], part, mips);
        }
    }

    fn depth_beyond_near(&self, point: &Point) -> f64 {
        -point.in_camera.z - self.near
    }

    /// The part of a triangle in front of the near plane: none, or three or four corners.
    fn clip_near(&self, points: [Point; 3]) -> Vec<Point> {
        let mut kept = Vec::with_capacity(4);
        for i in 0..3 {
            let (a, b) = (&points[i], &points[(i + 1) % 3]);
            let (depth_a, depth_b) = (self.depth_beyond_near(a), self.depth_beyond_near(b));
            if depth_a >= 0.0 {
                kept.push(*a);
            }
            if (depth_a >= 0.0) != (depth_b >= 0.0) {
                kept.push(between(a, b, depth_a / (depth_a - depth_b)));
            }
        }
        kept
    }

    fn emit(&mut self, points: [Point; 3], part: &Part<'_>, mips: Option<&Mips>) {
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
        let nearest = corners.iter().map(|corner| corner.inverse_w).fold(0.0, f32::max);
        let level = mips.map_or([0; 2], |mips| levels(mips, &corners, twice_area.unsigned_abs()));
        self.out.corners.extend(corners);
        self.out.triangles.push(ScreenTriangle {
            corners: [first, first + 1, first + 2],
            material: part.material,
            plant: self.plant,
            level,
            is_leaf: part.leaf.is_some(),
            samples: part.samples(),
            nearest,
        });
    }

    /// `None` for a point that is not finite.
    fn corner(&self, point: &Point) -> Option<Corner> {
        let clip = self.clip_from_camera * point.in_camera.extend(1.0);
        let x = (clip.x / clip.w * 0.5 + 0.5) * self.size[0] * STEPS_PER_PIXEL as f64;
        let y = (0.5 - clip.y / clip.w * 0.5) * self.size[1] * STEPS_PER_PIXEL as f64;
        let step = |value: f64| value.clamp(-FARTHEST_STEP, FARTHEST_STEP).round() as i64;
        let [r, g, b, _] = point.vertex.color;
        (x.is_finite() && y.is_finite()).then(|| Corner {
            at: [step(x), step(y)],
            inverse_w: (1.0 / clip.w) as f32,
            uv: point.vertex.uv,
            normal: Vec3::from(point.vertex.normal),
            from_eye: point.from_eye,
            color: [r, g, b],
        })
    }
}

/// Twice the signed area in square steps; positive when the inside is on the right of each edge, y downwards.
pub(super) fn twice_area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Levels at which one texel is about one sample (a sixteenth of a pixel), and about one pixel.
fn levels(mips: &Mips, corners: &[Corner], twice_area_steps: u64) -> [u8; 2] {
    let edge = |i: usize| [corners[i].uv[0] - corners[0].uv[0], corners[i].uv[1] - corners[0].uv[1]];
    let (b, c) = (edge(1), edge(2));
    let twice_area_texels = (b[0] * c[1] - b[1] * c[0]).abs() * mips.full_texels();
    let twice_area_px = twice_area_steps as f32 / (STEPS_PER_PIXEL * STEPS_PER_PIXEL) as f32;
    let texels_per_px = twice_area_texels / twice_area_px;
    [mips.level_for(texels_per_px / super::tile::SAMPLES as f32), mips.level_for(texels_per_px)]
}

fn between(a: &Point, b: &Point, t: f64) -> Point {
    let [from, to]: [[f32; 12]; 2] = [bytemuck::cast(a.vertex), bytemuck::cast(b.vertex)];
    let mixed: [f32; 12] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * t as f32);
    Point {
        in_camera: a.in_camera.lerp(b.in_camera, t),
        from_eye: a.from_eye.lerp(b.from_eye, t as f32),
        vertex: bytemuck::cast(mixed),
    }
}
