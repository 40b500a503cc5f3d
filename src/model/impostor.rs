//! Impostor: pictures of the full plant from a lattice of directions, drawn in its place where it
//! is small on screen.
//!
//! Directions are points of an octahedron that is unfolded into a square, or of its upper half
//! turned into one (Z. Cigolle et al., *A Survey of Efficient Representations for Independent Unit
//! Vectors*, 2014); R. Brucks used both for impostors (*Octahedral Impostors*, 2018). The three
//! frames around a direction, weighted by its place in their triangle, change without a jump.

use crate::plant::{Checked, check};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Numbers of frames along a side of the lattice.
pub const FRAMES_ACROSS: [u32; 2] = [2, 16];
/// Sides of a frame in texels; multiples of 4, as block compression needs.
pub const FRAME_SIDES: [u32; 2] = [8, 256];

/// The directions of an impostor's frames: a square lattice, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lattice {
    /// Frames along each side: 2 to 16, at least 3 for the whole sphere.
    pub across: u32,
    /// Whether directions from below are among them; otherwise a plant seen from below shows the
    /// frames of the horizon.
    pub is_whole_sphere: bool,
}

/// Pictures of a plant from the directions of a lattice, each orthographic and square.
///
/// Both pages hold the frames one after another, rows from the top, four bytes a texel. What the
/// plant does not cover is 0 in both.
#[derive(Debug, Clone, PartialEq)]
pub struct Impostor {
    /// Directions of the frames.
    pub lattice: Lattice,
    /// Side of a frame in texels: a multiple of 4 from 8 to 256.
    pub frame_px: u32,
    /// Point in the middle of every frame, in the plant's space.
    pub center: [f32; 3],
    /// Half the side of a frame, in the plant's units: the radius of the plant's bounding sphere
    /// and one texel.
    pub half_side: f32,
    /// Colour without light (sRGB), and coverage.
    pub color: Vec<u8>,
    /// Mean normal of the surfaces, turned towards the viewer, and depth. Red and green: the parts
    /// to the right and up, from -1 to 1. Blue: depth, from 0 at `half_side` behind the centre to
    /// 1 as far before it. Alpha: the part towards the viewer, from 0 to 1, mapped to 0.5 to 1 for
    /// leaves and to 0.5 to 0 for wood. The shorter the mean normal, the more normals differ.
    pub surface: Vec<u8>,
}

/// What the frames of an impostor show: all of it but the pages. See [`Impostor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Framing {
    pub(crate) lattice: Lattice,
    pub(crate) frame_px: u32,
    pub(crate) center: [f32; 3],
    pub(crate) half_side: f32,
}

impl Framing {
    /// Radius of the bounding sphere of what the frames show, in the plant's units.
    pub(crate) fn radius(&self) -> f32 {
        self.half_side * (self.frame_px - 2) as f32 / self.frame_px as f32
    }

    /// Half the side of frames of a plant of this radius.
    #[cfg(feature = "software")]
    pub(crate) fn half_side_of(radius: f32, frame_px: u32) -> f32 {
        radius * frame_px as f32 / (frame_px - 2) as f32
    }

    /// Size in bytes of both pages on the GPU, with their mip levels.
    pub(crate) fn gpu_bytes(&self) -> u64 {
        let sides = std::iter::successors(Some(self.frame_px), |side| (*side > 1).then_some(side / 2));
        8 * u64::from(self.lattice.frames()) * sides.map(|side| u64::from(side * side)).sum::<u64>()
    }
}

impl Lattice {
    /// Fewest frames along a side: the corners of a whole sphere's lattice are one direction.
    pub(crate) fn least(&self) -> u32 {
        FRAMES_ACROSS[0] + u32::from(self.is_whole_sphere)
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.across * self.across
    }

    /// Unit vector from the plant towards the viewer of a frame.
    pub fn direction(&self, frame: u32) -> Vec3 {
        let steps = (self.across - 1) as f32;
        let [u, v] = [frame % self.across, frame / self.across].map(|at| at as f32 / steps);
        if self.is_whole_sphere {
            let flat = Vec2::new(2.0 * u - 1.0, 2.0 * v - 1.0);
            let y = 1.0 - flat.x.abs() - flat.y.abs();
            let flat = if y < 0.0 { folded(flat) } else { flat };
            return Vec3::new(flat.x, y, flat.y).normalize_or(Vec3::Y);
        }
        let [x, z] = [u - v, u + v - 1.0];
        Vec3::new(x, 1.0 - x.abs() - z.abs(), z).normalize_or(Vec3::Y)
    }

    /// The frames around a direction towards the viewer, of any length, and their weights, which
    /// add up to 1.
    pub fn around(&self, towards_viewer: Vec3) -> [(u32, f32); 3] {
        let steps = self.across - 1;
        let at = self.place(towards_viewer) * steps as f32;
        let cell = at.floor().clamp(Vec2::ZERO, Vec2::splat((steps - 1) as f32));
        let f = (at - cell).clamp(Vec2::ZERO, Vec2::ONE);
        let first = cell.y as u32 * self.across + cell.x as u32;
        let third = if f.x > f.y { first + 1 } else { first + self.across };
        [(first, 1.0 - f.x.max(f.y)), (third, (f.x - f.y).abs()), (first + self.across + 1, f.x.min(f.y))]
    }

    /// Place of a direction on the unfolded square, from 0 to 1 both ways.
    fn place(&self, direction: Vec3) -> Vec2 {
        let up = if self.is_whole_sphere { direction.y } else { direction.y.max(0.0) };
        let sum = direction.x.abs() + up.abs() + direction.z.abs();
        let flat = if sum > 0.0 { Vec2::new(direction.x, direction.z) / sum } else { Vec2::ZERO };
        if self.is_whole_sphere {
            let flat = if up < 0.0 { folded(flat) } else { flat };
            return (flat + 1.0) * 0.5;
        }
        Vec2::new(1.0 + flat.x + flat.y, 1.0 + flat.y - flat.x) * 0.5
    }

    /// Unit vectors to the right and up in the picture of a viewer in this direction.
    pub fn axes(towards_viewer: Vec3) -> [Vec3; 2] {
        let right = Vec3::new(towards_viewer.z, 0.0, -towards_viewer.x).normalize_or(Vec3::X);
        [right, towards_viewer.cross(right)]
    }
}

/// Mirrors a point of the unfolded octahedron at the edges of its middle.
fn folded(flat: Vec2) -> Vec2 {
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    Vec2::new((1.0 - flat.y.abs()) * sign(flat.x), (1.0 - flat.x.abs()) * sign(flat.y))
}

impl Impostor {
    /// Number of bytes of one page.
    pub fn page_bytes(&self) -> usize {
        4 * self.lattice.frames() as usize * self.frame_px as usize * self.frame_px as usize
    }

    /// Size in bytes of both pages on the GPU, with their mip levels.
    pub fn gpu_bytes(&self) -> u64 {
        self.framing().gpu_bytes()
    }

    /// Radius of the bounding sphere of what the frames show, in the plant's units.
    pub fn radius(&self) -> f32 {
        self.framing().radius()
    }

    /// What the frames show.
    pub(crate) fn framing(&self) -> Framing {
        let Self { lattice, frame_px, center, half_side, .. } = *self;
        Framing { lattice, frame_px, center, half_side }
    }

    /// Checks sizes, centre and lengths of the pages.
    pub(super) fn check(&self) -> Checked {
        let Self { lattice, frame_px, half_side, .. } = self;
        let [_, most] = FRAMES_ACROSS;
        let is_sound = (lattice.least()..=most).contains(&lattice.across);
        check(15, is_sound, || format!("the impostor has {0} x {0} frames", lattice.across))?;
        let [least, most] = FRAME_SIDES;
        let is_sound = (least..=most).contains(frame_px) && frame_px.is_multiple_of(4);
        check(15, is_sound, || format!("frames of the impostor have {frame_px} texels across"))?;
        let is_sound = self.center.iter().all(|at| at.is_finite()) && *half_side > 0.0 && half_side.is_finite();
        check(15, is_sound, || format!("the impostor reaches {half_side} from {:?}", self.center))?;
        let lengths = [&self.color, &self.surface].map(Vec::len);
        check(15, lengths == [self.page_bytes(); 2], || format!("pages of the impostor have {lengths:?} bytes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattices() -> impl Iterator<Item = Lattice> {
        let both = |across| [false, true].map(|is_whole_sphere| Lattice { across, is_whole_sphere });
        [2, 3, 12, 16].into_iter().flat_map(both).filter(|lattice| lattice.across >= lattice.least())
    }

    fn directions(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(move |i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            Vec3::new(cos * (1.0 - y * y).sqrt(), y, sin * (1.0 - y * y).sqrt())
        })
    }

    #[test]
    fn a_frame_is_found_by_its_own_direction_alone() {
        for lattice in lattices() {
            for frame in 0..lattice.frames() {
                let direction = lattice.direction(frame);
                let found = lattice.around(direction * 3.0);
                let own: f32 = found
                    .iter()
                    .filter(|(other, _)| lattice.direction(*other).distance(direction) < 1e-3)
                    .map(|(_, weight)| weight)
                    .sum();
                assert!((own - 1.0).abs() < 1e-4, "{lattice:?}: {frame} is {found:?}");
            }
        }
    }

    #[test]
    fn weights_add_up_to_one_change_without_a_jump_and_belong_to_near_frames() {
        for lattice in lattices() {
            let widest = if lattice.is_whole_sphere { 9.0 } else { 6.0 } / lattice.across as f32;
            for direction in directions(3000).filter(|direction| lattice.is_whole_sphere || direction.y > 0.0) {
                let found = lattice.around(direction);
                assert!((found.iter().map(|(_, weight)| weight).sum::<f32>() - 1.0).abs() < 1e-5);
                assert!(found.iter().all(|&(frame, weight)| frame < lattice.frames() && weight >= 0.0));
                let mean = |found: [(u32, f32); 3]| -> Vec3 {
                    found.iter().map(|&(frame, weight)| lattice.direction(frame) * weight).sum()
                };
                let near = found.iter().filter(|found| found.1 > 1e-3);
                assert!(
                    near.clone().all(|&(frame, _)| lattice.direction(frame).distance(direction) < widest),
                    "{lattice:?}: {direction}"
                );
                let beside = lattice.around(direction + Vec3::new(2e-4, 1e-4, -1e-4));
                assert!(mean(found).distance(mean(beside)) < 2e-2, "{lattice:?} at {direction}");
            }
        }
    }

    #[test]
    fn a_view_from_below_and_one_from_nowhere_show_some_frame() {
        for lattice in lattices() {
            for direction in [Vec3::NEG_Y, Vec3::ZERO, Vec3::NAN, Vec3::new(1e-30, -1.0, 0.0)] {
                let found = lattice.around(direction);
                assert!(found.iter().all(|&(frame, _)| frame < lattice.frames()), "{direction}: {found:?}");
            }
            let below = lattice.around(Vec3::new(1.0, -0.3, 0.2));
            let level = lattice.around(Vec3::new(1.0, 0.0, 0.2));
            assert_eq!(below == level, !lattice.is_whole_sphere);
        }
    }

    #[test]
    fn axes_are_perpendicular_and_upright() {
        for direction in directions(100).chain([Vec3::Y, Vec3::NEG_Y]) {
            let [right, up] = Lattice::axes(direction);
            assert!((right.cross(up) - direction).length() < 1e-5 && right.y == 0.0 && up.y >= 0.0);
        }
    }
}
