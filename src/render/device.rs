//! The wgpu device that everything on the GPU shares: how it is chosen, and what becomes of its errors.
//!
//! Any adapter will do, software ones too. Nothing here or in the passes panics when the device fails: the first failure
//! is kept and [`GpuDevice::check`] gives it as an [`Error::Gpu`].

use super::guard::{self, guarded};
use crate::{Error, Result};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// What to do without a GPU.
const USE_CPU: &str = "use the CPU: `CpuFragments`";

/// Longest wait for one picture or one job of a capture. Software adapters take a few seconds for the largest.
pub(super) const LONGEST_WAIT: Duration = Duration::from_secs(300);

/// Which adapter to take.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Part of the adapter's name, in any case; `None` leaves the choice to wgpu, which prefers the fastest.
    pub adapter: Option<String>,
}

impl GpuOptions {
    /// The adapter that the environment variable `WGPU_ADAPTER_NAME` names, if it is set.
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
    /// Opens an adapter with all that it offers in limits, and lines for triangles where it draws them.
    ///
    /// # Errors
    /// [`Error::Gpu`] when there is no driver, no adapter (of that name), or it refuses.
    pub fn new(options: &GpuOptions) -> Result<Self> {
        guarded(|| pollster::block_on(Self::open(options)))
    }

    async fn open(options: &GpuOptions) -> Result<Self> {
        Self::on(&choose_adapter(options).await?).await
    }

    /// Opens a given adapter.
    pub(super) async fn on(adapter: &wgpu::Adapter) -> Result<Self> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("foliage-lod"),
            required_limits: adapter.limits(),
            required_features: adapter.features() & wgpu::Features::POLYGON_MODE_LINE,
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            gpu_error(format!("adapter {:?} gives no device: {}", adapter.get_info().name, one_line(&error)))
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
        Ok(Self { device, queue, info: adapter.get_info(), downlevel, failure })
    }

    /// Name and interface, for instance `llvmpipe (LLVM 19.1.7, 256 bits), Vulkan`.
    pub fn adapter_name(&self) -> String {
        format!("{}, {:?}", self.info.name, self.info.backend)
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Refuses an adapter that lacks one of `flags`.
    ///
    /// # Errors
    /// [`Error::Gpu`] that names what is missing.
    pub fn require(&self, flags: wgpu::DownlevelFlags) -> Result<()> {
        let missing = flags - self.downlevel;
        if missing.is_empty() {
            return Ok(());
        }
        let names: Vec<_> = missing.iter_names().map(|(name, _)| name).collect();
        Err(gpu_error(format!("{} lacks {}", self.adapter_name(), names.join(" and "))))
    }

    /// Hands commands to the device.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device has failed.
    pub fn submit(&self, commands: impl IntoIterator<Item = wgpu::CommandBuffer>) -> Result<wgpu::SubmissionIndex> {
        self.caught(|| self.queue.submit(commands))
    }

    /// Waits until the device has done what was submitted, `longest` at most.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device has failed or does not answer.
    pub fn wait(&self, submission: wgpu::SubmissionIndex, longest: Duration) -> Result<()> {
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(longest) };
        let waited = self.caught(|| self.device.poll(wait))?;
        waited.map(drop).or_else(|error| {
            self.failure.keep(format!("it does not answer: {}", one_line(&error)));
            self.check()
        })
    }

    /// What `call` gives. Its panic is a failure of the device from then on.
    fn caught<T>(&self, call: impl FnOnce() -> T) -> Result<T> {
        let given = guard::caught(call).inspect_err(|reason| self.failure.keep(reason.clone()));
        self.check()?;
        given.map_err(gpu_error)
    }

    /// The first failure since the device was opened.
    ///
    /// # Errors
    /// [`Error::Gpu`] with what the device said, from its first failure on.
    pub fn check(&self) -> Result<()> {
        match self.failure.first() {
            None => Ok(()),
            Some(reason) => Err(gpu_error(format!("{} failed: {reason}", self.adapter_name()))),
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
            .map_err(|_| gpu_error("no adapter found (is a Vulkan, Metal or Direct3D 12 driver installed?)"));
    };
    let mut names = Vec::new();
    for adapter in instance.enumerate_adapters(wgpu::Backends::PRIMARY).await {
        let name = adapter.get_info().name;
        if name.to_lowercase().contains(&wanted.to_lowercase()) {
            return Ok(adapter);
        }
        names.push(name);
    }
    Err(gpu_error(format!("no adapter is named {wanted:?}; there are {names:?}")))
}

/// The first thing that went wrong, from whichever thread it was reported.
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

/// An [`Error::Gpu`] whose fix is the CPU.
pub(super) fn gpu_error(reason: impl Into<String>) -> Error {
    Error::Gpu { reason: reason.into(), fix: USE_CPU.into() }
}

/// wgpu explains itself over several indented lines.
pub(super) fn one_line(error: &impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
