//! Makes the maps of `data/scenes/landscape.toml`: two kilometres of hills with a path.
//!
//! ```sh
//! cargo run --release --example landscape_maps -- data/scenes/landscape
//! ```

use image::{ImageBuffer, Luma, Rgb};
use std::path::PathBuf;

/// Side of the area in metres.
const SIDE: f64 = 2000.0;
/// Height of white in the map of heights.
const RELIEF: f64 = 120.0;
/// Texels on a side: of heights, of woods, and of what shows the path.
const HEIGHTS: u32 = 256;
const WOODS: u32 = 512;
const FINE: u32 = 1024;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("give the folder to write to")?);
    std::fs::create_dir_all(&folder)?;
    let place =
        |x: u32, z: u32, side: u32| [x, z].map(|at| (f64::from(at) + 0.5) / f64::from(side) * SIDE - 0.5 * SIDE);
    let heights = ImageBuffer::from_fn(HEIGHTS, HEIGHTS, |x, z| {
        Luma([(height(place(x, z, HEIGHTS)) / RELIEF * 65535.0).clamp(0.0, 65535.0) as u16])
    });
    heights.save(folder.join("heights.png"))?;
    let woods = ImageBuffer::from_fn(WOODS, WOODS, |x, z| Luma([(255.0 * wood(place(x, z, WOODS))) as u8]));
    woods.save(folder.join("woods.png"))?;
    let meadows = ImageBuffer::from_fn(FINE, FINE, |x, z| Luma([(255.0 * meadow(place(x, z, FINE))) as u8]));
    meadows.save(folder.join("meadows.png"))?;
    let colors = ImageBuffer::from_fn(FINE, FINE, |x, z| Rgb(color(place(x, z, FINE))));
    colors.save(folder.join("colors.png"))?;
    Ok(())
}

/// Where the path crosses a row.
fn path_x(z: f64) -> f64 {
    150.0 * (z / 260.0).sin() + 45.0 * (z / 83.0 + 1.0).sin()
}

/// Distance from the middle of the path.
fn from_path([x, z]: [f64; 2]) -> f64 {
    let slope = (path_x(z + 1.0) - path_x(z - 1.0)) / 2.0;
    (x - path_x(z)).abs() / (1.0 + slope * slope).sqrt()
}

/// Hills, with a valley along the path.
fn height(at: [f64; 2]) -> f64 {
    let hills = RELIEF * (0.5 + 1.3 * (layered(at, 600.0, 5, 7) - 0.5));
    let along = 25.0 + 20.0 * layered([0.0, at[1]], 500.0, 2, 3);
    let off = (from_path(at) / 220.0).min(1.0);
    let off = off * off * (3.0 - 2.0 * off);
    along + (hills - along) * off
}

/// Share of the woods: 1 inside, 0 on the path.
fn wood(at: [f64; 2]) -> f64 {
    let share = rising(layered(at, 260.0, 4, 12), 0.45, 0.53);
    share * rising(from_path(at), 9.0, 22.0)
}

/// Share of the meadows: around the woods and in their clearings.
fn meadow(at: [f64; 2]) -> f64 {
    (1.0 - 0.85 * wood(at)) * rising(from_path(at), 1.5, 3.5)
}

/// Colour of the ground, as sRGB: earth on the path, litter under trees, grass elsewhere.
fn color(at: [f64; 2]) -> [u8; 3] {
    // Few different values make a small file.
    let patches = (12.0 * layered(at, 45.0, 3, 23)).round() / 12.0;
    let grass = mixed([64.0, 76.0, 30.0], [78.0, 88.0, 40.0], patches);
    let litter = mixed([70.0, 66.0, 42.0], [88.0, 80.0, 52.0], patches);
    let ground = mixed(grass, litter, rising(wood(at), 0.2, 0.9));
    mixed([150.0, 132.0, 100.0], ground, rising(from_path(at), 1.2, 2.6)).map(|channel| channel as u8)
}

fn mixed(a: [f64; 3], b: [f64; 3], share: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// Smooth step from 0 at `low` to 1 at `high`.
fn rising(value: f64, low: f64, high: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Sum of layers of noise, each half as wide and half as strong as the one before and turned
/// against it; 0 to 1, seldom near either.
fn layered([x, z]: [f64; 2], width: f64, layers: u32, seed: u32) -> f64 {
    let layer = |i: u32| {
        let (sin, cos) = (0.6 + 1.1 * f64::from(i)).sin_cos();
        let turned = [x * cos - z * sin, x * sin + z * cos];
        noise(turned.map(|at| at / width * f64::from(1 << i)), seed + i) / f64::from(1 << i)
    };
    (0..layers).map(layer).sum::<f64>() / (0..layers).map(|i| 1.0 / f64::from(1 << i)).sum::<f64>()
}

/// Random values on a grid, smooth between them.
fn noise([x, z]: [f64; 2], seed: u32) -> f64 {
    let [(x0, fx), (z0, fz)] = [x, z].map(|at| (at.floor(), rising(at - at.floor(), 0.0, 1.0)));
    let value = |dx: f64, dz: f64| {
        let [a, b] = [x0 + dx, z0 + dz].map(|at| at as i32 as u32);
        let mut bits = a.wrapping_mul(0x9e37_79b1) ^ b.wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
        for _ in 0..2 {
            bits = (bits ^ bits >> 15).wrapping_mul(0x2c1b_3c6d);
        }
        f64::from(bits ^ bits >> 16) / f64::from(u32::MAX)
    };
    let row = |dz: f64| value(0.0, dz) * (1.0 - fx) + value(1.0, dz) * fx;
    row(0.0) * (1.0 - fz) + row(1.0) * fz
}
