//! The size at which a level of detail is looked at.

/// Side in pixels of pictures at which the full plant is looked at.
const FULL_PX: f64 = 256.0;
/// Smallest matched size in pixels: SSIM needs as many.
const LEAST_PX: u32 = 8;

/// Matched size (ours): the side, in pixels, of the picture in which a drawn leaf of a level is as
/// large as a leaf of the full plant is at 256 pixels, rounded.
///
/// `share` is the fraction of the leaves that is drawn, above 0 and at most 1. Leaves grow so that
/// together they cover what all of them did, so their area grows with 1 / share, and the side is
/// 256 times the square root of `share`: 181 pixels for half of the leaves, 99 for 15 %, 57 for 5 %
/// and 26 for 1 %. At least 8, also for NaN; at most 256.
///
/// A level is drawn for plants far away. At one size for all levels, differences that nobody will
/// see count for as much as those that show.
pub fn matched_px(share: f64) -> u32 {
    ((FULL_PX * share.clamp(0.0, 1.0).sqrt()).round() as u32).max(LEAST_PX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_of_the_picture_is_in_proportion_to_the_leaves() {
        assert_eq!([1.0, 0.5, 0.15, 0.05, 0.01].map(matched_px), [256, 181, 99, 57, 26]);
        assert_eq!([1e-9, 0.0, -1.0, f64::NAN, 7.0].map(matched_px), [8, 8, 8, 8, 256]);
    }
}
