//! Reflective shadow maps and the plain gather.

use std::fmt::Display;
use std::time::Instant;

use glam::Vec3;
use indirect_accel::cast;
use indirect_core::{GBuffer, Image, SceneProfile};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{Context, GBufferTarget, PassTimer, Vec3Pad};
use rsm::{Form, Options, Params, Selection};

use super::params::Kind;
use super::{Backend, Bytes, Data, Notes, Param, Pass, Renderer, Technique, Twin, Values};
use crate::failure::{Failure, Outcome};
use crate::setup;
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
        let mut notes = Notes::default();
        let maps = [
            (profile.directional_lights, "directional", "one orthographic map each"),
            (profile.spot_lights, "spot", "one perspective map each, five beyond 60°"),
            (profile.point_lights, "point", "six cube faces each"),
        ];
        for (count, kind, how) in maps.into_iter().filter(|(count, ..)| *count > 0) {
            notes.modelled.push(format!("first bounce of {count} {kind} light{}: {how}", plural(count)));
        }
        if profile.punctual_lights() == 0 {
            notes.skipped.push(
                "EVERYTHING: there is no punctual light, and emissive surfaces have no shadow map: the indirect \
                 light is black"
                    .into(),
            );
        } else {
            if profile.emissive_triangles > 0 {
                notes.skipped.push(format!(
                    "indirect light of {} emissive triangle{}: a shadow map needs a punctual light",
                    profile.emissive_triangles,
                    plural(profile.emissive_triangles)
                ));
            }
            notes
                .skipped
                .push("visibility of the first bounce: light passes through what stands between".into());
            notes.skipped.push("second and later bounces".into());
        }
        if profile.textured {
            notes.modelled.push("textured albedo, at camera and at light texels".into());
        }
        if profile.alpha_masked {
            notes.modelled.push("alpha masks, in camera and light views".into());
        }
        if profile.glossy_triangles > 0 {
            notes.skipped.push(format!(
                "gloss of {} triangle{}: all surfaces reflect diffusely",
                profile.glossy_triangles,
                plural(profile.glossy_triangles)
            ));
        }
        notes
    }

    fn largest_buffer(&self, profile: &SceneProfile, values: &Values) -> u64 {
        let texels = u64::from(values.int("resolution")).pow(2);
        // A pyramid is a third larger than its map. A point light has six maps; a wide spot light may have five.
        let maps = (profile.directional_lights + 6 * (profile.spot_lights + profile.point_lights)) as u64;
        let vpls = match values.word("select") {
            "all" => maps * texels,
            "grid" => maps * u64::from(values.int("cells")).pow(2),
            _ => u64::from(values.int("vpls")),
        };
        (texels * size_of::<rsm::layout::Node>() as u64 * 4 / 3).max(vpls * size_of::<rsm::Vpl>() as u64)
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
            let found = Gpu::new(stage, &values, 1)?.twins()?;
            let selected = ["vpls", "compact", "gather", "shade"];
            let keep = |t: &Twin| prefix.is_empty() || selected.contains(&t.pass.as_str());
            twins.extend(
                found.into_iter().filter(keep).map(|t| Twin { buffer: format!("{prefix}{}", t.buffer), ..t }),
            );
        }
        Ok(twins)
    }

    fn prepare<'a>(
        &self,
        stage: &'a Stage<'a>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer + 'a>> {
        Ok(match backend {
            Backend::Cpu => Box::new(Cpu::new(stage, values, seed)),
            Backend::Gpu => Box::new(Gpu::new(stage, values, seed)?),
        })
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn failure(stage: &Stage<'_>, error: &dyn Display) -> Failure {
    Failure::Input(format!("{}: rsm-gather: {error}", stage.file))
}

struct Cpu<'a> {
    stage: &'a Stage<'a>,
    options: Options,
    params: Params,
    /// Of the last frame.
    image: Image,
    passes: Vec<Pass>,
    bytes: u64,
}

impl<'a> Cpu<'a> {
    fn new(stage: &'a Stage<'a>, values: &Values, seed: u32) -> Self {
        let (options, params) = options(values, seed);
        Self { stage, options, params, image: Image::new(stage.size), passes: Vec::new(), bytes: 0 }
    }
}

impl Renderer for Cpu<'_> {
    fn frame(&mut self) -> Outcome<f64> {
        let Stage { accel, view, size, .. } = self.stage;
        let start = Instant::now();
        let camera = cast::gbuffer(accel, view, *size);
        let camera_ms = milliseconds(start);
        let output = rsm::cpu::indirect(accel, &camera, &self.options, &self.params)
            .map_err(|e| failure(self.stage, &e))?;
        let ms = milliseconds(start);
        // Triangle, depth, position, normal and albedo per pixel; index and irradiance per pixel that sees something.
        let pixels = camera.len() * (4 + 4 + 3 * 12) + output.irradiance.len() * (4 + 12);
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

    fn passes(&mut self) -> Outcome<Vec<Pass>> {
        Ok(self.passes.clone())
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: self.bytes, gpu: 0 }
    }
}

struct Gpu<'a> {
    stage: &'a Stage<'a>,
    gpu: &'a crate::gpu::Gpu,
    options: Options,
    params: Params,
    rsm: rsm::gpu::Rsm,
    resources: rsm::gpu::Resources,
    camera: GBufferTarget,
}

impl<'a> Gpu<'a> {
    fn new(stage: &'a Stage<'a>, values: &Values, seed: u32) -> Outcome<Self> {
        let gpu = stage.gpu.as_ref().ok_or_else(|| Failure::Check(setup::NO_ADAPTER.into()))?;
        let device = &gpu.context.device;
        let (options, params) = options(values, seed);
        let camera = GBufferTarget::new(device, stage.size, 1).map_err(|e| failure(stage, &e))?;
        let rsm = rsm::gpu::Rsm::new(device, &options).map_err(|e| failure(stage, &e))?;
        let maps = rsm::views::views(stage.scene).len();
        let resources = rsm.resources(device, maps, &camera).map_err(|e| failure(stage, &e))?;
        Ok(Self { stage, gpu, options, params, rsm, resources, camera })
    }

    /// Everything of a frame, from the scene's lights to the image. Two timers: both the camera and the maps have the passes
    /// `visibility` and `resolve`.
    fn render(&mut self, camera_timer: &mut PassTimer, timer: &mut PassTimer) -> Outcome {
        let Context { device, queue, .. } = &self.gpu.context;
        let views = rsm::views::views(self.stage.scene);
        let failed = |e: rsm::Error| failure(self.stage, &e);
        self.resources.prepare(queue, &self.stage.scene.lights, &views, &self.params).map_err(failed)?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let crate::gpu::Gpu { raster, scene, .. } = self.gpu;
        raster
            .encode(&mut encoder, camera_timer, scene, &self.stage.view, &self.camera, 0)
            .map_err(|e| failure(self.stage, &e))?;
        self.rsm.encode(&mut encoder, timer, scene, &self.resources).map_err(failed)?;
        queue.submit([encoder.finish()]);
        device.poll(PollType::wait_indefinitely()).map_err(|e| failure(self.stage, &e))?;
        Ok(())
    }

    fn twins(&mut self) -> Outcome<Vec<Twin>> {
        self.render(&mut PassTimer::off(), &mut PassTimer::off())?;
        let Stage { accel, view, size, .. } = self.stage;
        let Context { device, queue, .. } = &self.gpu.context;
        let camera = cast::gbuffer(accel, view, *size);
        let seen = self.camera.read(device, queue).map_err(|e| failure(self.stage, &e))?;
        let mut twins = camera_twins(&camera, &seen[0]);
        let expected = rsm::cpu::indirect(accel, &camera, &self.options, &self.params)
            .map_err(|e| failure(self.stage, &e))?;
        let found = rsm::gpu::twins(
            (device, queue),
            &self.rsm,
            &self.resources,
            &self.gpu.scene,
            &camera,
            &self.camera,
            &expected,
        )
        .map_err(|e| failure(self.stage, &e))?;
        // The triangles of a map tell which of its texels are silhouettes.
        let triangles = |map: Option<usize>| {
            found.iter().find_map(|t| match (&t.cpu, &t.gpu) {
                (rsm::gpu::Data::U32(c), rsm::gpu::Data::U32(g)) if t.pass == "surface" && t.map == map => {
                    Some(c.iter().zip(g).map(|(c, g)| c == g).collect::<Vec<_>>())
                }
                _ => None,
            })
        };
        let data = |d: &rsm::gpu::Data| match d {
            rsm::gpu::Data::F32 { values, components } => Data::Floats(values.clone(), *components),
            rsm::gpu::Data::U32(values) => Data::Ints(values.clone()),
        };
        for t in found.iter().filter(|t| !(t.pass == "surface" && t.buffer == "triangle")) {
            let map = t.map.map_or_else(String::new, |m| format!("map {m} "));
            twins.push(Twin {
                pass: t.pass.to_owned(),
                buffer: format!("{map}{}", t.buffer),
                cpu: data(&t.cpu),
                gpu: data(&t.gpu),
                same_triangle: if t.pass == "surface" { triangles(t.map) } else { None },
            });
        }
        Ok(twins)
    }
}

impl Renderer for Gpu<'_> {
    fn frame(&mut self) -> Outcome<f64> {
        let start = Instant::now();
        self.render(&mut PassTimer::off(), &mut PassTimer::off())?;
        Ok(milliseconds(start))
    }

    fn image(&mut self) -> Outcome<Image> {
        let image = self.gpu.context.read::<Vec3Pad>(&self.resources.image);
        let image = image.map_err(|e| failure(self.stage, &e))?;
        Ok(Image { size: self.stage.size, pixels: image.iter().map(|v| v.vec3()).collect() })
    }

    fn passes(&mut self) -> Outcome<Vec<Pass>> {
        let (mut camera, mut rest) = (self.gpu.timer(), self.gpu.timer());
        self.render(&mut camera, &mut rest)?;
        let finish = |timer: &mut PassTimer| timer.finish().map_err(|e| failure(self.stage, &e));
        let camera_ms = finish(&mut camera)?.iter().map(|p| p.ms).sum();
        let mut passes = vec![Pass { name: "camera".into(), ms: camera_ms }];
        // The passes of all maps together.
        for p in finish(&mut rest)? {
            match passes.iter_mut().find(|q| q.name == p.name) {
                Some(q) => q.ms += p.ms,
                None => passes.push(Pass { name: p.name, ms: p.ms }),
            }
        }
        Ok(passes)
    }

    fn bytes(&self) -> Bytes {
        Bytes { cpu: 0, gpu: self.resources.bytes() + self.camera.bytes() }
    }
}

/// What the camera sees, from both backends.
fn camera_twins(cpu: &GBuffer, gpu: &GBuffer) -> Vec<Twin> {
    let same: Vec<bool> = cpu.triangle.iter().zip(&gpu.triangle).map(|(c, g)| c == g).collect();
    let vectors = |v: &[Vec3]| Data::Floats(v.iter().flat_map(|v| v.to_array()).collect(), 3);
    let twin = |buffer: &str, cpu, gpu| Twin {
        pass: "camera".into(),
        buffer: buffer.into(),
        cpu,
        gpu,
        same_triangle: Some(same.clone()),
    };
    vec![
        twin("depth", Data::Floats(cpu.depth.clone(), 1), Data::Floats(gpu.depth.clone(), 1)),
        twin("position", vectors(&cpu.position), vectors(&gpu.position)),
        twin("normal", vectors(&cpu.normal), vectors(&gpu.normal)),
        twin("albedo", vectors(&cpu.albedo), vectors(&gpu.albedo)),
    ]
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
