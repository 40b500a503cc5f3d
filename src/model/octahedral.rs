//! Unit vectors as two small integers, by folding the sphere onto a square.
//!
//! After Q. Meyer, J. Suessmuth, G. Sussner, M. Stamminger, G. Greiner, "On Floating-Point Normal
//! Vectors" (EGSR 2010): the vector is scaled onto the octahedron |x| + |y| + |z| = 1, whose lower
//! half is folded over the upper one. Of the four roundings of its coordinates, the one nearest to
//! the vector is taken, after Z. H. Cigolle, S. Donow, D. Evangelakos, M. Mara, M. McGuire and
//! Q. Meyer, "A Survey of Efficient Representations for Independent Unit Vectors" (JCGT 2014).

use glam::DVec3;

/// Bits per coordinate that decode to distinct vectors in `f32`.
pub(super) const MAX_BITS: u8 = 16;
/// Bits per coordinate of a quantised normal.
pub(super) const NORMAL_BITS: u8 = 10;
/// Bits per coordinate of a normal that others are made from.
pub(super) const FINE_NORMAL_BITS: u8 = 16;

/// Largest code of a coordinate; the smallest is its negative.
fn most(bits: u8) -> f64 {
    f64::from((1_i32 << (bits.clamp(2, MAX_BITS) - 1)) - 1)
}

/// Codes of a vector of any length but 0. A vector that [`decode`] returned gives codes that decode
/// to the same bits.
pub(crate) fn encode(vector: [f32; 3], bits: u8) -> [i32; 2] {
    let [x, y, z] = vector.map(f64::from);
    let length = x.abs() + y.abs() + z.abs();
    let [x, y] = [x / length, y / length];
    let folded = if z < 0.0 { [fold(y, x), fold(x, y)] } else { [x, y] };
    let low = folded.map(|coordinate| (coordinate * most(bits)).floor());
    let near = |codes: [i32; 2]| unfolded(codes, bits).dot(DVec3::from(vector.map(f64::from)));
    let mut best = ([0; 2], f64::NEG_INFINITY);
    for up in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        let codes = [0, 1].map(|axis| (low[axis] + up[axis]).min(most(bits)) as i32);
        let nearness = near(codes);
        if nearness > best.1 {
            best = (codes, nearness);
        }
    }
    best.0
}

/// The unit vector with these codes; codes that are too large are clamped.
pub(crate) fn decode(codes: [i32; 2], bits: u8) -> [f32; 3] {
    // Adding 0 makes -0 positive.
    unfolded(codes, bits).to_array().map(|coordinate| coordinate as f32 + 0.0)
}

fn unfolded(codes: [i32; 2], bits: u8) -> DVec3 {
    let step = 1.0 / most(bits);
    let [x, y] = codes.map(|code| (f64::from(code) * step).clamp(-1.0, 1.0));
    let z = 1.0 - x.abs() - y.abs();
    let [x, y] = if z < 0.0 { [fold(y, x), fold(x, y)] } else { [x, y] };
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    DVec3::new(x, y, z) * scale
}

/// Distance of `other` from the edge of the square, on the side of `along`.
fn fold(other: f64, along: f64) -> f64 {
    (1.0 - other.abs()).copysign(along)
}

/// Largest angle in radians between a vector and the one that its codes decode to.
pub(super) fn largest_error(bits: u8) -> f32 {
    // Half a step along both coordinates, as if they were only rounded. Lengths on the square grow
    // by at most sqrt(3) on a face of the octahedron, and by sqrt(3) from there to the sphere.
    (std::f64::consts::SQRT_2 * 0.5 / most(bits) * 3.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn every_code_of_8_bits_and_many_of_12_decode_to_unit_vectors_that_encode_to_themselves() {
        for bits in [2, 3, 8, 12, 16] {
            let most = most(bits) as i32;
            let step = (most / 500).max(1) as usize;
            for x in (-most..=most).step_by(step) {
                for y in (-most..=most).step_by(step) {
                    let vector = decode([x, y], bits);
                    assert!((Vec3::from(vector).length() - 1.0).abs() < 1e-6);
                    assert_eq!(decode(encode(vector, bits), bits).map(f32::to_bits), vector.map(f32::to_bits));
                }
            }
        }
    }

    #[test]
    fn errors_stay_within_the_stated_angle() {
        for bits in [8, 10, 12] {
            let mut worst = 0.0_f32;
            for i in 0..200_000_u32 {
                let coordinate =
                    |shift: u32| (i.wrapping_mul(2_654_435_761 ^ shift) >> 8) as f32 / (1 << 23) as f32 - 1.0;
                let vector = Vec3::new(coordinate(0), coordinate(77_777), coordinate(999_999)).normalize_or(Vec3::X);
                let decoded = Vec3::from(decode(encode(vector.to_array(), bits), bits));
                worst = worst.max(decoded.distance(vector));
            }
            let stated = largest_error(bits);
            assert!(worst < stated && worst > 0.2 * stated, "{worst} of {stated} at {bits} bits");
        }
    }
}
