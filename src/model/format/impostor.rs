//! The section of the impostor.

use super::{
    super::impostor::{FRAME_SIDES, FRAMES_ACROSS, Impostor, Lattice},
    fault::Decoded,
    stream::Stream,
};
use serde::{Deserialize, Serialize};

/// Channels of both pages together.
const CHANNELS: usize = 8;
/// Memory that a texel takes while it is read: both pages, and the channels that they come from.
const BYTES_PER_TEXEL: u64 = 24;

/// An impostor whose pages are split into channels: each texel less the one before it.
#[derive(Serialize, Deserialize)]
pub(super) struct PackedImpostor<'a> {
    lattice: Lattice,
    frame_px: u32,
    center: [f32; 3],
    half_side: f32,
    #[serde(borrow)]
    channels: Vec<Stream<'a>>,
}

impl PackedImpostor<'_> {
    pub(super) fn encode(impostor: &Impostor) -> PackedImpostor<'static> {
        let pages = [&impostor.color, &impostor.surface];
        let channel = |channel: usize| {
            let values = pages[channel / 4].iter().skip(channel % 4).step_by(4);
            let mut before = 0_u8;
            Stream::deflated(values.map(|&value| value.wrapping_sub(std::mem::replace(&mut before, value))).collect())
        };
        PackedImpostor {
            lattice: impostor.lattice,
            frame_px: impostor.frame_px,
            center: impostor.center,
            half_side: impostor.half_side,
            channels: (0..CHANNELS).map(channel).collect(),
        }
    }

    /// Memory that reading the impostor takes, in bytes.
    pub(super) fn memory(&self) -> u64 {
        self.texels() * BYTES_PER_TEXEL
    }

    fn texels(&self) -> u64 {
        let [across, side] = [self.lattice.across.min(FRAMES_ACROSS[1]), self.frame_px.min(FRAME_SIDES[1])];
        u64::from(across * side) * u64::from(across * side)
    }

    /// Decodes the impostor. Sizes beyond the limits are left to the model's validation: nothing is
    /// allocated for them.
    pub(super) fn decode(&self) -> Decoded<Impostor> {
        let texels = self.texels() as usize;
        if self.channels.len() != CHANNELS {
            return Err(format!("{} channels instead of {CHANNELS}", self.channels.len()));
        }
        let mut pages = [vec![0; 4 * texels], vec![0; 4 * texels]];
        for (number, channel) in self.channels.iter().enumerate() {
            let mut value = 0_u8;
            let to = pages[number / 4].iter_mut().skip(number % 4).step_by(4);
            for (texel, step) in to.zip(channel.unpack(texels)?.iter()) {
                value = value.wrapping_add(*step);
                *texel = value;
            }
        }
        let [color, surface] = pages;
        let Self { lattice, frame_px, center, half_side, .. } = *self;
        Ok(Impostor { lattice, frame_px, center, half_side, color, surface })
    }
}
