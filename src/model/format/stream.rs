//! Streams of bytes, each stored as it is or deflated, whichever is smaller.

use super::{fault::Decoded, records::as_bytes};
use miniz_oxide::{
    deflate::compress_to_vec,
    inflate::{
        TINFLStatus,
        core::{DecompressorOxide, decompress, inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF},
    },
};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Level of compression: 6 saves 2 % more and takes more than twice the time.
const LEVEL: u8 = 3;
/// Level that is enough to compare ways to store a column.
const QUICK_LEVEL: u8 = 1;
/// Shorter streams are stored as they are.
const WORTH_DEFLATING: usize = 256;
/// Bytes that one byte of deflate stands for at most (its longest match, 258 bytes, in 2 bits).
const MAX_RATIO: usize = 1032;

/// How a stream is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Codec {
    Raw,
    Deflate,
}

/// Bytes of a file and the number of bytes that they unpack to.
#[derive(Serialize, Deserialize)]
pub(super) struct Stream<'a> {
    codec: Codec,
    length: u64,
    #[serde(borrow, serialize_with = "as_bytes")]
    bytes: Cow<'a, [u8]>,
}

impl<'a> Stream<'a> {
    /// Stores `bytes` as they are.
    pub(super) fn raw(bytes: Cow<'a, [u8]>) -> Self {
        Self { codec: Codec::Raw, length: bytes.len() as u64, bytes }
    }

    /// Deflates `bytes` if that makes them smaller.
    pub(super) fn deflated(bytes: Vec<u8>) -> Self {
        Self::deflated_by(bytes, LEVEL)
    }

    /// As [`deflated`](Self::deflated), but larger.
    pub(super) fn quickly(bytes: Vec<u8>) -> Self {
        Self::deflated_by(bytes, QUICK_LEVEL)
    }

    fn deflated_by(bytes: Vec<u8>, level: u8) -> Self {
        if bytes.len() < WORTH_DEFLATING {
            return Self::raw(bytes.into());
        }
        let packed = compress_to_vec(&bytes, level);
        if packed.len() >= bytes.len() {
            return Self::raw(bytes.into());
        }
        Self { codec: Codec::Deflate, length: bytes.len() as u64, bytes: packed.into() }
    }

    /// Number of bytes in the file.
    pub(super) fn stored_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// Unpacks the stream, which must hold `expected` bytes. Nothing is allocated for a stream that
    /// states another length, or one that its bytes cannot give.
    pub(super) fn unpack(&self, expected: usize) -> Decoded<Cow<'_, [u8]>> {
        if self.length != expected as u64 {
            return Err(format!("a stream of {} bytes instead of {expected}", self.length));
        }
        let stored = self.bytes.len();
        match self.codec {
            Codec::Raw if stored == expected => Ok(Cow::Borrowed(&self.bytes)),
            Codec::Raw => Err(format!("a stream of {stored} bytes instead of {expected}")),
            Codec::Deflate if expected / MAX_RATIO > stored => {
                Err(format!("a stream of {expected} bytes cannot be packed into {stored}"))
            }
            Codec::Deflate => {
                let mut unpacked = vec![0; expected];
                let flags = TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
                let (status, read, written) =
                    decompress(&mut DecompressorOxide::new(), &self.bytes, &mut unpacked, 0, flags);
                match status {
                    TINFLStatus::Done if (read, written) == (stored, expected) => Ok(unpacked.into()),
                    _ => Err(format!("a stream of {expected} bytes is wrong after {written}")),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_come_back_and_are_never_larger_than_their_bytes() {
        let noise: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        for bytes in [vec![], vec![7], vec![0; 100_000], noise] {
            let stream = Stream::deflated(bytes.clone());
            assert!(stream.stored_bytes() <= bytes.len());
            assert_eq!(stream.unpack(bytes.len()).unwrap(), bytes);
            assert!(stream.unpack(bytes.len() + 1).is_err());
        }
    }

    #[test]
    fn a_stream_that_unpacks_to_more_or_less_than_it_states_is_refused() {
        for (stated, real) in [(1000, 1001), (1001, 1000), (0, 10), (1 << 40, 1000), (usize::MAX, 1000)] {
            let mut stream = Stream::deflated(vec![0; real]);
            stream.length = stated as u64;
            assert!(stream.unpack(stated).is_err(), "{stated} of {real}");
        }
    }

    #[test]
    fn every_damaged_byte_gives_an_error_or_as_many_bytes() {
        let text: Vec<u8> = (0..2000_u32).map(|i| (i * i % 7) as u8).collect();
        let stream = Stream::deflated(text.clone());
        for at in 0..stream.bytes.len() {
            for flip in 1..=255 {
                let mut bytes = stream.bytes.to_vec();
                bytes[at] ^= flip;
                let damaged = Stream { codec: Codec::Deflate, length: stream.length, bytes: bytes.into() };
                let unpacked = damaged.unpack(text.len());
                assert!(unpacked.is_err() || unpacked.is_ok_and(|bytes| bytes.len() == text.len()));
            }
        }
    }
}
