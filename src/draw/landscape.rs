//! Sky and ground, drawn in place of the plain backdrop if the [`Look`](super::look::Look) enables
//! them.
//!
//! Each pixel has the colour seen along its ray: the ground where the ray meets it, hazier with
//! distance, otherwise the sky.
//!
//! Limits: this ground is level and lies behind all plants; an eye below it sees none. Ground with
//! heights is a [`Terrain`](crate::terrain::Terrain), which renderers draw over it.

use super::light::{FLOOR, HORIZON, Lighting, ZENITH};
use crate::{Camera, Error, Result, crown::smoothstep, effects::sky::Daylight};
use glam::Vec3;

/// Ends of the plain sky's gradient, as sines of angles from the horizon: the first, above it, has
/// the zenith's colour, and the second, below it, the floor's. Both make a wide, soft band.
pub(crate) const ZENITH_FROM: f32 = 0.7;
pub(crate) const FLOOR_FROM: f32 = 0.4;

/// Fraction of the sides of a drawn ground's area over which its colours fade into the look's
/// beyond the area.
pub(crate) const FADES_OVER: f32 = 0.05;

/// Distance up to which ground with heights goes on beyond its area, in distances of the haze:
/// there 1/3000 of its light is left.
#[cfg(feature = "software")]
pub(crate) const REACH: f64 = 8.0;

/// Level ground, and what all ground has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Linear colour; of ground with heights where it has no colours of its own.
    pub color: [f32; 3],
    /// Height in world space; ground with heights has its own.
    pub height: f64,
    /// Distance, in world units, at which haze leaves 1/e (about a third) of the light of the
    /// ground and of plants; above 0.
    pub haze: f64,
}

/// Sky and ground behind all plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landscape {
    /// Sky of the effect `sky`; `None` for the plain sky.
    pub daylight: Option<Daylight>,
    /// The ground, if there is one.
    pub ground: Option<Ground>,
    /// Light of the sun and the sky, which lights the ground.
    pub lighting: Lighting,
}

impl Landscape {
    /// Linear colour of the sky in the unit direction `ray`.
    pub(crate) fn sky(&self, ray: Vec3) -> Vec3 {
        match self.daylight {
            Some(daylight) => daylight.shown(ray),
            None if ray.y < 0.0 => HORIZON.lerp(FLOOR, smoothstep(0.0, FLOOR_FROM, -ray.y)),
            None => HORIZON.lerp(ZENITH, smoothstep(0.0, ZENITH_FROM, ray.y)),
        }
    }
}

/// Rays of a camera: the ray of a pixel is `forward + right * x + up * y`, with x and y from -1 to
/// 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rays {
    /// From the picture's centre to its right edge.
    pub right: Vec3,
    /// From the picture's centre to its upper edge.
    pub up: Vec3,
    /// Through the picture's centre.
    pub forward: Vec3,
}

impl Rays {
    /// The rays of a perspective camera.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for an orthographic camera, which has no horizon.
    pub fn new(camera: &Camera) -> Result<Self> {
        let allowed = "a perspective projection where a sky or a ground is drawn";
        let rays = camera.rays().ok_or_else(|| Error::invalid("camera", "orthographic", allowed))?;
        let [forward, right, up] = rays.map(|ray| ray.as_vec3());
        Ok(Self { right, up, forward })
    }
}
