//! Records of a view's pixels. Most views show more sky than plant, so blocks of pixels without
//! fragments have no records of their own.

/// Number of pixels in a block. Those of a square follow each other in
/// [`PixelOrder`](super::order::PixelOrder).
const BLOCK: usize = 64;

/// Record of a pixel: 16 bytes, since steps visit pixels in no order that a cache could foresee.
#[derive(Debug, Clone, Copy)]
pub struct Pixel {
    /// Frontmost polygon and the one directly behind it. Behind all leaves is wood or background.
    pub pair: [u32; 2],
    /// Index of the stack's first slot.
    pub start: u32,
    /// Number of fragments on the stack, including dead ones, in the lower [`LEN_BITS`]; number of
    /// free slots behind them in the others.
    len_and_room: u32,
}

/// Bits of a stack's length: enough for the largest number of leaves that a plant may have, and
/// wood.
const LEN_BITS: u32 = 23;
/// Largest number of free slots that a stack knows of; others are lost.
pub const MAX_ROOM: u32 = u32::MAX >> LEN_BITS;

impl Pixel {
    /// Number of fragments on the stack.
    pub fn len(&self) -> u32 {
        self.len_and_room & ((1 << LEN_BITS) - 1)
    }

    /// Number of free slots behind them.
    pub fn room(&self) -> u32 {
        self.len_and_room >> LEN_BITS
    }

    /// Changes the length; slots that become free are room.
    pub fn set_len(&mut self, len: u32) {
        let room = self.len() + self.room() - len;
        self.set(len, room);
    }

    /// Sets the numbers of fragments and of free slots.
    pub fn set(&mut self, len: u32, room: u32) {
        self.len_and_room = room.min(MAX_ROOM) << LEN_BITS | len;
    }
}

/// Records of all pixels.
#[derive(Debug)]
pub struct Pixels {
    /// Number of pixels.
    count: usize,
    /// Number of each block's records; 0 for all blocks without fragments.
    blocks: Vec<u32>,
    /// Records, block by block.
    records: Vec<Pixel>,
}

impl Pixels {
    /// Creates `count` records without fragments, whose polygons are `background`.
    pub fn new(count: usize, background: u32) -> Self {
        let blocks = count.div_ceil(BLOCK);
        // Enough for all blocks, so that nothing is copied; what is not in use takes no memory.
        let mut records = Vec::with_capacity((1 + blocks) * BLOCK);
        records.resize(BLOCK, Pixel { pair: [background; 2], start: 0, len_and_room: 0 });
        Self { count, blocks: vec![0; blocks], records }
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Record of a pixel.
    pub fn get(&self, index: u32) -> &Pixel {
        let block = self.blocks[index as usize / BLOCK] as usize;
        &self.records[block * BLOCK + index as usize % BLOCK]
    }

    /// Record of a pixel, to be changed.
    pub fn get_mut(&mut self, index: u32) -> &mut Pixel {
        let block = &mut self.blocks[index as usize / BLOCK];
        if *block == 0 {
            *block = (self.records.len() / BLOCK) as u32;
            self.records.extend_from_within(..BLOCK);
        }
        &mut self.records[*block as usize * BLOCK + index as usize % BLOCK]
    }

    /// Iterates over all pixels.
    pub fn iter(&self) -> impl Iterator<Item = &Pixel> {
        (0..self.count as u32).map(|index| self.get(index))
    }

    /// Records of the blocks that have some.
    pub fn kept_mut(&mut self) -> &mut [Pixel] {
        &mut self.records[BLOCK..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_blocks_that_change_have_records() {
        let mut pixels = Pixels::new(200, 7);
        pixels.get_mut(130).pair = [3, 7];
        pixels.get_mut(130).set(2, 600);
        assert_eq!((pixels.count(), pixels.kept_mut().len()), (200, BLOCK));
        assert_eq!((pixels.get(130).len(), pixels.get(130).room()), (2, MAX_ROOM));
        let pairs: Vec<[u32; 2]> = pixels.iter().map(|pixel| pixel.pair).collect();
        assert_eq!(pairs.len(), 200);
        assert!(pairs.iter().enumerate().all(|(at, pair)| *pair == if at == 130 { [3, 7] } else { [7, 7] }));
        pixels.get_mut(199).set_len(0);
        assert_eq!(pixels.kept_mut().len(), 2 * BLOCK);
        assert_eq!(pixels.get(130).pair, [3, 7]);
    }
}
