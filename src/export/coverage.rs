//! Alpha that an alpha test can use: as many texels pass as are covered.

/// Turns coverage, the alpha of `rgba`, into alpha of which as large a part of the texels reaches
/// `cutoff`, from 0 to 1, as they are covered on average.
pub(super) fn keep_coverage(rgba: &mut [u8], cutoff: f32) {
    let mut texels = [0_u64; 256];
    rgba.iter().skip(3).step_by(4).for_each(|&alpha| texels[alpha as usize] += 1);
    let covered: u64 = (0..).zip(texels).map(|(alpha, count): (u64, u64)| alpha * count).sum();
    let mut passing = 0;
    let least = (1..256).rev().find(|&alpha| {
        passing += 255 * texels[alpha];
        passing >= covered
    });
    let least = least.unwrap_or(255);
    let factor = 255.0 * cutoff / least as f32;
    for alpha in rgba.iter_mut().skip(3).step_by(4) {
        let scaled = f32::from(*alpha) * factor;
        // Rounded so that texels that are just covered enough pass, and others do not.
        *alpha = if usize::from(*alpha) >= least { scaled.ceil() } else { scaled.floor() }.min(255.0) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_texels_pass_as_are_covered_on_average() {
        for (cutoff, power) in [(0.5, 1), (0.5, 3), (0.1, 2), (0.9, 2)] {
            let coverage = (0..4096_u32).map(|i| (i * 37 % 256) as f32 / 255.0);
            let alphas: Vec<u8> = coverage.map(|part| (part.powi(power) * 255.0).round() as u8).collect();
            let mut rgba: Vec<u8> = alphas.iter().flat_map(|&alpha| [9, 8, 7, alpha]).collect();
            keep_coverage(&mut rgba, cutoff);
            let passing = rgba.iter().skip(3).step_by(4).filter(|&&alpha| f32::from(alpha) / 255.0 >= cutoff).count();
            let covered = alphas.iter().map(|&alpha| f64::from(alpha)).sum::<f64>() / 255.0;
            assert!((passing as f64 / covered - 1.0).abs() < 0.02, "{passing} of {covered} at {cutoff}");
            assert!(rgba.chunks(4).all(|texel| texel[..3] == [9, 8, 7]));
        }
        let mut clear = vec![1, 2, 3, 0];
        keep_coverage(&mut clear, 0.5);
        assert_eq!(clear, [1, 2, 3, 0]);
    }
}
