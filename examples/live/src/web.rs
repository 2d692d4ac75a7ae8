//! The page's side: a handle that scripts hold.

use indirect_gpu::wgpu;
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;

use crate::{Live, NAMES, required_limits, settings};

/// A device, a canvas, and what is shown there.
#[wasm_bindgen]
pub struct Page {
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface: wgpu::Surface<'static>,
    format: wgpu::TextureFormat,
    size: [u32; 2],
    live: Live,
}

fn fail(e: impl core::fmt::Display) -> JsError {
    JsError::new(&e.to_string())
}

/// Names of the techniques, a comma between them.
#[wasm_bindgen]
#[must_use]
pub fn techniques() -> String {
    NAMES.join(",")
}

/// Settings of a technique that are not the defaults: `key=value`, a comma between them.
#[wasm_bindgen]
#[must_use]
pub fn settings_of(name: &str) -> String {
    settings(name).iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(",")
}

/// Number of the shader modules of the workspace.
#[wasm_bindgen]
#[must_use]
pub fn shader_count() -> usize {
    indirect_gpu::shaders::MODULES.len()
}

/// Name of a shader module.
#[wasm_bindgen]
#[must_use]
pub fn shader_name(i: usize) -> String {
    indirect_gpu::shaders::MODULES.get(i).map_or_else(String::new, |m| m.name.to_owned())
}

/// Source of a shader module, for the browser's own compiler.
#[wasm_bindgen]
#[must_use]
pub fn shader_source(i: usize) -> String {
    indirect_gpu::shaders::MODULES.get(i).map_or_else(String::new, |m| m.source())
}

#[wasm_bindgen]
impl Page {
    /// Opens a device for a canvas.
    ///
    /// # Errors
    /// Where the browser has no WebGPU, or too little of it.
    pub async fn open(canvas: HtmlCanvasElement, name: String) -> Result<Page, JsError> {
        console_error_panic_hook::set_once();
        let size = [canvas.width(), canvas.height()];
        let instance = wgpu::Instance::default();
        let surface = instance.create_surface(wgpu::SurfaceTarget::Canvas(canvas)).map_err(fail)?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = instance.request_adapter(&options).await.map_err(fail)?;
        let required_limits = required_limits(size).map_err(fail)?;
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(fail)?;
        let capabilities = surface.get_capabilities(&adapter);
        let format = *capabilities.formats.first().ok_or_else(|| fail("the canvas has no format"))?;
        let mut config = surface
            .get_default_config(&adapter, size[0], size[1])
            .ok_or_else(|| fail("the canvas cannot be drawn to"))?;
        config.format = format;
        surface.configure(&device, &config);
        let live = Live::new(&device, &queue, format, size, &name).map_err(fail)?;
        Ok(Self { device, queue, surface, format, size, live })
    }

    /// Another technique; camera and light stay.
    ///
    /// # Errors
    /// For a name that none has.
    pub fn choose(&mut self, name: &str) -> Result<(), JsError> {
        let mut live = Live::new(&self.device, &self.queue, self.format, self.size, name).map_err(fail)?;
        live.orbit = self.live.orbit.clone();
        (live.light, live.exposure) = (self.live.light, self.live.exposure);
        self.live = live;
        Ok(())
    }

    /// Turns the camera, radians, and moves it, as a factor of its distance.
    pub fn orbit(&mut self, yaw: f32, pitch: f32, zoom: f32) {
        self.live.orbit.turn(yaw, pitch, zoom);
    }

    /// Moves the light from where the scene has it, metres.
    pub fn light(&mut self, x: f32, y: f32, z: f32) {
        self.live.light = [x, y, z];
    }

    /// Brightness of the picture.
    pub fn exposure(&mut self, value: f32) {
        self.live.exposure = value;
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// Whatever the technique or the browser says.
    pub fn frame(&mut self) -> Result<(), JsError> {
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                frame
            }
            // Nothing to draw to just now.
            _ => return Ok(()),
        };
        let target = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.live.encode(&mut encoder, Some(&target)).map_err(fail)?;
        self.queue.submit([encoder.finish()]);
        self.queue.present(frame);
        Ok(())
    }

    /// A promise that all that was submitted is done; the page may be used while it is waited for.
    #[must_use]
    pub fn done(&self) -> js_sys::Promise {
        let queue = self.queue.clone();
        wasm_bindgen_futures::future_to_promise(async move {
            js_future(|done| queue.on_submitted_work_done(move || done(()))).await;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Indirect radiance of the frame that was encoded last: red, green, blue, 0 of each pixel, top row first.
    ///
    /// # Errors
    /// Where the browser cannot read it.
    pub async fn read(&self) -> Result<Vec<f32>, JsError> {
        self.download(self.live.image()).await
    }

    /// The triangle that each pixel of that frame sees.
    ///
    /// # Errors
    /// As there.
    pub async fn triangles(&self) -> Result<Vec<u32>, JsError> {
        self.download(self.live.triangles()).await
    }

    async fn download<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, JsError> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        let slice = staging.slice(..);
        js_future(|done| slice.map_async(wgpu::MapMode::Read, done)).await.map_err(fail)?;
        let bytes = slice.get_mapped_range().map_err(fail)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }
}

/// Waits for a callback of wgpu without blocking.
async fn js_future<T: 'static>(start: impl FnOnce(Box<dyn FnOnce(T) + Send>)) -> T
where
    T: Send,
{
    let shared = std::sync::Arc::new(std::sync::Mutex::new((None, None::<std::task::Waker>)));
    let sender = shared.clone();
    start(Box::new(move |value| {
        let mut slot = sender.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        slot.0 = Some(value);
        if let Some(waker) = slot.1.take() {
            waker.wake();
        }
    }));
    std::future::poll_fn(move |context| {
        let mut slot = shared.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match slot.0.take() {
            Some(value) => std::task::Poll::Ready(value),
            None => {
                slot.1 = Some(context.waker().clone());
                std::task::Poll::Pending
            }
        }
    })
    .await
}
