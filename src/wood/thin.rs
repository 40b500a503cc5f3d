//! The error at which each stem goes: at random, but so that what is left covers as much.
//!
//! A stem of width w that is thinner than the error e is drawn as wide as the error. So that stems
//! of a width cover as much on average as all of them did, one is drawn with probability w / e: a
//! stem with the evenly distributed random number u goes at w / u, but none while it is wider than
//! the error.
//!
//! A stem never goes before those on it. A child of r times its parent's width goes with its parent
//! with probability r, and else by a random number of its own from r to 1: both together are evenly
//! distributed again, and such a child always goes before its parent.

use super::{
    order::{StemLink, shortened},
    slide::SLIDE,
};

/// Step between the random numbers of successive stems, modulo 1: the golden ratio spreads them
/// evenly.
const RANDOM_STEP: f64 = 0.618_033_988_749_894_9;
/// Stems shrink to a point over the last fifth below their threshold. Their area falls with the
/// square: they cover as much as if they were whole up to this share of it.
const WHOLE: f32 = 0.8 + 0.2 / 3.0;

/// The error at which each stem goes; infinite for the widest, which always stays. Parents come
/// first.
pub(super) fn thresholds(links: &[StemLink], widths: &[f32]) -> Vec<f32> {
    let mut order: Vec<usize> = (0..links.len()).collect();
    order.sort_by(|&a, &b| widths[b].total_cmp(&widths[a]).then(a.cmp(&b)));
    let mut even = vec![0.0; links.len()];
    (0..).zip(&order).for_each(|(rank, &stem)| even[stem] = (f64::from(rank) * RANDOM_STEP).fract() as f32);
    let mut randoms = vec![0.0; links.len()];
    let mut thresholds = vec![0.0_f32; links.len()];
    for stem in 0..links.len() {
        randoms[stem] = match links[stem].parent.map(|parent| parent as usize) {
            Some(parent) => {
                let ratio = (widths[stem] / widths[parent]).min(1.0);
                if even[stem] < ratio { ratio * randoms[parent] } else { even[stem] }
            }
            None => even[stem],
        };
        let random = randoms[stem].max(f32::MIN_POSITIVE);
        let times = (1.0 / (WHOLE * random)).max(1.0 / (1.0 - SLIDE));
        thresholds[stem] = (widths[stem] * times).max(f32::MIN_POSITIVE);
    }
    for stem in (0..links.len()).rev() {
        if let Some(parent) = links[stem].parent {
            thresholds[parent as usize] = thresholds[parent as usize].max(thresholds[stem]);
        }
    }
    if let Some(&widest) = order.first() {
        let mut stem = Some(widest as u32);
        while let Some(at) = stem {
            thresholds[at as usize] = f32::INFINITY;
            stem = links[at as usize].parent;
        }
    }
    thresholds.iter().map(|&threshold| shortened(threshold)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk with limbs of different widths, each with twigs.
    fn tree() -> (Vec<StemLink>, Vec<f32>) {
        let (mut links, mut widths) = (vec![StemLink { parent: None, level: 0 }], vec![1.0]);
        for limb in 0..60 {
            let number = links.len() as u32;
            links.push(StemLink { parent: Some(0), level: 1 });
            widths.push(0.02 + 0.002 * limb as f32);
            for twig in 0..40 {
                links.push(StemLink { parent: Some(number), level: 2 });
                widths.push(0.004 + 0.0002 * (twig * 7 % 40) as f32);
            }
        }
        (links, widths)
    }

    #[test]
    fn no_stem_goes_before_it_is_thin_or_before_those_on_it() {
        let (links, widths) = tree();
        let thresholds = thresholds(&links, &widths);
        assert_eq!(thresholds[0], f32::INFINITY);
        for (stem, link) in links.iter().enumerate() {
            // It starts to go at four fifths of its threshold.
            assert!(0.8 * thresholds[stem] > 0.999 * widths[stem], "{stem}");
            assert!(link.parent.is_none_or(|parent| thresholds[parent as usize] >= thresholds[stem]), "{stem}");
        }
    }

    #[test]
    fn what_is_left_covers_as_much_as_all_stems_would() {
        let (links, widths) = tree();
        let thresholds = thresholds(&links, &widths);
        let twigs = || (0..links.len()).filter(|&stem| links[stem].level == 2);
        let all: f32 = twigs().map(|stem| widths[stem]).sum();
        for error in [0.02, 0.04, 0.1] {
            let drawn = |stem: usize| {
                let shrunk = 1.0 - (error / thresholds[stem] * 5.0 - 4.0).clamp(0.0, 1.0);
                shrunk * shrunk * error.max(widths[stem])
            };
            let covered: f32 = twigs().map(drawn).sum();
            assert!((covered / all - 1.0).abs() < 0.1, "{covered} of {all} at {error}");
        }
    }
}
