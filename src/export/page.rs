//! Pages: one HTML file that draws a continuous glTF in any browser, without a network.
//!
//! The page holds the reader, its own script and the glTF, whose bytes are deflated (zlib) and
//! written in base64. Nothing in a model can end the script or the title that it is in: names are
//! read from the glTF at run time and set as text.
//!
//! Limits: WebGL2; a browser that can inflate (all since 2023).

use base64::{Engine, engine::general_purpose::STANDARD};
use miniz_oxide::deflate::compress_to_vec_zlib;

/// The reader of continuous glTF files, an ES module without dependencies.
pub const READER: &str = include_str!("../../web/foliage-lod.js");
/// What the page does with the tree.
const SCRIPT: &str = include_str!("../../web/page.js");
/// The page around the script, with places for the title, the model and the script.
const PAGE: &str = include_str!("../../web/page.html");
/// Effort of the compression, of 10; above it, oaks lose 0.1 % and take twice the time.
const EFFORT: u8 = 9;

/// Returns an HTML page that draws `glb`, the bytes of a continuous glTF. `title` is that of the
/// browser's window until the tree is drawn; any text will do.
///
/// The page is as long as the compressed glTF and a third, plus 70 kB.
pub fn page(glb: &[u8], title: &str) -> String {
    let model = STANDARD.encode(compress_to_vec_zlib(glb, EFFORT));
    let script = format!("{READER}\n{SCRIPT}");
    let title = escaped(title);
    let mut page = String::with_capacity(PAGE.len() + model.len() + script.len() + title.len());
    let mut pieces = PAGE.split("{{");
    page.extend(pieces.next());
    // Each piece starts with the name of a place; what fills it is not searched for others.
    for piece in pieces {
        let (place, rest) = piece.split_once("}}").unwrap_or(("", piece));
        page.push_str(match place {
            "title" => &title,
            "model" => &model,
            "script" => &script,
            _ => "",
        });
        page.push_str(rest);
    }
    page
}

/// Text for an element of HTML.
fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            c if c.is_control() => html.push(' '),
            c => html.push(c),
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    #[test]
    fn the_model_in_a_page_inflates_to_the_bytes_that_were_given() {
        let glb: Vec<u8> = (0..5000_u32).map(|i| ((i * i) >> 5) as u8).collect();
        let page = page(&glb, "oak");
        let (_, after) = page.split_once("id=\"model\">").unwrap();
        let (text, _) = after.split_once("</script>").unwrap();
        assert_eq!(decompress_to_vec_zlib(&STANDARD.decode(text).unwrap()).unwrap(), glb);
        assert!(page.contains("<title>oak</title>"));
    }

    #[test]
    fn no_title_and_no_script_ends_the_element_that_it_is_in() {
        let tags = |page: &str| ["<script", "</script", "<img", "<!--", "{{"].map(|tag| page.matches(tag).count());
        let plain = page(b"", "oak");
        let hostile = "</title></script><script>alert(1)</script><img src=x onerror='alert(2)'>{{model}}<!--\n\0";
        assert_eq!(tags(&page(b"", hostile))[..4], tags(&plain)[..4]);
        assert_eq!(tags(&plain), [2, 2, 0, 0, 0]);
    }

    #[test]
    fn the_reader_takes_at_most_8_kb_compressed() {
        let compressed = compress_to_vec_zlib(READER.as_bytes(), EFFORT).len();
        assert!(compressed <= 8000, "{compressed} bytes");
    }
}
