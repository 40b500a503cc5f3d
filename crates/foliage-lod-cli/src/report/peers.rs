//! Peer methods: meshoptimizer on the foliage or the wood of each material as one mesh, at equal
//! triangle counts.
//!
//! Limits: its simplifiers weld leaves that touch, so results have no separate leaves; the foliage
//! of each material is drawn as one leaf.

use super::method::Method;
use foliage_lod::{
    Plant,
    leaf::Vertex,
    plant::{Wood, WoodPart},
};
use meshopt::{SimplifyOptions, VertexDataAdapter};
use std::sync::Arc;

/// Maximum error of the simplifiers, relative to the mesh: no limit.
const ANY_ERROR: f32 = 1.0;

type Simplifier = fn(&[u32], &VertexDataAdapter<'_>, usize) -> Vec<u32>;

const WAYS: [(&str, Simplifier); 3] = [
    ("meshopt simplify", |indices, vertices, count| {
        meshopt::simplify(indices, vertices, count, ANY_ERROR, SimplifyOptions::None, None)
    }),
    ("meshopt prune", |indices, vertices, count| {
        meshopt::simplify(indices, vertices, count, ANY_ERROR, SimplifyOptions::Prune, None)
    }),
    ("meshopt sloppy", |indices, vertices, count| meshopt::simplify_sloppy(indices, vertices, count, ANY_ERROR, None)),
];

/// meshoptimizer's three simplifiers, each at the fractions `levels` of the leaf triangles.
/// Materials are simplified one by one.
pub fn meshoptimizer(plant: &Plant, levels: &[f64]) -> Vec<Method> {
    let method = |(name, way): (&str, Simplifier)| {
        let plants = levels.iter().map(|&level| {
            let plant = simplified(plant, way, level);
            (level, Arc::new(plant))
        });
        Method::given(name, plants.collect())
    };
    WAYS.into_iter().map(method).collect()
}

/// The simplified plant, with the foliage of each material as one leaf.
fn simplified(plant: &Plant, way: Simplifier, level: f64) -> Plant {
    let mut result = Plant {
        name: plant.name.clone(),
        wood: plant.wood.clone(),
        materials: plant.materials.clone(),
        textures: plant.textures.clone(),
        ..Plant::default()
    };
    for material in 0..plant.materials.len() as u32 {
        let leaves = plant.leaves.iter().filter(|leaf| leaf.material == material);
        let indices: Vec<u32> = leaves.flat_map(|leaf| &plant.indices[leaf.index_range()]).copied().collect();
        let wanted = (indices.len() as f64 / 3.0 * level).round() as usize * 3;
        let stride = std::mem::size_of::<Vertex>();
        let Ok(vertices) = VertexDataAdapter::new(bytemuck::cast_slice(&plant.vertices), stride, 0) else { continue };
        let kept = way(&indices, &vertices, wanted);
        if kept.len() >= 3 {
            let (vertices, indices) = compacted(&plant.vertices, &kept);
            let pivot = vertices[0].position;
            result.push_leaf(&vertices, &indices, pivot, material);
        }
    }
    result
}

/// Wood with at most so many triangles, or as few as each simplifier gets to. Materials are
/// simplified one by one.
pub fn simplified_wood(wood: &Wood, triangles: u64) -> Vec<(&'static str, Wood)> {
    let level = triangles as f64 / wood.triangles().max(1) as f64;
    let of_way = |(name, way): (&'static str, Simplifier)| {
        let (mut indices, mut parts) = (Vec::new(), Vec::new());
        for part in &wood.parts {
            let own = &wood.indices[part.indices[0] as usize..part.indices[1] as usize];
            let wanted = (own.len() as f64 / 3.0 * level).floor() as usize * 3;
            let stride = std::mem::size_of::<Vertex>();
            let Ok(vertices) = VertexDataAdapter::new(bytemuck::cast_slice(&wood.vertices), stride, 0) else {
                continue;
            };
            let first = indices.len() as u32;
            indices.extend(way(own, &vertices, wanted));
            parts.push(WoodPart { indices: [first, indices.len() as u32], ..*part });
        }
        let (vertices, indices) = compacted(&wood.vertices, &indices);
        (name, Wood { vertices, indices, parts })
    };
    WAYS.map(of_way).into()
}

/// The vertices in use, and indices into them.
fn compacted(vertices: &[Vertex], indices: &[u32]) -> (Vec<Vertex>, Vec<u32>) {
    let mut places = std::collections::HashMap::new();
    let mut used = Vec::new();
    let own = indices.iter().map(|&index| {
        *places.entry(index).or_insert_with(|| {
            used.push(vertices[index as usize]);
            used.len() as u32 - 1
        })
    });
    let own = own.collect();
    (used, own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foliage_lod::grow::{GrowOptions, Species, grow};

    #[test]
    fn simplifiers_keep_at_most_the_triangles_that_are_asked_for_and_the_wood() {
        let species = Species::embedded("betula-populifolia").unwrap();
        let plant = grow(&species, &GrowOptions { leaves: Some(200), ..GrowOptions::default() }).unwrap();
        let methods = meshoptimizer(&plant, &[1.0, 0.5]);
        assert_eq!(methods.len(), 3);
        for method in &methods {
            let triangles = |level: f64| match method.at(level).reduced {
                crate::report::method::Reduced::Whole(plant) => (plant.validate().unwrap(), plant.leaf_triangles()).1,
                _ => panic!("{} is a plant of its own", method.name),
            };
            let (all, half) = (triangles(1.0), triangles(0.5));
            assert!(half <= plant.leaf_triangles() / 2 && half < all, "{}: {half} of {all}", method.name);
        }
    }
}
