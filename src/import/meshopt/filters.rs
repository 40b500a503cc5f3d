//! The filters that are undone after the attributes have been decoded.

/// How the encoder has changed the attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::import) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Undoes `filter` in every element of `bytes`.
pub(super) fn undo(bytes: &mut [u8], stride: usize, filter: Filter) -> Result<(), String> {
    let fits = match filter {
        Filter::None => true,
        Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
        Filter::Quaternion => stride == 8,
        Filter::Exponential => stride.is_multiple_of(4),
    };
    if !fits {
        return Err(format!("filter {filter:?} does not support a stride of {stride} bytes"));
    }
    match filter {
        Filter::None => {}
        Filter::Color if stride == 4 => bytes.chunks_exact_mut(4).for_each(|element| {
            let ycca = [element[0].into(), (element[1] as i8).into(), (element[2] as i8).into(), element[3].into()];
            element.copy_from_slice(&color(ycca, 255.0).map(|value| value as u8));
        }),
        Filter::Color => bytes.chunks_exact_mut(8).for_each(|element| {
            let [y, co, cg, a] = shorts(element);
            let rgba = color([(y as u16).into(), co.into(), cg.into(), (a as u16).into()], 65535.0);
            for (i, value) in rgba.into_iter().enumerate() {
                element[i * 2..][..2].copy_from_slice(&(value as u16).to_le_bytes());
            }
        }),
        Filter::Octahedral if stride == 4 => {
            bytes.chunks_exact_mut(4).for_each(|element| {
                let xyzw = [0, 1, 2, 3].map(|i| f32::from(element[i] as i8));
                let [x, y, z] = octahedral(xyzw, 127.0);
                element[..3].copy_from_slice(&[x as i8 as u8, y as i8 as u8, z as i8 as u8]);
            });
        }
        Filter::Octahedral => bytes.chunks_exact_mut(8).for_each(|element| {
            let normal = octahedral(shorts(element).map(f32::from), 32767.0);
            for (i, value) in normal.into_iter().enumerate() {
                element[i * 2..][..2].copy_from_slice(&(value as i16).to_le_bytes());
            }
        }),
        Filter::Quaternion => bytes.chunks_exact_mut(8).for_each(|element| {
            for (i, value) in quaternion(shorts(element)).into_iter().enumerate() {
                element[i * 2..][..2].copy_from_slice(&value.to_le_bytes());
            }
        }),
        Filter::Exponential => bytes.chunks_exact_mut(4).for_each(|element| {
            let value = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
            let [exponent, mantissa] = [value >> 24, value << 8 >> 8];
            let power = f64::from_bits(((1023 + exponent) as u64) << 52);
            element.copy_from_slice(&((f64::from(mantissa) * power) as f32).to_le_bytes());
        }),
    }
    Ok(())
}

fn shorts(element: &[u8]) -> [i16; 4] {
    [0, 1, 2, 3].map(|i| i16::from_le_bytes([element[i * 2], element[i * 2 + 1]]))
}

/// Decodes an octahedral (x, y) with scale z into a unit vector, multiplied by `one`.
fn octahedral([x, y, one_encoded, _]: [f32; 4], one: f32) -> [f32; 3] {
    let z = one_encoded - x.abs() - y.abs();
    let fold = z.min(0.0);
    let [x, y] = [x, y].map(|v| v + if v >= 0.0 { fold } else { -fold });
    let length = (x * x + y * y + z * z).sqrt();
    let scale = if length > 0.0 { one / length } else { 0.0 };
    [x, y, z].map(|v| round_half_away(v * scale))
}

/// Decodes luma, two chroma components and alpha into RGBA, multiplied by `one`. The highest bit of
/// alpha states how many bits the components have.
fn color([y, co, cg, a]: [i32; 4], one: f32) -> [f32; 4] {
    let greatest = 1i32.checked_shl(i32::BITS - a.leading_zeros()).map_or(i32::MAX, |above| above - 1);
    let low = a & (greatest >> 1);
    let alpha = low << 1 | low & 1;
    let scale = if greatest > 0 { one / greatest as f32 } else { 0.0 };
    [y + co - cg, y + cg, y - co - cg, alpha].map(|value| round_half_away(value as f32 * scale).clamp(0.0, one))
}

/// Decodes a quaternion from three components and the position of the fourth, the greatest.
fn quaternion([x, y, z, scale]: [i16; 4]) -> [i16; 4] {
    /// Upper bound on the three lesser components.
    const RANGE: f32 = std::f32::consts::FRAC_1_SQRT_2;
    let unit = RANGE / f32::from(scale | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) * unit);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let greatest = (scale & 3) as usize;
    let mut out = [0; 4];
    for (i, value) in [w, x, y, z].into_iter().enumerate() {
        out[(greatest + i) % 4] = round_half_away(value * 32767.0) as i16;
    }
    out
}

fn round_half_away(value: f32) -> f32 {
    (value + if value >= 0.0 { 0.5 } else { -0.5 }).trunc()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_give_unit_vectors_and_exact_floats() {
        let mut normals = [0, 0, 127, 0, 127, 0, 127, 9].map(|value: i8| value as u8);
        undo(&mut normals, 4, Filter::Octahedral).unwrap();
        assert_eq!(normals, [0, 0, 127, 0, 127, 0, 0, 9]);
        let mut identity = [0i16, 0, 0, 2047 << 2 | 3].map(i16::to_le_bytes).concat();
        undo(&mut identity, 8, Filter::Quaternion).unwrap();
        assert_eq!(shorts(&identity), [0, 0, 0, 32767]);
        let mut value = (((-2i32) << 24) | 5).to_le_bytes();
        undo(&mut value, 4, Filter::Exponential).unwrap();
        assert_eq!(f32::from_le_bytes(value), 1.25);
    }

    #[test]
    fn colours_come_back_from_luma_and_chroma_of_any_width() {
        // Eight bits: red 200, green 100, blue 50, alpha 254 of 255 in seven bits.
        let [r, g, b] = [200i32, 100, 50];
        let co = (r - b) / 2;
        let cg = (g - (b + co)) / 2;
        let mut element = [(b + co + cg) as u8, co as u8, cg as u8, 0x80 | 127];
        undo(&mut element, 4, Filter::Color).unwrap();
        assert_eq!(element, [200, 101, 50, 255]);
        // Four bits: 15 is white, and the alpha of three bits is doubled.
        let mut element = [15u8, 0, 0, 0b1000];
        undo(&mut element, 4, Filter::Color).unwrap();
        assert_eq!(element, [255, 255, 255, 0]);
        let mut element = [65535u16, 0, 0, 65535].map(u16::to_le_bytes).concat();
        undo(&mut element, 8, Filter::Color).unwrap();
        assert_eq!(element, [255; 8]);
        assert!(undo(&mut [0; 12], 12, Filter::Color).is_err());
    }
}
