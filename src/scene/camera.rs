//! Scene cameras: fixed, orbiting a point, or following a path.

use super::check::wrong_if;
use crate::{LookAt, Result, error::check_range};
use glam::DVec3;
use serde::Deserialize;

/// A camera: fixed at `eye`, orbiting `target`, or following `path`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Position of the eye.
    pub eye: Option<[f64; 3]>,
    /// Point that the camera looks at.
    pub target: Option<[f64; 3]>,
    /// Vertical field of view in degrees: 1 to 170.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// Orbit around `target`, instead of `eye`.
    pub orbit: Option<Orbit>,
    /// Stations by increasing time, instead of `eye`; interpolated linearly.
    #[serde(default)]
    pub path: Vec<Station>,
    /// Whether all heights of the camera are above the ground below it, as of somebody who walks.
    #[serde(default)]
    pub above_ground: bool,
}

fn default_fov() -> f64 {
    50.0
}

/// A circular orbit around a point.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Horizontal distance from the target.
    pub distance: f64,
    /// Height above the target.
    #[serde(default)]
    pub height: f64,
    /// Seconds per revolution.
    #[serde(default = "default_turn")]
    pub seconds: f64,
}

fn default_turn() -> f64 {
    20.0
}

/// Camera position and target at one time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Time in seconds.
    pub seconds: f64,
    /// Position of the eye.
    pub eye: [f64; 3],
    /// Point that the camera looks at.
    pub target: [f64; 3],
}

impl CameraEntry {
    /// The camera at a time, with a near plane at `near`; `None` if there is no eye, orbit or path.
    pub fn look_at(&self, seconds: f64, aspect: f64, near: f64) -> Option<LookAt> {
        let look = |eye: DVec3, target: DVec3| LookAt {
            eye,
            target,
            up: DVec3::Y,
            fov_y_radians: self.fov.to_radians(),
            aspect,
            near,
        };
        let target = DVec3::from(self.target.unwrap_or_default());
        if let Some(orbit) = &self.orbit {
            let (x, z) = (std::f64::consts::TAU * seconds / orbit.seconds).sin_cos();
            let eye = target + DVec3::new(x * orbit.distance, orbit.height, z * orbit.distance);
            return Some(look(eye, target));
        }
        let Some((first, last)) = self.path.first().zip(self.path.last()) else {
            return Some(look(DVec3::from(self.eye?), target));
        };
        let seconds = seconds.clamp(first.seconds, last.seconds);
        let next = self.path.partition_point(|station| station.seconds < seconds).min(self.path.len() - 1);
        let [from, to] = [&self.path[next.saturating_sub(1)], &self.path[next]];
        let span = to.seconds - from.seconds;
        let t = if span > 0.0 { (seconds - from.seconds) / span } else { 1.0 };
        let between = |a: [f64; 3], b: [f64; 3]| DVec3::from(a).lerp(DVec3::from(b), t);
        Some(look(between(from.eye, to.eye), between(from.target, to.target)))
    }

    pub(super) fn check(&self) -> Result<()> {
        check_range("camera.fov", self.fov, 1.0..=170.0)?;
        let ways = [self.eye.is_some(), self.orbit.is_some(), !self.path.is_empty()];
        let ways = ways.into_iter().filter(|&is_given| is_given).count();
        wrong_if(ways != 1, "camera", &format!("placed by {ways} keys"), "placed by one of eye, orbit and path")?;
        if let Some(orbit) = &self.orbit {
            check_range("camera.orbit.distance", orbit.distance, 1e-6..=1e9)?;
            check_range("camera.orbit.height", orbit.height, -1e9..=1e9)?;
            check_range("camera.orbit.seconds", orbit.seconds, 1e-3..=1e9)?;
        }
        for (i, station) in self.path.iter().enumerate() {
            let key = format!("camera.path.{i}.seconds");
            check_range(key.clone(), station.seconds, -1e9..=1e9)?;
            let is_late = i > 0 && self.path[i - 1].seconds >= station.seconds;
            wrong_if(is_late, &key, &station.seconds.to_string(), "later than the station before")?;
        }
        let stations = self.path.iter().flat_map(|station| [station.eye, station.target]);
        let places = stations.chain(self.eye).chain(self.target);
        places.flatten().try_for_each(|at| check_range("camera", at, -1e9..=1e9))
    }
}
