//! Random scattering of plants over an area, with a minimum spacing.

use crate::{Error, Result, random::Random};
use glam::DVec3;
use serde::Deserialize;
use std::collections::HashMap;

/// Attempts per plant before the area counts as full.
const TRIES: u32 = 200;

/// Plants scattered over an area.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Names of models, taken in turn.
    pub models: Vec<String>,
    /// Number of plants.
    pub count: u32,
    /// Random seed.
    #[serde(default)]
    pub seed: u64,
    /// Side lengths of the area along x and z.
    pub area: [f64; 2],
    /// Centre of the area.
    #[serde(default)]
    pub at: [f64; 3],
    /// Minimum distance between the feet of two plants.
    #[serde(default)]
    pub spacing: f64,
    /// Minimum and maximum size factor.
    #[serde(default = "same_size")]
    pub scale: [f64; 2],
}

fn same_size() -> [f64; 2] {
    [1.0, 1.0]
}

/// Placement of one plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Position of its foot.
    pub at: DVec3,
    /// Rotation about the vertical, in radians.
    pub turn: f64,
    /// Size factor.
    pub scale: f64,
    /// Index into the scattering's models.
    pub kind: usize,
}

impl Scatter {
    /// Placements of the plants: the same for the same parameters, on every machine. O(plants).
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if the plants do not fit into the area, with the number that does.
    pub fn spots(&self) -> Result<Vec<Spot>> {
        let mut random = Random::new(self.seed);
        let mut taken = Taken { spacing: self.spacing, cells: HashMap::new() };
        let mut spots: Vec<Spot> = Vec::new();
        for number in 0..self.count as usize {
            let place = (0..TRIES).find_map(|_| {
                let offset = DVec3::new(random.wide_signed() * self.area[0], 0.0, random.wide_signed() * self.area[1]);
                let at = DVec3::from(self.at) + offset * 0.5;
                taken.is_free(at).then_some(at)
            });
            let Some(at) = place else {
                let [x, z] = self.area;
                let value = format!("{} plants {} apart in {x} x {z}", self.count, self.spacing);
                let allowed = format!("fewer, closer together or on more ground: only {number} fit");
                return Err(Error::invalid("scatter", value, allowed));
            };
            taken.take(at);
            let [least, greatest] = self.scale;
            spots.push(Spot {
                at,
                turn: random.wide_signed() * std::f64::consts::PI,
                scale: least + (greatest - least) * 0.5 * (random.wide_signed() + 1.0),
                kind: number % self.models.len().max(1),
            });
        }
        Ok(spots)
    }
}

/// Grid of the feet placed so far, with cells as wide as the spacing: only the nine cells around a
/// foot can hold one too close.
struct Taken {
    spacing: f64,
    cells: HashMap<[i64; 2], Vec<DVec3>>,
}

impl Taken {
    fn cell(&self, at: DVec3) -> [i64; 2] {
        [at.x, at.z].map(|side| (side / self.spacing).floor() as i64)
    }

    fn is_free(&self, at: DVec3) -> bool {
        if self.spacing <= 0.0 {
            return true;
        }
        let [x, z] = self.cell(at);
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dz| [x.saturating_add(dx), z.saturating_add(dz)]));
        let mut near = around.filter_map(|cell| self.cells.get(&cell)).flatten();
        !near.any(|other| at.distance(*other) < self.spacing)
    }

    fn take(&mut self, at: DVec3) {
        if self.spacing > 0.0 {
            let cell = self.cell(at);
            self.cells.entry(cell).or_default().push(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forest() -> Scatter {
        Scatter {
            models: vec!["a".into(), "b".into(), "c".into()],
            count: 1000,
            seed: 7,
            area: [200.0, 100.0],
            at: [50.0, 1.0, 0.0],
            spacing: 2.5,
            scale: [0.8, 1.25],
        }
    }

    #[test]
    fn plants_keep_their_distance_stay_in_the_area_and_depend_on_the_seed_alone() {
        let spots = forest().spots().unwrap();
        for (i, spot) in spots.iter().enumerate() {
            assert!((-50.0..=150.0).contains(&spot.at.x) && (-50.0..=50.0).contains(&spot.at.z) && spot.at.y == 1.0);
            assert!((0.8..=1.25).contains(&spot.scale) && spot.kind == i % 3);
            assert!(spots[..i].iter().all(|other| other.at.distance(spot.at) >= 2.5));
        }
        let quarter = spots.iter().filter(|spot| spot.at.x < 0.0 && spot.at.z < 0.0).count();
        assert!((80..170).contains(&quarter), "an eighth of the area holds {quarter} of 1000");
        assert_eq!(spots, forest().spots().unwrap());
        assert_ne!(spots, Scatter { seed: 8, ..forest() }.spots().unwrap());
    }

    #[test]
    fn what_does_not_fit_is_told_with_what_does() {
        let error = Scatter { area: [10.0, 10.0], ..forest() }.spots().unwrap_err().to_string();
        assert!(error.contains("1000 plants 2.5 apart in 10 x 10") && error.contains("fit"), "{error}");
        assert_eq!(Scatter { area: [0.0, 0.0], spacing: 0.0, ..forest() }.spots().unwrap().len(), 1000);
    }
}
