//! Times that the GPU takes for frames, by timestamp queries.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

/// Most frames whose times are not read yet; further ones are not timed.
const FRAMES: usize = 8;
/// Bytes of the two timestamps of a frame.
const BYTES: wgpu::BufferAddress = 2 * wgpu::QUERY_SIZE as wgpu::BufferAddress;

/// State of a slot that is not in use.
const FREE: u8 = 0;
/// State of one whose times are on their way.
const BUSY: u8 = 1;
/// State of one whose times can be read.
const READY: u8 = 2;
/// State of one whose times cannot be read.
const FAILED: u8 = 3;

/// Times that the GPU takes for frames: read a few frames later, never waited for.
///
/// Record a frame between [`begin`](Self::begin) and [`end`](Self::end), call
/// [`submitted`](Self::submitted) once its commands are in the queue, and [`read`](Self::read) in
/// any later frame; the times are what a [`Pace`](crate::scene::budget::Pace) asks for.
pub struct FrameTimer {
    device: wgpu::Device,
    queries: wgpu::QuerySet,
    slots: Vec<Slot>,
    /// Milliseconds of a step of a timestamp.
    step_ms: f64,
    /// Slot and number of the frame that is being recorded.
    recorded: Option<(usize, u64)>,
}

struct Slot {
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
    state: Arc<AtomicU8>,
    frame: u64,
}

impl FrameTimer {
    /// Features that the device needs.
    pub const FEATURES: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// A timer; `None` if the device was opened without [`FEATURES`](Self::FEATURES).
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(Self::FEATURES) {
            return None;
        }
        let buffer = |usage| {
            let descriptor =
                wgpu::BufferDescriptor { label: Some("frame times"), size: BYTES, usage, mapped_at_creation: false };
            device.create_buffer(&descriptor)
        };
        use wgpu::BufferUsages as Usage;
        let slot = |_| Slot {
            resolved: buffer(Usage::QUERY_RESOLVE | Usage::COPY_SRC),
            readback: buffer(Usage::COPY_DST | Usage::MAP_READ),
            state: Arc::new(AtomicU8::new(FREE)),
            frame: 0,
        };
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("frame times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * FRAMES as u32,
            }),
            slots: (0..FRAMES).map(slot).collect(),
            step_ms: 1e-6 * f64::from(queue.get_timestamp_period()),
            recorded: None,
            device: device.clone(),
        })
    }

    /// Begins to time the frame with this number, in front of its commands.
    pub fn begin(&mut self, frame: u64, encoder: &mut wgpu::CommandEncoder) {
        let free = self.slots.iter().position(|slot| slot.state.load(Ordering::Acquire) == FREE);
        self.recorded = free.map(|slot| (slot, frame));
        if let Some(slot) = free {
            encoder.write_timestamp(&self.queries, 2 * slot as u32);
        }
    }

    /// Ends it, behind its commands; `encoder` may be another one that is submitted later.
    pub fn end(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let Some((number, _)) = self.recorded else { return };
        let (slot, first) = (&self.slots[number], 2 * number as u32);
        encoder.write_timestamp(&self.queries, first + 1);
        encoder.resolve_query_set(&self.queries, first..first + 2, &slot.resolved, 0);
        encoder.copy_buffer_to_buffer(&slot.resolved, 0, &slot.readback, 0, BYTES);
    }

    /// Asks for the time of the frame, once its commands are submitted. Without it, the frame is
    /// not timed.
    pub fn submitted(&mut self) {
        let Some((number, frame)) = self.recorded.take() else { return };
        let slot = &mut self.slots[number];
        slot.frame = frame;
        slot.state.store(BUSY, Ordering::Release);
        let state = Arc::clone(&slot.state);
        slot.readback.map_async(wgpu::MapMode::Read, .., move |mapped| {
            state.store(if mapped.is_ok() { READY } else { FAILED }, Ordering::Release);
        });
    }

    /// Number of each frame whose time is known by now and was not read, oldest first, and its time
    /// in milliseconds.
    pub fn read(&mut self) -> Vec<(u64, f64)> {
        // A lost device fails all that is waited for.
        let _ = self.device.poll(wgpu::PollType::Poll);
        let mut times = Vec::new();
        for slot in &self.slots {
            let state = slot.state.load(Ordering::Acquire);
            if state == READY {
                if let Ok(mapped) = slot.readback.get_mapped_range(..) {
                    let [from, to] = [0, 1].map(|i| bytemuck::pod_read_unaligned::<u64>(&mapped[8 * i..8 * i + 8]));
                    times.push((slot.frame, to.saturating_sub(from) as f64 * self.step_ms));
                }
                slot.readback.unmap();
            }
            if state == READY || state == FAILED {
                slot.state.store(FREE, Ordering::Release);
            }
        }
        times.sort_by_key(|(frame, _)| *frame);
        times
    }
}
