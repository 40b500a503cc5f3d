//! Names that say which of several siblings is not to be drawn: coarser levels of detail,
//! billboards, collision shapes.

use std::collections::BTreeMap;

/// Maximum number of triangles of a billboard. A crown of foliage cards has more.
pub(super) const MAX_BILLBOARD_TRIANGLES: u64 = 256;

/// Reason why a part of a file is not drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cause {
    /// A coarser level of detail of a sibling, or its billboard.
    Coarse,
    /// A shape for collisions only.
    Collision,
    /// Hidden by the file.
    Hidden,
}

/// Meaning of a name besides its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Drawn,
    Billboard,
    Collision,
    /// Drawn, and its shape collides; a copy if a sibling of the same base is drawn too.
    Solid,
}

/// Meaning of the name of a part.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Role {
    /// The name without level and meaning, in lower case.
    pub(super) base: String,
    /// Level of detail, 0 being the finest.
    pub(super) level: Option<u32>,
    kind: Kind,
}

impl Role {
    /// The role that `name` states.
    pub(super) fn of(name: &str) -> Self {
        let lower = name.to_lowercase();
        let is_solid = lower.ends_with("-col") || lower.ends_with("-convcol");
        let mut words = words(without_copy_number(name));
        let level = take_level(&mut words);
        let is_number = |word: &String| word.bytes().all(|byte| byte.is_ascii_digit());
        let last = words.iter().rposition(|word| !is_number(word));
        let first = words.first().map_or("", String::as_str);
        let kind = match last.map_or("", |last| words[last].as_str()) {
            "billboard" | "imposter" | "impostor" => Kind::Billboard,
            "collision" | "collider" | "colonly" | "convcolonly" => Kind::Collision,
            "col" | "convcol" if is_solid => Kind::Solid,
            _ if ["ucx", "ubx", "usp", "ucp"].contains(&first) && words.len() > 1 => Kind::Collision,
            _ => Kind::Drawn,
        };
        if kind != Kind::Drawn
            && let Some(last) = last
        {
            words.truncate(last);
        }
        Self { base: words.join("_"), level, kind }
    }
}

/// `name` without the number that modelling programs append to copies, such as `.001`.
fn without_copy_number(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((rest, number)) if number.len() == 3 && number.bytes().all(|byte| byte.is_ascii_digit()) => rest,
        _ => name,
    }
}

/// The words of a name in lower case; `LOD` starts one.
fn words(name: &str) -> Vec<String> {
    let name = name.replace("LOD", "_LOD");
    let words = name.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// Removes `lod0`, or `lod` and a number, and returns the number.
fn take_level(words: &mut Vec<String>) -> Option<u32> {
    let number = |text: &str| {
        let is_level = (1..=2).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
        is_level.then(|| text.parse().ok()).flatten()
    };
    for i in 0..words.len() {
        let Some(rest) = words[i].strip_prefix("lod") else { continue };
        if let Some(level) = number(rest) {
            words.remove(i);
            return Some(level);
        }
        if let Some(level) = words.get(i + 1).filter(|_| rest.is_empty()).and_then(|next| number(next)) {
            words.drain(i..i + 2);
            return Some(level);
        }
    }
    None
}

/// Why each of some siblings, each with its role and number of triangles, is not drawn. A plain
/// name is the finest level of its base.
pub(super) fn causes(siblings: &[(Role, u64)]) -> Vec<Option<Cause>> {
    let drawn = || siblings.iter().map(|(role, _)| role).filter(|role| role.kind == Kind::Drawn);
    let mut finest: BTreeMap<&str, u32> = BTreeMap::new();
    for role in drawn() {
        let level = finest.entry(&role.base).or_insert(u32::MAX);
        *level = (*level).min(role.level.unwrap_or(0));
    }
    let cause = |(role, triangles): &(Role, u64)| match (role.kind, finest.get(&*role.base)) {
        (Kind::Drawn, Some(&finest)) if role.level.is_some_and(|level| level > finest) => Some(Cause::Coarse),
        (Kind::Billboard, _) if *triangles <= MAX_BILLBOARD_TRIANGLES => Some(Cause::Coarse),
        (Kind::Collision, _) | (Kind::Solid, Some(_)) => Some(Cause::Collision),
        _ => None,
    };
    siblings.iter().map(cause).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left_out(names: &[&str]) -> Vec<bool> {
        let siblings: Vec<(Role, u64)> = names.iter().map(|name| (Role::of(name), 2)).collect();
        causes(&siblings).into_iter().map(|cause| cause.is_some()).collect()
    }

    #[test]
    fn every_common_spelling_of_a_level_is_read() {
        let spellings = [
            ["Oak_LOD0", "Oak_LOD1"],
            ["LOD0_Oak", "LOD1_Oak"],
            ["oak lod0", "oak lod1"],
            ["Oak_LOD_0", "Oak_LOD_1"],
            ["Oak LOD0.001", "Oak LOD1.002"],
            ["OakLOD0", "OakLOD1"],
            ["Oak_LOD0_bark", "Oak_LOD1_bark"],
            ["Oak", "Oak_LOD2"],
            ["lod-0", "lod-1"],
        ];
        for names in spellings {
            assert_eq!(left_out(&names), [false, true], "{names:?}");
        }
    }

    #[test]
    fn a_lone_level_other_bases_and_other_words_stay() {
        for names in [["Oak_LOD1", "Pine_LOD0"], ["explode1", "explode0"], ["Oak_LOD0", "Oak_LOD0"], ["Oak1", "Oak2"]] {
            assert_eq!(left_out(&names), [false, false], "{names:?}");
        }
    }

    #[test]
    fn billboards_and_collision_shapes_are_left_out() {
        let names =
            ["Oak", "Oak_LOD3_Billboard", "Oak_Imposter", "UCX_Oak_01", "Oak-colonly", "Oak_collision", "Oak-col"];
        assert_eq!(left_out(&names), [false, true, true, true, true, true, true]);
        assert_eq!(left_out(&["Trunk-col", "Leaves"]), [false, false], "drawn and solid");
        let crown = [(Role::of("Leaf_Billboard"), MAX_BILLBOARD_TRIANGLES + 1)];
        assert_eq!(causes(&crown), [None]);
    }
}
