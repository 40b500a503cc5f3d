//! Text of OBJ files and material libraries: UTF-8 with or without a byte-order mark, else
//! Windows-1252; lines that end in a backslash go on in the next.

use std::borrow::Cow;

/// Characters of the bytes 0x80 to 0x9f in Windows-1252. The five that it leaves undefined stand
/// for themselves.
const HIGH: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// The text in `bytes`, with continued lines joined. Any bytes are text.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = str::from_utf8(bytes).map_or_else(|_| windows_1252(bytes).into(), Cow::Borrowed);
    match text.contains("\\\n") || text.contains("\\\r\n") {
        true => text.replace("\\\r\n", " ").replace("\\\n", " ").into(),
        false => text,
    }
}

/// The text that `bytes` are in Windows-1252.
pub(super) fn windows_1252(bytes: &[u8]) -> String {
    let letter = |&byte: &u8| match byte {
        0x80..0xa0 => HIGH[usize::from(byte - 0x80)],
        _ => char::from(byte),
    };
    bytes.iter().map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_utf_8_or_windows_1252() {
        assert_eq!(text("\u{feff}v Blätter".as_bytes()), "v Blätter");
        assert_eq!(text(b"newmtl Bl\xe4tter \x80 \x93"), "newmtl Blätter € “");
    }

    #[test]
    fn a_backslash_at_the_end_continues_a_line() {
        assert_eq!(text(b"f 1 2 \\\n3\r\nf 1 2 \\\r\n3"), "f 1 2  3\r\nf 1 2  3");
        assert_eq!(text(b"map_Kd a\\b.png\n"), "map_Kd a\\b.png\n");
    }
}
