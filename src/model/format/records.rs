//! Records as bytes, by bincode with fixed-width integers: the only file that knows bincode.

use super::fault::{Decoded, MAX_FILE_BYTES};
use crate::{Error, Result};
use serde::{Deserialize, Serialize, Serializer};

pub(super) fn encode(value: &impl Serialize) -> Result<Vec<u8>> {
    bincode::serde::encode_to_vec(value, bincode::config::legacy())
        .map_err(|error| Error::unreadable("model", error.to_string(), "report this model"))
}

/// Decodes a record, which must end where `bytes` end; its byte fields borrow from them. Allocation
/// while decoding is bounded by the smallest of the limits below that fits; there are only a few
/// because bincode takes its limit at compile time.
pub(super) fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Decoded<T> {
    const KIB: usize = 1 << 10;
    const MIB: usize = 1 << 20;
    let decoded = match bytes.len() {
        length if length <= KIB => decode_limited::<T, KIB>(bytes),
        length if length <= MIB => decode_limited::<T, MIB>(bytes),
        length if length <= 32 * MIB => decode_limited::<T, { 32 * MIB }>(bytes),
        _ => decode_limited::<T, { MAX_FILE_BYTES as usize }>(bytes),
    };
    match decoded {
        Ok((value, used)) if used == bytes.len() => Ok(value),
        Ok((_, used)) => Err(format!("ends after {used} of {} bytes", bytes.len())),
        Err(error) => Err(error.to_string().replace('\n', " ")),
    }
}

fn decode_limited<'a, T: Deserialize<'a>, const LIMIT: usize>(
    bytes: &'a [u8],
) -> std::result::Result<(T, usize), bincode::error::DecodeError> {
    bincode::serde::borrow_decode_from_slice(bytes, bincode::config::legacy().with_limit::<LIMIT>())
}

/// For `serialize_with`: bytes as one field rather than one by one.
pub(super) fn as_bytes<S: Serializer>(bytes: &[u8], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytes)
}
