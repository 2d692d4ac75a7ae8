//! Reflective shadow maps and the plain gather.

use std::fmt::Display;
use std::time::Instant;

use indirect_accel::cast;
use indirect_core::{Image, SceneProfile};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{Context, GBufferTarget, PassTimer};
use rsm::{Form, Options, Params, Selection};

use super::params::Kind;
use super::shared::{self, milliseconds};
use super::{Backend, Bytes, Notes, Param, Pass, Renderer, Technique, Twin, Values};
use crate::failure::{Failure, Outcome};
use crate::stage::Stage;

/// The technique.
pub(crate) struct RsmGather;

const PARAMS: [Param; 5] = [
    Param {
        key: "resolution",
        default: "512",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "texels along each side of each map; higher: finer footprints, time and memory grow with the square",
    },
    Param {
        key: "select",
        default: "importance",
        kind: Kind::Choice(&["importance", "grid", "all"]),
        doc: "which texels become virtual point lights",
    },
    Param {
        key: "vpls",
        default: "1024",
        kind: Kind::Int { min: 1, max: 1 << 24 },
        doc: "lights drawn with select=importance, all maps together; higher: less noise, time grows in proportion",
    },
    Param {
        key: "cells",
        default: "32",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "cells along each side of each map with select=grid; higher: less bias, time grows with the square",
    },
    Param {
        key: "form",
        default: "disc",
        kind: Kind::Choice(&["disc", "point"]),
        doc: "a light is a small disc (bounded) or a point (bright spots near it)",
    },
];

/// The crate's options and parameters of a set of values.
pub(crate) fn options(values: &Values, seed: u32) -> (Options, Params) {
    let selection = match values.word("select") {
        "grid" => Selection::Grid { cells: values.int("cells") },
        "all" => Selection::All,
        _ => Selection::Importance { count: values.int("vpls") },
    };
    let form = if values.word("form") == "point" { Form::Point } else { Form::Disc };
    (Options { resolution: values.int("resolution"), selection }, Params { form, seed })
}

impl Technique for RsmGather {
    fn name(&self) -> &'static str {
        "rsm-gather"
    }

    fn summary(&self) -> &'static str {
        "one bounce of punctual lights, gathered from reflective shadow maps without indirect visibility \
         (Dachsbacher & Stamminger 2005)"
    }

    fn params(&self) -> &'static [Param] {
        &PARAMS
    }

    fn backends(&self) -> &'static [Backend] {
        &[Backend::Cpu, Backend::Gpu]
    }

    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>> {
        let curve = |pairs: &dyn Fn(u32) -> Vec<String>, numbers: &[u32]| {
            numbers.iter().map(|n| pairs(*n)).collect::<Vec<_>>()
        };
        let vpls: &[u32] = if quick { &[16, 64, 256, 1024] } else { &[16, 64, 256, 1024, 4096] };
        let cells: &[u32] = if quick { &[4, 8, 16, 32] } else { &[4, 8, 16, 32, 64] };
        let importance = |n| vec!["resolution=256".to_owned(), format!("vpls={n}")];
        let grid = |n| vec!["resolution=256".to_owned(), "select=grid".to_owned(), format!("cells={n}")];
        vec![curve(&importance, vpls), curve(&grid, cells)]
    }

    fn notes(&self, profile: &SceneProfile) -> Notes {
        let mut notes = shared::light_notes(profile);
        if profile.punctual_lights() > 0 {
            notes
                .skipped
                .push("visibility of the first bounce: light passes through what stands between".into());
            notes.skipped.push("second and later bounces".into());
        }
        notes
    }

    fn largest_buffer(&self, profile: &SceneProfile, size: [u32; 2], values: &Values) -> u64 {
        let texels = u64::from(values.int("resolution")).pow(2);
        let maps = shared::most_maps(profile);
        let vpls = match values.word("select") {
            "all" => maps * texels,
            "grid" => maps * u64::from(values.int("cells")).pow(2),
            _ => u64::from(values.int("vpls")),
        };
        let vpls = vpls * size_of::<rsm::Vpl>() as u64;
        shared::largest_rsm_buffer(values.int("resolution")).max(vpls).max(shared::image_buffer(size))
    }

    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        // All three selections and both forms; the passes before the selection are the same each time.
        let settings: [(&str, &[&str]); 3] = [
            ("", &["resolution=128"]),
            ("grid: ", &["resolution=64", "select=grid", "cells=16", "form=point"]),
            ("all: ", &["resolution=32", "select=all"]),
        ];
        let mut twins = Vec::new();
        for (prefix, pairs) in settings {
            let values = Values::parse(self.name(), &PARAMS, pairs)?;
            let found = Gpu::new(stage, &values, 1)?.twins(stage)?;
            let selected = ["vpls", "compact", "gather", "shade"];
            let keep = |t: &Twin| prefix.is_empty() || selected.contains(&t.pass.as_str());
            twins.extend(
                found.into_iter().filter(keep).map(|t| Twin { buffer: format!("{prefix}{}", t.buffer), ..t }),
            );
        }
        Ok(twins)
    }

    fn prepare(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer>> {
        Ok(match backend {
            Backend::Cpu => Box::new(Cpu::new(stage, values, seed)),
            Backend::Gpu => Box::new(Gpu::new(stage, values, seed)?),
        })
    }
}

fn failure(stage: &Stage<'_>, error: &dyn Display) -> Failure {
    shared::failure(stage, "rsm-gather", error)
}

struct Cpu {
    options: Options,
    params: Params,
    /// Of the last frame.
    image: Image,
    passes: Vec<Pass>,
    bytes: u64,
}

impl Cpu {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Self {
        let (options, params) = options(values, seed);
        Self { options, params, image: Image::new(stage.size), passes: Vec::new(), bytes: 0 }
    }
}

impl Renderer for Cpu {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let start = Instant::now();
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        let camera_ms = milliseconds(start);
        let output = rsm::cpu::indirect(&stage.accel, &camera, &self.options, &self.params)
            .map_err(|e| failure(stage, &e))?;
        let ms = milliseconds(start);
        // Index and irradiance per pixel that sees something.
        let pixels = shared::camera_bytes(&camera) + output.irradiance.len() * (4 + 12);
        let vpls = (output.slots.len() + output.vpls.len()) * size_of::<rsm::Vpl>();
        self.bytes = (output.rsm.bytes() + pixels + vpls) as u64;
        self.passes = vec![Pass { name: "camera".into(), ms: camera_ms }];
        self.passes.extend(output.passes.iter().map(|p| Pass { name: p.name.to_owned(), ms: p.ms }));
        self.image = output.image;
        Ok(ms)
    }

    fn image(&mut self) -> Outcome<Image> {
        Ok(self.image.clone())
    }

    fn passes(&mut self, _stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        Ok(self.passes.clone())
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: self.bytes, gpu: 0 }
    }
}

struct Gpu {
    context: Context,
    options: Options,
    params: Params,
    rsm: rsm::gpu::Rsm,
    resources: rsm::gpu::Resources,
    camera: GBufferTarget,
}

impl Gpu {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let context = stage.gpu()?.context.clone();
        let device = &context.device;
        let (options, params) = options(values, seed);
        let camera = GBufferTarget::new(device, stage.size, 1).map_err(|e| failure(stage, &e))?;
        let rsm = rsm::gpu::Rsm::new(device, &options).map_err(|e| failure(stage, &e))?;
        let maps = rsm::views::views(stage.scene).len();
        let resources = rsm.resources(device, maps, &camera).map_err(|e| failure(stage, &e))?;
        Ok(Self { context, options, params, rsm, resources, camera })
    }

    /// Everything of a frame, from the scene's lights to the image. Two timers: both the camera and the maps have the passes
    /// `visibility` and `resolve`.
    fn render(&mut self, stage: &Stage<'_>, camera_timer: &mut PassTimer, timer: &mut PassTimer) -> Outcome {
        let Context { device, queue, .. } = &self.context;
        let views = rsm::views::views(stage.scene);
        let failed = |e: rsm::Error| failure(stage, &e);
        self.resources.prepare(queue, &stage.scene.lights, &views, &self.params).map_err(failed)?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let crate::gpu::Gpu { raster, scene, .. } = stage.gpu()?;
        raster
            .encode(&mut encoder, camera_timer, scene, &stage.view, &self.camera, 0)
            .map_err(|e| failure(stage, &e))?;
        self.rsm.encode(&mut encoder, timer, scene, &self.resources).map_err(failed)?;
        queue.submit([encoder.finish()]);
        device.poll(PollType::wait_indefinitely()).map_err(|e| failure(stage, &e))?;
        Ok(())
    }

    fn twins(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        self.render(stage, &mut PassTimer::off(), &mut PassTimer::off())?;
        let Context { device, queue, .. } = &self.context;
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        let seen = self.camera.read(device, queue).map_err(|e| failure(stage, &e))?;
        let mut twins = shared::camera_twins(&camera, &seen[0]);
        let expected = rsm::cpu::indirect(&stage.accel, &camera, &self.options, &self.params)
            .map_err(|e| failure(stage, &e))?;
        let found = rsm::gpu::twins(
            (device, queue),
            &self.rsm,
            &self.resources,
            &stage.gpu()?.scene,
            &camera,
            &self.camera,
            &expected,
        )
        .map_err(|e| failure(stage, &e))?;
        twins.extend(shared::rsm_twins(&found));
        Ok(twins)
    }
}

impl Renderer for Gpu {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let start = Instant::now();
        self.render(stage, &mut PassTimer::off(), &mut PassTimer::off())?;
        Ok(milliseconds(start))
    }

    fn image(&mut self) -> Outcome<Image> {
        shared::read_image(&self.context, &self.resources.image, self.camera.size())
    }

    fn passes(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        let gpu = stage.gpu()?;
        let (mut camera, mut rest) = (gpu.timer(), gpu.timer());
        self.render(stage, &mut camera, &mut rest)?;
        shared::passes(stage, camera, rest)
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: 0, gpu: self.resources.bytes() + self.camera.bytes() }
    }
}
