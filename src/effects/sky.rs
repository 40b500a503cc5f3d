//! Daytime sky: its colour in every direction, and the light from sky and sun.
//!
//! After A. Preetham, P. Shirley, B. Smits, *A Practical Analytic Model for Daylight* (1999):
//! Perez' distribution with coefficients fitted to simulated skies, as functions of turbidity.
//! Brightness is relative: a clear sky with the sun at 46 degrees lights a scene as brightly as the
//! fixed lights used without this effect.
//!
//! Limits: daytime only, with the sun clamped to at least one degree above the horizon; no clouds
//! and no sun disc.

use crate::{Result, error::check_range};
use glam::{Mat3, Vec3};
use serde::Deserialize;

/// Elevation of the reference sun, in degrees, at which the effect matches the fixed lights. Their
/// sun (`TOWARDS_SUN` in `draw/light.rs`) has it to within a degree, a scene's default sun exactly.
pub(crate) const REFERENCE_ELEVATION: f32 = 46.0;
/// Turbidity of the reference sky, and the default: a clear sky, near the low end of 2 to 10.
const REFERENCE_TURBIDITY: f32 = 3.0;
/// Minimum sine of the sun's elevation: one degree, because the model holds by day only.
const LOWEST_SUN: f32 = 0.0175;
/// Minimum cosine to the zenith of a sampled direction: the model is singular at the horizon.
pub(crate) const LOWEST: f32 = 0.02;
/// Minimum chromaticity y: the conversion to XYZ divides by it.
pub(crate) const LOWEST_CHROMATICITY_Y: f32 = 1e-4;
/// Optical depth of one air mass for red, green and blue light, from scattering by molecules: blue
/// is scattered most, which turns a low sun red.
const CLEAR_AIR: Vec3 = Vec3::new(0.05, 0.11, 0.24);
/// Optical depth of one air mass per unit of turbidity, from scattering by haze: it depends less on
/// colour than that of clear air, so haze mostly dims the sun.
const HAZE: Vec3 = Vec3::new(0.035, 0.045, 0.055);
/// Brightness of the sky in pictures at exposure 1: the tone curve maps the mean skylight of the
/// reference, which has luminance 1, to 1 - e^-1.25 = 0.71.
pub const SHOWN: f32 = 1.25;
/// Rings of sky samples for the skylight, with twice as many samples in each: the mean costs 288
/// samples.
const SKYLIGHT_RINGS: usize = 12;
/// Luminance of linear sRGB: the weights of red, green and blue in Y of CIE XYZ, the middle row of
/// the inverse of [`RGB_FROM_XYZ`].
pub(crate) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Parameters of the sky.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sky {
    /// Haze: 2 (very clear) to 10 (hazy).
    pub turbidity: f32,
    /// Brightness factor of the sky in the picture: 0.1 to 10.
    pub exposure: f32,
}

impl Default for Sky {
    fn default() -> Self {
        Self { turbidity: REFERENCE_TURBIDITY, exposure: 1.0 }
    }
}

impl Sky {
    pub(super) fn check(&self) -> Result<()> {
        check_range("effects.sky.turbidity", self.turbidity, 2.0..=10.0)?;
        check_range("effects.sky.exposure", self.exposure, 0.1..=10.0)
    }

    /// Sky and sunlight for a sun in the direction `towards_sun`, of any length.
    pub fn under(&self, towards_sun: Vec3) -> Daylight {
        let reference = REFERENCE_ELEVATION.to_radians();
        let usual = Dome::new(REFERENCE_TURBIDITY, Vec3::new(0.0, reference.sin(), reference.cos()));
        let dome = Dome::new(self.turbidity, towards_sun);
        let through = |dome: &Dome| (-(CLEAR_AIR + HAZE * dome.turbidity) * dome.air_mass()).exp();
        Daylight {
            scale: luminance(usual.skylight()).recip(),
            exposure: self.exposure,
            sun: through(&dome) / through(&usual),
            dome,
        }
    }
}

/// Sky and sunlight for one position of the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Daylight {
    /// Distribution of light over the sky.
    pub dome: Dome,
    /// Reciprocal of the reference skylight's luminance.
    pub scale: f32,
    /// See [`Sky`].
    pub exposure: f32,
    /// Sunlight relative to the reference, linear RGB.
    pub sun: Vec3,
}

impl Daylight {
    /// Skylight on a level surface, linear RGB, divided by the luminance of the reference skylight.
    pub fn skylight(&self) -> Vec3 {
        self.dome.skylight() * self.scale
    }

    /// Colour of the sky in a direction as displayed, linear and at most 1. Directions below the
    /// horizon are raised to it.
    pub fn shown(&self, direction: Vec3) -> Vec3 {
        let light = self.dome.radiance(direction) * (self.scale * self.exposure * SHOWN);
        Vec3::ONE - (-light).exp()
    }
}

/// Perez' distribution of the chromaticities x and y and the luminance Y over the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    turbidity: f32,
    /// Unit vector, above the horizon.
    pub towards_sun: Vec3,
    /// Coefficients A to E, each for x, y and Y.
    pub perez: [Vec3; 5],
    /// x, y and Y at the zenith, divided by the distribution there.
    pub zenith: Vec3,
}

impl Dome {
    fn new(turbidity: f32, towards_sun: Vec3) -> Self {
        let t = turbidity;
        let flat = Vec3::new(towards_sun.x, 0.0, towards_sun.z).normalize_or(Vec3::Z);
        let sine = towards_sun.normalize_or(Vec3::Y).y.clamp(LOWEST_SUN, 1.0);
        let towards_sun = flat * (1.0 - sine * sine).sqrt() + Vec3::Y * sine;
        let perez = [
            Vec3::new(-0.0193 * t - 0.2592, -0.0167 * t - 0.2608, 0.1787 * t - 1.4630),
            Vec3::new(-0.0665 * t + 0.0008, -0.0950 * t + 0.0092, -0.3554 * t + 0.4275),
            Vec3::new(-0.0004 * t + 0.2125, -0.0079 * t + 0.2102, -0.0227 * t + 5.3251),
            Vec3::new(-0.0641 * t - 0.8989, -0.0441 * t - 1.6537, 0.1206 * t - 2.5771),
            Vec3::new(-0.0033 * t + 0.0452, -0.0109 * t + 0.0529, -0.0670 * t + 0.3703),
        ];
        let s = sine.acos();
        let chi = (4.0 / 9.0 - t / 120.0) * (std::f32::consts::PI - 2.0 * s);
        let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
        let powers = [s * s * s, s * s, s, 1.0];
        let chromaticity = |rows: [[f32; 4]; 3]| {
            let [a, b, c] = rows.map(|row| row.iter().zip(powers).map(|(k, power)| k * power).sum::<f32>());
            a * t * t + b * t + c
        };
        let x = chromaticity([
            [0.00166, -0.00375, 0.00209, 0.0],
            [-0.02903, 0.06377, -0.03202, 0.00394],
            [0.11693, -0.21196, 0.06052, 0.25886],
        ]);
        let y = chromaticity([
            [0.00275, -0.00610, 0.00317, 0.0],
            [-0.04214, 0.08970, -0.04153, 0.00516],
            [0.15346, -0.26756, 0.06670, 0.26688],
        ]);
        let mut dome = Self { turbidity, towards_sun, perez, zenith: Vec3::ONE };
        dome.zenith = Vec3::new(x, y, luminance.max(0.0)) / dome.distribution(1.0, sine);
        dome
    }

    /// Relative air mass along the sunlight's path: 1 from the zenith (formula and coefficients of
    /// Kasten and Young).
    fn air_mass(&self) -> f32 {
        let sine = self.towards_sun.y;
        1.0 / (sine + 0.505_72 * (sine.asin().to_degrees() + 6.079_95).powf(-1.6364))
    }

    /// Perez' formula; takes the cosines of the angles to the zenith and to the sun.
    fn distribution(&self, to_zenith: f32, to_sun: f32) -> Vec3 {
        let [a, b, c, d, e] = self.perez;
        let angle = to_sun.clamp(-1.0, 1.0).acos();
        (Vec3::ONE + a * (b / to_zenith).exp()) * (Vec3::ONE + c * (d * angle).exp() + e * (to_sun * to_sun))
    }

    /// Radiance from a unit direction, linear RGB on the model's own scale. Directions below the
    /// horizon are raised to it.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let direction = Vec3::new(direction.x, direction.y.max(LOWEST), direction.z).normalize_or(Vec3::Y);
        let xyy = self.zenith * self.distribution(direction.y.max(LOWEST), direction.dot(self.towards_sun));
        let [x, y, luminance] = [xyy.x, xyy.y.max(LOWEST_CHROMATICITY_Y), xyy.z.max(0.0)];
        let xyz = Vec3::new(x / y, 1.0, (1.0 - x - y) / y) * luminance;
        (RGB_FROM_XYZ * xyz).max(Vec3::ZERO)
    }

    /// Mean radiance received by a level surface: the cosine-weighted mean over the upper
    /// hemisphere.
    fn skylight(&self) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for ring in 0..SKYLIGHT_RINGS {
            // Rings of equal weight: the squares of their sines are evenly spaced.
            let sine = ((ring as f32 + 0.5) / SKYLIGHT_RINGS as f32).sqrt();
            for part in 0..2 * SKYLIGHT_RINGS {
                let (z, x) = (std::f32::consts::TAU * (part as f32 + 0.5) / (2 * SKYLIGHT_RINGS) as f32).sin_cos();
                sum += self.radiance(Vec3::new(x * sine, (1.0 - sine * sine).sqrt(), z * sine));
            }
        }
        sum / (2 * SKYLIGHT_RINGS * SKYLIGHT_RINGS) as f32
    }
}

/// Linear sRGB from CIE XYZ (IEC 61966-2-1).
pub(crate) const RGB_FROM_XYZ: Mat3 = Mat3::from_cols(
    Vec3::new(3.2406, -0.9689, 0.0557),
    Vec3::new(-1.5372, 1.8758, -0.2040),
    Vec3::new(-0.4986, 0.0415, 1.0570),
);

fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::from(LUMINANCE)).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun(degrees: f32) -> Vec3 {
        let elevation = degrees.to_radians();
        Vec3::new(elevation.cos(), elevation.sin(), 0.0)
    }

    #[test]
    fn at_the_reference_the_light_is_that_of_the_plain_lamps() {
        let daylight = Sky::default().under(sun(REFERENCE_ELEVATION));
        assert!((luminance(daylight.skylight()) - 1.0).abs() < 1e-3);
        assert!((daylight.sun - Vec3::ONE).length() < 1e-3, "{}", daylight.sun);
    }

    #[test]
    fn a_low_sun_is_red_and_dim_and_a_clear_sky_is_blue() {
        let [low, high] = [5.0, 60.0].map(|degrees| Sky::default().under(sun(degrees)));
        assert!(low.sun.x < high.sun.x && low.sun.z / low.sun.x < 0.5 * high.sun.z / high.sun.x);
        assert!(luminance(low.skylight()) < luminance(high.skylight()));
        let above = high.shown(Vec3::new(-0.5, 0.8, 0.0).normalize());
        assert!(above.z > 1.3 * above.x, "{above}");
        let [near, far] = [sun(60.0), Vec3::new(-0.8, 0.6, 0.0)].map(|direction| luminance(high.shown(direction)));
        assert!(near > 1.5 * far, "bright around the sun: {near} {far}");
    }

    #[test]
    fn every_sun_and_direction_gives_a_colour() {
        for degrees in [-5.0, 0.0, 1.0, 30.0, 89.9, 90.0] {
            for turbidity in [2.0, 5.0, 10.0] {
                let daylight = Sky { turbidity, exposure: 1.0 }.under(sun(degrees));
                assert!(daylight.sun.is_finite() && daylight.sun.min_element() >= 0.0);
                for direction in [Vec3::Y, Vec3::NEG_Y, Vec3::X, sun(degrees), Vec3::ZERO] {
                    let color = daylight.shown(direction);
                    let is_shown = color.is_finite() && color.min_element() >= 0.0 && color.max_element() <= 1.0;
                    assert!(is_shown, "{degrees} {turbidity} {direction}: {color}");
                }
            }
        }
    }
}
