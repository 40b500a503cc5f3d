//! What the shaders know of each plant: records by mesh tag.

use bevy::{
    asset::{Assets, Handle, RenderAssetUsages, uuid_handle},
    ecs::{lifecycle::HookContext, prelude::*, world::DeferredWorld},
    render::storage::ShaderBuffer,
};
use bytemuck::{Pod, Zeroable};
use foliage_lod::{effects::Sway, model::Transition};

/// Records of all plants.
pub(crate) const PLANTS: Handle<ShaderBuffer> = uuid_handle!("b7f1a9a0-2d34-4c3f-8f0a-6a2be7d9c1e4");
/// Motions of all plants.
pub(crate) const SWAYS: Handle<ShaderBuffer> = uuid_handle!("2c9f4a52-90a7-4d6e-b1a2-0f3b6d1e7c58");

/// One plant, as `foliage.wesl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct PlantRecord {
    pub(crate) count: u32,
    pub(crate) fraction: f32,
    pub(crate) window: f32,
    pub(crate) first_partial: u32,
    pub(crate) drawn: u32,
    pub(crate) has_wind: u32,
    pub(crate) far: f32,
    pub(crate) seed: u32,
}

impl PlantRecord {
    /// A plant with so many leaves, with a seed.
    pub(crate) fn new(transition: &Transition, seed: u32) -> Self {
        let (count, fraction, window) = transition.parts();
        let (first_partial, drawn) = (transition.first_partial(), transition.drawn());
        Self { count, fraction, window, first_partial, drawn, has_wind: 0, far: 0.0, seed }
    }
}

/// The records, and which are free.
#[derive(Resource, Debug)]
pub(crate) struct Plants {
    records: Vec<PlantRecord>,
    /// Motions of this frame and the last one.
    sways: Vec<[Sway; 2]>,
    free: Vec<u32>,
    is_changed: bool,
}

impl Default for Plants {
    /// No plants, and buffers still to be written, so that materials can be bound.
    fn default() -> Self {
        Self { records: Vec::new(), sways: Vec::new(), free: Vec::new(), is_changed: true }
    }
}

/// The record of a plant; freed with the component.
#[derive(Component, Debug)]
#[component(immutable, on_remove = free_slot)]
pub(crate) struct Slot(pub(crate) u32);

fn free_slot(mut world: DeferredWorld, context: HookContext) {
    let Some(slot) = world.get::<Slot>(context.entity).map(|slot| slot.0) else { return };
    if let Some(mut plants) = world.get_resource_mut::<Plants>() {
        plants.free.push(slot);
    }
}

impl Plants {
    /// A record that no plant has.
    pub(crate) fn take(&mut self) -> u32 {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.records.push(PlantRecord::zeroed());
            self.sways.push([Sway::zeroed(); 2]);
            self.records.len() as u32 - 1
        });
        self.is_changed = true;
        slot
    }

    /// Replaces a record.
    pub(crate) fn set(&mut self, slot: u32, record: PlantRecord, sway: Option<Sway>) {
        let slot = slot as usize;
        let record = PlantRecord { has_wind: u32::from(sway.is_some()), ..record };
        let before = &mut self.records[slot];
        let had_wind = before.has_wind == 1;
        self.is_changed |= *before != record || sway.is_some();
        *before = record;
        if let Some(sway) = sway {
            let last = if had_wind { self.sways[slot][0] } else { sway };
            self.sways[slot] = [sway, last];
        }
    }
}

/// Writes the records that the shaders read, if any has changed.
pub(crate) fn write_plants(mut plants: ResMut<Plants>, mut buffers: ResMut<Assets<ShaderBuffer>>) {
    if !plants.is_changed {
        return;
    }
    plants.is_changed = false;
    // Buffers grow by powers of two, so that bindings rarely change.
    let room = plants.records.len().next_power_of_two().max(16);
    let mut records = plants.records.clone();
    records.resize(room, PlantRecord::zeroed());
    let mut sways = plants.sways.clone();
    sways.resize(room, [Sway::zeroed(); 2]);
    put(&mut buffers, PLANTS, records);
    put(&mut buffers, SWAYS, sways);
}

fn put<T: bytemuck::NoUninit>(buffers: &mut Assets<ShaderBuffer>, handle: Handle<ShaderBuffer>, records: Vec<T>) {
    let buffer = ShaderBuffer::new(records, RenderAssetUsages::RENDER_WORLD);
    if let Err(error) = buffers.insert(handle.id(), buffer) {
        bevy::log::error!("the records of plants cannot be stored: {error}");
    }
}
