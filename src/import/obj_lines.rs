//! Lines of an OBJ file: checked and rewritten before tobj reads them.

use super::fault::Fault;
use crate::plant::MAX_ELEMENTS;
use std::collections::BTreeSet;

/// Suggested fix for most errors in an OBJ file.
pub(super) const FIX: &str = "export it again as triangles";

/// Keys of lines that contain names, and the maximum length of such a line in bytes: tobj repeats a
/// name for each group and material.
const NAMING: [&str; 4] = ["o", "g", "usemtl", "newmtl"];
const MAX_NAME_LINE: usize = 1024;

/// Rejects input that tobj cannot handle: very long names, and faces with indices before the first
/// element or above [`MAX_ELEMENTS`], which overflow when tobj multiplies them.
pub(super) fn check(text: &str) -> Result<(), Fault> {
    let kinds = ["v", "vt", "vn"];
    let mut counts = [0_i64; 3];
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        if let Some(kind) = kinds.iter().position(|&kind| kind == key) {
            counts[kind] += 1;
        }
        if NAMING.contains(&key) && line.len() > MAX_NAME_LINE {
            let reason = format!("line {} has a name of {} bytes", number + 1, line.len());
            return Err(Fault::Broken { reason, fix: FIX });
        }
        if !["f", "l", "p"].contains(&key) {
            continue;
        }
        let indices = words.flat_map(|word| (0..).zip(word.split('/')).take(3));
        for (kind, index) in indices.filter_map(|(kind, index)| Some((kind, index.parse::<i64>().ok()?))) {
            if index < -counts[kind] || index > MAX_ELEMENTS as i64 {
                let reason = format!("line {} refers to {} {index} of {}", number + 1, kinds[kind], counts[kind]);
                return Err(Fault::Broken { reason, fix: FIX });
            }
        }
    }
    Ok(())
}

/// Names of the materials that faces use.
pub(super) fn materials_in_use(text: &str) -> BTreeSet<&str> {
    text.lines().map(split).filter(|(key, name)| *key == "usemtl" && !name.is_empty()).map(|(_, name)| name).collect()
}

/// The text with every line as tobj reads it: one space after a keyword, and after `v` three
/// numbers, or four with a weight. If one vertex has a colour from 0 to 1, all have one.
pub(super) fn plain(text: &str) -> String {
    let colors = text.lines().map(split).filter(|(key, _)| *key == "v").filter_map(|(_, rest)| color(rest));
    let greatest = colors.flatten().reduce(f32::max);
    let scale = greatest.map(|greatest| if greatest > BYTES_FROM { 255.0 } else { 1.0 });
    let mut plain = String::with_capacity(text.len());
    for (key, rest) in text.lines().map(split) {
        match key {
            "v" => push_vertex(&mut plain, rest, scale),
            _ => plain.extend([key, " ", rest]),
        }
        plain.push('\n');
    }
    plain
}

/// Colours above this are bytes: 0 to 255.
const BYTES_FROM: f32 = 2.0;

/// The keyword of a line, and the rest.
fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (key, rest.trim_start())
}

/// The three numbers after a position; a seventh is an alpha, which no exporter means.
fn color(rest: &str) -> Option<[f32; 3]> {
    let mut words =
        rest.split_whitespace().skip(3).map(|word| word.parse().ok().filter(|value: &f32| value.is_finite()));
    Some([words.next()??, words.next()??, words.next()??])
}

/// Writes a position, and a colour if `scale` is set: white if the vertex has none.
fn push_vertex(plain: &mut String, rest: &str, scale: Option<f32>) {
    let words = rest.split_whitespace();
    let has_weight = scale.is_none() && words.clone().count() == 4;
    plain.push('v');
    words.take(if has_weight { 4 } else { 3 }).for_each(|word| plain.extend([" ", word]));
    let Some(scale) = scale else { return };
    for value in color(rest).map_or([1.0; 3], |color| color.map(|value| (value / scale).clamp(0.0, 1.0))) {
        plain.push_str(&format!(" {value}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_after_tabs_and_spaces_are_read() {
        assert_eq!(
            plain("  usemtl\t my leaf \r\nmtllib\ttree.mtl\nf 1 2 3\n"),
            "usemtl my leaf\nmtllib tree.mtl\nf 1 2 3\n"
        );
        assert_eq!(materials_in_use("usemtl\ta b \nusemtl\nusemtl c\nusemtl c"), BTreeSet::from(["a b", "c"]));
    }

    #[test]
    fn positions_have_three_numbers_and_all_or_none_a_colour() {
        assert_eq!(plain("v 1 2 3\nv 1 2 3 2\nv 1 2 3 4 5\n"), "v 1 2 3\nv 1 2 3 2\nv 1 2 3\n");
        assert_eq!(
            plain("v 1 2 3 0 0.5 1 0.2\nv 4 5 6\nv 7 8 9 1\nv 1 1 1 a b c"),
            "v 1 2 3 0 0.5 1\nv 4 5 6 1 1 1\nv 7 8 9 1 1 1\nv 1 1 1 1 1 1\n"
        );
        assert_eq!(plain("v 1 2 3 255 0 51\n"), "v 1 2 3 1 0 0.2\n");
    }
}
