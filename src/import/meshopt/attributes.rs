//! The codec of vertex attributes, versions 0 and 1: deltas between elements, by columns of bytes.

use super::reader::Reader;

/// First byte of an attribute stream, version 0 and version 1.
const HEADER: u8 = 0xa0;
const HEADER_1: u8 = 0xa1;
/// Maximum number of elements in a block of attributes, and of bytes in it.
const BLOCK_ELEMENTS: usize = 256;
const BLOCK_BYTES: usize = 8192;
/// Number of bytes of one column that share a bit width.
const GROUP: usize = 16;
/// The stream ends with the first element and the channels, padded at the front to this many bytes,
/// by version.
const MIN_TAIL: [usize; 2] = [32, 24];
/// Bits of a delta by the width of its group: in version 0, then in the control modes 0 and 1 of
/// version 1.
const BITS: [[usize; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// How four bytes of an element follow from those of the element before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Channel {
    /// Four bytes, each with its own difference.
    Bytes,
    /// Two 16-bit numbers, each with its own difference.
    Shorts,
    /// A 32-bit number: exclusive or with a difference that is rotated right by this many bits.
    Xor(u32),
}

impl Channel {
    fn parse(byte: u8) -> Result<Self, String> {
        match (byte & 15, byte >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Shorts),
            (2, rotation) => Ok(Self::Xor(rotation.into())),
            _ => Err(format!("unknown channel mode {byte:#04x}")),
        }
    }

    /// The value that follows `last`, both in little-endian order.
    fn next(self, last: [u8; 4], delta: [u8; 4]) -> [u8; 4] {
        match self {
            Self::Bytes => std::array::from_fn(|i| last[i].wrapping_add(unzigzag8(delta[i]))),
            Self::Shorts => {
                let half = |i: usize| {
                    let [last, delta] = [last, delta].map(|of| u16::from_le_bytes([of[i], of[i + 1]]));
                    last.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg()).to_le_bytes()
                };
                let ([a, b], [c, d]) = (half(0), half(2));
                [a, b, c, d]
            }
            Self::Xor(rotation) => {
                (u32::from_le_bytes(last) ^ u32::from_le_bytes(delta).rotate_right(rotation)).to_le_bytes()
            }
        }
    }
}

/// Decodes `count` elements of `stride` bytes.
pub(super) fn decode(encoded: &[u8], count: usize, stride: usize) -> super::Decoded {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!("unsupported stride of {stride} bytes"));
    }
    let version = match *encoded.first().ok_or("the stream is truncated")? {
        HEADER => 0,
        HEADER_1 => 1,
        first => return Err(format!("attributes start with {first:#04x}; only 0xa0 and 0xa1 are supported")),
    };
    let whole = if version == 0 { stride } else { stride + stride / 4 };
    let tail = encoded.len().checked_sub(whole).zip(encoded.len().checked_sub(whole.max(MIN_TAIL[version])));
    let (tail, end) = tail.filter(|(_, end)| *end > 0).ok_or("the stream is truncated")?;
    let (first, channels) = encoded[tail..].split_at(stride);
    let channels = match version {
        0 => vec![Channel::Bytes; stride / 4],
        _ => channels.iter().map(|&byte| Channel::parse(byte)).collect::<Result<_, _>>()?,
    };
    let mut decoder = Decoder { stream: Reader(&encoded[1..end]), version, stride, last: first.to_vec(), channels };
    let mut bytes = vec![0; count * stride];
    let block_elements = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    for block in bytes.chunks_mut(block_elements * stride) {
        decoder.block(block)?;
    }
    let left = decoder.stream.0.len();
    if left == 0 { Ok(bytes) } else { Err(format!("{left} bytes are left over")) }
}

/// State between two blocks.
struct Decoder<'a> {
    stream: Reader<'a>,
    version: usize,
    stride: usize,
    /// The element before.
    last: Vec<u8>,
    /// One per four bytes of an element.
    channels: Vec<Channel>,
}

impl Decoder<'_> {
    fn block(&mut self, block: &mut [u8]) -> Result<(), String> {
        let elements = block.len() / self.stride;
        let controls = self.stream.take(if self.version == 0 { 0 } else { self.channels.len() })?;
        for (i, &channel) in self.channels.iter().enumerate() {
            let mut columns = [[0; BLOCK_ELEMENTS]; 4];
            for (j, column) in columns.iter_mut().enumerate() {
                let control = controls.get(i).map(|control| control >> (j * 2) & 3);
                decode_column(&mut self.stream, &mut column[..elements], control)?;
            }
            let last = &mut self.last[i * 4..][..4];
            for (element, into) in block.chunks_exact_mut(self.stride).enumerate() {
                let value = channel.next([last[0], last[1], last[2], last[3]], columns.map(|column| column[element]));
                last.copy_from_slice(&value);
                into[i * 4..][..4].copy_from_slice(&value);
            }
        }
        Ok(())
    }
}

/// Decodes the deltas of one column of a block; `control` is its control mode in version 1.
fn decode_column(stream: &mut Reader, column: &mut [u8], control: Option<u8>) -> Result<(), String> {
    let bits = match control {
        None => BITS[0],
        Some(2) => return Ok(()),
        Some(3) => {
            column.copy_from_slice(stream.take(column.len())?);
            return Ok(());
        }
        Some(control) => BITS[1 + usize::from(control)],
    };
    let widths = stream.take(column.len().div_ceil(GROUP).div_ceil(4))?;
    for (group, into) in column.chunks_mut(GROUP).enumerate() {
        let width = widths[group / 4] >> (group % 4 * 2) & 3;
        let deltas = decode_group(stream, bits[usize::from(width)])?;
        into.copy_from_slice(&deltas[..into.len()]);
    }
    Ok(())
}

/// Sixteen deltas of 0, 1, 2, 4 or 8 bits each. The greatest value of 1, 2 or 4 bits is an escape:
/// the delta is a whole byte after the packed ones.
fn decode_group(stream: &mut Reader, bits: usize) -> Result<[u8; GROUP], String> {
    let mut deltas = [0; GROUP];
    let packed = stream.take(GROUP * bits / 8)?;
    if bits == 8 {
        deltas.copy_from_slice(packed);
    }
    if bits == 0 || bits == 8 {
        return Ok(deltas);
    }
    let escape = (1 << bits) - 1;
    for (i, delta) in deltas.iter_mut().enumerate() {
        let at = i * bits;
        // Single bits start at the lowest, wider ones at the highest.
        let shift = if bits == 1 { at % 8 } else { 8 - bits - at % 8 };
        let value = packed[at / 8] >> shift & escape;
        *delta = if value == escape { stream.byte()? } else { value };
    }
    Ok(deltas)
}

fn unzigzag8(value: u8) -> u8 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 17 elements of 4 bytes, in two groups. Column 0 counts up by one, the others stay.
    fn counting() -> (Vec<u8>, Vec<u8>) {
        let mut encoded = vec![HEADER];
        // Column 0: widths 1 (two bits) and 3 (eight bits). Zigzag of 1 is 2; the first delta is 0
        // to the tail's element.
        encoded.push(0b1101);
        encoded.extend([0b0010_1010, 0b1010_1010, 0b1010_1010, 0b1010_1010]);
        encoded.extend([2; GROUP]);
        encoded.extend([0; 3]);
        encoded.resize(encoded.len() + MIN_TAIL[0] - 4, 0);
        encoded.extend([5, 1, 2, 3]);
        let decoded = (0..17).flat_map(|i| [5 + i, 1, 2, 3]).collect();
        (encoded, decoded)
    }

    /// The same in version 1, with the control modes `controls`, the bytes `columns` and a channel.
    fn of_version_1(controls: u8, columns: &[u8], channel: u8) -> Vec<u8> {
        let mut encoded = vec![HEADER_1, controls];
        encoded.extend_from_slice(columns);
        encoded.resize(encoded.len() + MIN_TAIL[1] - 5, 0);
        encoded.extend([5, 1, 2, 3, channel]);
        encoded
    }

    #[test]
    fn attributes_are_deltas_to_the_element_at_the_end() {
        let (encoded, decoded) = counting();
        assert_eq!(decode(&encoded, 17, 4).unwrap(), decoded);
        for length in 0..encoded.len() {
            assert!(decode(&encoded[..length], 17, 4).is_err());
        }
    }

    #[test]
    fn every_control_mode_gives_the_same_column() {
        let (_, decoded) = counting();
        // Literal deltas without padding; the other columns are zero without data.
        let literal = [&[0][..], &[2; 16]].concat();
        // One bit per delta, lowest first: the first is 0, the others are escapes. The second group
        // takes one bit per delta too, and one escape.
        let single = [&[0b0000_0000, 0xfe, 0xff][..], &[2; 15], &[0x01, 0x00], &[2]].concat();
        // Four bits, then whole bytes.
        let wide = [&[0b1110][..], &[0x02, 0x22, 0x22, 0x22, 0x22, 0x22, 0x22, 0x22], &[2; 16]].concat();
        for (control, column) in [(3, literal), (1, single), (1, wide)] {
            let encoded = of_version_1(control | 0b1010_1000, &column, 0);
            assert_eq!(decode(&encoded, 17, 4).unwrap(), decoded, "{control}");
            for length in 0..encoded.len() {
                assert!(decode(&encoded[..length], 17, 4).is_err(), "{control}, {length}");
            }
        }
    }

    #[test]
    fn channels_are_bytes_shorts_or_rotated_words() {
        assert_eq!(Channel::parse(0).unwrap().next([255, 0, 0, 0], [2, 1, 0, 0]), [0, 255, 0, 0]);
        assert_eq!(Channel::parse(1).unwrap().next([255, 0, 0, 0], [2, 0, 1, 0]), [0, 1, 255, 255]);
        let turned = Channel::parse(0x42).unwrap();
        assert_eq!(turned.next([1, 0, 0, 0], [0x12, 0, 0, 0]), [0, 0, 0, 0x20]);
        for byte in [3, 0x10, 0x11, 0xff] {
            assert!(Channel::parse(byte).is_err(), "{byte}");
        }
    }
}
