//! Shared wgpu device: choice of the adapter, and error handling.
//!
//! Any adapter is suitable, including software ones. A device failure does not panic here or in the
//! passes: the first failure is recorded, and [`GpuDevice::check`] returns it as an [`Error::Gpu`].

use super::{
    guard::{self, guarded},
    timer::FrameTimer,
};
use crate::{Error, Result, draw::records::bindings};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Timeout for one picture or one job of a capture. Software adapters take a few seconds for the
/// largest ones.
pub(super) const LONGEST_WAIT: Duration = Duration::from_secs(300);

/// Choice of the adapter.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Part of the adapter's name, ignoring case; `None` leaves the choice to wgpu, with a
    /// preference for high performance.
    pub adapter: Option<String>,
}

impl GpuOptions {
    /// Selects the adapter named by the environment variable `WGPU_ADAPTER_NAME`, if it is set.
    pub fn from_env() -> Self {
        Self { adapter: std::env::var("WGPU_ADAPTER_NAME").ok().filter(|name| !name.is_empty()) }
    }
}

/// An open device and its queue. A clone is another handle to the same device.
#[derive(Debug, Clone)]
pub struct GpuDevice {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    downlevel: wgpu::DownlevelFlags,
    failure: Failure,
}

impl GpuDevice {
    /// Opens an adapter with its full limits, and with wireframe drawing and
    /// [timestamps](FrameTimer) if it supports them.
    ///
    /// # Errors
    /// [`Error::Gpu`] if no driver or no matching adapter is found, or if the adapter cannot be
    /// opened.
    pub fn new(options: &GpuOptions) -> Result<Self> {
        guarded(|| pollster::block_on(Self::open(options)))
    }

    /// Same as [`new`](Self::new), without blocking.
    ///
    /// # Errors
    /// Same as [`new`](Self::new).
    pub async fn open(options: &GpuOptions) -> Result<Self> {
        Self::on(&choose_adapter(options).await?).await
    }

    /// Wraps the caller's own device and queue. The caller remains responsible for device errors:
    /// [`check`](Self::check) only reports failures of calls made through this handle.
    pub fn existing(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let (device, queue) = (device.clone(), queue.clone());
        let downlevel = wgpu::DownlevelFlags::all();
        Self { info: device.adapter_info(), device, queue, downlevel, failure: Failure::default() }
    }

    /// Opens `adapter`.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the adapter's vertex shaders cannot read storage buffers, or if it cannot
    /// be opened.
    pub async fn on(adapter: &wgpu::Adapter) -> Result<Self> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("foliage-lod"),
            required_limits: adapter.limits(),
            required_features: adapter.features() & (wgpu::Features::POLYGON_MODE_LINE | FrameTimer::FEATURES),
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            Error::gpu(format!("adapter {:?} cannot be opened: {}", adapter.get_info().name, one_line(&error)))
        })?;
        let failure = Failure::default();
        let (on_error, on_loss) = (failure.clone(), failure.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| on_error.keep(one_line(&error))));
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device is not a failure.
            if reason != wgpu::DeviceLostReason::Destroyed {
                on_loss.keep(format!("device lost: {}", one_line(&message)));
            }
        });
        let downlevel = adapter.get_downlevel_capabilities().flags;
        let opened = Self { device, queue, info: adapter.get_info(), downlevel, failure };
        opened.require(wgpu::DownlevelFlags::VERTEX_STORAGE)?;
        Ok(opened)
    }

    /// Name and graphics API, such as `llvmpipe (LLVM 19.1.7, 256 bits), Vulkan`.
    pub fn adapter_name(&self) -> String {
        format!("{}, {:?}", self.info.name, self.info.backend)
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Whether the adapter is a software adapter, which draws on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Checks that the adapter has all `flags`.
    ///
    /// # Errors
    /// [`Error::Gpu`] naming the missing ones.
    pub(super) fn require(&self, flags: wgpu::DownlevelFlags) -> Result<()> {
        let missing = flags - self.downlevel;
        if missing.is_empty() {
            return Ok(());
        }
        let names: Vec<_> = missing.iter_names().map(|(name, _)| name).collect();
        Err(Error::gpu(format!("{} lacks {}", self.adapter_name(), names.join(" and "))))
    }

    /// Submits commands to the queue.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device has failed.
    pub fn submit(&self, commands: impl IntoIterator<Item = wgpu::CommandBuffer>) -> Result<wgpu::SubmissionIndex> {
        self.caught(|| self.queue.submit(commands))
    }

    /// Waits until the device has completed `submission`, for at most `longest`.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device has failed or does not respond in time, which counts as a
    /// failure.
    pub fn wait(&self, submission: wgpu::SubmissionIndex, longest: Duration) -> Result<()> {
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(longest) };
        let waited = self.caught(|| self.device.poll(wait))?;
        waited.map(drop).or_else(|error| {
            self.failure.keep(format!("no response: {}", one_line(&error)));
            self.check()
        })
    }

    /// Runs `call` and returns its value. A panic is recorded as a failure of the device.
    fn caught<T>(&self, call: impl FnOnce() -> T) -> Result<T> {
        let given = guard::caught(call).inspect_err(|reason| self.failure.keep(reason.clone()));
        self.check()?;
        given.map_err(Error::gpu)
    }

    /// Checks that the device has not failed since it was opened.
    ///
    /// # Errors
    /// [`Error::Gpu`] with the first failure, if there was one.
    pub fn check(&self) -> Result<()> {
        match self.failure.first() {
            None => Ok(()),
            Some(reason) => Err(Error::gpu(format!("{} failed: {reason}", self.adapter_name()))),
        }
    }
}

async fn choose_adapter(options: &GpuOptions) -> Result<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        flags: wgpu::InstanceFlags::empty().with_env(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let Some(wanted) = &options.adapter else {
        let request = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = instance.request_adapter(&request).await;
        return adapter
            .map_err(|_| Error::gpu("no adapter found (is a Vulkan, Metal or Direct3D 12 driver installed?)"));
    };
    let mut names = Vec::new();
    for adapter in instance.enumerate_adapters(wgpu::Backends::PRIMARY).await {
        let name = adapter.get_info().name;
        if name.to_lowercase().contains(&wanted.to_lowercase()) {
            return Ok(adapter);
        }
        names.push(name);
    }
    Err(Error::gpu(format!("no adapter is named {wanted:?}; available are {names:?}")))
}

/// The first failure that any thread reported.
#[derive(Debug, Clone, Default)]
struct Failure(Arc<Mutex<Option<String>>>);

impl Failure {
    fn keep(&self, reason: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
    }

    fn first(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Formats an error on one line; wgpu's messages span several indented lines.
pub fn one_line(error: &impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Storage buffers per shader stage that a device must allow.
const STORAGE_BUFFERS: u32 = 8;

/// Checks that plants can be drawn on a device with so many samples per pixel.
pub(super) fn check_device(device: &wgpu::Device, samples: u32) -> Result<()> {
    let limits = device.limits();
    let needs = [
        ("storage buffers per shader stage", limits.max_storage_buffers_per_shader_stage, STORAGE_BUFFERS),
        ("bind groups", limits.max_bind_groups, bindings::EFFECTS + 1),
    ];
    for (what, has, needed) in needs {
        if has < needed {
            let name = device.adapter_info().name;
            return Err(Error::gpu(format!("the device on {name:?} has {has} {what}; plants need {needed}")));
        }
    }
    if samples == 0 || samples > 16 {
        return Err(Error::invalid("target.samples", samples, "1 to 16"));
    }
    Ok(())
}
