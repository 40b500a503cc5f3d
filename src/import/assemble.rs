//! Builds the plant: leaves in canonical form, wood, and the materials in use.

use super::{
    Finding, Group, ImportOptions, Imported, Warning, WarningKind, cards,
    crossed::{self, Card},
    fault::{Fault, limit},
    foliage::{self, Judgement},
    marks, named,
    opacity::Shades,
    pieces::pieces,
    pivot::{self, WoodSurface},
    plants,
    source::{Part, Place, Source},
};
use crate::{
    Plant,
    bounds::Aabb,
    leaf::Vertex,
    material::Material,
    plant::{MAX_LEAVES, Wood, WoodPart, canonical},
};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// One leaf, in canonical form, before it is added to the plant.
struct Leaf {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    material: usize,
}

/// Builds the plant in `source`.
pub(super) fn plant(source: Source, options: &ImportOptions) -> Result<Imported, Fault> {
    let mut pieces: Vec<Vec<Vec<u32>>> =
        source.meshes.iter().map(|mesh| pieces(&mesh.vertices, &mesh.indices)).collect();
    let mut judgements = judge(&source, &pieces, &options.leaves)?;
    let is_named = named::parts(&source, &options.leaves);
    let may_separate = |part: usize| options.leaves.is_empty() || is_named[part].is_some();
    if cards::separate(&source, &mut pieces, &judgements, may_separate) {
        judgements = judge(&source, &pieces, &options.leaves)?;
    }
    let marks = if options.leaves.is_empty() { marks::warning(&source, &pieces, &judgements) } else { None };
    let mut leaves = Vec::new();
    let origin = source.origin();
    let mut shades = Shades::new(&source.materials);
    let mut wood = WoodBuilder { origin, ..WoodBuilder::default() };
    for (part, judgement) in source.parts.iter().zip(&judgements) {
        let leaf_pieces = pieces[part.mesh].iter().zip(&judgement.is_leaf);
        let [mut of_leaves, mut of_wood] = [Vec::new(), Vec::new()];
        leaf_pieces.for_each(|(piece, is_leaf)| if *is_leaf { of_leaves.push(piece) } else { of_wood.push(piece) });
        push_leaves(&source, part, &of_leaves, origin, (&mut leaves, &mut shades))?;
        wood.push(&source, part, &of_wood, &mut shades)?;
    }
    if options.group == Group::Crossed {
        leaves = merge_crossed(leaves);
    }
    let several = plants::several(&source, &judgements);
    let (shaded, of_alpha) = shades.finish();
    limit("the number of leaves", leaves.len() as u64, MAX_LEAVES as u64)?;
    let findings = source.parts.iter().zip(judgements).map(|(part, judgement)| {
        let mesh = &source.meshes[part.mesh];
        Finding {
            name: if part.name.is_empty() { mesh.name.clone() } else { part.name.clone() },
            material: source.materials[mesh.material].name.clone(),
            triangles: mesh.indices.len() / 3 * part.places.len(),
            pieces: pieces[part.mesh].len() * part.places.len(),
            verdict: judgement.verdict,
            reason: judgement.reason,
        }
    });
    let findings = findings.collect();
    let mut plant = Plant { name: source.name, ..Plant::default() };
    push_all(&mut plant, leaves, wood);
    let materials = source.materials.into_iter().chain(shaded).collect();
    keep_used_materials(&mut plant, materials, source.textures);
    let mut warnings = source.warnings;
    warnings.extend(of_alpha.into_iter().chain(several).chain(marks));
    if origin != DVec3::ZERO {
        let at = origin.to_array();
        let message = format!(
            "the plant was at {at:?}, too far from the origin for single precision, and has been moved to the origin"
        );
        warnings.push(Warning::new(WarningKind::Moved, message, ""));
    }
    Ok(Imported { plant, origin: origin.to_array(), findings, warnings })
}

/// Classifies every part: by the names of `leaves`, or by its shape if there are none.
fn judge(source: &Source, pieces: &[Vec<Vec<u32>>], leaves: &[String]) -> Result<Vec<Judgement>, Fault> {
    if leaves.is_empty() { Ok(foliage::judge(source, pieces)) } else { named::judge(source, pieces, leaves) }
}

fn push_leaves(
    source: &Source,
    part: &Part,
    pieces: &[&Vec<u32>],
    origin: DVec3,
    (leaves, shades): (&mut Vec<Leaf>, &mut Shades),
) -> Result<(), Fault> {
    let mesh = &source.meshes[part.mesh];
    for place in part.places.iter() {
        let place = Place::new(place, origin);
        for piece in pieces {
            let mut triangles = mesh.triangles_at(piece, &place);
            check_finite(&part.name, &triangles)?;
            if let Some(material) = shades.settle(mesh.material, &mut triangles) {
                leaves.push(leaf(triangles, material));
            }
        }
    }
    Ok(())
}

/// Builds a leaf. Triangles without area are dropped as long as others remain.
fn leaf(mut triangles: Vec<[Vertex; 3]>, material: usize) -> Leaf {
    if triangles.iter().any(has_area) {
        triangles.retain(has_area);
    }
    let vertices = triangles.into_flattened();
    let indices: Vec<u32> = (0..vertices.len() as u32).collect();
    let (vertices, indices) = canonical(&vertices, &indices);
    Leaf { vertices, indices, material }
}

fn has_area(corners: &[Vertex; 3]) -> bool {
    let [a, b, c] = corners.each_ref().map(|corner| Vec3::from(corner.position).as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

fn check_finite(name: &str, triangles: &[[Vertex; 3]]) -> Result<(), Fault> {
    let mut corners = triangles.iter().flatten();
    match corners.find(|vertex| !Vec3::from(vertex.position).is_finite()) {
        None => Ok(()),
        Some(vertex) => Err(Fault::broken(format!("node {name:?} moves a vertex to {:?}", vertex.position))),
    }
}

fn merge_crossed(leaves: Vec<Leaf>) -> Vec<Leaf> {
    let cards: Vec<Card> = leaves.iter().map(card).collect();
    let groups = crossed::groups(&cards);
    let mut merged: Vec<Leaf> = Vec::new();
    let mut counts: Vec<usize> = Vec::new();
    for (leaf, group) in leaves.into_iter().zip(groups) {
        if group == merged.len() {
            merged.push(leaf);
            counts.push(1);
            continue;
        }
        let target = &mut merged[group];
        let first = target.vertices.len() as u32;
        target.vertices.extend(leaf.vertices);
        target.indices.extend(leaf.indices.into_iter().map(|index| index + first));
        counts[group] += 1;
    }
    for (leaf, _) in merged.iter_mut().zip(counts).filter(|(_, count)| *count > 1) {
        (leaf.vertices, leaf.indices) = canonical(&leaf.vertices, &leaf.indices);
    }
    merged
}

fn card(leaf: &Leaf) -> Card {
    // Vertices in canonical form are sorted by position, so equal positions are neighbours and the
    // order of summation is fixed.
    let mut positions: Vec<[f32; 3]> = leaf.vertices.iter().map(|vertex| vertex.position).collect();
    positions.dedup();
    let positions: Vec<DVec3> = positions.into_iter().map(|position| Vec3::from(position).as_dvec3()).collect();
    let center = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
    let radius = positions.iter().map(|position| position.distance(center)).fold(0.0, f64::max);
    Card { center, size: 2.0 * radius, material: leaf.material as u32 }
}

fn size(leaf: &Leaf) -> f64 {
    Aabb::of_points(leaf.vertices.iter().map(|vertex| vertex.position)).size().as_dvec3().length()
}

fn push_all(plant: &mut Plant, leaves: Vec<Leaf>, wood: WoodBuilder) {
    let surface = WoodSurface::new(wood.triangles().filter(|_| !leaves.is_empty()));
    let pivot = |leaf: &Leaf| pivot::pivot(&leaf.vertices, &leaf.indices, size(leaf), &surface);
    let pivots: Vec<[f32; 3]> = leaves.par_iter().map(pivot).collect();
    for (leaf, pivot) in leaves.iter().zip(pivots) {
        plant.push_leaf(&leaf.vertices, &leaf.indices, pivot, leaf.material as u32);
    }
    plant.wood = wood.finish();
}

/// Collects the wood by material.
#[derive(Default)]
struct WoodBuilder {
    origin: DVec3,
    vertices: Vec<Vertex>,
    known: HashMap<[u32; 12], u32>,
    /// Indices of each material, in the order in which materials are first used.
    parts: Vec<(usize, Vec<u32>)>,
    /// Part of each material.
    part_of: HashMap<usize, usize>,
}

impl WoodBuilder {
    /// Appends the triangles with a non-zero area, in file order.
    fn push(&mut self, source: &Source, part: &Part, pieces: &[&Vec<u32>], shades: &mut Shades) -> Result<(), Fault> {
        let mesh = &source.meshes[part.mesh];
        let mut all: Vec<u32> = pieces.iter().copied().flatten().copied().collect();
        all.sort_unstable();
        for place in part.places.iter() {
            let mut triangles = mesh.triangles_at(&all, &Place::new(place, self.origin));
            check_finite(&part.name, &triangles)?;
            for triangle in triangles.iter_mut().filter(|corners| has_area(corners)) {
                let Some(material) = shades.settle(mesh.material, std::slice::from_mut(triangle)) else { continue };
                let indices = triangle.each_ref().map(|vertex| self.index(vertex));
                let part = self.part(material);
                self.parts[part].1.extend(indices);
            }
        }
        Ok(())
    }

    /// The part of a material.
    fn part(&mut self, material: usize) -> usize {
        let part = *self.part_of.entry(material).or_insert(self.parts.len());
        if part == self.parts.len() {
            self.parts.push((material, Vec::new()));
        }
        part
    }

    fn index(&mut self, vertex: &Vertex) -> u32 {
        let next = self.vertices.len() as u32;
        let index = *self.known.entry(bytemuck::cast(*vertex)).or_insert(next);
        if index == next {
            self.vertices.push(*vertex);
        }
        index
    }

    fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> {
        let position = |index: u32| Vec3::from(self.vertices[index as usize].position);
        self.parts
            .iter()
            .flat_map(|(_, indices)| indices.as_chunks().0)
            .map(move |corners: &[u32; 3]| corners.map(position))
    }

    fn finish(self) -> Wood {
        let mut wood = Wood { vertices: self.vertices, ..Wood::default() };
        for (material, indices) in self.parts.into_iter().filter(|(_, indices)| !indices.is_empty()) {
            let first = wood.indices.len() as u32;
            wood.indices.extend(indices);
            wood.parts.push(WoodPart { indices: [first, wood.indices.len() as u32], material: material as u32 });
        }
        wood
    }
}

/// Moves the materials and textures used by leaves and wood into the plant, in file order.
fn keep_used_materials(plant: &mut Plant, materials: Vec<Material>, textures: Vec<crate::material::Texture>) {
    let leaves = plant.leaves.iter_mut().map(|leaf| &mut leaf.material);
    let parts = plant.wood.parts.iter_mut().map(|part| &mut part.material);
    let users: Vec<&mut u32> = leaves.chain(parts).collect();
    plant.materials = keep_used(users, materials);
    plant.textures =
        keep_used(plant.materials.iter_mut().filter_map(|material| material.texture.as_mut()).collect(), textures);
}

/// The items that `users` refer to, in their old order; the users are renumbered.
fn keep_used<T>(users: Vec<&mut u32>, items: Vec<T>) -> Vec<T> {
    let mut new_index: BTreeMap<u32, u32> = users.iter().map(|user| (**user, 0)).collect();
    for (new, index) in new_index.values_mut().enumerate() {
        *index = new as u32;
    }
    for user in users {
        *user = new_index[user];
    }
    let kept = items.into_iter().enumerate().filter(|(old, _)| new_index.contains_key(&(*old as u32)));
    kept.map(|(_, item)| item).collect()
}
