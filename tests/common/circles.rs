//! Import circles between the files of a folder.

use std::collections::{BTreeMap, BTreeSet};

/// Module of each file, as path segments, with its code: comments and literals blanked.
pub struct Sources {
    code: BTreeMap<Vec<String>, String>,
    /// Names that a module re-exports from its children, with the child.
    reexports: BTreeMap<(Vec<String>, String), Vec<String>>,
}

/// Imports of one folder: each entry uses others, by the names listed.
type Uses = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

impl Sources {
    /// `files` are paths relative to the root of a crate, with `/`, and their blanked code.
    /// Everything from the first test module on is ignored.
    pub fn new(files: impl IntoIterator<Item = (String, String)>) -> Self {
        let mut sources = Self { code: BTreeMap::new(), reexports: BTreeMap::new() };
        for (file, code) in files {
            let end = code.find("#[cfg(test)]").unwrap_or(code.len());
            let end = end.min(code.find("#[cfg(all(test").unwrap_or(code.len()));
            sources.code.insert(module_of(&file), code[..end].to_owned());
        }
        let modules: Vec<_> = sources.code.keys().cloned().collect();
        for module in modules {
            for path in paths(&sources.code[&module], "use ") {
                let Some((name, rest)) = path.split_last() else { continue };
                let target: Vec<String> = module.iter().chain(rest).cloned().collect();
                if !rest.is_empty() && sources.code.contains_key(&target) {
                    sources.reexports.insert((module.clone(), name.clone()), target);
                }
            }
        }
        sources
    }

    /// One line per circle: the files that lean on each other, and the names that tie them.
    pub fn circles(&self) -> Vec<String> {
        let folders: BTreeSet<&[String]> =
            self.code.keys().filter_map(|module| module.split_last()).map(|(_, folder)| folder).collect();
        folders.into_iter().flat_map(|folder| circles(folder, &self.uses(folder))).collect()
    }

    /// Imports between the entries of `folder`: files, and folders with all below them.
    fn uses(&self, folder: &[String]) -> Uses {
        let mut uses = Uses::new();
        for (module, code) in &self.code {
            let Some(user) = entry(folder, module) else { continue };
            let own = |up: usize| module[..module.len().saturating_sub(up)].to_vec();
            let prefixes = [("crate::", vec![]), ("super::super::", own(2)), ("super::", own(1)), ("self::", own(0))];
            for (prefix, base) in prefixes {
                for path in paths(code, prefix) {
                    let target = self.resolve(base.iter().chain(&path).cloned().collect());
                    let Some(used) = entry(folder, &target).filter(|used| *used != user) else { continue };
                    let name = path.last().cloned().unwrap_or_default();
                    uses.entry(user.clone()).or_default().entry(used).or_default().insert(name);
                }
            }
        }
        uses
    }

    /// The module that a path leads to, through re-exports.
    fn resolve(&self, path: Vec<String>) -> Vec<String> {
        let known = (0..=path.len()).rev().find(|&length| self.code.contains_key(&path[..length])).unwrap_or(0);
        let (module, rest) = path.split_at(known);
        let through = rest.first().and_then(|name| self.reexports.get(&(module.to_vec(), name.clone())));
        match through {
            Some(target) => self.resolve(target.iter().chain(&rest[..1]).cloned().collect()),
            None => module.to_vec(),
        }
    }
}

/// `simplify/prune.rs` is `[simplify, prune]`, `simplify/mod.rs` is `[simplify]`, `lib.rs` is `[]`.
fn module_of(file: &str) -> Vec<String> {
    let stem = file.trim_end_matches(".rs").trim_end_matches("/mod");
    stem.split('/').filter(|part| !["lib", "main", "mod"].contains(part)).map(str::to_owned).collect()
}

/// The entry of `folder` that holds `module`.
fn entry(folder: &[String], module: &[String]) -> Option<String> {
    module.starts_with(folder).then(|| module.get(folder.len()).cloned()).flatten()
}

/// Every path after `prefix`, with the braces of use trees expanded; `as` names are left out.
fn paths(code: &str, prefix: &str) -> Vec<Vec<String>> {
    let starts = code.match_indices(prefix).filter(|(at, _)| {
        let before = code[..*at].chars().next_back();
        before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':')
    });
    starts.flat_map(|(at, _)| tree(&code[at + prefix.len()..]).0).collect()
}

/// The paths of the use tree at the start of `text`, and the length that it takes.
fn tree(text: &str) -> (Vec<Vec<String>>, usize) {
    let space = text.len() - text.trim_start().len();
    let word: String = text[space..].chars().take_while(|&c| c.is_alphanumeric() || c == '_' || c == '*').collect();
    let mut at = space + word.len();
    if text[at..].starts_with("::") && !word.is_empty() {
        let (rest, length) = tree(&text[at + 2..]);
        let paths = rest.into_iter().map(|path| std::iter::once(word.clone()).chain(path).collect()).collect();
        return (paths, at + 2 + length);
    }
    if !word.is_empty() || !text[at..].starts_with('{') {
        let is_self = word == "self" || word.is_empty();
        return (vec![if is_self { Vec::new() } else { vec![word] }], at);
    }
    let mut paths = Vec::new();
    at += 1;
    while at < text.len() && !text[at..].starts_with('}') {
        if text[at..].starts_with([',', ' ', '\n']) {
            at += 1;
            continue;
        }
        let (more, length) = tree(&text[at..]);
        paths.extend(more);
        at += length.max(1);
        // Skips ` as name`.
        at += text[at..].find([',', '}']).unwrap_or(0);
    }
    (paths, at + 1)
}

/// The circles among the entries of a folder.
fn circles(folder: &[String], uses: &Uses) -> Vec<String> {
    let reaches = |from: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(next) = open.pop() {
            for used in uses.get(next).into_iter().flat_map(|used| used.keys()) {
                if seen.insert(used) {
                    open.push(used);
                }
            }
        }
        seen
    };
    let mut rings: BTreeSet<Vec<&String>> = BTreeSet::new();
    for name in uses.keys() {
        let reached = reaches(name);
        let ring: Vec<&String> = reached.iter().copied().filter(|other| reaches(other).contains(name)).collect();
        if ring.len() > 1 {
            rings.insert(ring);
        }
    }
    let line = |ring: Vec<&String>| {
        let ties = ring.iter().flat_map(|user| {
            let used = uses[*user].iter().filter(|(used, _)| ring.contains(used));
            used.map(move |(used, names)| {
                format!("{user} -> {used} ({})", names.iter().cloned().collect::<Vec<_>>().join(", "))
            })
        });
        format!("src/{}: a circle: {}", folder.join("/"), ties.collect::<Vec<_>>().join("; "))
    };
    rings.into_iter().map(line).collect()
}
