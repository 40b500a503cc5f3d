//! Random numbers of a cell: the same on every machine, in any order and on any thread.
//!
//! xxHash (Y. Collet, 2012) with 32 bits of three words: the cell's column and row, and the stream.

/// What a random number is for. Numbers of different streams are independent.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stream {
    /// A layer's own seed.
    Layer,
    /// Place within the cell along x.
    Along,
    /// Place within the cell along z.
    Across,
    /// Whether a plant grows, and of which kind.
    Kind,
    /// Its height.
    Height,
    /// Its width.
    Width,
    /// Its rotation.
    Turn,
    /// Its colour.
    Tint,
    /// Its own seed.
    Seed,
}

/// A random number of a cell.
pub(super) fn draw(seed: u32, cell: [i32; 2], stream: Stream) -> u32 {
    const PRIMES: [u32; 4] = [2_246_822_519, 3_266_489_917, 668_265_263, 374_761_393];
    const BYTES: u32 = 12;
    let start = seed.wrapping_add(PRIMES[3]).wrapping_add(BYTES);
    let words = [cell[0] as u32, cell[1] as u32, stream as u32];
    let mixed = words.into_iter().fold(start, |hash, word| {
        hash.wrapping_add(word.wrapping_mul(PRIMES[1])).rotate_left(17).wrapping_mul(PRIMES[2])
    });
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(PRIMES[0]);
    let mixed = (mixed ^ mixed >> 13).wrapping_mul(PRIMES[1]);
    mixed ^ mixed >> 16
}

/// A random number of a cell, from 0 to below 1, in steps of 2^-24.
pub(super) fn unit(seed: u32, cell: [i32; 2], stream: Stream) -> f32 {
    (draw(seed, cell, stream) >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_cells_and_streams_share_nothing() {
        let streams = [Stream::Along, Stream::Across, Stream::Kind, Stream::Height];
        let values = |stream| (0..10_000).map(move |i| f64::from(unit(7, [i % 100, i / 100], stream)) - 0.5);
        for (i, one) in streams.into_iter().enumerate() {
            assert!((values(one).sum::<f64>() / 10_000.0).abs() < 0.01);
            let shifted = values(one).zip(values(one).skip(1)).map(|(a, b)| a * b).sum::<f64>() / 10_000.0 * 12.0;
            assert!(shifted.abs() < 0.05, "neighbours correlate by {shifted}");
            for other in &streams[i + 1..] {
                let product = values(one).zip(values(*other)).map(|(a, b)| a * b).sum::<f64>() / 10_000.0 * 12.0;
                assert!(product.abs() < 0.05, "{one:?} and {other:?} correlate by {product}");
            }
        }
    }
}
