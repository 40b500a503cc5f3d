//! The sRGB transfer curve (IEC 61966-2-1), identical on every machine, and the luminance of its
//! primaries.

/// Linear value of an sRGB-encoded value, both from 0 to 1.
pub(crate) fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// Linear values of all 256 sRGB-encoded bytes.
pub(crate) fn linear_bytes() -> [f32; 256] {
    std::array::from_fn(|byte| linear(byte as f32 / 255.0))
}

/// sRGB-encoded value of a linear value, which is clamped to 0 to 1.
pub(crate) fn encoded(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.0031308 { 12.92 * c } else { 1.055 * libm::powf(c, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back() {
        for (byte, linear) in linear_bytes().into_iter().enumerate() {
            assert!((encoded(linear) * 255.0 - byte as f32).abs() < 1e-3);
        }
        assert_eq!([encoded(-1.0), encoded(2.0)].map(|c| (c * 255.0).round()), [0.0, 255.0]);
    }
}
