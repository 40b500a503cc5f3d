//! Vertices of leaves and of wood.

use super::{
    fault::Decoded,
    numbers::{Form, Numbers, padded},
};
use crate::leaf::Vertex;
use serde::{Deserialize, Serialize};

/// Vertices, attribute by attribute.
#[derive(Serialize, Deserialize)]
pub(super) struct Vertices<'a> {
    #[serde(borrow)]
    positions: Numbers<'a>,
    normals: Numbers<'a>,
    uvs: Numbers<'a>,
    colors: Numbers<'a>,
    alphas: Numbers<'a>,
}

impl Vertices<'_> {
    /// Encodes vertices; `near` gives a point near the vertex with an index, if there is one.
    pub(super) fn encode(vertices: &[Vertex], near: impl Fn(usize) -> Option<[f32; 3]>) -> Vertices<'static> {
        let encoded = |form, width, numbers: &dyn Fn(&Vertex) -> [f32; 4]| {
            Numbers::encode(form, [vertices.len(), width], |i| (numbers(&vertices[i]), None))
        };
        let positions = Form::of_numbers(vertices.iter().map(|vertex| &vertex.position[..]));
        let normals = Form::of_vectors(vertices.iter().map(|vertex| vertex.normal));
        let uvs = Form::of_numbers(vertices.iter().map(|vertex| &vertex.uv[..]));
        let colors = Form::of_numbers(vertices.iter().map(|vertex| &vertex.color[..3]));
        let alphas = Form::of_numbers(vertices.iter().map(|vertex| &vertex.color[3..]));
        let position = |i: usize| (padded(vertices[i].position), near(i).map(padded));
        Vertices {
            positions: Numbers::encode(positions, [vertices.len(), 3], position),
            normals: encoded(normals, 3, &|vertex| padded(vertex.normal)),
            uvs: encoded(uvs, 2, &|vertex| padded([vertex.uv[0], vertex.uv[1], 0.0])),
            colors: encoded(colors, 3, &|vertex| vertex.color),
            alphas: encoded(alphas, 1, &|vertex| padded([vertex.color[3], 0.0, 0.0])),
        }
    }

    /// Decodes `count` vertices; `place` gives where in `vertices` the one with an index belongs,
    /// and a point near it, if there is one.
    pub(super) fn decode(
        &self,
        count: usize,
        place: impl Fn(usize) -> (usize, Option<[f32; 3]>),
        vertices: &mut [Vertex],
    ) -> Decoded<()> {
        let at = |i: usize| place(i).0;
        let positions = self.positions.decode([count, 3])?;
        positions.each(count, |i| place(i).1.map(padded), |i, [x, y, z, _]| vertices[at(i)].position = [x, y, z]);
        drop(positions);
        let normals = self.normals.decode([count, 3])?;
        normals.each(count, |_| None, |i, [x, y, z, _]| vertices[at(i)].normal = [x, y, z]);
        drop(normals);
        self.uvs.decode([count, 2])?.each(count, |_| None, |i, [u, v, ..]| vertices[at(i)].uv = [u, v]);
        self.colors.decode([count, 3])?.each(count, |_| None, |i, color| vertices[at(i)].color = color);
        self.alphas.decode([count, 1])?.each(count, |_| None, |i, [alpha, ..]| vertices[at(i)].color[3] = alpha);
        Ok(())
    }
}
