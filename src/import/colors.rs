//! Vertex colours: used, ignored, or suspected to be data, such as the weights of a wind animation.

use super::{
    Warning, WarningKind,
    source::{Mesh, Source, listed},
};
use std::collections::BTreeSet;
use strum::{Display, EnumMessage, EnumString, IntoStaticStr, VariantArray};

/// Use of the vertex colours of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum VertexColors {
    /// They are multiplied with the material's colour and alpha, as glTF demands.
    #[default]
    Use,
    /// They are ignored: they hold something else.
    Ignore,
}

/// Minimum part of the triangles over which a channel opens while another stays.
const MOST: f64 = 0.25;
/// A channel opens over a triangle if it rises from below the first value to above the second.
const OPENS: [f32; 2] = [0.05, 0.5];
/// A channel stays if it changes by less than this fraction of its greatest value.
const STAYS: f32 = 0.25;
/// Channels below this are absent; those that stay are above.
const ABSENT: f32 = 0.02;
const PRESENT: f32 = 0.2;
/// Number of hues, of twelve, that the leaves of one plant do not have, each in at least this
/// fraction of the vertices.
const MANY_HUES: usize = 7;
const HUE_SHARE: f64 = 0.02;

/// Makes all colours white, or returns a warning if some look like data.
pub(super) fn settle(source: &mut Source, colors: VertexColors) -> Option<Warning> {
    if colors == VertexColors::Ignore {
        source.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| vertex.color = [1.0; 4]);
        return None;
    }
    let is_textured = |mesh: &Mesh| source.materials[mesh.material].texture.is_some();
    let suspects = source.meshes.iter().filter(|mesh| looks_like_data(mesh, is_textured(mesh)));
    let materials: BTreeSet<&str> = suspects.map(|mesh| &*source.materials[mesh.material].name).collect();
    let materials: Vec<&str> = materials.into_iter().collect();
    let names = listed(&materials);
    let message = format!("the vertex colours of material {names} look like data, such as wind weights");
    (!materials.is_empty()).then(|| Warning::new(WarningKind::VertexColors, message, "use `VertexColors::Ignore`"))
}

/// Whether colours behave as those of no leaf: within a triangle one channel opens while another
/// stays or none is there, or they have all hues.
fn looks_like_data(mesh: &Mesh, is_textured: bool) -> bool {
    let color = |&corner: &u32| mesh.vertices[corner as usize].color;
    if mesh.vertices.iter().all(|vertex| vertex.color[0] == vertex.color[1] && vertex.color[1] == vertex.color[2]) {
        return false;
    }
    let triangles = mesh.indices.chunks_exact(3).map(|corners| [&corners[0], &corners[1], &corners[2]].map(color));
    let broken = triangles.filter(|corners| breaks_hue(corners, is_textured)).count();
    broken as f64 > MOST * (mesh.indices.len() / 3) as f64 || has_all_hues(mesh)
}

fn breaks_hue(corners: &[[f32; 4]; 3], is_textured: bool) -> bool {
    let of = |pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|i| corners.map(|corner| corner[i]).into_iter().fold(corners[0][i], pick))
    };
    let [low, high] = [of(f32::min), of(f32::max)];
    (0..3).filter(|&i| low[i] <= OPENS[0] && high[i] >= OPENS[1]).any(|opening| {
        let mut others = (0..3).filter(|&other| other != opening);
        let stays = |other: usize| high[other] >= PRESENT && high[other] - low[other] <= STAYS * high[other];
        let is_alone = others.clone().all(|other| high[other] <= ABSENT);
        // Black to green may be a leaf in the shade, if the green is its own.
        others.any(stays) || is_alone && (opening != 1 || is_textured)
    })
}

fn has_all_hues(mesh: &Mesh) -> bool {
    let mut counts = [0_usize; 12];
    for hue in mesh.vertices.iter().filter_map(|vertex| hue(vertex.color)) {
        counts[hue] += 1;
    }
    let least = HUE_SHARE * mesh.vertices.len() as f64;
    counts.into_iter().filter(|&count| count as f64 >= least.max(1.0)).count() >= MANY_HUES
}

/// One of twelve hues, from red over green and blue; `None` for a colour that is nearly grey.
fn hue([r, g, b, _]: [f32; 4]) -> Option<usize> {
    let [low, high] = [r.min(g).min(b), r.max(g).max(b)];
    let range = high - low;
    if range < PRESENT || low > 0.5 * high {
        return None;
    }
    let sixth = match high {
        _ if high == r => ((g - b) / range + 6.0) % 6.0,
        _ if high == g => (b - r) / range + 2.0,
        _ => (r - g) / range + 4.0,
    };
    Some((sixth * 2.0) as usize % 12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Vertex;

    /// A row of triangles with the given corner colours.
    fn mesh(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Mesh {
        let corner = |[r, g, b]: [f32; 3]| Vertex { color: [r, g, b, 1.0], ..bytemuck::Zeroable::zeroed() };
        let vertices: Vec<Vertex> = triangles.into_iter().flatten().map(corner).collect();
        Mesh { indices: (0..vertices.len() as u32).collect(), vertices, ..Mesh::default() }
    }

    fn unit(i: u32, factor: f32) -> f32 {
        (i as f32 * factor).fract()
    }

    #[test]
    fn weights_look_like_data() {
        let phases = mesh((0..90).map(|i| [0.0, 1.0, 1.0].map(|bend| [0.4 + 0.4 * unit(i, 0.618), bend, 0.0])));
        let stiffness = mesh((0..90).map(|_| [0.0, 1.0, 1.0].map(|bend| [bend, 0.0, 0.0])));
        let random = mesh((0..90).map(|i| [[unit(i, 0.618), unit(i, 0.414), unit(i, 0.732)]; 3]));
        for (data, name) in [(phases, "phases"), (stiffness, "stiffness"), (random, "random")] {
            assert!(looks_like_data(&data, true), "{name}");
        }
    }

    #[test]
    fn colours_of_leaves_do_not() {
        let shade = mesh((0..90).map(|i| [0.0, 0.5, 1.0].map(|light| [light * unit(i, 0.618); 3])));
        let greens = mesh((0..90).map(|i| [0.1, 0.7, 1.0].map(|light| [0.1 * light, 0.6 * light, 0.1 * unit(i, 0.3)])));
        let autumn = mesh((0..90).map(|i| [[0.2 + 0.7 * unit(i, 0.618), 0.5 * unit(i, 0.414), 0.01]; 3]));
        let veins = mesh((0..90).map(|_| [[0.05, 0.4, 0.02], [0.3, 0.5, 0.05], [0.6, 0.1, 0.02]]));
        let white = mesh((0..90).map(|_| [[1.0; 3]; 3]));
        for (color, name) in
            [(shade, "shade"), (greens, "greens"), (autumn, "autumn"), (veins, "veins"), (white, "white")]
        {
            assert!(!looks_like_data(&color, true), "{name}");
        }
    }
}
