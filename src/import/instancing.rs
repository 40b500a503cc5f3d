//! `EXT_mesh_gpu_instancing`: one node with many instances.

use super::{
    accessor::Accessors,
    fault::{Fault, limit},
    transform::{NO_ROTATION, affine},
};
use ::gltf::json::{Accessor, Index, Node, Value};
use glam::DAffine3;

/// Name of the extension.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Node from instance, one per instance, at most `most`; `None` for a node without the extension.
pub(super) fn places(node: &Node, accessors: &Accessors, most: u64) -> Result<Option<Vec<DAffine3>>, Fault> {
    let Some(extension) = node.extensions.as_ref().and_then(|extensions| extensions.others.get(INSTANCING)) else {
        return Ok(None);
    };
    let accessor = |name: &str| accessor_of(extension, name);
    let (translation, rotation, scale) = (accessor("TRANSLATION")?, accessor("ROTATION")?, accessor("SCALE")?);
    let counts = [translation, rotation, scale].into_iter().flatten().map(|index| accessors.count(index));
    let counts = counts.collect::<Result<Vec<_>, _>>()?;
    let count = counts.first().copied().unwrap_or(0);
    if counts.iter().any(|&other| other != count) {
        return Err(Fault::broken(format!("{INSTANCING}: its attributes have different element counts, {counts:?}")));
    }
    limit("the number of instances for a file of its size", count as u64, most)?;
    let all: Vec<u32> = (0..count as u32).collect();
    let vectors = |index: Option<Index<Accessor>>, absent: f32| match index {
        Some(index) => accessors.floats::<3>(index, "instances", &all, 3..=3, [absent; 3]),
        None => Ok(vec![[absent; 3]; count]),
    };
    let [translations, scales] = [vectors(translation, 0.0)?, vectors(scale, 1.0)?];
    let rotations = match rotation {
        Some(index) => accessors.floats::<4>(index, "instances", &all, 4..=4, [0.0; 4])?,
        None => vec![NO_ROTATION; count],
    };
    let places = translations.into_iter().zip(rotations).zip(scales);
    Ok(Some(places.map(|((translation, rotation), scale)| affine(translation, rotation, scale)).collect()))
}

fn accessor_of(extension: &Value, name: &str) -> Result<Option<Index<Accessor>>, Fault> {
    let Some(value) = extension.get("attributes").and_then(|attributes| attributes.get(name)) else {
        return Ok(None);
    };
    let index = value.as_u64().and_then(|index| u32::try_from(index).ok());
    let broken = || Fault::broken(format!("{INSTANCING}: {name} is {value}, which is not an accessor index"));
    index.map(Index::new).ok_or_else(broken).map(Some)
}
