//! The renderers of any technique: on the CPU, on the GPU, and with each pass where one likes.

use std::time::Instant;

use indirect_accel::cast;
use indirect_core::{Image, PassTime};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{Context, GBufferTarget, PassTimer, Vec3Pad};
use indirect_technique::Frame;
use indirect_technique::cpu::{Fit, run};
use indirect_technique::gpu::{
    Backend as Place, GpuTechnique, Inputs, Resources, Twin, camera_twins, run_both,
};

use super::diagram;
use super::model::{Backend, Bytes, Pass, Renderer};
use super::settings::Values;
use crate::failure::{Failure, Outcome};
use crate::stage::Stage;

/// The setup of a technique for a stage.
pub(super) fn setup<T: Fit>(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<T::Setup> {
    use indirect_core::settings::Settings;
    let failed = |e: &dyn std::fmt::Display| failure::<T>(stage, e);
    let (options, mut params) = values.settings::<T>(&stage.profile).map_err(|e| failed(&e))?;
    if T::Params::key("seed").is_some() && params.get("seed") == T::Params::default().get("seed") {
        params.set("seed", &seed.to_string()).map_err(|e| failed(&e))?;
    }
    T::fit(&stage.accel, options, params).map_err(|e| failed(&e))
}

fn failure<T: indirect_technique::Technique>(stage: &Stage<'_>, error: &dyn std::fmt::Display) -> Failure {
    Failure::Input(format!("{}: {}: {error}", stage.file, T::NAME))
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn passes(times: &[PassTime]) -> Vec<Pass> {
    times.iter().map(|p| Pass { name: p.name.to_owned(), ms: p.ms }).collect()
}

/// Plain Rust.
pub(super) struct Cpu<T: Fit> {
    setup: T::Setup,
    /// Of the last frame.
    output: T::Output,
    passes: Vec<PassTime>,
    bytes: u64,
}

impl<T: Fit> Cpu<T> {
    pub(super) fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let setup = setup::<T>(stage, values, seed)?;
        Ok(Self { setup, output: T::Output::default(), passes: Vec::new(), bytes: 0 })
    }
}

impl<T: Fit> Renderer for Cpu<T> {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let start = Instant::now();
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        self.passes = vec![PassTime { name: "camera", ms: milliseconds(start) }];
        T::refit(&mut self.setup, &stage.accel);
        let frame = Frame::new(&stage.accel, &stage.view, &camera, &self.setup);
        self.passes.extend(run::<T>(&frame, &mut self.output));
        let ms = milliseconds(start);
        self.bytes = T::output_bytes(&self.output) + camera.bytes() as u64;
        Ok(ms)
    }

    fn image(&mut self) -> Outcome<Image> {
        Ok(T::image(&self.output).clone())
    }

    fn passes(&mut self, _stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        Ok(passes(&self.passes))
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: self.bytes, gpu: 0 }
    }
}

/// wgpu.
pub(super) struct Gpu<T: Fit + GpuTechnique> {
    context: Context,
    setup: T::Setup,
    resources: Resources<T>,
    camera: GBufferTarget,
}

impl<T: Fit + GpuTechnique> Gpu<T> {
    pub(super) fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let gpu = stage.gpu()?;
        let Context { device, queue, .. } = &gpu.device.context;
        let setup = setup::<T>(stage, values, seed)?;
        let camera = GBufferTarget::new(device, stage.size).map_err(|e| failure::<T>(stage, &e))?;
        let maps = rsm::views::views(stage.scene).len();
        let resources = Resources::new(&gpu.device.pipelines, queue, &setup, maps, &camera)
            .map_err(|e| failure::<T>(stage, &e))?;
        Ok(Self { context: gpu.device.context.clone(), setup, resources, camera })
    }

    fn prepare(&mut self, stage: &Stage<'_>) -> Outcome {
        T::refit(&mut self.setup, &stage.accel);
        let views = rsm::views::views(stage.scene);
        let inputs = Inputs { lights: &stage.scene.lights, views: &views, camera: &stage.view };
        self.camera.prepare(&self.context.queue, &stage.view);
        self.resources.prepare(&self.context.queue, &inputs, &self.setup).map_err(|e| failure::<T>(stage, &e))
    }

    /// Everything of a frame, from the scene's lights to the image.
    fn render(&mut self, stage: &Stage<'_>, timer: &mut PassTimer) -> Outcome {
        self.prepare(stage)?;
        let Context { device, queue, .. } = &self.context;
        let crate::gpu::Gpu { device: gpu, scene } = stage.gpu()?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        gpu.pipelines.raster().encode(&mut encoder, timer, "camera", scene, [&self.camera]);
        self.resources.encode(&mut encoder, timer, scene);
        queue.submit([encoder.finish()]);
        device.poll(PollType::wait_indefinitely()).map_err(|e| failure::<T>(stage, &e))?;
        Ok(())
    }

    /// Every pass on both backends, see [`run_both`].
    fn both(&mut self, stage: &Stage<'_>, keep: impl Fn(&str) -> Place) -> Outcome<(T::Output, Vec<Twin>)> {
        self.render(stage, &mut PassTimer::off())?;
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        let Context { device, queue, .. } = &self.context;
        let failed = |e| failure::<T>(stage, &e);
        let mut twins = camera_twins((device, queue), &camera, &self.camera).map_err(failed)?;
        let frame = Frame::new(&stage.accel, &stage.view, &camera, &self.setup);
        let scene = &stage.gpu()?.scene;
        let (output, found) =
            run_both((device, queue), &frame, &self.resources, scene, keep).map_err(failed)?;
        twins.extend(found);
        Ok((output, twins))
    }

    /// The passes of these settings and the buffers between them, as a mermaid graph.
    pub(super) fn diagram(&self) -> String {
        diagram::of(self.resources.passes(), &self.camera)
    }

    /// All buffers beside their twins.
    pub(super) fn twins(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        Ok(self.both(stage, |_| Place::Cpu)?.1)
    }
}

impl<T: Fit + GpuTechnique> Renderer for Gpu<T> {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let start = Instant::now();
        self.render(stage, &mut PassTimer::off())?;
        Ok(milliseconds(start))
    }

    fn image(&mut self) -> Outcome<Image> {
        let pixels = self.context.read::<Vec3Pad>(self.resources.image());
        let pixels = pixels.map_err(|e| Failure::Check(format!("{}: {e}", self.context.info.name)))?;
        Ok(Image { size: self.camera.size(), pixels: pixels.iter().map(|v| v.vec3()).collect() })
    }

    fn passes(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        let mut timer = stage.gpu()?.device.timer();
        self.render(stage, &mut timer)?;
        Ok(passes(&timer.finish().map_err(|e| failure::<T>(stage, &e))?))
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: 0, gpu: self.resources.bytes() + self.camera.bytes() }
    }
}

/// Each pass where one likes, to find the one that spoils an image: both backends run all of them.
pub(super) struct Mixed<T: Fit + GpuTechnique> {
    gpu: Gpu<T>,
    others: Backend,
    choices: Vec<(String, Backend)>,
    image: Image,
}

impl<T: Fit + GpuTechnique> Mixed<T> {
    /// Passes that `choices` does not name run on `others`.
    pub(super) fn new(
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        others: Backend,
        choices: &[(String, Backend)],
    ) -> Outcome<Self> {
        let gpu = Gpu::<T>::new(stage, values, seed)?;
        let names: Vec<_> = gpu.resources.passes().map(indirect_gpu::Pass::name).collect();
        if let Some((unknown, _)) = choices.iter().find(|(name, _)| !names.contains(&name.as_str())) {
            let known = names.join(", ");
            return Err(Failure::Input(format!(
                "--set-backend {unknown}: no such pass; these settings have {known}"
            )));
        }
        Ok(Self { gpu, others, choices: choices.to_vec(), image: Image::new(stage.size) })
    }
}

impl<T: Fit + GpuTechnique> Renderer for Mixed<T> {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let start = Instant::now();
        let place = |pass: &str| {
            let chosen = self.choices.iter().find(|(name, _)| name == pass);
            match chosen.map_or(self.others, |(_, backend)| *backend) {
                Backend::Cpu => Place::Cpu,
                Backend::Gpu => Place::Gpu,
            }
        };
        let (output, _) = self.gpu.both(stage, place)?;
        self.image = T::image(&output).clone();
        Ok(milliseconds(start))
    }

    fn image(&mut self) -> Outcome<Image> {
        Ok(self.image.clone())
    }

    fn passes(&mut self, _stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        Ok(Vec::new())
    }

    fn bytes(&self) -> Bytes {
        self.gpu.bytes()
    }
}
