//! Columns of integers: differences to an earlier element, split into byte planes.
//!
//! An element is predicted from the one `lag` before it, or with `sloped` from that one and the
//! step that the previous element made against its own: `v[i-1] + v[i-lag] - v[i-lag-1]`, which
//! suits rings of vertices. The differences are stored lowest byte first, one plane of bytes after
//! another, with as many planes as the largest of them needs.

use super::{fault::Decoded, stream::Stream};
use serde::{Deserialize, Serialize};
use std::{panic::resume_unwind, thread};

/// Lags that are tried for any column: rings and triangles of up to this many elements.
const MAX_LAG: u32 = 40;
/// Number of elements that decide which predictions are tried in full.
const SAMPLE: usize = 1 << 14;
/// Predictions that are tried in full, besides none.
const TRIED: usize = 2;

/// A column of 32-bit integers; all arithmetic wraps.
#[derive(Serialize, Deserialize)]
pub(super) struct Ints<'a> {
    /// Prediction of the elements that have no earlier one.
    base: u32,
    /// Distance to the element that predicts; 0 for the base alone.
    lag: u32,
    sloped: bool,
    /// Bytes per element, 0 to 4.
    planes: u8,
    #[serde(borrow)]
    stream: Stream<'a>,
}

impl Ints<'_> {
    /// Encodes columns side by side if they are long.
    pub(super) fn encode_all(columns: &[Vec<u32>]) -> Vec<Ints<'static>> {
        let [of_another, own] = match columns {
            [first, rest @ ..] if !rest.is_empty() && first.len() >= SAMPLE => [rest, &columns[..1]],
            _ => [&[][..], columns],
        };
        thread::scope(|scope| {
            let others: Vec<_> = of_another.iter().map(|column| scope.spawn(|| Self::encode(column))).collect();
            let own = own.iter().map(|column| Self::encode(column)).collect::<Vec<_>>().into_iter();
            own.chain(others.into_iter().map(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic))))
                .collect()
        })
    }

    pub(super) fn encode(values: &[u32]) -> Ints<'static> {
        if values.iter().all(|value| Some(value) == values.first()) {
            return Self::encode_by(values, (0, false), Stream::deflated);
        }
        let sample = &values[..values.len().min(SAMPLE)];
        let steps = (1..MAX_LAG.min(values.len() as u32)).flat_map(|lag| [(lag, false), (lag, true)]);
        let mut scored: Vec<(u64, (u32, bool))> = steps.map(|step| (cost(sample, step), step)).collect();
        scored.sort_unstable();
        let tried = scored.iter().take(TRIED).map(|&(_, step)| step);
        let tried = std::iter::once((0, false)).chain(tried);
        let best = tried.min_by_key(|&step| Self::encode_by(values, step, Stream::quickly).stream.stored_bytes());
        Self::encode_by(values, best.unwrap_or_default(), Stream::deflated)
    }

    fn encode_by(
        values: &[u32],
        (lag, sloped): (u32, bool),
        stream: impl Fn(Vec<u8>) -> Stream<'static>,
    ) -> Ints<'static> {
        let base = match lag {
            0 => values.iter().map(|&value| value as i32).min().unwrap_or_default() as u32,
            _ => values.first().copied().unwrap_or_default(),
        };
        let differences = differences(values, base, lag, sloped);
        let most = differences.iter().copied().max().unwrap_or_default();
        let planes = (4 - most.leading_zeros() / 8) as u8;
        Ints { base, lag, sloped, planes, stream: stream(planes_of(&differences, planes)) }
    }

    /// Decodes a column of `count` elements. Allocates at most 8 bytes for each.
    pub(super) fn decode(&self, count: usize) -> Decoded<Vec<u32>> {
        if self.planes > 4 {
            return Err(format!("a column of {} byte planes", self.planes));
        }
        let bytes = self.stream.unpack(count * usize::from(self.planes))?;
        let mut values = vec![0_u32; count];
        for (plane, bytes) in bytes.chunks_exact(count.max(1)).enumerate() {
            values.iter_mut().zip(bytes).for_each(|(value, &byte)| *value |= u32::from(byte) << (8 * plane));
        }
        drop(bytes);
        if self.lag == 0 {
            values.iter_mut().for_each(|value| *value = value.wrapping_add(self.base));
            return Ok(values);
        }
        let lag = self.lag as usize;
        for i in 0..count.min(lag.saturating_add(1)) {
            values[i] = unzigzag(values[i]).wrapping_add(prediction(&values, i, self.base, lag, self.sloped));
        }
        for i in lag.saturating_add(1)..count {
            // As `prediction`, without its cases.
            let step = if self.sloped { values[i - 1].wrapping_sub(values[i - lag - 1]) } else { 0 };
            values[i] = unzigzag(values[i]).wrapping_add(values[i - lag]).wrapping_add(step);
        }
        Ok(values)
    }
}

/// Differences of the elements to their predictions, small ones as small numbers.
fn differences(values: &[u32], base: u32, lag: u32, sloped: bool) -> Vec<u32> {
    if lag == 0 {
        return values.iter().map(|value| value.wrapping_sub(base)).collect();
    }
    let lag = lag as usize;
    let (first, rest) = values.split_at(values.len().min(lag + 1));
    let mut differences = Vec::with_capacity(values.len());
    differences.extend(
        first.iter().enumerate().map(|(i, value)| value.wrapping_sub(prediction(values, i, base, lag, sloped))),
    );
    // As `prediction`, without its cases.
    let lagged = rest.iter().zip(&values[values.len().min(1)..]).map(|(value, lagged)| value.wrapping_sub(*lagged));
    if sloped {
        let steps =
            values[first.len().max(1) - 1..].iter().zip(values).map(|(last, before)| last.wrapping_sub(*before));
        differences.extend(lagged.zip(steps).map(|(difference, step)| difference.wrapping_sub(step)));
    } else {
        differences.extend(lagged);
    }
    differences.iter_mut().for_each(|difference| *difference = zigzag(*difference));
    differences
}

/// Prediction of element `i` from those before it.
#[inline]
fn prediction(values: &[u32], i: usize, base: u32, lag: usize, sloped: bool) -> u32 {
    match lag {
        _ if i == 0 || lag == 0 => base,
        _ if i < lag => values[i - 1],
        _ if sloped && i > lag => values[i - 1].wrapping_add(values[i - lag]).wrapping_sub(values[i - lag - 1]),
        _ => values[i - lag],
    }
}

/// Bits that the differences take, roughly.
fn cost(values: &[u32], (lag, sloped): (u32, bool)) -> u64 {
    let base = values.first().copied().unwrap_or_default();
    differences(values, base, lag, sloped)
        .into_iter()
        .map(|difference| u64::from(32 - difference.leading_zeros()))
        .sum()
}

fn zigzag(value: u32) -> u32 {
    (value << 1) ^ ((value as i32 >> 31) as u32)
}

fn unzigzag(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn planes_of(values: &[u32], planes: u8) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.len() * usize::from(planes));
    (0..planes).for_each(|plane| bytes.extend(values.iter().map(|value| (value >> (8 * plane)) as u8)));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Vec<Vec<u32>> {
        let noise = |i: u32| i.wrapping_mul(2_654_435_761).rotate_left(7);
        vec![
            vec![],
            vec![u32::MAX],
            vec![5; 1000],
            (0..1000).map(noise).collect(),
            (0..1000).map(|i| 70_000 + i / 4 + noise(i) % 3).collect(),
            (0..1000).map(|i| if i % 100 == 0 { noise(i) } else { i }).collect(),
            (0..999).map(|i: u32| (i / 3).wrapping_sub(5)).collect(),
        ]
    }

    #[test]
    fn columns_come_back_whatever_they_hold() {
        for values in samples() {
            assert_eq!(Ints::encode(&values).decode(values.len()).unwrap(), values);
            for step in (0..12).flat_map(|lag| [(lag, false), (lag, lag > 0)]) {
                assert_eq!(
                    Ints::encode_by(&values, step, Stream::deflated).decode(values.len()).unwrap(),
                    values,
                    "{step:?}"
                );
            }
        }
    }

    #[test]
    fn equal_elements_take_no_bytes_and_regular_ones_hardly_any() {
        let sizes = samples().iter().map(|values| Ints::encode(values).stream.stored_bytes()).collect::<Vec<_>>();
        assert_eq!(sizes[..3], [0; 3]);
        assert!(sizes[6] < 40, "{sizes:?}");
    }

    #[test]
    fn wrong_numbers_of_elements_and_planes_are_refused() {
        let mut ints = Ints::encode(&[1, 2, 300]);
        assert!(ints.decode(2).is_err() && ints.decode(4).is_err());
        ints.planes = 5;
        assert!(ints.decode(3).is_err());
        let hostile = Ints { lag: u32::MAX, sloped: true, ..Ints::encode(&[1, 2, 3]) };
        assert!(hostile.decode(3).is_ok());
    }
}
