//! Methods under comparison: ways to draw a plant with a subset of its leaves.

use foliage_lod::{
    FoliageModel, Plant, Result,
    extract::leaf_count,
    software::{DrawList, Painter, Toning},
    stochastic::{AreaRule, Stochastic, contrast, lambda},
};
use glam::Vec3;
use std::sync::Arc;

/// A way to draw a plant with a subset of its leaves.
pub struct Method {
    /// Name in tables.
    pub name: String,
    kind: Kind,
}

enum Kind {
    /// Prefixes of a model, and the tone of their leaves.
    Prefix(FoliageModel, Option<Toning>),
    /// Prefixes of a random order, with all leaves scaled equally.
    Stochastic { plant: Stochastic, area: AreaRule, toned: Toned },
    /// One plant per level.
    Given(Vec<(f64, Arc<Plant>)>),
}

/// What moves the shaded colours of equally scaled leaves towards their mean, given here.
#[derive(Clone, Copy)]
pub enum Toned {
    /// Nothing.
    Not,
    /// The published contrast reduction.
    Contrast([f32; 3]),
    /// Tone by their scale, as of a model's enlarged leaves.
    Scale([f32; 3], f32),
}

/// A plant with a subset of its leaves.
pub enum Reduced<'a> {
    /// The first leaves of a model.
    Prefix(&'a FoliageModel, u32),
    /// A plant of its own.
    Whole(Arc<Plant>),
}

/// Result of a method at a level.
pub struct Sample<'a> {
    /// The plant to draw.
    pub reduced: Reduced<'a>,
    /// Tone of its leaves.
    pub tone: Option<Toning>,
}

impl Method {
    /// Prefixes of a model.
    pub fn of_model(name: &str, model: FoliageModel) -> Self {
        Self { name: name.into(), kind: Kind::Prefix(model, None) }
    }

    /// Prefixes of a model with its tone, towards the `mean` shaded colour of its leaves.
    pub fn of_toned_model(name: &str, model: FoliageModel, mean: [f32; 3]) -> Self {
        let tone = model.growth.tone;
        let toning = (tone > 0.0).then_some(Toning { mean, kept: 1.0, tone });
        Self { name: name.into(), kind: Kind::Prefix(model, toning) }
    }

    /// Stochastic simplification (Cook et al.): all leaves scaled by the `area` rule.
    pub fn stochastic(name: &str, plant: Stochastic, area: AreaRule, toned: Toned) -> Self {
        Self { name: name.into(), kind: Kind::Stochastic { plant, area, toned } }
    }

    /// Ready-made plants, each with its fraction of the full plant's leaf triangles.
    pub fn given(name: &str, plants: Vec<(f64, Arc<Plant>)>) -> Self {
        Self { name: name.into(), kind: Kind::Given(plants) }
    }

    /// The model, if the method draws prefixes of one.
    pub fn model(&self) -> Option<&FoliageModel> {
        match &self.kind {
            Kind::Prefix(model, _) => Some(model),
            _ => None,
        }
    }

    /// The levels to measure at: `wanted`, or the levels of the ready-made plants.
    pub fn levels(&self, wanted: &[f64]) -> Vec<f64> {
        match &self.kind {
            Kind::Given(plants) => plants.iter().map(|&(level, _)| level).collect(),
            _ => wanted.to_vec(),
        }
    }

    /// Same as [`at`](Self::at) for ready-made plants; `None` for other methods.
    pub fn at_if_given(&self, level: f64) -> Option<Reduced<'_>> {
        matches!(self.kind, Kind::Given(_)).then(|| self.at(level).reduced)
    }

    /// The plant with a fraction `level` of its leaves, 0 to 1, and at least one leaf; for
    /// ready-made plants, the one with the nearest level.
    pub fn at(&self, level: f64) -> Sample<'_> {
        match &self.kind {
            Kind::Prefix(model, tone) => Sample { reduced: Reduced::Prefix(model, count(model, level)), tone: *tone },
            Kind::Stochastic { plant, area, toned } => {
                let scale = area.linear_scale(level, plant.visible_share);
                let whole = scaled_prefix(&plant.model, count(&plant.model, level) as usize, scale as f32);
                let tone = match *toned {
                    Toned::Not => None,
                    Toned::Contrast(mean) => {
                        Some(Toning { mean, kept: contrast::kept(lambda::floored(level)) as f32, tone: 0.0 })
                    }
                    Toned::Scale(mean, tone) => {
                        let kept = Toning { mean, kept: 1.0, tone }.kept_at(scale as f32);
                        Some(Toning { mean, kept, tone: 0.0 })
                    }
                };
                Sample { reduced: Reduced::Whole(whole.into()), tone }
            }
            Kind::Given(plants) => {
                let nearest = plants.iter().min_by(|a, b| (a.0 - level).abs().total_cmp(&(b.0 - level).abs()));
                let whole = nearest.map_or_else(Default::default, |(_, plant)| plant.clone());
                Sample { reduced: Reduced::Whole(whole), tone: None }
            }
        }
    }
}

impl Reduced<'_> {
    /// Number of leaves drawn.
    pub fn leaves(&self) -> u32 {
        match self {
            Self::Prefix(_, count) => *count,
            Self::Whole(plant) => plant.leaves.len() as u32,
        }
    }

    /// Number of triangles of the leaves drawn.
    pub fn triangles(&self) -> u64 {
        match self {
            Self::Prefix(model, count) => {
                let drawn = &model.leaves[..*count as usize];
                drawn.iter().map(|leaf| u64::from(leaf.indices[1] - leaf.indices[0]) / 3).sum()
            }
            Self::Whole(plant) => plant.leaf_triangles() as u64,
        }
    }

    /// Draw list for the software renderer.
    pub fn draw_list(&self) -> DrawList<'_> {
        match self {
            Self::Prefix(model, count) => DrawList::of_model(model, *count as usize),
            Self::Whole(plant) => DrawList::of_plant(plant),
        }
    }

    /// A painter with the textures of the plant.
    ///
    /// # Errors
    /// Errors from [`Painter::new`].
    pub fn painter(&self) -> Result<Painter<'_>> {
        match self {
            Self::Prefix(model, _) => Painter::new(&model.materials, &model.textures),
            Self::Whole(plant) => Painter::new(&plant.materials, &plant.textures),
        }
    }
}

fn count(model: &FoliageModel, level: f64) -> u32 {
    leaf_count(level as f32, model.leaves.len() as u32, 1)
}

/// The first `count` leaves of a model as a plant, each scaled about its pivot.
fn scaled_prefix(model: &FoliageModel, count: usize, scale: f32) -> Plant {
    let mut plant = Plant {
        name: model.name.clone(),
        wood: model.wood.clone(),
        materials: model.materials.clone(),
        textures: model.textures.clone(),
        ..Plant::default()
    };
    for leaf in model.leaves.iter().take(count) {
        let pivot = Vec3::from(leaf.pivot);
        let [first, end] = leaf.vertices.map(|vertex| vertex as usize);
        let mut vertices = model.vertices[first..end].to_vec();
        for vertex in &mut vertices {
            vertex.position = (pivot + (Vec3::from(vertex.position) - pivot) * scale).to_array();
        }
        let indices = &model.indices[leaf.indices[0] as usize..leaf.indices[1] as usize];
        let own: Vec<u32> = indices.iter().map(|index| index - leaf.vertices[0]).collect();
        plant.push_leaf(&vertices, &own, leaf.pivot, leaf.material);
    }
    plant
}
