//! The live scene in a window: drag or use the arrow keys to turn, `+` and `-` to move, 1 to 5 to choose a technique, A and D to move the
//! light. The title says the technique and the time of a frame.
//!
//!     cargo run --release -p live --example viewer

use std::sync::Arc;
use std::time::Instant;

use indirect_gpu::wgpu::{
    self, CommandEncoderDescriptor, CurrentSurfaceTexture, Device, PollType, Queue, Surface,
    SurfaceConfiguration, TextureViewDescriptor,
};
use live::{Live, NAMES, required_limits};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

/// Pixels along each side; the picture keeps its size.
const SIDE: u32 = 384;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Fallible<()> {
    let mut viewer = Viewer::default();
    EventLoop::new()?.run_app(&mut viewer)?;
    viewer.failed.map_or(Ok(()), |e| Err(e.into()))
}

#[derive(Default)]
struct Viewer {
    shown: Option<Shown>,
    failed: Option<String>,
}

/// A window and what is in it.
struct Shown {
    window: Arc<Window>,
    surface: Surface<'static>,
    config: SurfaceConfiguration,
    device: Device,
    queue: Queue,
    live: Live,
    name: &'static str,
    dragged: bool,
    pointer: [f64; 2],
    /// Milliseconds of a frame, smoothed.
    time: f64,
}

impl Shown {
    fn open(event_loop: &ActiveEventLoop) -> Fallible<Self> {
        let attributes = Window::default_attributes()
            .with_title("indirect")
            .with_inner_size(PhysicalSize::new(SIDE, SIDE))
            .with_resizable(false);
        let window = Arc::new(event_loop.create_window(attributes)?);
        let instance = wgpu::Instance::default();
        let surface = instance.create_surface(Arc::clone(&window))?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        let required_limits = required_limits([SIDE; 2])?;
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let config = surface
            .get_default_config(&adapter, SIDE, SIDE)
            .ok_or("the adapter cannot draw to the window")?;
        surface.configure(&device, &config);
        let name = NAMES[0];
        let live = Live::new(&device, &queue, config.format, [SIDE; 2], name)?;
        let (dragged, pointer, time) = (false, [0.0; 2], 0.0);
        Ok(Self { window, surface, config, device, queue, live, name, dragged, pointer, time })
    }

    fn draw(&mut self) -> Fallible<()> {
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) => frame,
            CurrentSurfaceTexture::Suboptimal(_)
            | CurrentSurfaceTexture::Outdated
            | CurrentSurfaceTexture::Lost => {
                self.surface.configure(&self.device, &self.config);
                return Ok(());
            }
            // Nothing to draw to just now.
            _ => return Ok(()),
        };
        let start = Instant::now();
        let target = frame.texture.create_view(&TextureViewDescriptor::default());
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor::default());
        self.live.encode(&mut encoder, Some(&target))?;
        self.queue.submit([encoder.finish()]);
        self.device.poll(PollType::wait_indefinitely())?;
        self.queue.present(frame);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        self.time += (ms - self.time) / if self.time == 0.0 { 1.0 } else { 8.0 };
        self.window.set_title(&format!("indirect: {}, {:.1} ms a frame", self.name, self.time));
        Ok(())
    }

    fn key(&mut self, key: KeyCode) -> Fallible<()> {
        let orbit = &mut self.live.orbit;
        match key {
            KeyCode::ArrowLeft => orbit.turn(-0.05, 0.0, 1.0),
            KeyCode::ArrowRight => orbit.turn(0.05, 0.0, 1.0),
            KeyCode::ArrowUp => orbit.turn(0.0, -0.05, 1.0),
            KeyCode::ArrowDown => orbit.turn(0.0, 0.05, 1.0),
            KeyCode::Equal | KeyCode::NumpadAdd => orbit.turn(0.0, 0.0, 1.0 / 1.05),
            KeyCode::Minus | KeyCode::NumpadSubtract => orbit.turn(0.0, 0.0, 1.05),
            KeyCode::KeyA => self.live.light[0] -= 0.01,
            KeyCode::KeyD => self.live.light[0] += 0.01,
            _ => {
                let digits =
                    [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4, KeyCode::Digit5];
                if let Some((_, name)) = digits.iter().zip(NAMES).find(|(digit, _)| **digit == key) {
                    let mut live = Live::new(&self.device, &self.queue, self.config.format, [SIDE; 2], name)?;
                    live.orbit = self.live.orbit.clone();
                    live.light = self.live.light;
                    (self.live, self.name, self.time) = (live, name, 0.0);
                }
            }
        }
        Ok(())
    }
}

impl Viewer {
    fn end(&mut self, event_loop: &ActiveEventLoop, why: &dyn core::fmt::Display) {
        self.failed = Some(why.to_string());
        event_loop.exit();
    }
}

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            match Shown::open(event_loop) {
                Ok(shown) => self.shown = Some(shown),
                Err(e) => self.end(event_loop, &e),
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        let done = match event {
            WindowEvent::CloseRequested => {
                event_loop.exit();
                Ok(())
            }
            WindowEvent::RedrawRequested => {
                let drawn = shown.draw();
                shown.window.request_redraw();
                drawn
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                match event.physical_key {
                    PhysicalKey::Code(key) => shown.key(key),
                    PhysicalKey::Unidentified(_) => Ok(()),
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                shown.dragged = state == ElementState::Pressed;
                Ok(())
            }
            WindowEvent::CursorMoved { position, .. } => {
                let before = core::mem::replace(&mut shown.pointer, [position.x, position.y]);
                if shown.dragged {
                    let by = |i: usize| ((shown.pointer[i] - before[i]) / 300.0) as f32;
                    shown.live.orbit.turn(by(0), by(1), 1.0);
                }
                Ok(())
            }
            _ => Ok(()),
        };
        if let Err(e) = done {
            self.end(event_loop, &e);
        }
    }
}
