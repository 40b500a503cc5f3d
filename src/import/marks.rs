//! Warns if hardly anything of a plant was taken for leaves while its crown is a solid.
//!
//! Bark marks, stickers and stones are many small opaque sheets, as modelled leaves are. They are
//! not the leaves if their surface is next to nothing of the plant's and a solid that stays wood
//! fills much of the box around the plant, as a crown modelled in one piece does. A bare tree with
//! a few last leaves fills next to nothing of its box, and grass has no wood at all.
//!
//! In 23 trees with separate leaves, leaves had at least 0.6 of the surface, and wood enclosed at
//! most 0.013 of the box; in two with solid crowns, wood enclosed 0.15 and 0.52.

use super::{
    Warning, WarningKind,
    foliage::{self, Judgement},
    source::{Mesh, Part, Source, around},
};
use crate::bounds::Aabb;
use glam::{DVec3, Vec3};

/// Maximum fraction of the plant's surface that leaves have which are not the plant's.
const NEXT_TO_NOTHING: f64 = 0.1;
/// Minimum fraction of the box around the plant that a solid crown fills: the geometric mean of the
/// two measured extremes.
const CROWN: f64 = 0.044;

/// Surface and enclosed volume of something, in units of the source, and the box around it.
#[derive(Debug, Clone, Copy, Default)]
struct Extent {
    area: f64,
    volume: f64,
    bounds: Option<[DVec3; 2]>,
}

/// The warning, if the parts judged as leaves are not the foliage of the plant.
pub(super) fn warning(source: &Source, pieces: &[Vec<Vec<u32>>], judgements: &[Judgement]) -> Option<Warning> {
    let extents = |keeps: fn(&Mesh, &[u32], bool) -> bool| -> Vec<Extent> {
        let parts = source.parts.iter().zip(judgements);
        parts.map(|(part, judgement)| extent(source, part, &pieces[part.mesh], &judgement.is_leaf, keeps)).collect()
    };
    let sum = |extents: &[Extent]| extents.iter().copied().fold(Extent::default(), Extent::and);
    let leaves = sum(&extents(|_, _, is_leaf| is_leaf));
    let wood = sum(&extents(|_, _, is_leaf| !is_leaf));
    if leaves.area == 0.0 || leaves.share_with(&wood) >= NEXT_TO_NOTHING {
        return None;
    }
    // Ground and walls are sheets: they are no part of the plant.
    let solids = extents(|mesh, piece, is_leaf| !is_leaf && !foliage::is_sheet(mesh, piece));
    let solid = sum(&solids);
    let [min, max] = leaves.and(solid).bounds?;
    let share = leaves.share_with(&solid);
    if share >= NEXT_TO_NOTHING || solid.volume <= CROWN * (max - min).element_product() {
        return None;
    }
    let largest = source.parts.iter().zip(&solids).max_by(|(_, a), (_, b)| a.volume.total_cmp(&b.volume));
    largest.map(|(solid, _)| describe(source, solid, share))
}

fn describe(source: &Source, solid: &Part, share: f64) -> Warning {
    let mesh = &source.meshes[solid.mesh];
    let name = if solid.name.is_empty() { &mesh.name } else { &solid.name };
    let material = &source.materials[mesh.material].name;
    let message = format!(
        "the leaves are only {:.1} % of the plant's surface, while {name:?} with material {material:?} is a solid and stays wood",
        100.0 * share
    );
    let fix = "model the crown as separate leaves or, if these are the leaves, name their material or node in `leaves`";
    Warning::new(WarningKind::Foliage, message, fix)
}

impl Extent {
    fn and(self, other: Self) -> Self {
        let bounds = [self.bounds, other.bounds].into_iter().flatten().reduce(around);
        Self { area: self.area + other.area, volume: self.volume + other.volume, bounds }
    }

    /// The fraction of both surfaces that this one is.
    fn share_with(&self, other: &Self) -> f64 {
        self.area / (self.area + other.area)
    }
}

/// The sum over all places of a part of those of its pieces that `keeps` selects, given whether
/// they are leaves. What a piece with a rim encloses is what a cone from its middle to the rim
/// closes.
fn extent(
    source: &Source,
    part: &Part,
    pieces: &[Vec<u32>],
    is_leaf: &[bool],
    keeps: fn(&Mesh, &[u32], bool) -> bool,
) -> Extent {
    let mesh = &source.meshes[part.mesh];
    let (mut area, mut volume, mut aabb) = (0.0, 0.0, Aabb::EMPTY);
    for (piece, _) in pieces.iter().zip(is_leaf).filter(|(piece, is_leaf)| keeps(mesh, piece, **is_leaf)) {
        let corners = || piece.iter().flat_map(|&triangle| mesh.corners(triangle));
        corners().for_each(|corner| aabb.add(mesh.vertices[corner as usize].position));
        let [own_area, own_volume] = measures(mesh, piece);
        (area, volume) = (area + own_area, volume + own_volume);
    }
    let lengths = || part.places.iter().map(|place| libm::cbrt(place.matrix3.determinant().abs()));
    let [areas, volumes] = [lengths().map(|x| x * x).sum::<f64>(), lengths().map(|x| x * x * x).sum()];
    Extent { area: area * areas, volume: volume * volumes, bounds: part.bounds(&aabb) }
}

/// Area and enclosed volume of a piece in its mesh.
fn measures(mesh: &Mesh, piece: &[u32]) -> [f64; 2] {
    let position = |corner: u32| Vec3::from(mesh.vertices[corner as usize].position).as_dvec3();
    let triangles = || piece.iter().map(|&triangle| mesh.corners(triangle).map(position));
    let middle = triangles().flatten().sum::<DVec3>() / (3 * piece.len()).max(1) as f64;
    let (area, volume) = triangles().fold((0.0, 0.0), |(area, volume), [a, b, c]| {
        let normal = (b - a).cross(c - a);
        (area + 0.5 * normal.length(), volume + normal.dot(a - middle) / 6.0)
    });
    [area, volume.abs()]
}
