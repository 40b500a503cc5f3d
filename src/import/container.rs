//! The two forms of a glTF file: JSON alone, or the binary container with its chunks.

use super::fault::Fault;

/// First bytes of a binary glTF file.
const MAGIC: &[u8] = b"glTF";
/// Bytes of the file header: magic, version, length.
const HEADER_BYTES: usize = 12;
/// Bytes of a chunk header: length, type.
const CHUNK_HEADER_BYTES: usize = 8;

/// The JSON text and, if present, the binary chunk.
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
}

/// Returns true for binary glTF, and for text that starts like JSON.
pub(super) fn is_gltf(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC) || bytes.trim_ascii_start().starts_with(b"{")
}

/// Splits a file into JSON and binary chunk. The format requires other chunks to be skipped.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, Fault> {
    if !bytes.starts_with(MAGIC) {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return if is_gltf(json) { Ok(Container { json, binary: None }) } else { Err(not_gltf()) };
    }
    let version = word(bytes, 4)?;
    if version != 2 {
        let feature = format!("glTF version {version}");
        return Err(Fault::Unsupported { feature, fix: "convert the file to glTF 2.0".to_owned() });
    }
    let length = word(bytes, 8)? as usize;
    let body = bytes.get(HEADER_BYTES..length).ok_or_else(|| truncated(length, bytes.len()))?;
    let (json, mut rest) = chunk(body, b"JSON")?.ok_or_else(|| Fault::broken("the first chunk is not JSON"))?;
    while !rest.is_empty() {
        if let Some((binary, _)) = chunk(rest, b"BIN\0")? {
            return Ok(Container { json, binary: Some(binary) });
        }
        let skipped = word(rest, 0)? as usize;
        rest = rest.get(CHUNK_HEADER_BYTES + skipped..).unwrap_or(&[]);
    }
    Ok(Container { json, binary: None })
}

/// Content of a chunk, and the bytes after it.
type Split<'a> = (&'a [u8], &'a [u8]);

/// Content of the first chunk and the bytes after it, or `None` if its type is not `kind`.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Result<Option<Split<'a>>, Fault> {
    let length = word(bytes, 0)? as usize;
    let found = bytes.get(4..CHUNK_HEADER_BYTES).ok_or_else(|| truncated(CHUNK_HEADER_BYTES, bytes.len()))?;
    let content = &bytes[CHUNK_HEADER_BYTES..];
    if length > content.len() {
        return Err(truncated(length, content.len()));
    }
    Ok((found == kind).then(|| content.split_at(length)))
}

fn word(bytes: &[u8], at: usize) -> Result<u32, Fault> {
    let word = bytes.get(at..at + 4).ok_or_else(|| truncated(at + 4, bytes.len()))?;
    Ok(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
}

fn truncated(needed: usize, found: usize) -> Fault {
    Fault::Broken {
        reason: format!("the file is truncated: {needed} bytes are declared and {found} are present"),
        fix: "copy or export it again",
    }
}

fn not_gltf() -> Fault {
    Fault::Broken { reason: "the content is neither glTF nor OBJ".to_owned(), fix: "use a .glb, .gltf or .obj file" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut body = Vec::new();
        for (kind, content) in chunks {
            body.extend_from_slice(&(content.len() as u32).to_le_bytes());
            body.extend_from_slice(*kind);
            body.extend_from_slice(content);
        }
        let mut bytes = b"glTF".to_vec();
        bytes.extend_from_slice(&2u32.to_le_bytes());
        bytes.extend_from_slice(&((HEADER_BYTES + body.len()) as u32).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    #[test]
    fn unknown_chunks_are_passed_over() {
        let bytes = glb(&[(b"JSON", b"{}  "), (b"XTRA", b"1234"), (b"BIN\0", b"5678")]);
        let container = split(&bytes).unwrap();
        assert_eq!((container.json, container.binary), (&b"{}  "[..], Some(&b"5678"[..])));
    }

    #[test]
    fn every_truncation_is_refused() {
        let bytes = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"5678")]);
        for length in 0..bytes.len() {
            assert!(split(&bytes[..length]).is_err(), "{length} bytes were accepted");
        }
    }

    #[test]
    fn header_shorter_than_itself_is_refused() {
        let mut bytes = glb(&[(b"JSON", b"{}  ")]);
        bytes[8..12].copy_from_slice(&3u32.to_le_bytes());
        assert!(split(&bytes).is_err());
    }
}
