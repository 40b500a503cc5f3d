//! Classifies parts by the names that the user gave: of materials, meshes, and nodes with
//! everything below them.
//!
//! A material, or a node or mesh of one material, is taken at the user's word. Where a node holds
//! more, its bark must not become leaves: the shape of the pieces decides, as it does without
//! names.

use super::{
    Verdict,
    fault::Fault,
    foliage::{Judgement, is_leaf_like, shapes, with_exceptions},
    source::{Part, Source},
};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of names that an error lists.
const MAX_LISTED: usize = 10;
/// Number of letters that names are compared by.
const COMPARED: usize = 48;

/// The way in which a part is named.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Named {
    Material,
    /// By its own node or mesh.
    Node,
    /// By a node above its own.
    Group,
}

/// Classifies every part: foliage are the parts that a name in `given` stands for, and no others.
/// `*` in a name stands for any letters; a name that the file does not have may be several, with
/// commas between them.
pub(super) fn judge(source: &Source, pieces: &[Vec<Vec<u32>>], given: &[String]) -> Result<Vec<Judgement>, Fault> {
    let patterns = patterns(&names(source), given)?;
    let named = named(source, &patterns);
    let nodes = || source.parts.iter().zip(&named).filter(|(_, named)| named.is_some_and(|by| by != Named::Material));
    let materials: BTreeSet<usize> = nodes().map(|(part, _)| source.meshes[part.mesh].material).collect();
    let holds_more = materials.len() > 1 || named.contains(&Some(Named::Group));
    let sheets = if holds_more { sheets(source, pieces, nodes().map(|(part, _)| part)) } else { BTreeMap::new() };
    let judge = |(part, named): (&Part, &Option<Named>)| match named {
        None => all(part, pieces, Verdict::Wood, "not named as foliage"),
        Some(Named::Material) => all(part, pieces, Verdict::Leaf, "named as foliage"),
        Some(_) => match sheets.get(&source.meshes[part.mesh].material) {
            Some(Sheets { is_foliage: true, .. }) => with_exceptions(Judgement {
                verdict: Verdict::Leaf,
                reason: "named as foliage".to_owned(),
                is_leaf: shapes(source, part, &pieces[part.mesh]).iter().map(is_leaf_like).collect(),
            }),
            Some(Sheets { likely, count, .. }) => {
                let reason = format!("in a node named as foliage, but {likely} of {count} pieces are sheets");
                all(part, pieces, Verdict::Wood, &reason)
            }
            None => all(part, pieces, Verdict::Leaf, "named as foliage"),
        },
    };
    Ok(source.parts.iter().zip(&named).map(judge).collect())
}

/// How each part is named by `given`; not at all if one of these names stands for nothing.
pub(super) fn parts(source: &Source, given: &[String]) -> Vec<Option<Named>> {
    named(source, &patterns(&names(source), given).unwrap_or_default())
}

fn all(part: &Part, pieces: &[Vec<Vec<u32>>], verdict: Verdict, reason: &str) -> Judgement {
    let is_leaf = vec![verdict == Verdict::Leaf; pieces[part.mesh].len()];
    Judgement { verdict, reason: reason.to_owned(), is_leaf }
}

/// Number of pieces of a material, and of those that are shaped like leaves.
#[derive(Default)]
struct Sheets {
    likely: usize,
    count: usize,
    is_foliage: bool,
}

/// The materials of `parts`, with those marked that are mostly sheets; if there are none, those
/// with any. Empty if there is no sheet at all.
fn sheets<'a>(
    source: &Source,
    pieces: &[Vec<Vec<u32>>],
    parts: impl Iterator<Item = &'a Part>,
) -> BTreeMap<usize, Sheets> {
    let mut sheets: BTreeMap<usize, Sheets> = BTreeMap::new();
    for part in parts {
        let of = sheets.entry(source.meshes[part.mesh].material).or_default();
        let shapes = shapes(source, part, &pieces[part.mesh]);
        of.likely += shapes.iter().filter(|shape| is_leaf_like(shape)).count() * part.places.len();
        of.count += shapes.len() * part.places.len();
    }
    sheets.values_mut().for_each(|of| of.is_foliage = of.likely > 0 && of.likely * 2 >= of.count);
    if !sheets.values().any(|of| of.is_foliage) {
        sheets.values_mut().for_each(|of| of.is_foliage = of.likely > 0);
    }
    if sheets.values().any(|of| of.is_foliage) { sheets } else { BTreeMap::new() }
}

/// How each part is named by one of `patterns`.
fn named(source: &Source, patterns: &[&str]) -> Vec<Option<Named>> {
    let matches = |name: &str| !name.is_empty() && patterns.iter().any(|pattern| stands_for(pattern, name));
    let is_named: Vec<bool> = source.nodes.iter().map(|node| matches(&node.name)).collect();
    let below = below(source, &is_named);
    let named = |part: &Part| {
        let mesh = &source.meshes[part.mesh];
        let parent = part.node.and_then(|node| source.nodes[node].parent);
        if matches(&source.materials[mesh.material].name) {
            Some(Named::Material)
        } else if matches(&part.name) || matches(&mesh.name) {
            Some(Named::Node)
        } else {
            parent.is_some_and(|parent| below[parent]).then_some(Named::Group)
        }
    };
    source.parts.iter().map(named).collect()
}

/// Whether each node, or one above it, is in `marked`.
fn below(source: &Source, marked: &[bool]) -> Vec<bool> {
    let mut below: Vec<Option<bool>> = vec![None; marked.len()];
    for start in 0..marked.len() {
        let mut walked = Vec::new();
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| below[node].is_none()) {
            walked.push(node);
            at = source.nodes[node].parent;
        }
        let mut is_below = at.and_then(|node| below[node]).unwrap_or(false);
        for node in walked.into_iter().rev() {
            is_below |= marked[node];
            below[node] = Some(is_below);
        }
    }
    below.into_iter().map(|below| below == Some(true)).collect()
}

/// Every name that stands for a part: of its material, its mesh, its node and the nodes above.
fn names(source: &Source) -> BTreeSet<&str> {
    let mut names = BTreeSet::new();
    let mut seen = vec![false; source.nodes.len()];
    for part in &source.parts {
        let mesh = &source.meshes[part.mesh];
        names.extend([source.materials[mesh.material].name.as_str(), &part.name, &mesh.name]);
        let mut at = part.node;
        while let Some(node) = at.filter(|&node| !std::mem::replace(&mut seen[node], true)) {
            names.insert(&source.nodes[node].name);
            at = source.nodes[node].parent;
        }
    }
    names.remove("");
    names
}

/// The single names in `given`; fails for one that stands for nothing.
fn patterns<'a>(names: &BTreeSet<&str>, given: &'a [String]) -> Result<Vec<&'a str>, Fault> {
    let is_known = |pattern: &str| names.iter().any(|name| stands_for(pattern, name));
    let mut patterns = Vec::new();
    for given in given {
        let several: Vec<&str> = match is_known(given) || !given.contains(',') {
            true => vec![given],
            false => given.split(',').map(str::trim).filter(|name| !name.is_empty()).collect(),
        };
        if let Some(unknown) = several.iter().find(|pattern| !is_known(pattern)) {
            let (name, closest) = ((*unknown).to_owned(), closest(names, unknown));
            return Err(Fault::UnknownName { name, closest, count: names.len() });
        }
        patterns.extend(several);
    }
    Ok(patterns)
}

/// Whether `pattern` is `name`, with each `*` for any number of letters.
fn stands_for(pattern: &str, name: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(name) = name.strip_prefix(first) else { return pattern == name };
    let steps: Vec<&str> = rest.split('*').collect();
    let Some((last, steps)) = steps.split_last() else { return true };
    let after = steps.iter().try_fold(name, |name, step| name.find(step).map(|at| &name[at + step.len()..]));
    after.is_some_and(|name| name.ends_with(last))
}

/// The names most like `given`, best first.
fn closest(names: &BTreeSet<&str>, given: &str) -> Vec<String> {
    let letters = |name: &str| name.to_lowercase().chars().take(COMPARED).collect::<Vec<char>>();
    let wanted = letters(&given.replace('*', ""));
    let mut ranked: Vec<(usize, &str)> = names.iter().map(|name| (distance(&wanted, &letters(name)), *name)).collect();
    ranked.sort_unstable();
    ranked.into_iter().take(MAX_LISTED).map(|(_, name)| name.to_owned()).collect()
}

/// Number of letters to insert, remove or replace (Levenshtein).
fn distance(from: &[char], to: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name) in
            [("*", "a"), ("Leaf.*", "Leaf.001"), ("*af", "leaf"), ("L*f*1", "Leaf.001"), ("a*b", "a*b"), ("a**", "a")]
        {
            assert!(stands_for(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in
            [("Leaf", "Leaf.001"), ("L*f", "Leaf.001"), ("ab*b", "ab"), ("a*b*b", "ab"), ("", "a"), ("b*", "ab")]
        {
            assert!(!stands_for(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn the_closest_names_come_first_and_are_few() {
        let many: Vec<String> = (0..400).map(|i| format!("Leaf.{i:03}")).collect();
        let names = many.iter().map(String::as_str).chain(["crown", "bark"]).collect();
        let closest = closest(&names, "Crwon");
        assert_eq!((closest.len(), closest[0].as_str()), (MAX_LISTED, "crown"));
    }

    #[test]
    fn several_names_are_taken_apart_unless_one_has_the_comma() {
        let names = BTreeSet::from(["a", "b", "a,b"]);
        let given = |text: &str| patterns(&names, &[text.to_owned()]).map(|names| names.len()).ok();
        assert_eq!(
            [given("a,b"), given("b, a"), given("a,c"), given(""), given("a,")],
            [Some(1), Some(2), None, None, Some(1)]
        );
    }
}
