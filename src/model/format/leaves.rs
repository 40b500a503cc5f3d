//! The section of leaf records: materials, targets, scales, errors and pivots.

use super::{
    super::{Leaf, NO_LEAF},
    fault::Decoded,
    ints::Ints,
    numbers::{Form, Numbers, padded},
};
use serde::{Deserialize, Serialize};

/// Everything about leaves but their vertices.
#[derive(Serialize, Deserialize)]
pub(super) struct Leaves<'a> {
    #[serde(borrow)]
    materials: Ints<'a>,
    /// Targets; 0 for leaf 0, which has none.
    targets: Ints<'a>,
    /// Bits of the scales and errors: both are positive, so that they are in order.
    scales: Ints<'a>,
    errors: Ints<'a>,
    /// Pivots, each predicted by the target's, which is near.
    pivots: Numbers<'a>,
}

impl Leaves<'_> {
    pub(super) fn encode(leaves: &[Leaf]) -> Leaves<'static> {
        let column = |of: fn(&Leaf) -> u32| Ints::encode(&leaves.iter().map(of).collect::<Vec<_>>());
        let pivot = |i: usize| padded(leaves[i].pivot);
        let predicted = |i: usize| leaves[i].target().map(pivot);
        Leaves {
            materials: column(|leaf| leaf.material),
            targets: column(|leaf| leaf.target().map_or(0, |target| target as u32)),
            scales: column(|leaf| leaf.scale.to_bits()),
            errors: column(|leaf| leaf.error.to_bits()),
            pivots: Numbers::encode(
                Form::of_numbers(leaves.iter().map(|leaf| &leaf.pivot[..])),
                [leaves.len(), 3],
                |i| (pivot(i), predicted(i)),
            ),
        }
    }

    /// Decodes `count` leaves, without their ranges of vertices and indices.
    pub(super) fn decode(&self, count: usize) -> Decoded<Vec<Leaf>> {
        let columns = [&self.materials, &self.targets, &self.scales, &self.errors];
        let [materials, targets, scales, errors] = decode_all(columns, count)?;
        let pivots = self.pivots.decode([count, 3])?;
        let mut leaves: Vec<Leaf> = Vec::with_capacity(count);
        for i in 0..count {
            let target = if i == 0 { NO_LEAF } else { targets[i] };
            let predicted = match (i, leaves.get(target as usize)) {
                (0, _) => None,
                (_, Some(target)) => Some(padded(target.pivot)),
                (_, None) => return Err(format!("leaf {i} has target {target}")),
            };
            let [x, y, z, _] = pivots.element(i, predicted);
            leaves.push(Leaf {
                vertices: [0; 2],
                indices: [0; 2],
                pivot: [x, y, z],
                material: materials[i],
                leaf_to_split: target,
                leaf_to_collapse: target,
                scale: f32::from_bits(scales[i]),
                error: f32::from_bits(errors[i]),
            });
        }
        Ok(leaves)
    }
}

fn decode_all<const N: usize>(columns: [&Ints<'_>; N], count: usize) -> Decoded<[Vec<u32>; N]> {
    let decoded = columns.iter().map(|column| column.decode(count)).collect::<Decoded<Vec<_>>>()?;
    decoded.try_into().map_err(|_| "a column is missing".into())
}
