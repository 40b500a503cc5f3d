//! Classifies the parts of a file as foliage or wood.
//!
//! Foliage is many small pieces, each a *sheet*: a surface with a rim, flat or bent. A branch is a
//! tube, whose normals cancel out. For alpha-cut materials a few sheets are enough (a fern has nine
//! fronds); opaque sheets must be many, similar in size, and small. Names are ignored. In the 22
//! files used for tuning, the area-weighted sum of normals was at least 0.54 of the area for every
//! leaf and at most 0.13 for every branch.
//!
//! Limits: solid opaque leaves and needles modelled as tubes are classified as wood; to import
//! them, name their material, node or mesh in `leaves`.

use super::{
    Verdict,
    source::{Mesh, Part, Source},
};
use crate::{bounds::Aabb, material::AlphaMode};
use glam::{DVec3, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// A piece is a sheet if the sum of its normals exceeds this fraction of its area: the geometric
/// mean of the two measured extremes.
const SHEET: f64 = 0.27;
/// Minimum fraction of the pieces of a group that must be sheets.
const MOST: f64 = 0.8;
/// Minimum number of alpha-cut sheets in foliage.
const FEW: usize = 4;
/// Minimum number of opaque sheets in foliage. Parts with fewer pieces than this are judged
/// together with the other small parts of their material, because some exporters give every leaf
/// its own node.
const MANY: usize = 16;
/// Maximum number of triangles of a leaf: the longest fronds measured have 176.
const MAX_TRIANGLES: usize = 1024;
/// Maximum size ratio of opaque sheets: the 90th percentile over the 10th percentile.
const ALIKE: f64 = 4.0;
/// Maximum median size of opaque sheets, as a fraction of the size of the plant.
const SMALL: f64 = 0.5;

/// The reason why cards that were joined are not leaves, in a plant without any: `cards` has not
/// separated them.
const JOINED: &str = "; cards joined at their edges are separated only where their texture coordinates repeat";

/// Classification of a part.
#[derive(Debug, Clone)]
pub(super) struct Judgement {
    pub(super) verdict: Verdict,
    pub(super) reason: String,
    /// Whether each piece of the mesh is a leaf.
    pub(super) is_leaf: Vec<bool>,
}

/// Properties of a piece that its classification depends on.
pub(super) struct Shape {
    triangles: usize,
    /// Diagonal of its bounding box, scaled as at the first place of the part.
    size: f64,
    is_sheet: bool,
}

/// Classifies every part by its shape.
pub(super) fn judge(source: &Source, pieces: &[Vec<Vec<u32>>]) -> Vec<Judgement> {
    let plant_size = source.bounds().map_or(0.0, |[min, max]| min.distance(max));
    let shapes: Vec<Vec<Shape>> = source.parts.iter().map(|part| shapes(source, part, &pieces[part.mesh])).collect();
    let mut groups: BTreeMap<(usize, Option<usize>), Vec<usize>> = BTreeMap::new();
    for (i, part) in source.parts.iter().enumerate() {
        let stands_alone = pieces[part.mesh].len() * part.places.len() >= MANY;
        let key = (source.meshes[part.mesh].material, stands_alone.then_some(i));
        groups.entry(key).or_default().push(i);
    }
    let mut judgements: Vec<Option<Judgement>> = vec![None; source.parts.len()];
    for ((material, _), parts) in groups {
        let instances = parts.iter().map(|&i| (&shapes[i][..], source.parts[i].places.len()));
        let (verdict, reason) = judge_group(instances, source.stated_alpha[material], plant_size);
        for i in parts {
            let is_leaf = shapes[i].iter().map(|shape| verdict == Verdict::Leaf && is_leaf_like(shape)).collect();
            judgements[i] = Some(with_exceptions(Judgement { verdict, reason: reason.clone(), is_leaf }));
        }
    }
    let mut judgements: Vec<Judgement> = judgements.into_iter().flatten().collect();
    if judgements.iter().all(|judgement| judgement.verdict == Verdict::Wood) {
        for ((part, shapes), judgement) in source.parts.iter().zip(&shapes).zip(&mut judgements) {
            let is_cut = source.stated_alpha[source.meshes[part.mesh].material] != AlphaMode::Opaque;
            if is_cut && !shapes.iter().all(is_leaf_like) {
                judgement.reason.push_str(JOINED);
            }
        }
    }
    judgements
}

/// Counts the pieces of foliage that are not leaves; a part with no other pieces is wood.
pub(super) fn with_exceptions(mut judgement: Judgement) -> Judgement {
    let exceptions = judgement.is_leaf.iter().filter(|is_leaf| !**is_leaf).count();
    if judgement.verdict == Verdict::Leaf && exceptions > 0 {
        judgement.reason.push_str(&format!("; pieces of another shape, which stay wood: {exceptions}"));
        if exceptions == judgement.is_leaf.len() {
            judgement.verdict = Verdict::Wood;
        }
    }
    judgement
}

/// Whether a piece is a surface with a rim.
pub(super) fn is_sheet(mesh: &Mesh, piece: &[u32]) -> bool {
    shape(mesh, piece, 1.0).is_sheet
}

/// Whether a piece is shaped like a leaf.
pub(super) fn is_leaf(mesh: &Mesh, piece: &[u32]) -> bool {
    is_leaf_like(&shape(mesh, piece, 1.0))
}

pub(super) fn is_leaf_like(shape: &Shape) -> bool {
    shape.is_sheet && shape.triangles <= MAX_TRIANGLES
}

fn judge_group<'a>(
    parts: impl Iterator<Item = (&'a [Shape], usize)> + Clone,
    alpha: AlphaMode,
    plant_size: f64,
) -> (Verdict, String) {
    let count: usize = parts.clone().map(|(shapes, places)| shapes.len() * places).sum();
    let likely: usize =
        parts.clone().map(|(shapes, places)| shapes.iter().filter(|shape| is_leaf_like(shape)).count() * places).sum();
    let is_opaque = alpha == AlphaMode::Opaque;
    let kind = if is_opaque { "opaque" } else { "cut out by alpha" };
    if (likely as f64) < count as f64 * MOST {
        let reason = format!("{kind}, {likely} of {count} pieces are sheets of at most {MAX_TRIANGLES} triangles");
        return (Verdict::Wood, reason);
    }
    let needed = if is_opaque { MANY } else { FEW };
    if likely < needed {
        return (Verdict::Wood, format!("{kind}, {likely} separate sheets where at least {needed} are expected"));
    }
    let mut sizes: Vec<f64> =
        parts.flat_map(|(shapes, _)| shapes).filter(|s| is_leaf_like(s)).map(|s| s.size).collect();
    sizes.sort_by(f64::total_cmp);
    let [low, median, high] = [1, 5, 9].map(|tenth| sizes[(sizes.len() - 1) * tenth / 10]);
    let percent = 100.0 * median / plant_size;
    if is_opaque && high > low * ALIKE {
        return (Verdict::Wood, format!("opaque, {likely} sheets whose sizes differ by a factor of {:.1}", high / low));
    }
    if is_opaque && median > plant_size * SMALL {
        return (Verdict::Wood, format!("opaque, {likely} sheets of {percent:.0} % of the size of the plant"));
    }
    (Verdict::Leaf, format!("{kind}, {likely} sheets of {percent:.1} % of the size of the plant"))
}

pub(super) fn shapes(source: &Source, part: &Part, pieces: &[Vec<u32>]) -> Vec<Shape> {
    let mesh = &source.meshes[part.mesh];
    let scale = part.places.first().map_or(1.0, |place| libm::cbrt(place.matrix3.determinant().abs()));
    pieces.iter().map(|piece| shape(mesh, piece, scale)).collect()
}

fn shape(mesh: &Mesh, piece: &[u32], scale: f64) -> Shape {
    let triangles: Vec<[[f32; 3]; 3]> =
        piece.iter().map(|&t| mesh.corners(t).map(|corner| mesh.vertices[corner as usize].position)).collect();
    let size = Aabb::of_points(triangles.iter().flatten().copied()).size().as_dvec3().length() * scale;
    let is_sheet = openness(&triangles) > SHEET || openness(&without_twins(&triangles)) > SHEET;
    Shape { triangles: piece.len(), size, is_sheet }
}

/// Length of the area-weighted sum of normals over the area: 1 for a plane, 0 for a closed surface,
/// about 0 for a tube.
fn openness(triangles: &[[[f32; 3]; 3]]) -> f64 {
    let normals = triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|corner| Vec3::from(corner).as_dvec3());
        (b - a).cross(c - a)
    });
    let (sum, area) = normals.fold((DVec3::ZERO, 0.0), |(sum, area), normal| (sum + normal, area + normal.length()));
    // A surface without area counts as open.
    if area > 0.0 { sum.length() / area } else { 1.0 }
}

/// Keeps one triangle of each set on the same three corners: foliage is often doubled to be visible
/// from both sides.
fn without_twins(triangles: &[[[f32; 3]; 3]]) -> Vec<[[f32; 3]; 3]> {
    let mut seen = BTreeSet::new();
    let is_first = |corners: &&[[f32; 3]; 3]| {
        let mut key = corners.map(|corner| corner.map(|value| (value + 0.0).to_bits()));
        key.sort_unstable();
        seen.insert(key)
    };
    triangles.iter().filter(is_first).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{leaf::Vertex, material::Material};
    use glam::DAffine3;

    /// `count` unit cards in a row and, if `tube`, a four-sided tube below them, in one mesh.
    fn row(count: u16, alpha: AlphaMode, tube: bool) -> Source {
        let mut mesh = Mesh::default();
        let mut quad = |corners: [[f32; 3]; 4]| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners.map(|position| Vertex { position, ..bytemuck::Zeroable::zeroed() }));
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| corner + first));
        };
        for x in (0..count).map(|i| f32::from(i) * 3.0) {
            quad([[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]]);
        }
        let ring = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for side in 0..if tube { 4 } else { 0 } {
            let [[x, z], [to_x, to_z]] = [ring[side], ring[(side + 1) % 4]];
            quad([[x, -9.0, z], [to_x, -9.0, to_z], [to_x, -1.0, to_z], [x, -1.0, z]]);
        }
        Source {
            parts: vec![Part { name: "node".into(), node: None, mesh: 0, places: [DAffine3::IDENTITY].into() }],
            meshes: vec![mesh],
            materials: vec![Material { name: "green".into(), ..Material::default() }],
            stated_alpha: vec![alpha],
            ..Source::default()
        }
    }

    fn judge_row(source: &Source) -> Judgement {
        let mesh = &source.meshes[0];
        let pieces = super::super::pieces::pieces(&mesh.vertices, &mesh.indices);
        judge(source, &[pieces])[0].clone()
    }

    #[test]
    fn few_sheets_are_foliage_only_when_alpha_cuts_them_out() {
        let verdict = |count, alpha| judge_row(&row(count, alpha, false)).verdict;
        assert_eq!(verdict(4, AlphaMode::Mask), Verdict::Leaf);
        assert_eq!(verdict(4, AlphaMode::Blend), Verdict::Leaf);
        assert_eq!(verdict(3, AlphaMode::Mask), Verdict::Wood);
        assert_eq!(verdict(15, AlphaMode::Opaque), Verdict::Wood);
        assert_eq!(verdict(16, AlphaMode::Opaque), Verdict::Leaf);
    }

    #[test]
    fn a_trunk_in_the_leaves_material_stays_wood() {
        let judgement = judge_row(&row(20, AlphaMode::Mask, true));
        assert_eq!(judgement.verdict, Verdict::Leaf);
        assert_eq!(judgement.is_leaf.iter().position(|is_leaf| !is_leaf), Some(20));
        assert!(judgement.reason.contains("stay wood: 1"), "{}", judgement.reason);
    }

    #[test]
    fn doubled_sheets_are_open_and_tubes_are_not() {
        let [a, b, c] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(openness(&[[a, b, c], [a, c, b]]), 0.0);
        assert_eq!(openness(&without_twins(&[[a, b, c], [a, c, b]])), 1.0);
        let tube = row(0, AlphaMode::Mask, true);
        assert!(!shape(&tube.meshes[0], &(0..8).collect::<Vec<_>>(), 1.0).is_sheet);
    }
}
