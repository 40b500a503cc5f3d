//! Imports point one way: every `crate::` path in `src` is checked against the layers below.

#[path = "common/circles.rs"]
mod circles;

use circles::Sources;
use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

/// The crate's modules, from the bottom layer up. A module may use itself and lower layers only.
const LAYERS: [&[&str]; 15] = [
    &["error"],
    &["bounds", "edge", "file", "hash", "memory", "random", "srgb"],
    &["camera", "crown"],
    &["frustum"],
    &["leaf", "material"],
    &["plant"],
    &["wood"],
    &["import", "grow", "model"],
    &["simplify", "extract", "stochastic", "continuous"],
    &["effects"],
    &["terrain"],
    &["scene", "draw"],
    &["software"],
    &["gpu", "measure", "export"],
    &["internals", "numerics"],
];

/// Exceptions: pairs (user, used) of modules in the same layer.
const WITHIN_LAYER: [(&str, &str); 3] = [
    ("leaf", "material"),
    // The least lambda.
    ("extract", "stochastic"),
    // Areas are measured in the views.
    ("stochastic", "simplify"),
];

/// Crates that only some files may name, and the paths of these files.
const ONLY_IN: [(&str, &[&str]); 3] = [
    ("obvhs", &["import/pivot.rs", "simplify/neighbours", "scene/"]),
    ("bincode", &["model/format/records.rs"]),
    ("wgpu", &["gpu/"]),
];

/// Code that must not depend on the machine, so that the same input produces the same model
/// everywhere. Square roots are rounded alike on all machines; other functions must come from
/// `libm`.
const SAME_EVERYWHERE: [&str; 15] = [
    "bounds",
    "continuous/",
    "crown",
    "edge",
    "export/",
    "grow/",
    "import/",
    "model/",
    "plant",
    "random",
    "scene/patch/",
    "simplify/",
    "srgb",
    "terrain/",
    "wood/",
];
/// The bounds in this file only decide what is recomputed, so it may use the platform's logarithm,
/// which saves 5 % of the time.
const ANYWHERE: &str = "simplify/drift.rs";
/// Calls of platform functions. `FixedLog::log2` takes an argument and is not among them.
const OF_PLATFORM: [&str; 20] = [
    ".sin()",
    ".cos()",
    ".tan()",
    ".sin_cos()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(",
    ".ln()",
    ".log2()",
    ".log10()",
    ".ln_1p()",
    ".exp()",
    ".exp2()",
    ".exp_m1()",
    ".powf(",
    ".powi(",
    ".cbrt()",
    ".hypot(",
    ".tanh()",
];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

/// The source with comments and literals replaced by spaces, so that every position is unchanged.
fn code_only(source: &str) -> String {
    let chars: Vec<char> = source.chars().collect();
    let mut code = String::new();
    let mut at = 0;
    while at < chars.len() {
        let end = blank_end(&chars, at);
        if end > at {
            code.extend(chars[at..end].iter().map(|&c| if c == '\n' { '\n' } else { ' ' }));
            at = end;
        } else {
            code.push(chars[at]);
            at += 1;
        }
    }
    code
}

/// One past the end of the comment or literal that starts at `at`; `at` itself if none does.
fn blank_end(chars: &[char], at: usize) -> usize {
    let starts = |from: usize, text: &str| text.chars().enumerate().all(|(i, c)| chars.get(from + i) == Some(&c));
    let after = |from: usize, text: &str| (from..chars.len()).find(|&i| starts(i, text)).map(|i| i + text.len());
    let raw_hashes = chars[at + 1..].iter().take_while(|&&c| c == '#').count();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    if starts(at, "//") {
        after(at, "\n").map_or(chars.len(), |end| end - 1)
    } else if starts(at, "/*") {
        after(at + 2, "*/").unwrap_or(chars.len())
    } else if chars[at] == 'r' && chars.get(at + 1 + raw_hashes) == Some(&'"') && (at == 0 || !is_word(chars[at - 1])) {
        after(at + 2 + raw_hashes, &format!("\"{}", "#".repeat(raw_hashes))).unwrap_or(chars.len())
    } else if chars[at] == '"' {
        let mut end = at + 1;
        while end < chars.len() && chars[end] != '"' {
            end += if chars[end] == '\\' { 2 } else { 1 };
        }
        (end + 1).min(chars.len())
    } else if chars[at] == '\'' && chars.get(at + 1) == Some(&'\\') {
        after(at + 3, "'").unwrap_or(chars.len())
    } else if chars[at] == '\'' && chars.get(at + 2) == Some(&'\'') {
        at + 3
    } else {
        at
    }
}

/// First names of the paths that follow `prefix` in `code`, with their line numbers: `a` and `b`
/// for `crate::{a::x, b}`.
fn first_names(code: &str, prefix: &str) -> Vec<(usize, String)> {
    let mut names = Vec::new();
    for (start, _) in code.match_indices(prefix) {
        let rest = &code[start + prefix.len()..];
        let line = |offset: usize| code[..start + prefix.len() + offset].matches('\n').count() + 1;
        let word = |from: usize| rest[from..].chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect();
        if !rest.starts_with('{') {
            names.push((line(0), word(0)));
            continue;
        }
        let (mut depth, mut expects_name) = (0, false);
        for (offset, c) in rest.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
            if depth == 1 && expects_name && (c.is_alphanumeric() || c == '_') {
                names.push((line(offset), word(offset)));
                expects_name = false;
            } else if depth == 1 && (c == '{' || c == ',') {
                expects_name = true;
            }
        }
    }
    names
}

/// Names re-exported by `lib.rs`, mapped to the modules that they come from.
fn reexports(lib: &str) -> HashMap<String, String> {
    let code = code_only(lib);
    let mut found = HashMap::new();
    for (_, module) in first_names(&code, "pub use ") {
        for (_, name) in first_names(&code, &format!("pub use {module}::")) {
            found.insert(name, module.clone());
        }
    }
    found
}

/// Every broken rule in a file, as `file:line: rule`. `file` is relative to `src`, with `/`.
fn violations(file: &str, source: &str, reexports: &HashMap<String, String>) -> Vec<String> {
    if ["lib.rs", "internals.rs"].contains(&file) {
        return Vec::new();
    }
    let code = code_only(source);
    let user = file.split('/').next().unwrap().trim_end_matches(".rs");
    let mut broken = Vec::new();
    let mut report = |line: usize, rule: String| broken.push(format!("src/{file}:{line}: {rule}"));
    let Some(own) = layer(user) else {
        return vec![format!("src/{file}:1: module `{user}` is in no layer")];
    };
    let library = "crate::";
    for (line, name) in first_names(&code, library) {
        let used = reexports.get(&name).unwrap_or(&name).as_str();
        let is_allowed = used == user || WITHIN_LAYER.contains(&(user, used));
        match layer(used) {
            None => report(line, format!("`{library}{name}` is in no layer")),
            Some(other) if other >= own && !is_allowed => {
                report(line, format!("`{user}` may not use `{used}`, which is not in a lower layer"));
            }
            Some(_) => {}
        }
    }
    if !file.contains('/') {
        for (number, text) in code.lines().enumerate().filter(|(_, text)| text.starts_with("use super")) {
            report(number + 1, format!("`{}` reaches around the layers; write `crate::`", text.trim()));
        }
    }
    for (name, places) in ONLY_IN {
        let is_elsewhere = !places.iter().any(|place| file.starts_with(place));
        let lines = code.lines().enumerate().filter(|(_, text)| has_word(text, name));
        lines.filter(|_| is_elsewhere).for_each(|(number, _)| {
            report(number + 1, format!("`{name}` may be named only in {}", places.join(", ")));
        });
    }
    if file != ANYWHERE && SAME_EVERYWHERE.iter().any(|place| file.starts_with(place)) {
        let tested = code.find("#[cfg(test)]").unwrap_or(code.len());
        for (number, text) in code[..tested].lines().enumerate() {
            if let Some(call) = OF_PLATFORM.iter().find(|call| text.contains(*call)) {
                report(number + 1, format!("`{call}` differs between machines; use `libm`"));
            }
        }
    }
    broken
}

fn has_word(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|part| part == word)
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    files(folder, &["rs"])
}

/// All files below `folder` with one of the extensions, sorted.
fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extensions));
        } else if path.extension().and_then(|extension| extension.to_str()).is_some_and(|e| extensions.contains(&e)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn imports_point_downwards_and_crates_stay_in_their_files() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let reexports = reexports(&fs::read_to_string(src.join("lib.rs")).unwrap());
    let files = rust_files(&src);
    assert!(files.len() > 20, "only {} files found", files.len());
    let broken: Vec<String> = files
        .iter()
        .flat_map(|path| {
            let file = path.strip_prefix(&src).unwrap().to_str().unwrap().replace('\\', "/");
            violations(&file, &fs::read_to_string(path).unwrap(), &reexports)
        })
        .collect();
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

/// Files of a crate with their blanked code, by their paths below its root.
fn blanked(root: &Path) -> impl Iterator<Item = (String, String)> {
    rust_files(root).into_iter().map(move |path| {
        let file = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        (file, code_only(&fs::read_to_string(path).unwrap()))
    })
}

#[test]
fn no_folder_has_an_import_circle() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let command = package.join("crates/foliage-lod-cli/src");
    // The command is not in the published package.
    let roots = [package.join("src"), command.join("report"), command.join("bin/foliage-lod")];
    for root in roots.into_iter().filter(|root| root.exists()) {
        let circles = Sources::new(blanked(&root)).circles();
        assert!(circles.is_empty(), "{}:\n{}", root.display(), circles.join("\n"));
    }
}

/// Longest line of a comment.
const COMMENT_COLUMNS: usize = 100;

#[test]
fn no_comment_is_wider_than_100_columns() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["src", "shaders", "tests", "benches", "examples", "crates"].map(|folder| package.join(folder));
    let mut wide = Vec::new();
    for path in folders.iter().filter(|folder| folder.exists()).flat_map(|folder| files(folder, &["rs", "wgsl"])) {
        let text = fs::read_to_string(&path).unwrap();
        let is_comment = |line: &str| line.trim_start().starts_with("//") || line.contains(" // ");
        let lines = text.lines().enumerate().filter(|(_, line)| line.chars().count() > COMMENT_COLUMNS);
        let lines = lines.filter(|(_, line)| is_comment(line));
        wide.extend(lines.map(|(number, _)| format!("{}:{}", path.display(), number + 1)));
    }
    assert!(wide.is_empty(), "comments wider than {COMMENT_COLUMNS} columns:\n{}", wide.join("\n"));
}

#[test]
fn a_circle_is_reported_with_its_files_and_names() {
    let circles = |files: &[(&str, &str)]| {
        Sources::new(files.iter().map(|(file, code)| ((*file).to_owned(), (*code).to_owned()))).circles()
    };
    let found = circles(&[
        ("room/mod.rs", "pub use a::{Apple as Fruit, Ant};"),
        ("room/a.rs", "use super::{b::Bee, c};"),
        ("room/b.rs", "use crate::room::c::{self, Cat};"),
        ("room/c.rs", "fn f() -> super::Ant {}"),
        ("room/d.rs", "use super::{a::Ant, b, c};\n#[cfg(test)]\nuse super::e;"),
        ("room/e.rs", "use super::d;"),
    ]);
    assert_eq!(found, ["src/room: a circle: a -> b (Bee); a -> c (c); b -> c (Cat, c); c -> a (Ant)"]);
    let files = [("lib.rs", "pub use x::X;"), ("x.rs", "use crate::y::z;"), ("y/mod.rs", ""), ("y/z.rs", "crate::X")];
    assert_eq!(circles(&files), ["src/: a circle: x -> y (z); y -> x (X)"]);
    assert!(circles(&[("x.rs", "use crate::y;"), ("y.rs", "use std::fmt;")]).is_empty());
}

#[test]
fn a_broken_rule_is_reported_with_file_line_and_rule() {
    let reexports = reexports("pub use error::{Error, Result};\npub use plant::Plant;\n");
    let found = |file, source| violations(file, source, &reexports);
    assert_eq!(
        found("extract/lod.rs", "use crate::{\n    Plant,\n    simplify::views,\n};\n"),
        ["src/extract/lod.rs:3: `extract` may not use `simplify`, which is not in a lower layer"]
    );
    assert_eq!(found("plant.rs", "fn f(m: &crate::model::FoliageModel) {}").len(), 1);
    assert_eq!(found("bounds.rs", "\nuse super::plant;\n").len(), 1);
    assert_eq!(found("model/mod.rs", "let x = bincode::config();")[0].split(": ").next(), Some("src/model/mod.rs:1"));
    assert_eq!(found("simplify/prune.rs", "use wgpu::Device;\nuse obvhs::Bvh2;").len(), 2);
    assert_eq!(found("novelty/mod.rs", "").len(), 1);
    assert_eq!(found("plant.rs", "use crate::novelty;").len(), 1);
    assert_eq!(found("simplify/prune.rs", "let x = y.powf(0.5);\n#[cfg(test)]\nlet x = y.sin();").len(), 1);
    assert!(found("draw/light.rs", "let x = y.powf(0.5);").is_empty());
}

#[test]
fn comments_literals_and_lower_layers_break_nothing() {
    let reexports = reexports("pub use error::{Error, Result};\n");
    let source = r##"
        //! Uses [`crate::draw`] and wgpu.
        use crate::{Error, leaf::{Vertex, LeafGeometry}, extract::swap::Swap};
        /* crate::report */
        const TEXT: (&str, char, &str) = ("wgpu \" crate::draw", '"', r#"bincode " crate::bin"#);
        fn f<'a>(x: &'a str) -> &'a str { x }
    "##;
    assert_eq!(violations("extract/lod.rs", source, &reexports), Vec::<String>::new());
}
