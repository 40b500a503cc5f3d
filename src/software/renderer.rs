//! CPU counterpart of the GPU renderer: draws a picture from the same camera, look and instances.

use super::{
    image::Image,
    list::{DrawList, Drawn, Placed, is_sound},
    options::{Background, DrawOptions},
    painter::{Painter, mean_leaf_color},
    sprite::PlacedImpostor,
    toning::Toning,
};
use crate::{
    Camera, Error, Result,
    bounds::{Aabb, largest_scale},
    draw::{
        instance::{Frame, Instance, ModelId, Prepared},
        look::{Coloring, Look},
        pages::Pages,
    },
    effects::{Counts, FadeBy, wind::Shape},
    model::{FoliageModel, Impostor, Timeline, Transition},
};
use glam::Vec3;
use slotmap::SlotMap;
use std::collections::HashMap;

/// Maximum number of triangles in one picture; they take 2 GB.
const MOST_TRIANGLES: u64 = 1 << 23;

/// Draws instances of foliage models on the CPU.
///
/// Every effect except `shadow` is simulated for every plant, visible or not. Drawn scales always
/// come from the timeline: [`Instance::scales`] is ignored. Thin stems are never left out.
pub struct SoftwareRenderer<'a> {
    look: Look,
    models: SlotMap<ModelId, Model<'a>>,
    painter: Painter<'a>,
}

/// A picture and its draw statistics.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// The picture.
    pub image: Image,
    /// Draw statistics. Shadows count as skipped, because the CPU draws none.
    pub prepared: Prepared,
}

struct Model<'a> {
    model: &'a FoliageModel,
    timeline: Timeline,
    shape: Shape,
    /// Mean shaded colour of the leaves, linear; 0 if neither tone nor the effect `contrast` acts.
    mean: [f32; 3],
    /// Index of its first material in the painter.
    first_material: u32,
    /// Its impostor, if the look hands plants over and it has one.
    far: Option<FarModel<'a>>,
}

struct FarModel<'a> {
    impostor: &'a Impostor,
    pages: Pages,
    /// Bounding box of all leaves.
    crown: Aabb,
}

impl<'a> SoftwareRenderer<'a> {
    /// Creates a renderer without models.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a parameter of the look that is out of range, and for a
    /// colouring other than [`Coloring::Picture`].
    pub fn new(look: Look) -> Result<Self> {
        look.check()?;
        if look.coloring != Coloring::Picture {
            return Err(Error::invalid("look.coloring", format!("{:?}", look.coloring), "Picture on the CPU"));
        }
        Ok(Self { look, models: SlotMap::default(), painter: Painter::new(&[], &[])? })
    }

    /// Adds a model and decodes its textures.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for a model that breaks an invariant, [`Error::Unreadable`] for a
    /// damaged texture.
    pub fn add_model(&mut self, model: &'a FoliageModel) -> Result<ModelId> {
        model.validate()?;
        let mean = match self.look.tones(&model.growth) {
            true => mean_leaf_color(model, &self.look.lighting())?,
            false => [0.0; 3],
        };
        let first_material = self.painter.add(&model.materials, &model.textures)?;
        let (timeline, shape) = (Timeline::new(model), Shape::new(&model.aabb()));
        let far = self.look.far.and(model.impostor.as_ref()).map(|impostor| FarModel {
            impostor,
            pages: Pages::new(impostor),
            crown: Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position)),
        });
        Ok(self.models.insert(Model { model, timeline, shape, mean, first_material, far }))
    }

    /// Draws a frame; `size` is its width and height in pixels. Instances of unknown models are
    /// skipped.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a size or camera that cannot be drawn, [`Error::TooLarge`] for
    /// more than eight million triangles.
    pub fn draw(&self, frame: impl Into<Frame>, instances: &[Instance], size: [u32; 2]) -> Result<Drawing> {
        let background = self.look.landscape().map_or(Background::Sky, Background::Landscape);
        self.draw_before(background, &frame.into(), instances, size)
    }

    /// Same as [`draw`](Self::draw) without anything behind the plants: alpha is the covered
    /// fraction of each pixel.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub fn cutout(&self, frame: impl Into<Frame>, instances: &[Instance], size: [u32; 2]) -> Result<Drawing> {
        self.draw_before(Background::Transparent, &frame.into(), instances, size)
    }

    fn draw_before(
        &self,
        background: Background,
        frame: &Frame,
        instances: &[Instance],
        size: [u32; 2],
    ) -> Result<Drawing> {
        let (look, effects) = (&self.look, &self.look.effects);
        let camera = frame.jittered();
        let known = instances.iter().filter_map(|instance| {
            let model = self.models.get(instance.model)?;
            Some((model, instance, model.share(look, instance, &camera)))
        });
        let known: Vec<(&Model<'a>, &Instance, f32)> = known.collect();
        let near: Vec<(&Model<'a>, &Instance)> =
            known.iter().filter(|(.., share)| *share < 1.0).map(|&(model, instance, _)| (model, instance)).collect();
        check_triangles(&near)?;
        let mut prepared = Prepared { draws: 1, effects: Counts::of(effects), ..Prepared::default() };
        let lists = self.lists(&near, &mut prepared);
        let moment = effects.wind.map(|wind| wind.at(frame.seconds));
        let sway = |model: &Model<'_>, instance: &Instance| {
            moment.map(|moment| moment.sway(&model.shape, &instance.world_from_plant))
        };
        let with_leaves = known.iter().filter(|(.., share)| *share < 1.0);
        let placed: Vec<Placed<'_>> = with_leaves
            .map(|&(model, instance, far)| {
                let (tone, sway) = (self.toning(model, instance), sway(model, instance));
                Placed { tone, sway, far, ..Placed::new(&lists[&key(instance)], instance.world_from_plant) }
            })
            .collect();
        let with_impostors = known.iter().filter(|(.., share)| *share > 0.0);
        let impostors: Vec<PlacedImpostor<'_>> = with_impostors
            .filter_map(|&(model, instance, share)| {
                let FarModel { impostor, pages, crown } = model.far.as_ref()?;
                let sway = sway(model, instance);
                let world_from_plant = instance.world_from_plant;
                let seed = instance.seed;
                Some(PlacedImpostor { impostor, pages, crown: *crown, world_from_plant, sway, share, seed })
            })
            .filter(|placed| is_sound(&placed.world_from_plant))
            .collect();
        for plant in &placed {
            let of_leaves = plant.list.parts.iter().filter(|part| part.leaf.is_some()).count();
            prepared.leaves += of_leaves as u64;
            prepared.effects.add_plant();
        }
        prepared.wood_triangles = near.iter().map(|(model, _)| model.model.wood.triangles() as u64).sum();
        let sound = known.iter().filter(|(_, instance, _)| is_sound(&instance.world_from_plant));
        prepared.instances = sound.clone().count() as u32;
        sound.for_each(|&(.., share)| prepared.far.add(share));
        prepared.skipped = instances.len() as u32 - prepared.instances;
        prepared.effects.shadow.iter_mut().for_each(|count| count.skipped = instances.len() as u64);
        let options = DrawOptions { lighting: look.lighting(), background, ..DrawOptions::default() };
        let image = self.painter.draw_all(&placed, &impostors, &camera, size, &options)?;
        Ok(Drawing { image, prepared })
    }

    /// Tone of an instance's leaves: by their scales if the model asks for it, otherwise by the
    /// effect `contrast`.
    fn toning(&self, model: &Model<'_>, instance: &Instance) -> Option<Toning> {
        let tone = model.model.growth.tone;
        if self.look.tone && tone > 0.0 {
            return Some(Toning { mean: model.mean, kept: 1.0, tone });
        }
        let effect = self.look.effects.contrast?;
        Some(Toning { mean: model.mean, kept: effect.kept(instance.active, model.model.leaves.len()), tone: 0.0 })
    }

    /// Builds the draw lists, one for all plants with the same [`Key`], and counts fading leaves.
    fn lists(&self, plants: &[(&Model<'a>, &Instance)], prepared: &mut Prepared) -> HashMap<Key, DrawList<'a>> {
        let mut lists = HashMap::new();
        for (model, instance) in plants {
            let leaves = model.model.leaves.len() as u32;
            let active = f64::from(instance.active);
            let (transition, by) = match self.look.effects.fade {
                Some(fade) => (fade.transition(active, leaves), fade.by),
                None => (Transition::new(active, instance.window, leaves), FadeBy::Size),
            };
            prepared.effects.add_leaves(&transition);
            lists.entry(key(instance)).or_insert_with(|| {
                let drawn = Drawn { transition, by, leaf_scale: instance.leaf_scale };
                let mut list = DrawList::of_drawn(model.model, &model.timeline, &drawn);
                list.parts.iter_mut().for_each(|part| part.material += model.first_material);
                list
            });
        }
        lists
    }
}

impl Model<'_> {
    /// Share of an instance's samples that its impostor takes.
    fn share(&self, look: &Look, instance: &Instance, camera: &Camera) -> f32 {
        let Some((far, model)) = look.far.zip(self.far.as_ref()) else { return 0.0 };
        let to_world = &instance.world_from_plant;
        let center = to_world.transform_point3(Vec3::from(model.impostor.center).as_dvec3());
        let radius = f64::from(model.impostor.radius()) * largest_scale(to_world);
        far.share_of(camera.diameter_px(center, radius), instance.seed, instance.far)
    }
}

/// Inputs of a draw list: model, and the bits of the active count, the window and the leaf scale.
type Key = (ModelId, [u32; 3]);

fn key(instance: &Instance) -> Key {
    (instance.model, [instance.active, instance.window, instance.leaf_scale].map(f32::to_bits))
}

fn check_triangles(plants: &[(&Model<'_>, &Instance)]) -> Result<()> {
    let of_plant = |(Model { model, .. }, instance): &(&Model<'_>, &Instance)| {
        let last = (instance.active.ceil() as usize).min(model.leaves.len()).checked_sub(1);
        let of_leaves = last.map_or(0, |last| u64::from(model.leaves[last].indices[1] / 3));
        model.wood.triangles() as u64 + of_leaves
    };
    let value = plants.iter().map(of_plant).sum::<u64>();
    if value <= MOST_TRIANGLES {
        return Ok(());
    }
    let fix = "draw fewer trees, lower `lod`, or use `GpuDevice`".into();
    Err(Error::TooLarge { what: "triangles drawn on the CPU".into(), value, limit: MOST_TRIANGLES, fix })
}
