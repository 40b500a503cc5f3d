//! Who looks at a scene: from a place, around a place, or along a path.

use super::check::wrong_if;
use crate::{Result, error::check_range};
use glam::DVec3;
use serde::Deserialize;

/// Who looks: from a place, around a place, or along a path.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Where it stands.
    pub eye: Option<[f64; 3]>,
    /// What it looks at.
    pub target: Option<[f64; 3]>,
    /// Vertical field of view in degrees: 1 to 170.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// Around `target` instead of from `eye`.
    pub orbit: Option<Orbit>,
    /// From station to station instead, in a straight line between two, by rising time.
    #[serde(default)]
    pub path: Vec<Station>,
}

fn default_fov() -> f64 {
    50.0
}

/// A turn around a place.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Distance from the target.
    pub distance: f64,
    /// Height over the target.
    #[serde(default)]
    pub height: f64,
    /// Seconds for one turn.
    #[serde(default = "default_turn")]
    pub seconds: f64,
}

fn default_turn() -> f64 {
    20.0
}

/// Where the camera is at one time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// When.
    pub seconds: f64,
    /// Where it stands.
    pub eye: [f64; 3],
    /// What it looks at.
    pub target: [f64; 3],
}

/// A camera at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Where it stands.
    pub eye: DVec3,
    /// What it looks at.
    pub target: DVec3,
    /// Vertical field of view in radians.
    pub fov_y: f64,
}

impl CameraEntry {
    /// The camera at a time; `None` where no way to place it is given.
    pub fn view(&self, seconds: f64) -> Option<View> {
        let fov_y = self.fov.to_radians();
        let target = DVec3::from(self.target.unwrap_or_default());
        if let Some(orbit) = &self.orbit {
            let (x, z) = (std::f64::consts::TAU * seconds / orbit.seconds).sin_cos();
            let eye = target + DVec3::new(x * orbit.distance, orbit.height, z * orbit.distance);
            return Some(View { eye, target, fov_y });
        }
        let Some((first, last)) = self.path.first().zip(self.path.last()) else {
            return Some(View { eye: DVec3::from(self.eye?), target, fov_y });
        };
        let seconds = seconds.clamp(first.seconds, last.seconds);
        let next = self.path.partition_point(|station| station.seconds < seconds).min(self.path.len() - 1);
        let [from, to] = [&self.path[next.saturating_sub(1)], &self.path[next]];
        let span = to.seconds - from.seconds;
        let t = if span > 0.0 { (seconds - from.seconds) / span } else { 1.0 };
        let between = |a: [f64; 3], b: [f64; 3]| DVec3::from(a).lerp(DVec3::from(b), t);
        Some(View { eye: between(from.eye, to.eye), target: between(from.target, to.target), fov_y })
    }

    pub(super) fn check(&self) -> Result<()> {
        check_range("camera.fov", self.fov, 1.0..=170.0)?;
        let ways = [self.eye.is_some(), self.orbit.is_some(), !self.path.is_empty()];
        let ways = ways.into_iter().filter(|&is_given| is_given).count();
        wrong_if(ways != 1, "camera", &format!("given {ways} ways"), "one of eye, orbit and path")?;
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
