//! The triangles of one stem while vertices collapse: what meets where, and what a collapse would
//! change.

use super::{measure::from_triangle, mesh::Mesh};
use crate::{leaf::Vertex, plant::Wood};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Least cosine between the normals of a triangle before and after a collapse.
const LEAST_COSINE: f32 = 0.1;
/// Most points that are gone and still measured, for each triangle: those farthest from it.
const MOST_GONE: usize = 12;
/// How much farther, in texture coordinates, a vertex may be moved that no triangle of the
/// collapsed edge leads across.
const UV_REACH: f32 = 2.0;

/// The triangles of one stem. A *point* is a position, a *wedge* one of the vertices there.
pub(super) struct Patch<'a> {
    vertices: &'a [Vertex],
    /// Index of each wedge in the wood.
    pub(super) wedges: Vec<u32>,
    /// Point of each wedge.
    point_of: Vec<u32>,
    positions: Vec<Vec3>,
    /// Wedges of each point.
    at: Vec<Vec<u32>>,
    /// Whether each point belongs to another stem too, which moves it.
    locked: Vec<bool>,
    /// Whether stems that grow on this one begin at each point.
    borne: Vec<bool>,
    /// Wedges of each triangle; `None` once it is gone.
    faces: Vec<Option<[u32; 3]>>,
    pub(super) left: usize,
    /// Triangles around each point, gone ones too.
    around: Vec<Vec<u32>>,
    /// Positions that are gone, by the triangle nearest to them, with their distances.
    gone: Vec<Vec<(f32, Vec3)>>,
}

/// Numbers things from 0 on, in the order in which they first occur.
struct Numbers {
    few: Vec<u32>,
    many: Option<HashMap<u32, u32>>,
}

impl Numbers {
    /// Triangles up to which it is faster to look through all than to hash.
    const FEW: usize = 32;

    fn new(triangles: usize) -> Self {
        Self { few: Vec::new(), many: (triangles > Self::FEW).then(HashMap::new) }
    }

    /// The number of a thing, and whether it is new.
    fn number(&mut self, of: u32) -> (u32, bool) {
        let next = self.few.len() as u32;
        let number = match &mut self.many {
            Some(many) => *many.entry(of).or_insert(next),
            None => self.few.iter().position(|&few| few == of).map_or(next, |place| place as u32),
        };
        if number == next {
            self.few.push(of);
        }
        (number, number == next)
    }
}

/// A collapse that is possible.
#[derive(Debug, Clone)]
pub(super) struct Collapse {
    pub(super) from: u32,
    pub(super) to: u32,
    /// Greatest distance of a position that is gone from what is left.
    pub(super) distance: f32,
    /// Greatest distance of what is left from what was there.
    pub(super) added: f32,
    /// Length of the edge.
    pub(super) length: f32,
    /// Triangles that go.
    pub(super) faces: u32,
    /// Wedges of `from` and those that they are moved to.
    pub(super) moves: Vec<[u32; 2]>,
}

/// What is around a point, for a collapse onto another.
#[derive(Default)]
struct Around {
    /// Triangles that go.
    removed: Vec<u32>,
    /// Triangles that move.
    kept: Vec<u32>,
}

impl<'a> Patch<'a> {
    /// The triangles with these numbers, of a stem. `users` are the first and the last stem at each
    /// point of the mesh.
    pub(super) fn new(wood: &'a Wood, mesh: &Mesh, triangles: &[u32], stem: u32, users: &[[u32; 2]]) -> Self {
        let mut patch = Self {
            vertices: &wood.vertices,
            wedges: Vec::new(),
            point_of: Vec::new(),
            positions: Vec::new(),
            at: Vec::new(),
            locked: Vec::new(),
            borne: Vec::new(),
            faces: Vec::new(),
            left: 0,
            around: Vec::new(),
            gone: Vec::new(),
        };
        let (mut points, mut wedges) = (Numbers::new(triangles.len()), Numbers::new(triangles.len()));
        for &triangle in triangles {
            let first = 3 * triangle as usize;
            let face = [0, 1, 2].map(|i| {
                let vertex = wood.indices[first + i];
                let (wedge, is_new) = wedges.number(vertex);
                if is_new {
                    let point = mesh.of_vertex[vertex as usize];
                    let (number, is_new) = points.number(point);
                    if is_new {
                        patch.positions.push(mesh.points[point as usize]);
                        let [first, last] = users[point as usize];
                        patch.locked.push(first != stem);
                        patch.borne.push(last > stem);
                        patch.around.push(Vec::new());
                        patch.at.push(Vec::new());
                    }
                    patch.at[number as usize].push(wedge);
                    patch.wedges.push(vertex);
                    patch.point_of.push(number);
                }
                wedge
            });
            let [a, b, c] = face.map(|wedge| patch.point_of[wedge as usize]);
            if a != b && b != c && c != a {
                [a, b, c].iter().for_each(|&point| patch.around[point as usize].push(patch.faces.len() as u32));
                patch.faces.push(Some(face));
                patch.gone.push(Vec::new());
            }
        }
        patch.left = patch.faces.len();
        patch
    }

    pub(super) fn points(&self) -> u32 {
        self.positions.len() as u32
    }

    pub(super) fn position(&self, point: u32) -> Vec3 {
        self.positions[point as usize]
    }

    pub(super) fn is_locked(&self, point: u32) -> bool {
        self.locked[point as usize]
    }

    /// Whether stems that grow on this one begin at any point.
    pub(super) fn bears(&self) -> bool {
        self.borne.contains(&true)
    }

    /// Wedges with their points.
    pub(super) fn wedges_of_points(&self) -> impl Iterator<Item = (u32, u32)> {
        self.wedges.iter().copied().zip(self.point_of.iter().copied())
    }

    /// The triangles around a point that are left.
    fn faces_around(&self, point: u32) -> impl Iterator<Item = (u32, [u32; 3])> {
        self.around[point as usize].iter().filter_map(|&face| Some((face, self.faces[face as usize]?)))
    }

    fn points_of(&self, face: [u32; 3]) -> [u32; 3] {
        face.map(|wedge| self.point_of[wedge as usize])
    }

    fn corners(&self, face: [u32; 3]) -> [Vec3; 3] {
        self.points_of(face).map(|point| self.position(point))
    }

    /// Points that share an edge with a point, each once, in the order of the triangles.
    pub(super) fn neighbors(&self, point: u32) -> Vec<u32> {
        let mut found = Vec::new();
        for (_, face) in self.faces_around(point) {
            for other in self.points_of(face) {
                if other != point && !found.contains(&other) {
                    found.push(other);
                }
            }
        }
        found
    }

    /// What collapsing `from` onto `to` would do; `None` if it is not possible: if it would join
    /// what is apart, turn a triangle over, tear the texture or move a stem that begins there away.
    pub(super) fn measured(&self, from: u32, to: u32) -> Option<Collapse> {
        if self.borne[from as usize] && !self.borne[to as usize] {
            return None;
        }
        let around = self.split(from, to)?;
        let moves = self.moves(from, to, &around)?;
        let moved =
            |face: [u32; 3]| self.points_of(face).map(|point| self.position(if point == from { to } else { point }));
        let mut left: Vec<[Vec3; 3]> = Vec::with_capacity(around.kept.len() + 4);
        for &face in &around.kept {
            let face = self.faces[face as usize]?;
            let (before, after) = (normal(self.corners(face)), normal(moved(face)));
            let lengths = before.length() * after.length();
            if before != Vec3::ZERO && before.dot(after) <= LEAST_COSINE * lengths {
                return None;
            }
            left.push(moved(face));
        }
        let mut before: Vec<[Vec3; 3]> = self.faces_around(from).map(|(_, face)| self.corners(face)).collect();
        let moved = left.len();
        for (_, face) in self.faces_around(to).filter(|(_, face)| !self.points_of(*face).contains(&from)) {
            left.push(self.corners(face));
            before.push(self.corners(face));
        }
        if left.is_empty() {
            return None;
        }
        let mut added = 0.0;
        for &[a, b, c] in &left[..moved] {
            // Away from the corners, which were there before.
            for between in [(a + b + c) / 3.0, a.midpoint(b), b.midpoint(c), c.midpoint(a)] {
                added = nearest(between, &before, added);
            }
        }
        let mut distance = nearest(self.position(from), &left, 0.0);
        for &face in around.kept.iter().chain(&around.removed) {
            for &(_, point) in &self.gone[face as usize] {
                distance = nearest(point, &left, distance);
            }
        }
        let length = self.position(from).distance(self.position(to));
        Some(Collapse { from, to, distance, added, length, faces: around.removed.len() as u32, moves })
    }

    /// Triangles around `from` that go or move, if what is around both ends fits together.
    fn split(&self, from: u32, to: u32) -> Option<Around> {
        let mut around = Around::default();
        let mut thirds: Vec<u32> = Vec::new();
        for (number, face) in self.faces_around(from) {
            let points = self.points_of(face);
            if points.contains(&to) {
                thirds.extend(points.iter().filter(|&&point| point != from && point != to));
                around.removed.push(number);
            } else {
                around.kept.push(number);
            }
        }
        thirds.sort_unstable();
        thirds.dedup();
        // The link condition: otherwise what was a tube would become a sheet.
        let of_to = self.neighbors(to);
        let common = self.neighbors(from).iter().filter(|&point| of_to.contains(point)).count();
        (!around.removed.is_empty() && common == thirds.len()).then_some(around)
    }

    /// The wedges that those of `from` are moved to: across a triangle of the edge or, where
    /// triangles share no vertices, to the one with the nearest texture coordinates.
    fn moves(&self, from: u32, to: u32, around: &Around) -> Option<Vec<[u32; 2]>> {
        let of = |face: [u32; 3], point: u32| face.into_iter().find(|&wedge| self.point_of[wedge as usize] == point);
        let uv = |wedge: u32| Vec2::from(self.vertices[self.wedges[wedge as usize] as usize].uv);
        let (mut moves, mut targets): (Vec<[u32; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut reach = 0.0_f32;
        for &face in &around.removed {
            let face = self.faces[face as usize]?;
            let (wedge, target) = (of(face, from)?, of(face, to)?);
            reach = reach.max(uv(wedge).distance(uv(target)));
            targets.push(target);
            if moves.iter().all(|moved| moved[0] != wedge) {
                moves.push([wedge, target]);
            }
        }
        targets.extend(self.faces_around(to).filter_map(|(_, face)| of(face, to)));
        for &face in &around.kept {
            let wedge = of(self.faces[face as usize]?, from)?;
            if moves.iter().any(|moved| moved[0] == wedge) {
                continue;
            }
            let distance = |&target: &u32| uv(target).distance(uv(wedge));
            let nearest = targets.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            if distance(&nearest) > UV_REACH * reach {
                return None;
            }
            moves.push([wedge, nearest]);
        }
        // Vertices that no triangle needs any more come along, so that what has met stays together.
        for &wedge in &self.at[from as usize] {
            if moves.iter().all(|moved| moved[0] != wedge) {
                let distance = |&target: &u32| uv(target).distance(uv(wedge));
                moves.push([wedge, targets.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))?]);
            }
        }
        Some(moves)
    }

    /// The vertex among `targets` whose texture coordinates are nearest to those of a vertex, both
    /// by their indices in the wood. There must be a target.
    pub(super) fn alike(&self, vertex: u32, targets: &[u32]) -> u32 {
        let uv = |vertex: u32| Vec2::from(self.vertices[vertex as usize].uv);
        let distance = |&target: &u32| uv(target).distance_squared(uv(vertex));
        targets.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(vertex)
    }

    /// The longest edge between points that count.
    pub(super) fn longest_side(&self, counts: impl Fn(u32) -> bool) -> Option<[u32; 2]> {
        let faces = self.faces.iter().flatten().map(|&face| self.points_of(face));
        let sides =
            faces.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|side| side.iter().all(|&at| counts(at)));
        let length = |side: &[u32; 2]| self.position(side[0]).distance_squared(self.position(side[1]));
        sides.max_by(|a, b| length(a).total_cmp(&length(b)))
    }

    /// Carries out a collapse.
    pub(super) fn collapse(&mut self, collapse: &Collapse) {
        let Collapse { from, to, moves, .. } = collapse;
        let around: Vec<u32> = self.faces_around(*from).map(|(face, _)| face).collect();
        let mut gone = vec![self.position(*from)];
        for &number in &around {
            gone.extend(std::mem::take(&mut self.gone[number as usize]).into_iter().map(|(_, point)| point));
            let Some(mut face) = self.faces[number as usize] else { continue };
            if self.points_of(face).contains(to) {
                self.faces[number as usize] = None;
                self.left -= 1;
                continue;
            }
            for wedge in &mut face {
                if let Some(moved) = moves.iter().find(|moved| moved[0] == *wedge) {
                    *wedge = moved[1];
                }
            }
            self.faces[number as usize] = Some(face);
            self.around[*to as usize].push(number);
        }
        self.around[*from as usize].clear();
        let Self { around, faces, .. } = self;
        around[*to as usize].retain(|&face| faces[face as usize].is_some());
        let left: Vec<(u32, [Vec3; 3])> =
            self.faces_around(*to).map(|(face, wedges)| (face, self.corners(wedges))).collect();
        for point in gone {
            let distances = left.iter().map(|&(face, corners)| (from_triangle(point, corners), face));
            let least = distances.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((distance, face)) = least else { continue };
            let gone = &mut self.gone[face as usize];
            gone.push((distance, point));
            if gone.len() > MOST_GONE {
                let nearest = (0..gone.len()).min_by(|&a, &b| gone[a].0.total_cmp(&gone[b].0));
                gone.swap_remove(nearest.unwrap_or_default());
            }
        }
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// The greater of `distance` and the distance of a point from the nearest of the triangles.
fn nearest(point: Vec3, triangles: &[[Vec3; 3]], distance: f32) -> f32 {
    let mut least = f32::INFINITY;
    for &triangle in triangles {
        least = least.min(from_triangle(point, triangle));
        if least <= distance {
            return distance;
        }
    }
    least
}
