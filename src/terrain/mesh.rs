//! Triangles of the ground for one camera.

use super::Terrain;
use crate::Camera;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Distance in pixels between the ground and its triangles above which they become finer, in the
/// middle of the picture.
pub const ERROR_PX: f64 = 0.5;

/// Most triangles of the ground; with more, all become coarser.
pub const MOST_TRIANGLES: usize = 1 << 20;

/// How far the middles of all triangles that follow from a triangle are from the middle of its
/// longest side, over that side: the sum of a geometric series.
const FOLLOWERS: f64 = 1.207_106_781_186_547_6;

/// A corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct GroundPoint {
    /// Position relative to the eye.
    pub from_eye: [f32; 3],
    /// Fractions of the area's sides; beyond 0 to 1 outside it.
    pub uv: [f32; 2],
}

/// Triangles of the ground for one camera. It can be made again for the next one, and then
/// allocates nothing once it has grown.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GroundMesh {
    /// Corners, three for each triangle.
    pub points: Vec<GroundPoint>,
    /// How often [`ERROR_PX`] was doubled so that there are at most [`MOST_TRIANGLES`]: 0 if the
    /// ground is drawn as finely as it is seen.
    pub coarser: u32,
    /// What it was made for.
    made_for: Option<[u64; 5]>,
}

/// A point of the grid.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: [u32; 2],
    /// Horizontal position relative to the eye.
    from_eye: [f64; 2],
    /// Height at which it is drawn, relative to the eye.
    height: f64,
}

impl GroundMesh {
    /// Makes the triangles of `terrain` as a perspective camera sees them, in all directions around
    /// it, and up to `reach` beyond the area. Does nothing if the eye and the size of a pixel are
    /// what they were; use one mesh for one terrain. Returns whether anything was done.
    pub fn update(&mut self, terrain: &Terrain, camera: &Camera, reach: f64) -> bool {
        let per_unit = camera.pixels_per_unit() / camera.w_slope();
        let [x, y, z] = camera.eye.to_array().map(f64::to_bits);
        let made_for = Some([x, y, z, per_unit.to_bits(), reach.to_bits()]);
        if made_for == self.made_for || !(camera.eye.is_finite() && per_unit.is_finite()) {
            return false;
        }
        self.made_for = made_for;
        self.coarser = 0;
        let mut halving = Halving::new(terrain, camera.eye, per_unit / ERROR_PX, reach, &mut self.points);
        while !halving.halve_all() {
            halving.px_per_unit *= 0.5;
            self.coarser += 1;
        }
        true
    }
}

struct Halving<'a> {
    terrain: &'a Terrain,
    eye: DVec3,
    /// Pixels, in units of the allowed error, of a length of 1 at a distance of 1.
    px_per_unit: f64,
    reach: f64,
    /// Size of a square of the grid.
    square: [f64; 2],
    /// For each level of halving, how far from the middle of a triangle's longest side points lie
    /// that follow from it.
    radii: Vec<f64>,
    /// Corner of the area with the least x and z, relative to the eye.
    low: [f64; 2],
    /// How far the eye is above or below all ground.
    beyond: f64,
    points: &'a mut Vec<GroundPoint>,
}

impl<'a> Halving<'a> {
    fn new(terrain: &'a Terrain, eye: DVec3, px_per_unit: f64, reach: f64, points: &'a mut Vec<GroundPoint>) -> Self {
        let side = f64::from(terrain.grid.side());
        let square = terrain.heights.size().map(|size| size / side);
        let [low, high] = terrain.heights.range();
        let longest = |level: u32| {
            // Every second level halves the squares; between them the long sides are shorter by the
            // square root of two.
            let squares = side / f64::from(1 << (level / 2));
            squares * square[0].max(square[1]) * if level.is_multiple_of(2) { std::f64::consts::SQRT_2 } else { 1.0 }
        };
        let radii = (0..2 * terrain.grid.depth()).map(|level| FOLLOWERS * longest(level)).collect();
        let beyond = (low - eye.y).max(eye.y - high).max(0.0);
        let [x, z] = terrain.heights.low_corner();
        let low = [x - eye.x, z - eye.z];
        Self { terrain, eye, px_per_unit, reach, square, radii, low, beyond, points }
    }

    /// Makes all triangles; returns false if there are too many.
    fn halve_all(&mut self) -> bool {
        self.points.clear();
        let side = self.terrain.grid.side();
        let corner = |at: [u32; 2]| Corner { at, from_eye: self.place(at), height: self.height(at) };
        let [low, right, high, left] = [[0, 0], [side, 0], [side, side], [0, side]].map(corner);
        self.halve(low, high, right, 0) && self.halve(high, low, left, 0)
    }

    /// Halves the triangle with the longest side from `a` to `b` until it is fine enough. Returns
    /// false if there are too many triangles.
    fn halve(&mut self, a: Corner, b: Corner, apex: Corner, level: u32) -> bool {
        if self.points.len() >= 3 * MOST_TRIANGLES {
            return false;
        }
        if level < 2 * self.terrain.grid.depth() {
            let at = [a.at[0].midpoint(b.at[0]), a.at[1].midpoint(b.at[1])];
            let from_eye = self.place(at);
            let excess = self.excess(at, from_eye, level);
            if excess > 1.0 {
                let straight = 0.5 * (a.height + b.height);
                let height = straight + (self.height(at) - straight) * (excess - 1.0).min(1.0);
                let middle = Corner { at, from_eye, height };
                return self.halve(a, apex, middle, level + 1) && self.halve(apex, b, middle, level + 1);
            }
        }
        self.add([a, b, apex]);
        true
    }

    /// The error of a point over what is allowed; 0 where that is at most 1.
    fn excess(&self, at: [u32; 2], [x, z]: [f64; 2], level: u32) -> f64 {
        let error = self.terrain.grid.error(at) * self.px_per_unit;
        if error == 0.0 {
            return 0.0;
        }
        let across = ((x * x + z * z).sqrt() - self.radii[level as usize]).max(0.0);
        let squared = across * across + self.beyond * self.beyond;
        if error * error <= squared { 0.0 } else { error / squared.sqrt() }
    }

    /// Height of a point relative to the eye.
    fn height(&self, [x, z]: [u32; 2]) -> f64 {
        let share = 1.0 / f64::from(self.terrain.grid.side());
        self.terrain.heights.height_at([f64::from(x) * share, f64::from(z) * share]) - self.eye.y
    }

    /// Horizontal position of a point relative to the eye.
    fn place(&self, [x, z]: [u32; 2]) -> [f64; 2] {
        [self.low[0] + f64::from(x) * self.square[0], self.low[1] + f64::from(z) * self.square[1]]
    }

    /// Adds a triangle, and what continues it beyond the area.
    fn add(&mut self, corners: [Corner; 3]) {
        let points = [self.point(&corners[0]), self.point(&corners[1]), self.point(&corners[2])];
        self.points.extend_from_slice(&points);
        let side = self.terrain.grid.side();
        let is_at_edge = |corner: &Corner| corner.at.iter().any(|&at| at == 0 || at == side);
        if corners.iter().filter(|corner| is_at_edge(corner)).count() < 2 {
            return;
        }
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % 3];
            for (axis, edge, out) in [(0, 0, -1.0), (0, side, 1.0), (1, 0, -1.0), (1, side, 1.0)] {
                if a.at[axis] == edge && b.at[axis] == edge {
                    let out = if axis == 0 { [out, 0.0] } else { [0.0, out] };
                    self.add_strip([a, b], out);
                }
            }
        }
    }

    /// Adds the ground beyond a stretch of the area's edge, in direction `out`, and that beyond a
    /// corner at its end.
    fn add_strip(&mut self, ends: [Corner; 2], out: [f64; 2]) {
        let side = self.terrain.grid.side();
        self.add_quad(ends.map(|end| [self.point(&end), self.beyond(end, out)]));
        let along_x = out[0] != 0.0;
        for end in ends.into_iter().filter(|end| along_x && [0, side].contains(&end.at[1])) {
            let beside = [0.0, if end.at[1] == 0 { -1.0 } else { 1.0 }];
            let both = [out[0], beside[1]];
            let near = [self.point(&end), self.beyond(end, out)];
            self.add_quad([near, [self.beyond(end, beside), self.beyond(end, both)]]);
        }
    }

    fn add_quad(&mut self, [[a, b], [c, d]]: [[GroundPoint; 2]; 2]) {
        self.points.extend([a, b, d, a, d, c]);
    }

    fn point(&self, corner: &Corner) -> GroundPoint {
        let ([x, z], share) = (corner.from_eye, 1.0 / self.terrain.grid.side() as f32);
        GroundPoint {
            from_eye: [x as f32, corner.height as f32, z as f32],
            uv: [corner.at[0] as f32 * share, corner.at[1] as f32 * share],
        }
    }

    /// The point `reach` away from a corner in direction `out`.
    fn beyond(&self, corner: Corner, out: [f64; 2]) -> GroundPoint {
        let (mut point, size) = (self.point(&corner), self.terrain.heights.size());
        for axis in [0, 1] {
            let by = out[axis] * self.reach;
            point.from_eye[2 * axis] = (corner.from_eye[axis] + by) as f32;
            point.uv[axis] += (by / size[axis]) as f32;
        }
        point
    }
}
