//! Decoder for `EXT_meshopt_compression` and `KHR_meshopt_compression`.
//!
//! Follows the specifications of the extensions (Khronos glTF repository, appendices A "Bitstream"
//! and B "Filters"; Kapoulkine, 2021 and 2025): vertex codec versions 0 and 1, index codecs version
//! 1, the four filters. The older extension has neither version 1 of the vertex codec nor the
//! colour filter; they are read there too.
//!
//! The decoder is written in Rust here because the `meshopt` crate wraps the original C++ library,
//! and the default build compiles no C++.

mod attributes;
mod filters;
mod reader;

use filters::Filter;
use reader::Reader;

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

impl Mode {
    /// Parses the mode and filter names of the extension.
    pub(super) fn parse(mode: Option<&str>, filter: Option<&str>) -> Result<Self, String> {
        let filter = match filter {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
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
            let mut bytes = attributes::decode(encoded, count, stride)?;
            filters::undo(&mut bytes, stride, filter)?;
            Ok(bytes)
        }
        Mode::Triangles | Mode::Indices if stride != 2 && stride != 4 => {
            Err(format!("indices cannot be {stride} bytes wide"))
        }
        Mode::Triangles => Ok(pack(&decode_triangles(encoded, count)?, stride)),
        Mode::Indices => Ok(pack(&decode_indices(encoded, count)?, stride)),
    }
}

/// First byte of a triangle stream, version 1.
const TRIANGLES_HEADER: u8 = 0xe1;
/// First byte of an index sequence, version 1.
const INDICES_HEADER: u8 = 0xd1;

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

#[cfg(test)]
mod tests {
    use super::*;

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
            let headers = [0xa0, 0xa1, TRIANGLES_HEADER, INDICES_HEADER];
            noise.iter_mut().take(1).for_each(|first| *first = headers[round % 4]);
            let smooth = [Filter::Octahedral, Filter::Quaternion, Filter::Exponential, Filter::Color];
            for filter in smooth.into_iter().chain([Filter::None]) {
                drop(decode(&noise, count, stride, Mode::Attributes(filter)));
            }
            for mode in [Mode::Triangles, Mode::Indices] {
                drop(decode(&noise, count / 3 * 3, 2 + stride % 3, mode));
            }
        }
    }
}
