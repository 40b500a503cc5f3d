//! Combines a picture with the opacity of another into one RGBA texture.

use super::mtl::Channel;
use crate::material::Pixels;

/// `color` with the opacity in `mask`, of the size of the larger of the two. An opacity is the
/// alpha of a picture that has any, otherwise its luminance.
pub(super) fn combined(color: &Pixels, mask: &Pixels, channel: Option<Channel>) -> Pixels {
    let [color_size, mask_size] = [color, mask].map(|of| [of.width, of.height]);
    let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let size @ [width, height] = if area(mask_size) > area(color_size) { mask_size } else { color_size };
    let opacity = channel.unwrap_or(if mask.rgba.iter().skip(3).step_by(4).any(|alpha| *alpha < 255) {
        Channel::Alpha
    } else {
        Channel::Luminance
    });
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    let [columns, rows] = [0, 1].map(|axis| steps(color_size[axis], size[axis]));
    let [mask_columns, mask_rows] = [0, 1].map(|axis| steps(mask_size[axis], size[axis]));
    for (row, mask_row) in rows.iter().zip(&mask_rows) {
        for (column, mask_column) in columns.iter().zip(&mask_columns) {
            let texel = |x, y| color.texel(x, y).map(u32::from);
            let [r, g, b, _] = blended(column, row, texel);
            let [alpha] = blended(mask_column, mask_row, |x, y| [opacity.of(mask.texel(x, y))]);
            rgba.extend([r, g, b, alpha]);
        }
    }
    Pixels { width, height, rgba }
}

impl Channel {
    fn of(self, [r, g, b, a]: [u8; 4]) -> u32 {
        let [r, g, b, a] = [r, g, b, a].map(u32::from);
        match self {
            Self::Red => r,
            Self::Green => g,
            Self::Blue => b,
            Self::Alpha => a,
            // Weights of Rec. 709 in 256ths.
            Self::Luminance => (r * 54 + g * 183 + b * 19) >> 8,
        }
    }
}

impl Pixels {
    fn texel(&self, x: u32, y: u32) -> [u8; 4] {
        let at = (y as usize * self.width as usize + x as usize) * 4;
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2], self.rgba[at + 3]]
    }
}

/// Two texels next to each other, and the weight of the second in 256ths.
type Step = ([u32; 2], u32);

/// Where the middles of `to` texels lie among `from` texels.
fn steps(from: u32, to: u32) -> Vec<Step> {
    let step = |i: u32| {
        let at = (u64::from(i) * 2 + 1) * u64::from(from) * 128 / u64::from(to);
        let at = at.saturating_sub(128);
        let first = (at >> 8) as u32;
        ([first, (first + 1).min(from - 1)], (at & 255) as u32)
    };
    (0..to).map(step).collect()
}

fn blended<const N: usize>(
    ([left, right], to_right): &Step,
    ([top, bottom], to_bottom): &Step,
    texel: impl Fn(u32, u32) -> [u32; N],
) -> [u8; N] {
    if (*to_right, *to_bottom) == (0, 0) {
        return texel(*left, *top).map(|value| value as u8);
    }
    let mix = |a: u32, b: u32, weight: u32| a * (256 - weight) + b * weight;
    let corners = [(*left, *top), (*right, *top), (*left, *bottom), (*right, *bottom)].map(|(x, y)| texel(x, y));
    std::array::from_fn(|i| {
        let [above, below] = [0, 2].map(|row| mix(corners[row][i], corners[row + 1][i], *to_right));
        ((mix(above, below, *to_bottom) + (1 << 15)) >> 16) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: u32, height: u32, values: &[u8]) -> Pixels {
        Pixels { width, height, rgba: values.iter().flat_map(|&value| [value, value, value, 255]).collect() }
    }

    fn of_white(mask: &Pixels, channel: Option<Channel>) -> Pixels {
        combined(&grey(1, 1, &[255]), mask, channel)
    }

    fn alphas(pixels: &Pixels) -> Vec<u8> {
        pixels.rgba.iter().skip(3).step_by(4).copied().collect()
    }

    #[test]
    fn a_grey_mask_becomes_alpha_and_leaves_the_colour() {
        let color = Pixels { width: 2, height: 1, rgba: vec![1, 2, 3, 255, 4, 5, 6, 255] };
        let both = combined(&color, &grey(2, 1, &[0, 200]), None);
        assert_eq!(both, Pixels { width: 2, height: 1, rgba: vec![1, 2, 3, 0, 4, 5, 6, 200] });
    }

    #[test]
    fn alpha_counts_where_there_is_any_and_a_channel_overrides_it() {
        let mask = Pixels { width: 2, height: 1, rgba: vec![9, 9, 9, 10, 200, 100, 50, 255] };
        assert_eq!(alphas(&of_white(&mask, None)), [10, 255]);
        assert_eq!(alphas(&of_white(&mask, Some(Channel::Red))), [9, 200]);
        assert_eq!(alphas(&of_white(&mask, Some(Channel::Luminance))), [9, 117]);
    }

    #[test]
    fn the_smaller_one_is_stretched() {
        let color = grey(4, 2, &[10; 8]);
        let both = combined(&color, &grey(2, 1, &[0, 200]), None);
        assert_eq!((both.width, both.height), (4, 2));
        assert_eq!(alphas(&both), [0, 50, 150, 200, 0, 50, 150, 200]);
        let both = combined(&grey(1, 1, &[7]), &grey(2, 2, &[1, 2, 3, 4]), None);
        assert_eq!((both.rgba[0], alphas(&both)), (7, vec![1, 2, 3, 4]));
    }
}
