//! Objects of an OBJ file that are not to be drawn, and the choice of one.

use super::{
    fault::Fault,
    left_out::warnings,
    nodes::EVERYTHING,
    roles::{Cause, Role, causes},
    source::Source,
};

/// Leaves out coarser levels of detail, billboards and collision shapes, or all objects but
/// `plant`.
pub(super) fn select(source: &mut Source, plant: Option<&str>) -> Result<(), Fault> {
    match plant {
        Some(EVERYTHING) => Ok(()),
        Some(plant) => choose(source, plant),
        None => {
            leave_out(source);
            Ok(())
        }
    }
}

fn choose(source: &mut Source, plant: &str) -> Result<(), Fault> {
    let is_chosen: Vec<bool> = source.parts.iter().map(|part| part.name == plant).collect();
    if !is_chosen.contains(&true) {
        let mut known: Vec<String> = source.parts.iter().map(|part| part.name.clone()).collect();
        known.dedup();
        return Err(Fault::UnknownPlant { name: plant.to_owned(), known });
    }
    source.keep_parts(|part| is_chosen[part]);
    Ok(())
}

fn leave_out(source: &mut Source) {
    let role = |part: usize| {
        let part = &source.parts[part];
        (Role::of(&part.name), source.meshes[part.mesh].indices.len() as u64 / 3)
    };
    let roles: Vec<(Role, u64)> = (0..source.parts.len()).map(role).collect();
    let causes = causes(&roles);
    if causes.iter().all(Option::is_some) {
        return;
    }
    let named = source.parts.iter().zip(&causes);
    let mut found: Vec<(Cause, String)> =
        named.filter_map(|(part, cause)| Some(((*cause)?, part.name.clone()))).collect();
    found.dedup();
    source.warnings.extend(warnings(&found));
    source.keep_parts(|part| causes[part].is_none());
    group(source);
}

/// Notes runs of parts with one name as possible plants.
fn group(source: &mut Source) {
    let mut first = 0;
    for run in source.parts.chunk_by(|one, other| one.name == other.name) {
        source.plants.push((run[0].name.clone(), first..first + run.len()));
        first += run.len();
    }
}
