//! Arrangements of plants for a picture, each with its camera.

use crate::pictures::{DIRECTION, FILLING_RADII, camera};
use foliage_lod::{Error, LookAt, Result, bounds::Sphere, extract::REFERENCE_FOV_Y};
use glam::{DAffine3, DQuat, DVec3};

/// Spacing of plants in a ring or forest, in radii: the crowns of broad trees touch.
const SPACING_RADII: f64 = 1.6;
/// Gap between the plants of a row, as a fraction of their width.
const ROW_GAP: f64 = 0.08;
/// Maximum angle that a row may span: beyond it the outer plants are distorted.
const WIDEST_ROW_DEG: f64 = 120.0;
/// Maximum number of plants in a row or ring, and on a side of a forest.
const MOST: [u32; 2] = [10_000, 100];
/// Height of a ring's camera above the plants' centres, as a fraction of its horizontal distance.
const RING_RISE: f64 = 0.5;
/// Rotation from one plant of a ring or forest to the next, in radians: no two face the same way.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Plants and their camera.
pub struct Planting {
    /// The plants.
    pub plants: Vec<Standing>,
    /// Their camera.
    pub camera: LookAt,
}

/// One plant.
pub struct Standing {
    /// Transform from the plant to the world.
    pub world_from_plant: DAffine3,
    /// Distance from the camera to its centre in radii, which sets its level of detail.
    pub distance: f32,
}

impl Planting {
    /// One plant seen from `distance` radii; by default it fills the picture.
    pub fn single(sphere: &Sphere, distance: Option<f32>, aspect: f64) -> Self {
        let plant = Standing { world_from_plant: DAffine3::IDENTITY, distance: distance.unwrap_or(FILLING_RADII) };
        Self { plants: vec![plant], camera: camera(sphere, distance).with_aspect(aspect) }
    }

    /// One plant at each of `distances`, from left to right, all showing the same side; they fill
    /// the picture.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a distance inside the plant, and for plants too many or too
    /// near to fit into one picture.
    pub fn row(sphere: &Sphere, distances: &[f32], aspect: f64) -> Result<Self> {
        if let Some(distance) = distances.iter().find(|&&distance| !(distance > 1.0 && distance.is_finite())) {
            return Err(Error::invalid("--row", distance, "distances in radii above 1, such as 3,10,30"));
        }
        check_count("--row", distances.len() as u32, MOST[0])?;
        let half_angles: Vec<f64> = distances.iter().map(|&distance| (1.0 / f64::from(distance)).asin()).collect();
        let span = 2.0 * (1.0 + ROW_GAP) * half_angles.iter().sum::<f64>();
        if span > WIDEST_ROW_DEG.to_radians() {
            let value = format!("{:.0} degrees wide", span.to_degrees());
            let allowed = format!("at most {WIDEST_ROW_DEG} degrees; give fewer or larger distances");
            return Err(Error::invalid("--row", value, allowed));
        }
        let mut left = -0.5 * span;
        let mut plants = Vec::new();
        for (&distance, half_angle) in distances.iter().zip(&half_angles) {
            let half_width = (1.0 + ROW_GAP) * half_angle;
            plants.push(facing(sphere, distance, left + half_width));
            left += 2.0 * half_width;
        }
        let tallest = half_angles.iter().copied().fold(0.0, f64::max);
        let fov_y = 2.0 * ((0.5 * span).tan() / aspect).atan().max((1.0 + ROW_GAP) * tallest);
        Ok(Self { plants, camera: level_camera(sphere, fov_y).with_aspect(aspect) })
    }

    /// `count` plants in a circle, seen from outside and above.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for no plants or too many.
    pub fn ring(sphere: &Sphere, count: u32, aspect: f64) -> Result<Self> {
        check_count("--ring", count, MOST[0])?;
        let step = std::f64::consts::TAU / f64::from(count);
        let ring_radii = if count > 1 { 0.5 * SPACING_RADII / (0.5 * step).sin() } else { 0.0 };
        let places =
            (0..count).map(|i| (f64::from(i) * step).sin_cos()).map(|(x, z)| DVec3::new(x, 0.0, z) * ring_radii);
        let around = Sphere { center: sphere.center, radius: (ring_radii + 1.0) * radius(sphere) };
        let from = DVec3::new(0.0, RING_RISE, 1.0);
        let camera = LookAt::framing(&around, from, f64::from(REFERENCE_FOV_Y), 1.0).with_aspect(aspect);
        Ok(Self::seen_by(camera, sphere, places))
    }

    /// A forest of `side` x `side` plants, seen from its front edge over the nearest crowns.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for no plants or too many.
    pub fn grid(sphere: &Sphere, side: u32, aspect: f64) -> Result<Self> {
        check_count("--grid", side, MOST[1])?;
        let half = 0.5 * SPACING_RADII * f64::from(side - 1);
        let place = move |i: u32| SPACING_RADII * f64::from(i) - half;
        let places = (0..side * side).map(|i| DVec3::new(place(i % side), 0.0, place(i / side)));
        let radius = radius(sphere);
        let camera = LookAt {
            eye: sphere.center() + DVec3::new(0.0, 1.0 + 0.35 * half, half + 2.5) * radius,
            target: sphere.center() + DVec3::new(0.0, 0.0, 0.35 * half) * radius,
            ..LookAt::framing(sphere, DVec3::Z, f64::from(REFERENCE_FOV_Y), 1.0)
        };
        Ok(Self::seen_by(camera.with_aspect(aspect), sphere, places))
    }

    /// Plants with their centres moved to `places`, in radii, each rotated differently.
    fn seen_by(camera: LookAt, sphere: &Sphere, places: impl Iterator<Item = DVec3>) -> Self {
        let plant = |(i, place): (u32, DVec3)| {
            let middle = sphere.center() + place * radius(sphere);
            let turn = f64::from(i) * GOLDEN_ANGLE;
            let distance = (middle.distance(camera.eye) / radius(sphere)) as f32;
            Standing { world_from_plant: moved(sphere, middle, turn), distance }
        };
        Self { plants: (0..).zip(places).map(plant).collect(), camera }
    }
}

/// A plant `distance` radii from a camera at the centre of `sphere`, `azimuth` radians to the right
/// of -Z, facing the camera.
fn facing(sphere: &Sphere, distance: f32, azimuth: f64) -> Standing {
    let away = DVec3::new(azimuth.sin(), 0.0, -azimuth.cos()) * f64::from(distance) * radius(sphere);
    let turn = -azimuth - DIRECTION.x.atan2(DIRECTION.z);
    Standing { world_from_plant: moved(sphere, sphere.center() + away, turn), distance }
}

/// Turns the plant about the vertical through its centre and moves the centre to `middle`.
fn moved(sphere: &Sphere, middle: DVec3, turn: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), middle)
        * DAffine3::from_translation(-sphere.center())
}

/// A camera at the centre of `sphere`, looking along -Z.
fn level_camera(sphere: &Sphere, fov_y: f64) -> LookAt {
    let camera = LookAt::framing(sphere, DVec3::Z, fov_y, 1.0);
    LookAt { eye: sphere.center(), target: sphere.center() - DVec3::Z * radius(sphere), ..camera }
}

fn radius(sphere: &Sphere) -> f64 {
    if sphere.radius > 0.0 { sphere.radius } else { 1.0 }
}

fn check_count(option: &'static str, count: u32, most: u32) -> Result<()> {
    if (1..=most).contains(&count) { Ok(()) } else { Err(Error::invalid(option, count, format!("from 1 to {most}"))) }
}
