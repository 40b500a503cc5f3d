//! What the ground hides from an eye.
//!
//! Over a map of heights, a point is hidden if the ground rises steeper between it and the eye than
//! the point itself. So along each direction on the map, the eye remembers how steep the ground has
//! been so far: a stair that only rises, on which the place is looked up where a ray meets the
//! ground. All rays in one direction share the walk over the map. (Horizons along directions are
//! those of N. Max, *Horizon mapping: shadows for bump-mapped surfaces*, The Visual Computer 4,
//! 1988, from one eye instead of from every texel.)
//!
//! Limits: rays are put into one of 1,024 directions; steps are half a texel, and farther away 1/64
//! of the way, so that places are as much too far, and narrower ridges may be missed.

use super::HeightMap;
use glam::DVec3;

/// Directions all around; a quarter of them in each quadrant.
const SECTORS: usize = 1024;
/// Length of a step as a share of the way, and the least in texels.
const STEP: f64 = 1.0 / 64.0;
const LEAST_STEP: f64 = 0.5;
/// How far the walk goes, in diagonals of the map and distances from its corner.
const REACH: f64 = 2.0;

/// The ground as one eye sees it. Keeps its memory from eye to eye.
#[derive(Debug)]
pub struct Horizon {
    heights: HeightMap,
    eye: DVec3,
    /// Height of the eye over the ground.
    over_ground: f64,
    /// For each direction the part of `stairs` that is its own, once it is walked.
    walked: Vec<Option<[u32; 2]>>,
    /// Tangents that rise along each walk, and how far on the map they are met.
    stairs: Vec<[f32; 2]>,
}

impl Horizon {
    /// The ground of a height map, which is shared, from its corner.
    pub fn new(heights: &HeightMap) -> Self {
        let heights = heights.clone();
        let mut horizon = Self { heights, eye: DVec3::ZERO, over_ground: 0.0, walked: Vec::new(), stairs: Vec::new() };
        horizon.look_from(DVec3::ZERO);
        horizon
    }

    /// Moves the eye. O(1): directions are walked when they are first asked for.
    pub fn look_from(&mut self, eye: DVec3) {
        (self.eye, self.over_ground) = (eye, eye.y - self.heights.height([eye.x, eye.z]));
        self.walked.clear();
        self.walked.resize(SECTORS, None);
        self.stairs.clear();
    }

    /// One over the distance at which a ray from the eye meets the ground: 0 if it does not, for an
    /// eye on or below the ground, and for numbers that are not finite. The direction may have any
    /// length. O(log steps); O(steps) for the first ray in a direction.
    pub fn nearness(&mut self, direction: DVec3) -> f32 {
        if !direction.is_finite() || !self.eye.is_finite() || self.over_ground <= 0.0 {
            return 0.0;
        }
        let across = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let tangent = direction.y / across;
        if tangent.is_nan() {
            return 0.0;
        }
        let [first, end] = self.stair(direction);
        let stair = &self.stairs[first as usize..end as usize];
        let at = stair.partition_point(|[steep, _]| f64::from(*steep) < tangent);
        match stair.get(at) {
            None => 0.0,
            // The ground below the eye is about level.
            Some(_) if at == 0 => (-direction.y / direction.length() / self.over_ground).max(0.0) as f32,
            Some([_, distance]) => (1.0 / (f64::from(*distance) * (1.0 + tangent * tangent).sqrt())) as f32,
        }
    }

    /// Part of the stairs for a direction.
    fn stair(&mut self, direction: DVec3) -> [u32; 2] {
        // Quadrants are from 0 to 1, 1 to 2, ... and directions even along a square on its corner.
        let x = direction.x / (direction.x.abs() + direction.z.abs());
        let turn = if direction.z >= 0.0 { 1.0 - x } else { 3.0 + x };
        // Straight up and down are in the first.
        let sector = ((turn * (SECTORS / 4) as f64) as usize).min(SECTORS - 1);
        if let Some(walked) = self.walked[sector] {
            return walked;
        }
        let turn = (sector as f64 + 0.5) / (SECTORS / 4) as f64;
        let x = if turn < 2.0 { 1.0 - turn } else { turn - 3.0 };
        let z = (1.0 - x.abs()) * if turn < 2.0 { 1.0 } else { -1.0 };
        let length = (x * x + z * z).sqrt();
        let first = self.stairs.len() as u32;
        self.walk([x / length, z / length]);
        let walked = [first, self.stairs.len() as u32];
        self.walked[sector] = Some(walked);
        walked
    }

    /// Adds the stair along a direction of length 1.
    fn walk(&mut self, [x, z]: [f64; 2]) {
        let Self { heights, eye, stairs, .. } = self;
        let (sides, texels, corner) = (heights.size(), heights.map().size(), heights.low_corner());
        let least = LEAST_STEP * (sides[0] / f64::from(texels[0])).min(sides[1] / f64::from(texels[1]));
        let [_, highest] = heights.range();
        let reach = REACH * ((eye.x - corner[0]).abs() + (eye.z - corner[1]).abs() + sides[0] + sides[1]);
        let (mut steepest, mut way) = (f64::NEG_INFINITY, 0.0);
        while way < reach {
            way += least.max(STEP * way);
            if steepest * way >= highest - eye.y && steepest >= 0.0 {
                // Nothing farther is steeper.
                break;
            }
            let tangent = (heights.height([eye.x + way * x, eye.z + way * z]) - eye.y) / way;
            if tangent > steepest {
                steepest = tangent;
                stairs.push([tangent as f32, way as f32]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Map, *};

    /// Hills on a map that is no power of two, over oblong texels.
    fn hills(height: [f64; 2]) -> HeightMap {
        let of = |i: u32| {
            let [x, z] = [i % 45, i / 45].map(f64::from);
            (9000.0 * (2.0 + libm::sin(0.3 * x) + libm::sin(0.2 * z + 0.1 * x)) + 300.0 * libm::sin(3.0 * x)) as u16
        };
        let map = Map::new([45, 64], (0..45 * 64).map(of).collect()).unwrap();
        HeightMap::new(map, [-100.0; 2], [200.0, 150.0], height).unwrap()
    }

    /// First distance at which a ray is below the ground, by small steps.
    fn slow(heights: &HeightMap, eye: DVec3, direction: DVec3) -> f64 {
        let below = |distance: f64| {
            let at = eye + distance * direction;
            at.y <= heights.height([at.x, at.z])
        };
        (0..40_000).map(|step| 0.01 * f64::from(step)).find(|&distance| below(distance)).unwrap_or(f64::INFINITY)
    }

    #[test]
    fn rays_meet_the_ground_where_small_steps_do() {
        for height in [[0.0, 30.0], [30.0, 0.0]] {
            let heights = hills(height);
            let mut horizon = Horizon::new(&heights);
            let (mut met, mut missed, mut beyond, mut off) = (0, 0, 0, 0);
            for ray in 0..800_u32 {
                let part = |factor: u32| f64::from((ray * factor) % 101) / 101.0;
                if ray % 8 == 0 {
                    let at = [240.0 * part(7) - 120.0, 240.0 * part(29) - 120.0];
                    horizon.look_from(DVec3::new(at[0], heights.height(at) + 0.5 + 20.0 * part(13), at[1]));
                }
                let turn = std::f64::consts::TAU * part(53);
                let mut direction = DVec3::new(libm::cos(turn), 0.2 - 0.8 * part(71), libm::sin(turn)).normalize();
                if ray % 40 == 0 {
                    direction = [DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y][(ray / 40 % 3) as usize];
                }
                let (eye, found) = (horizon.eye, 1.0 / f64::from(horizon.nearness(3.0 * direction)));
                let exact = slow(&heights, eye, direction);
                // Rays a little to the side, up and down, and their distances a step apart.
                let right = direction.cross(DVec3::Y).normalize_or(DVec3::X);
                let beside = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
                    .map(|[x, y]| slow(&heights, eye, (direction + 0.005 * (right * x + DVec3::Y * y)).normalize()));
                let [near, far] = [f64::min, f64::max].map(|of| beside.into_iter().fold(exact, of));
                let is_near = found < 400.0 || far < 400.0;
                off += u32::from(is_near && !(0.97 * near - 0.2..=1.03 * far + 2.5).contains(&found));
                met += u32::from(exact < 400.0);
                missed += u32::from(exact > 400.0);
                let at = eye + exact.min(1e3) * direction;
                beyond += u32::from(exact < 400.0 && (at.x.abs() > 100.0 || !(-100.0..=50.0).contains(&at.z)));
            }
            println!("{met} meet the ground, {beyond} of them beyond the map, {missed} do not; {off} are off");
            assert!(met > 400 && missed > 50 && beyond > 50 && off < 3, "{met}, {missed}, {beyond}, {off}");
        }
    }

    #[test]
    fn rays_that_cannot_meet_the_ground_do_not() {
        let heights = hills([0.0, 30.0]);
        let mut horizon = Horizon::new(&heights);
        let eye = DVec3::new(0.0, 50.0, 0.0);
        horizon.look_from(eye);
        for direction in [DVec3::Y, DVec3::X, DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::new(1.0, 1e-300, 1.0)] {
            assert_eq!(horizon.nearness(direction), 0.0, "{direction}");
        }
        let down = 1.0 / f64::from(horizon.nearness(DVec3::NEG_Y));
        assert!((eye.y - down - heights.height([0.0, 0.0])).abs() < 1e-3);
        for eye in [-eye, DVec3::NAN, DVec3::INFINITY, DVec3::new(1e300, 1.0, 1e300)] {
            horizon.look_from(eye);
            assert!(horizon.nearness(DVec3::new(1.0, -1.0, 0.0)).is_finite(), "{eye}");
        }
        horizon.look_from(-eye);
        assert_eq!(horizon.nearness(DVec3::NEG_Y), 0.0, "below the ground");
    }

    #[test]
    fn level_ground_is_met_at_its_height() {
        let map = Map::new([7, 3], vec![9; 21]).unwrap();
        for level in [HeightMap::level(3.0), HeightMap::new(map, [5.0; 2], [90.0; 2], [3.0; 2])] {
            let level = level.unwrap();
            assert!(level.is_level());
            let mut horizon = Horizon::new(&level);
            for (height, slope) in [(0.1, 1.0), (2.0, 0.3), (2.0, 9.0), (0.5, 0.1)] {
                horizon.look_from(DVec3::new(7.0, 3.0 + height, 4.0));
                let direction = DVec3::new(0.6, -slope, 0.8);
                let found = 1.0 / f64::from(horizon.nearness(direction));
                let expected = height / slope * direction.length();
                assert!(
                    (1.0..1.02).contains(&(found / expected)) || (found - expected).abs() < 15.0,
                    "{found}, {expected}"
                );
                assert_eq!(horizon.nearness(DVec3::X), 0.0);
            }
        }
        assert!(!hills([0.0, 30.0]).is_level());
    }
}
