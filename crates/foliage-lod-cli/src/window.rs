//! A window that shows plants, with a panel beside them.
//!
//! The content is a [`Stage`]: it receives drag and scroll events, fills the panel, and prepares a
//! [`FoliageRenderer`] for each frame. The window does the rest: surface, multisampling, backdrop,
//! drawing the panel, resizing.

use egui_winit::winit::{
    application::ApplicationHandler,
    dpi::LogicalSize,
    event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop},
    window::{Window, WindowId},
};
use foliage_lod::{
    Error, FoliageRenderer, Result,
    gpu::{self, Backdrop, FrameTimer, GpuDevice, TARGET, TargetFormat, guarded, one_line},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

pub use egui;

/// Size of a new window in logical pixels.
const SIZE: [u32; 2] = [1280, 800];
/// Pixels per line, for a touchpad that scrolls by pixels instead of lines.
const PIXELS_PER_LINE: f64 = 40.0;

/// Maximum wait for one frame.
const LONGEST_FRAME: Duration = Duration::from_secs(60);

/// Times of a frame.
#[derive(Debug, Clone, Copy)]
pub struct FrameTimes {
    /// From its preparation until the GPU has drawn it.
    pub whole: Duration,
    /// GPU time of the scene without the panel, in milliseconds; `None` without timestamps.
    pub gpu_ms: Option<f64>,
}

/// Content of a window.
pub trait Stage {
    /// Fills the panel.
    fn panel(&mut self, ui: &mut egui::Ui);

    /// Called when the pointer is dragged over the picture; `by_px` is the movement to the right
    /// and down, in pixels.
    fn dragged(&mut self, by_px: [f32; 2]);

    /// Called when the wheel is turned over the picture; `lines` is positive away from the user.
    fn scrolled(&mut self, lines: f32);

    /// Prepares the next frame; `size` is its width and height in pixels.
    ///
    /// # Errors
    /// Any error closes the window and is returned by [`open`].
    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()>;

    /// The prepared renderer.
    fn foliage(&self) -> &FoliageRenderer;

    /// Called when the frame is done, with its times.
    fn drawn(&mut self, _: FrameTimes) {}
}

/// Creates the stage once there is a device.
pub type MakeStage<S> = Box<dyn FnOnce(&GpuDevice, TargetFormat) -> Result<S>>;

/// Opens a window and shows a stage in it, until the user closes the window. Must be called from
/// the main thread.
///
/// # Errors
/// [`Error::Gpu`] without a display or an adapter, or if the device fails; any error of the stage.
pub fn open<S: Stage>(title: &str, make: MakeStage<S>) -> Result<()> {
    let events = EventLoop::new().map_err(|error| no_display(&error))?;
    events.set_control_flow(ControlFlow::Wait);
    let mut app = App { title: title.into(), make: Some(make), shown: None, failure: None };
    events.run_app(&mut app).map_err(|error| no_display(&error))?;
    app.failure.map_or(Ok(()), Err)
}

fn no_display(error: &impl std::fmt::Display) -> Error {
    Error::Gpu {
        reason: format!("no window can be opened: {}", reason(error)),
        fix: "run on a desktop, or use `foliage-lod render`".into(),
    }
}

/// Message of the window library, without the leading source location.
fn reason(error: &impl std::fmt::Display) -> String {
    let text = one_line(error);
    let said = text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(&text[..], |(_, said)| said);
    said.trim_end_matches('.').to_string()
}

struct App<S> {
    title: String,
    make: Option<MakeStage<S>>,
    shown: Option<Shown<S>>,
    failure: Option<Error>,
}

impl<S: Stage> ApplicationHandler for App<S> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(make) = self.make.take() else { return };
        match guarded(|| Shown::new(events, &self.title, make)) {
            Ok(shown) => self.shown = Some(shown),
            Err(error) => self.fail(events, error),
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        match guarded(|| shown.event(&event)) {
            Ok(true) => {}
            Ok(false) => events.exit(),
            Err(error) => self.fail(events, error),
        }
    }
}

impl<S> App<S> {
    fn fail(&mut self, events: &ActiveEventLoop, error: Error) {
        self.failure = Some(error);
        events.exit();
    }
}

/// An open window.
struct Shown<S> {
    window: Arc<Window>,
    gpu: GpuDevice,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Multisampled colour and depth, of the window's size.
    attachments: [wgpu::TextureView; 2],
    backdrop: Backdrop,
    panel: Panel,
    pointer: Pointer,
    timer: Option<FrameTimer>,
    stage: S,
}

/// Position of the pointer, and whether it drags the picture.
#[derive(Default)]
struct Pointer {
    at: Option<[f64; 2]>,
    is_dragging: bool,
}

impl<S: Stage> Shown<S> {
    fn new(events: &ActiveEventLoop, title: &str, make: MakeStage<S>) -> Result<Self> {
        let size = LogicalSize::new(SIZE[0], SIZE[1]);
        let attributes = Window::default_attributes().with_title(title).with_inner_size(size);
        let window = Arc::new(events.create_window(attributes).map_err(|error| no_display(&error))?);
        let display = Box::new(events.owned_display_handle());
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_with_display_handle(display)
        });
        let surface = instance.create_surface(window.clone()).map_err(|error| no_display(&error))?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..Default::default()
        }));
        let adapter = adapter.map_err(|_| Error::gpu("no adapter can draw into a window"))?;
        let gpu = pollster::block_on(GpuDevice::on(&adapter))?;
        let inner = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, inner.width.max(1), inner.height.max(1))
            .ok_or_else(|| Error::gpu("the adapter offers no format for the window"))?;
        let formats = surface.get_capabilities(&adapter).formats;
        // egui outputs colours that are already encoded in sRGB: an sRGB format would encode them
        // a second time.
        config.format = formats.iter().copied().find(|format| !format.is_srgb()).unwrap_or(config.format);
        surface.configure(gpu.device(), &config);
        let target = TargetFormat { color: config.format, ..TARGET };
        let stage = make(&gpu, target)?;
        let panel = Panel::new(&window, gpu.device(), config.format);
        let attachments = attachments(gpu.device(), &config);
        let backdrop = Backdrop::new(gpu.device(), target);
        window.request_redraw();
        let (timer, pointer) = (FrameTimer::new(gpu.device(), gpu.queue()), Pointer::default());
        Ok(Self { window, gpu, surface, config, attachments, backdrop, panel, pointer, timer, stage })
    }

    /// Handles one event. Returns false once the window is closed.
    fn event(&mut self, event: &WindowEvent) -> Result<bool> {
        if matches!(event, WindowEvent::RedrawRequested) {
            self.draw()?;
            return Ok(true);
        }
        let response = self.panel.input.on_window_event(&self.window, event);
        match event {
            WindowEvent::CloseRequested => return Ok(false),
            WindowEvent::Resized(size) => {
                (self.config.width, self.config.height) = (size.width.max(1), size.height.max(1));
                self.surface.configure(self.gpu.device(), &self.config);
                self.attachments = attachments(self.gpu.device(), &self.config);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.pointer.is_dragging = *state == ElementState::Pressed && !response.consumed;
            }
            WindowEvent::CursorMoved { position, .. } => {
                let at = [position.x, position.y];
                if let (Some(before), true) = (self.pointer.at, self.pointer.is_dragging) {
                    self.stage.dragged([0, 1].map(|axis| (at[axis] - before[axis]) as f32));
                }
                self.pointer.at = Some(at);
            }
            WindowEvent::MouseWheel { delta, .. } if !response.consumed => self.stage.scrolled(match delta {
                MouseScrollDelta::LineDelta(_, lines) => *lines,
                MouseScrollDelta::PixelDelta(pixels) => (pixels.y / PIXELS_PER_LINE) as f32,
            }),
            _ => {}
        }
        self.window.request_redraw();
        Ok(true)
    }

    fn draw(&mut self) -> Result<()> {
        let texture = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => texture,
            wgpu::CurrentSurfaceTexture::Suboptimal(_)
            | wgpu::CurrentSurfaceTexture::Outdated
            | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(self.gpu.device(), &self.config);
                self.window.request_redraw();
                return self.gpu.check();
            }
            // The window is hidden or the surface timed out: the next event requests another frame.
            _ => return self.gpu.check(),
        };
        let size = [self.config.width, self.config.height];
        let started = Instant::now();
        let filled = self.panel.fill(&self.gpu, &self.window, &mut self.stage);
        self.stage.prepare(&self.gpu, size)?;
        let view = texture.texture.create_view(&Default::default());
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        self.timer.iter_mut().for_each(|timer| timer.begin(0, &mut encoder));
        self.stage.foliage().render_before(&mut encoder);
        {
            let mut pass = plant_pass(&mut encoder, &self.attachments, &view, self.stage.foliage().depth_clear_value());
            self.backdrop.render(&mut pass);
            self.stage.foliage().render(&mut pass);
        }
        self.timer.iter_mut().for_each(|timer| timer.end(&mut encoder));
        self.panel.draw(&self.gpu, &mut encoder, &view, size, &filled);
        let submission = self.gpu.submit([encoder.finish()])?;
        self.timer.iter_mut().for_each(FrameTimer::submitted);
        // Waits for the frame, so that each one can be timed.
        self.gpu.wait(submission, LONGEST_FRAME)?;
        let gpu_ms = self.timer.as_mut().and_then(|timer| Some(timer.read().last()?.1));
        self.stage.drawn(FrameTimes { whole: started.elapsed(), gpu_ms });
        self.window.pre_present_notify();
        self.gpu.queue().present(texture);
        if filled.wants_redraw {
            self.window.request_redraw();
        }
        self.gpu.check()
    }
}

fn plant_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    [samples, depth]: &[wgpu::TextureView; 2],
    resolved: &wgpu::TextureView,
    clear_depth: f32,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("plants"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: samples,
            depth_slice: None,
            resolve_target: Some(resolved),
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(clear_depth), store: wgpu::StoreOp::Discard }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}

fn attachments(device: &wgpu::Device, config: &wgpu::SurfaceConfiguration) -> [wgpu::TextureView; 2] {
    [config.format, TARGET.depth].map(|format| {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let size = [config.width, config.height];
        gpu::texture(device, size, format, TARGET.samples, usage).create_view(&Default::default())
    })
}

/// The panel at the side.
struct Panel {
    context: egui::Context,
    input: egui_winit::State,
    renderer: egui_wgpu::Renderer,
}

impl Panel {
    fn new(window: &Window, device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let context = egui::Context::default();
        let id = context.viewport_id();
        let input = egui_winit::State::new(context.clone(), id, window, None, None, None);
        Self { context, input, renderer: egui_wgpu::Renderer::new(device, format, Default::default()) }
    }

    fn fill(&mut self, gpu: &GpuDevice, window: &Window, stage: &mut impl Stage) -> Filled {
        let input = self.input.take_egui_input(window);
        let mut output = self.context.run_ui(input, |ui| {
            egui::Panel::left("panel").resizable(false).show(ui, |ui| stage.panel(ui));
        });
        self.input.handle_platform_output(window, std::mem::take(&mut output.platform_output));
        for (id, deltas) in &output.textures_delta.set {
            deltas.iter().for_each(|delta| self.renderer.update_texture(gpu.device(), gpu.queue(), *id, delta));
        }
        let unused_textures = output.textures_delta.free.iter().copied().collect();
        output.textures_delta.clear();
        Filled {
            primitives: self.context.tessellate(output.shapes, output.pixels_per_point),
            pixels_per_point: output.pixels_per_point,
            unused_textures,
            wants_redraw: output.viewport_output.values().any(|viewport| viewport.repaint_delay.is_zero()),
        }
    }

    /// Draws the panel over the picture.
    fn draw(
        &mut self,
        gpu: &GpuDevice,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        size: [u32; 2],
        filled: &Filled,
    ) {
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels: size, pixels_per_point: filled.pixels_per_point };
        let commands = self.renderer.update_buffers(gpu.device(), gpu.queue(), encoder, &filled.primitives, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panel"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &filled.primitives, &screen);
        gpu.queue().submit(commands);
        filled.unused_textures.iter().for_each(|id| self.renderer.free_texture(id));
    }
}

/// The panel of one frame, ready to be drawn.
struct Filled {
    primitives: Vec<egui::ClippedPrimitive>,
    pixels_per_point: f32,
    unused_textures: Vec<egui::TextureId>,
    wants_redraw: bool,
}
