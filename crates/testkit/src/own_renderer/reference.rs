//! What the workspace's own raster makes of the same frames.

use std::error::Error;

use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Image, MapView, Scene};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, Device, Queue};
use indirect_gpu::{GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad, read_buffer};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Inputs, Resources};

use super::frame::{Frame, SIZE};

/// The indirect light of `frames` frames, W/(sr·m²), drawn by the technique's own raster from triangles that are uploaded
/// whole each frame. `views` are the maps of a scene's lights.
///
/// # Errors
/// Whatever the technique says.
pub fn pictures<T: GpuTechnique<Error: 'static> + Fit>(
    device: &Device,
    queue: &Queue,
    frames: u32,
    (options, params): (T::Options, T::Params),
    views: impl Fn(&Scene) -> Vec<MapView>,
) -> Result<Vec<Image>, Box<dyn Error>> {
    let mut images = Vec::new();
    let pipelines = Pipelines::new(device);
    let camera = GBufferTarget::new(device, SIZE)?;
    let first = Frame::new(0).scene();
    let mut setup = T::fit(&Accel::build(&first, BuildPreset::Fast), options, params)?;
    let maps = views(&first).len();
    let mut resources = Resources::<T>::new(&pipelines, queue, &setup, maps, &camera)?;
    for number in 0..frames {
        let frame = Frame::new(number);
        let scene = frame.scene();
        T::refit(&mut setup, &Accel::build(&scene, BuildPreset::Fast));
        let buffers = SceneBuffers::upload(device, &scene)?;
        let view = frame.view();
        camera.prepare(queue, &view);
        let inputs = Inputs { lights: &scene.lights, views: &views(&scene), camera: &view };
        resources.prepare(queue, &inputs, &setup)?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let timer = &mut PassTimer::off();
        pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&camera]);
        resources.encode(&mut encoder, timer, &buffers);
        queue.submit([encoder.finish()]);
        let pixels: Vec<Vec3Pad> = read_buffer(device, queue, resources.image())?;
        images.push(Image { size: SIZE, pixels: pixels.iter().map(|p| p.vec3()).collect() });
    }
    Ok(images)
}
