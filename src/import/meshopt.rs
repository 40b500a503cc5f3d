//! Decoder for `EXT_meshopt_compression`.
//!
//! Follows the specification of the extension (Khronos glTF repository, `EXT_meshopt_compression`,
//! appendices A "Bitstream" and B "Filters"; Kapoulkine, 2021): vertex codec version 0, index
//! codecs version 1, the three filters.
//!
//! The decoder is written in Rust here because the `meshopt` crate wraps the original C++ library,
//! and the default build compiles no C++.
//!
//! Limits: version 1 of the vertex codec (`KHR_meshopt_compression`) is not supported.

/// How a view is encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// Vertex attributes, then a filter.
    Attributes(Filter),
    /// Indices of a triangle list.
    Triangles,
    /// Any other indices.
    Indices,
}

/// Filter to undo after the attributes have been decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

impl Mode {
    /// Parses the mode and filter names of the extension.
    pub(super) fn parse(mode: Option<&str>, filter: Option<&str>) -> Result<Self, String> {
        let filter = match filter {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some(other) => return Err(format!("unknown filter {other:?}")),
        };
        match mode {
            Some("ATTRIBUTES") => Ok(Self::Attributes(filter)),
            Some("TRIANGLES") if filter == Filter::None => Ok(Self::Triangles),
            Some("INDICES") if filter == Filter::None => Ok(Self::Indices),
            _ => Err(format!("unknown mode {mode:?} with filter {filter:?}")),
        }
    }
}

type Decoded = Result<Vec<u8>, String>;

/// Decodes `encoded` into `count * stride` bytes. The caller has bounded that product.
pub(super) fn decode(encoded: &[u8], count: usize, stride: usize, mode: Mode) -> Decoded {
    match mode {
        Mode::Attributes(filter) => {
            let mut bytes = decode_attributes(encoded, count, stride)?;
            undo_filter(&mut bytes, stride, filter)?;
            Ok(bytes)
        }
        Mode::Triangles | Mode::Indices if stride != 2 && stride != 4 => {
            Err(format!("indices cannot be {stride} bytes wide"))
        }
        Mode::Triangles => Ok(pack(&decode_triangles(encoded, count)?, stride)),
        Mode::Indices => Ok(pack(&decode_indices(encoded, count)?, stride)),
    }
}

/// First byte of an attribute stream, version 0.
const ATTRIBUTES_HEADER: u8 = 0xa0;
/// First byte of a triangle stream, version 1.
const TRIANGLES_HEADER: u8 = 0xe1;
/// First byte of an index sequence, version 1.
const INDICES_HEADER: u8 = 0xd1;
/// Maximum number of elements in a block of attributes, and of bytes in it.
const BLOCK_ELEMENTS: usize = 256;
const BLOCK_BYTES: usize = 8192;
/// Number of bytes of one column that share a bit width.
const GROUP: usize = 16;
/// The attribute stream ends with the first element, padded at the front to this many bytes.
const MIN_TAIL: usize = 32;

/// Reads bytes from the front of a slice.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("the stream is truncated")?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// Unsigned integer in groups of 7 bits, least significant first.
    fn varint(&mut self) -> Result<u32, String> {
        let mut value = 0u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127).wrapping_shl(shift);
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("a number takes more than 5 bytes".to_owned())
    }
}

fn decode_attributes(encoded: &[u8], count: usize, stride: usize) -> Decoded {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!("unsupported stride of {stride} bytes"));
    }
    let tail_start = encoded.len().checked_sub(stride.max(MIN_TAIL)).ok_or("the stream is truncated")?;
    let mut last = encoded[encoded.len() - stride..].to_vec();
    let mut stream = Reader(&encoded[..tail_start]);
    match stream.byte()? {
        ATTRIBUTES_HEADER => {}
        header => {
            return Err(format!("attributes start with {header:#04x}; only {ATTRIBUTES_HEADER:#04x} is supported"));
        }
    }
    let mut bytes = vec![0; count * stride];
    let block_elements = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    for block in bytes.chunks_mut(block_elements * stride) {
        for (column, last) in last.iter_mut().enumerate() {
            decode_column(&mut stream, block, column, stride, last)?;
        }
    }
    if stream.0.is_empty() { Ok(bytes) } else { Err(format!("{} bytes are left over", stream.0.len())) }
}

/// Decodes one byte column of a block: zigzag deltas to the previous element, per [`GROUP`].
fn decode_column(
    stream: &mut Reader,
    block: &mut [u8],
    column: usize,
    stride: usize,
    last: &mut u8,
) -> Result<(), String> {
    let elements = block.len() / stride;
    let groups = elements.div_ceil(GROUP);
    let widths = stream.take(groups.div_ceil(4))?;
    for group in 0..groups {
        let width = widths[group / 4] >> (group % 4 * 2) & 3;
        let deltas = decode_group(stream, width)?;
        for (element, delta) in (group * GROUP..elements).zip(deltas) {
            *last = last.wrapping_add(unzigzag8(delta));
            block[element * stride + column] = *last;
        }
    }
    Ok(())
}

/// Sixteen deltas of 0, 2, 4 or 8 bits each. The greatest value of 2 or 4 bits is an escape: the
/// delta is a whole byte after the packed ones.
fn decode_group(stream: &mut Reader, width: u8) -> Result<[u8; GROUP], String> {
    let mut deltas = [0; GROUP];
    let bits = match width {
        0 => return Ok(deltas),
        3 => {
            deltas.copy_from_slice(stream.take(GROUP)?);
            return Ok(deltas);
        }
        width => usize::from(width) * 2,
    };
    let packed = stream.take(GROUP * bits / 8)?;
    let escape = (1 << bits) - 1;
    for (i, delta) in deltas.iter_mut().enumerate() {
        let at = i * bits;
        let value = packed[at / 8] >> (8 - bits - at % 8) & escape;
        *delta = if value == escape { stream.byte()? } else { value };
    }
    Ok(deltas)
}

fn unzigzag8(value: u8) -> u8 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn unzigzag32(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

/// Ring buffer of the sixteen most recent items, indexed by age.
struct Fifo<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn new(fill: T) -> Self {
        Self { items: [fill; 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        self.items[self.next] = item;
        self.next = (self.next + 1) % 16;
    }

    /// The item pushed `age` pushes before the newest.
    fn get(&self, age: usize) -> T {
        self.items[(self.next + 31 - age) % 16]
    }
}

/// State of the triangle decoder.
struct Triangles<'a> {
    edges: Fifo<[u32; 2]>,
    vertices: Fifo<u32>,
    /// The next index that has not occurred yet.
    next: u32,
    /// The last index that was stored explicitly.
    last: u32,
    data: Reader<'a>,
}

fn decode_triangles(encoded: &[u8], count: usize) -> Result<Vec<u32>, String> {
    /// Size in bytes of the table of frequent auxiliary codes at the end.
    const TABLE: usize = 16;
    let triangles = count / 3;
    let mut stream = Reader(encoded);
    if !count.is_multiple_of(3) || stream.byte()? != TRIANGLES_HEADER {
        return Err(format!(
            "{count} indices are not whole triangles, or the version of the triangle codec is unknown"
        ));
    }
    let codes = stream.take(triangles)?;
    let data_length = stream.0.len().checked_sub(TABLE).ok_or("the stream is truncated")?;
    let (data, table) = stream.0.split_at(data_length);
    let mut state = Triangles {
        edges: Fifo::new([u32::MAX; 2]),
        vertices: Fifo::new(u32::MAX),
        next: 0,
        last: 0,
        data: Reader(data),
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        indices.extend(state.triangle(code, table)?);
    }
    if state.data.0.is_empty() { Ok(indices) } else { Err(format!("{} bytes are left over", state.data.0.len())) }
}

impl Triangles<'_> {
    fn triangle(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        match code {
            0x00..0xf0 => self.on_known_edge(code),
            0xf0..0xfe => self.apart(0, table[usize::from(code & 15)]),
            0xfe | 0xff => {
                let auxiliary = self.data.byte()?;
                if auxiliary == 0 {
                    self.next = 0;
                }
                self.apart(if code == 0xff { 15 } else { 0 }, auxiliary)
            }
        }
    }

    /// Decodes a triangle on one of the sixteen most recent edges.
    fn on_known_edge(&mut self, code: u8) -> Result<[u32; 3], String> {
        let [a, b] = self.edges.get(usize::from(code >> 4));
        let low = code & 15;
        let c = match low {
            0 => self.fresh(),
            1..13 => self.vertices.get(usize::from(low)),
            13 => self.written(Step::Back)?,
            14 => self.written(Step::Forward)?,
            _ => self.written(Step::Delta)?,
        };
        if low == 0 || low >= 13 {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    /// Decodes a triangle on no known edge: each corner is new, recent (by age) or explicit.
    fn apart(&mut self, a_code: u8, auxiliary: u8) -> Result<[u32; 3], String> {
        let [b_code, c_code] = [auxiliary >> 4, auxiliary & 15];
        let mut corners = [0; 3];
        // New and recent corners are resolved before the explicitly stored ones.
        for (corner, code) in corners.iter_mut().zip([a_code, b_code, c_code]) {
            *corner = match code {
                0 => self.fresh(),
                15 => 0,
                code => self.vertices.get(usize::from(code) - 1),
            };
        }
        for (corner, code) in corners.iter_mut().zip([a_code, b_code, c_code]) {
            if code == 15 {
                *corner = self.written(Step::Delta)?;
            }
        }
        for (corner, code) in corners.into_iter().zip([a_code, b_code, c_code]) {
            if code == 0 || code == 15 {
                self.vertices.push(corner);
            }
        }
        let [a, b, c] = corners;
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        Ok(corners)
    }

    fn fresh(&mut self) -> u32 {
        self.next = self.next.wrapping_add(1);
        self.next.wrapping_sub(1)
    }

    fn written(&mut self, step: Step) -> Result<u32, String> {
        self.last = match step {
            Step::Back => self.last.wrapping_sub(1),
            Step::Forward => self.last.wrapping_add(1),
            Step::Delta => self.last.wrapping_add(unzigzag32(self.data.varint()?)),
        };
        Ok(self.last)
    }
}

/// How an explicitly stored index follows from the last one.
#[derive(Clone, Copy)]
enum Step {
    Back,
    Forward,
    Delta,
}

fn decode_indices(encoded: &[u8], count: usize) -> Result<Vec<u32>, String> {
    /// Number of zero bytes at the end.
    const TAIL: usize = 4;
    let mut stream = Reader(encoded);
    if stream.byte()? != INDICES_HEADER {
        return Err("the version of the index codec is unknown".to_owned());
    }
    if stream.0.len() < count.saturating_add(TAIL) {
        return Err("the stream is truncated".to_owned());
    }
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let value = stream.varint()?;
        let last = &mut last[(value & 1) as usize];
        *last = last.wrapping_add(unzigzag32(value >> 1));
        indices.push(*last);
    }
    if stream.0.len() == TAIL { Ok(indices) } else { Err(format!("{} bytes are left over", stream.0.len())) }
}

fn pack(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}

fn undo_filter(bytes: &mut [u8], stride: usize, filter: Filter) -> Result<(), String> {
    let fits = match filter {
        Filter::None => true,
        Filter::Octahedral => stride == 4 || stride == 8,
        Filter::Quaternion => stride == 8,
        Filter::Exponential => stride.is_multiple_of(4),
    };
    if !fits {
        return Err(format!("filter {filter:?} does not support a stride of {stride} bytes"));
    }
    match filter {
        Filter::None => {}
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

    /// 17 elements of 4 bytes, in two groups. Column 0 counts up by one, the others stay.
    fn counting() -> (Vec<u8>, Vec<u8>) {
        let mut encoded = vec![ATTRIBUTES_HEADER];
        // Column 0: widths 1 (two bits) and 3 (eight bits). Zigzag of 1 is 2; the first delta is 0
        // to the tail's element.
        encoded.push(0b1101);
        encoded.extend([0b0010_1010, 0b1010_1010, 0b1010_1010, 0b1010_1010]);
        encoded.extend([2; GROUP]);
        encoded.extend([0; 3]);
        encoded.resize(encoded.len() + MIN_TAIL - 4, 0);
        encoded.extend([5, 1, 2, 3]);
        let decoded = (0..17).flat_map(|i| [5 + i, 1, 2, 3]).collect();
        (encoded, decoded)
    }

    #[test]
    fn attributes_are_deltas_to_the_element_at_the_end() {
        let (encoded, decoded) = counting();
        assert_eq!(decode(&encoded, 17, 4, Mode::Attributes(Filter::None)).unwrap(), decoded);
        for length in 0..encoded.len() {
            assert!(decode(&encoded[..length], 17, 4, Mode::Attributes(Filter::None)).is_err());
        }
    }

    #[test]
    fn two_triangles_of_a_strip_share_their_edge() {
        // Both corners new (table entry 0 is 0), then a new vertex on the newest edge (a, c) of the
        // first.
        let mut encoded = vec![TRIANGLES_HEADER, 0xf0, 0x00];
        encoded.extend([0; 16]);
        let bytes = decode(&encoded, 6, 2, Mode::Triangles).unwrap();
        assert_eq!(bytes, [0, 1, 2, 0, 2, 3].map(|index: u16| index.to_le_bytes()).concat());
    }

    #[test]
    fn index_sequences_follow_two_baselines() {
        // (value << 1 | baseline), value a zigzag delta: 10 and 12 on baseline 0, 3 on baseline 1,
        // 11 on baseline 0.
        let encoded = [INDICES_HEADER, 40, 8, 13, 2, 0, 0, 0, 0];
        let bytes = decode(&encoded, 4, 4, Mode::Indices).unwrap();
        assert_eq!(bytes, [10, 12, 3, 11].map(|index: u32| index.to_le_bytes()).concat());
    }

    #[test]
    fn filters_give_unit_vectors_and_exact_floats() {
        let mut normals = [0, 0, 127, 0, 127, 0, 127, 9].map(|value: i8| value as u8);
        undo_filter(&mut normals, 4, Filter::Octahedral).unwrap();
        assert_eq!(normals, [0, 0, 127, 0, 127, 0, 0, 9]);
        let mut identity = [0i16, 0, 0, 2047 << 2 | 3].map(i16::to_le_bytes).concat();
        undo_filter(&mut identity, 8, Filter::Quaternion).unwrap();
        assert_eq!(shorts(&identity), [0, 0, 0, 32767]);
        let mut value = (((-2i32) << 24) | 5).to_le_bytes();
        undo_filter(&mut value, 4, Filter::Exponential).unwrap();
        assert_eq!(f32::from_le_bytes(value), 1.25);
    }

    #[test]
    fn noise_never_panics() {
        let mut state = 7u64;
        let mut byte = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 56) as u8
        };
        for round in 0..4000 {
            let length = usize::from(byte());
            let mut noise: Vec<u8> = (0..length).map(|_| byte()).collect();
            let [count, stride] = [usize::from(byte()), usize::from(byte() / 4) * 4];
            let headers = [ATTRIBUTES_HEADER, TRIANGLES_HEADER, INDICES_HEADER];
            noise.iter_mut().take(1).for_each(|first| *first = headers[round % 3]);
            for filter in [Filter::None, Filter::Octahedral, Filter::Quaternion, Filter::Exponential] {
                drop(decode(&noise, count, stride, Mode::Attributes(filter)));
            }
            for mode in [Mode::Triangles, Mode::Indices] {
                drop(decode(&noise, count / 3 * 3, 2 + stride % 3, mode));
            }
        }
    }
}
