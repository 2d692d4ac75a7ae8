//! Hierarchical image-space radiosity.

use std::fmt::Display;
use std::time::Instant;

use image_space_radiosity::gpu::{ImageSpaceRadiosity as Pipelines, Resources};
use image_space_radiosity::{Block, Bound, Branch, Lights, Method, Options, Params, Patch, Thresholds, cpu};
use indirect_accel::cast;
use indirect_core::{Image, SceneProfile};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{Context, GBufferTarget, PassTimer};
use rsm::{Form, Selection};

use super::params::Kind;
use super::shared::{self, milliseconds};
use super::{Backend, Bytes, Notes, Param, Pass, Renderer, Technique, Twin, Values};
use crate::failure::{Failure, Outcome};
use crate::stage::Stage;

/// The technique.
pub(crate) struct ImageSpaceRadiosity;

const PARAMS: [Param; 19] = [
    Param {
        key: "resolution",
        default: "256",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "texels along each side of each map; higher: finer footprints, time and memory grow with the square",
    },
    Param {
        key: "lights",
        default: "hierarchical",
        kind: Kind::Choice(&["hierarchical", "basic", "flat"]),
        doc: "each tile its own cut, one list of clusters, or one list of texels",
    },
    Param {
        key: "tau",
        default: "0.003",
        kind: Kind::Number { min: 0.0, max: 1e6 },
        doc: "error of a patch above which it is split, lights=hierarchical; higher: fewer lights, less exact",
    },
    Param {
        key: "bound",
        default: "error",
        kind: Kind::Choice(&["error", "contribution"]),
        doc: "what tau bounds: a patch's error, or its light as the paper prints",
    },
    Param {
        key: "coarsest",
        default: "16",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "coarsest patches, so many along each side of a map",
    },
    Param {
        key: "finest",
        default: "8192",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "finest patches, likewise, no finer than the map; at least `coarsest`",
    },
    Param {
        key: "patch_depth",
        default: "0.2",
        kind: Kind::Number { min: 0.0, max: 1e6 },
        doc: "relief of a patch, in radii, above which it is split, lights=basic",
    },
    Param {
        key: "patch_normal",
        default: "0.3",
        kind: Kind::Number { min: 0.0, max: 10.0 },
        doc: "half angle of its cone of normals, radians, likewise",
    },
    Param {
        key: "select",
        default: "grid",
        kind: Kind::Choice(&["grid", "importance", "all"]),
        doc: "which texels become lights, lights=flat",
    },
    Param {
        key: "cells",
        default: "16",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "cells along each side of each map, select=grid",
    },
    Param {
        key: "vpls",
        default: "1024",
        kind: Kind::Int { min: 1, max: 1 << 24 },
        doc: "lights drawn, select=importance",
    },
    Param {
        key: "block",
        default: "6",
        kind: Kind::Int { min: 0, max: 8 },
        doc: "coarsest blocks of pixels, 2^block along each side; 0 gathers at every pixel",
    },
    Param {
        key: "depth",
        default: "0.05",
        kind: Kind::Number { min: 0.0, max: 1e6 },
        doc: "relative depth range above which a block is split; higher: fewer fragments, less exact",
    },
    Param {
        key: "normal",
        default: "0.3",
        kind: Kind::Number { min: 0.0, max: 10.0 },
        doc: "half angle of its cone of normals, radians, likewise",
    },
    Param {
        key: "margin",
        default: "3",
        kind: Kind::Number { min: 0.0, max: 1e6 },
        doc: "distance, in radii, to what rises beside a block and splits it too; 0: the block alone",
    },
    Param {
        key: "bend",
        default: "0.003",
        kind: Kind::Number { min: 0.0, max: 1e9 },
        doc: "share of the light that may bend across a block before it is split; 1e9: as the paper, any",
    },
    Param {
        key: "method",
        default: "gather",
        kind: Kind::Choice(&["gather", "splat", "bounded"]),
        doc: "how light gets to fragments; splats are the baselines, lights=flat|basic",
    },
    Param {
        key: "cutoff",
        default: "0.01",
        kind: Kind::Number { min: 1e-9, max: 1e6 },
        doc: "irradiance at which a splat ends, method=bounded; higher: faster and darker",
    },
    Param {
        key: "form",
        default: "disc",
        kind: Kind::Choice(&["disc", "point"]),
        doc: "a light is a small disc (bounded) or a point (bright spots near it)",
    },
];

/// The crate's options and parameters of a set of values.
fn options(values: &Values, seed: u32) -> (Options, Params) {
    let [coarsest, finest] = ["coarsest", "finest"].map(|key| values.int(key));
    let lights = match (values.word("lights"), values.word("select")) {
        ("basic", _) => Lights::Basic { coarsest, finest },
        ("hierarchical", _) => Lights::Hierarchical { coarsest, finest },
        (_, "all") => Lights::Flat(Selection::All),
        (_, "importance") => Lights::Flat(Selection::Importance { count: values.int("vpls") }),
        _ => Lights::Flat(Selection::Grid { cells: values.int("cells") }),
    };
    let method = match values.word("method") {
        "splat" => Method::Splat,
        "bounded" => Method::BoundedSplat,
        _ => Method::Gather,
    };
    let options =
        Options { resolution: values.int("resolution"), lights, method, coarsest_block: values.int("block") };
    let thresholds =
        |depth, normal| Thresholds { depth: values.number(depth), normal: values.number(normal) };
    let params = Params {
        form: if values.word("form") == "point" { Form::Point } else { Form::Disc },
        seed,
        blocks: thresholds("depth", "normal"),
        margin: values.number("margin"),
        bend: values.number("bend"),
        patches: thresholds("patch_depth", "patch_normal"),
        tau: values.number("tau"),
        bound: if values.word("bound") == "error" { Bound::Error } else { Bound::ContributionAsPrinted },
        cutoff: values.number("cutoff"),
    };
    (options, params)
}

impl Technique for ImageSpaceRadiosity {
    fn name(&self) -> &'static str {
        "image-space-radiosity"
    }

    fn summary(&self) -> &'static str {
        "one bounce of punctual lights at as many resolutions as camera and light need, without indirect visibility \
         (Nichols, Shopf & Wyman 2009)"
    }

    fn params(&self) -> &'static [Param] {
        &PARAMS
    }

    fn backends(&self) -> &'static [Backend] {
        &[Backend::Cpu, Backend::Gpu]
    }

    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>> {
        let set = |pairs: &[&str]| pairs.iter().map(|p| (*p).to_owned()).collect::<Vec<_>>();
        let eye: &[&str] = if quick {
            &["bend=0.03", "bend=0.003"]
        } else {
            &["bend=0.03", "bend=0.003", "bend=0.0003", "block=0"]
        };
        let taus: &[&str] = if quick {
            &["tau=1", "tau=0.1"]
        } else {
            &["tau=1", "tau=0.3", "tau=0.1", "tau=0.03", "tau=0.01", "tau=0.003"]
        };
        let mut curves: Vec<_> =
            eye.iter().map(|e| taus.iter().map(|t| set(&[e, t])).collect::<Vec<_>>()).collect();
        let cells: &[&str] =
            if quick { &["cells=16"] } else { &["cells=8", "cells=16", "cells=32", "cells=64"] };
        curves.push(cells.iter().map(|c| set(&["lights=flat", c])).collect());
        let clusters: &[&str] =
            if quick { &["finest=64"] } else { &["finest=32", "finest=64", "finest=128"] };
        curves.push(clusters.iter().map(|c| set(&["lights=basic", c])).collect());
        curves
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
        // Each pyramid is a third larger than its image, and all maps' patches are one buffer.
        let blocks = shared::image_buffer(size) / 16 * 4 / 3 * size_of::<Block>() as u64 + 4096;
        let texels = u64::from(values.int("resolution")).pow(2);
        let maps = shared::most_maps(profile);
        let node = size_of::<Patch>().max(size_of::<Branch>()).max(size_of::<Block>()) as u64;
        let patches = maps * (texels * 4 / 3 + 16) * node;
        let lights = match (values.word("lights"), values.word("select")) {
            ("flat", "importance") => u64::from(values.int("vpls")),
            _ => maps * (texels * 4 / 3 + 16),
        };
        // Rounded up to a whole chunk of the gather.
        let lights = (lights + 1024) * size_of::<rsm::Vpl>() as u64;
        shared::largest_rsm_buffer(values.int("resolution")).max(patches).max(lights).max(blocks)
    }

    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        let settings: [(&str, &[&str]); 5] = [
            ("", &["resolution=128"]),
            ("as printed: ", &["resolution=64", "bound=contribution", "margin=0", "form=point"]),
            ("basic: ", &["resolution=64", "lights=basic", "finest=32"]),
            ("splat: ", &["resolution=64", "lights=flat", "cells=8", "method=splat"]),
            ("bounded: ", &["resolution=64", "lights=flat", "cells=8", "method=bounded"]),
        ];
        let mut twins = Vec::new();
        for (prefix, pairs) in settings {
            let values = Values::parse(self.name(), &PARAMS, pairs)?;
            let found = Gpu::new(stage, &values, 1)?.twins(stage)?;
            // The camera is the same each time.
            let keep = |t: &Twin| prefix.is_empty() || t.pass != "camera";
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
    shared::failure(stage, "image-space-radiosity", error)
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
        let output = cpu::indirect(&stage.accel, &camera, &stage.view, &self.options, &self.params)
            .map_err(|e| failure(stage, &e))?;
        let ms = milliseconds(start);
        self.bytes = (shared::camera_bytes(&camera) + output.bytes()) as u64;
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
    technique: Pipelines,
    resources: Resources,
    camera: GBufferTarget,
}

impl Gpu {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let context = stage.gpu()?.context.clone();
        let device = &context.device;
        let (options, params) = options(values, seed);
        let camera = GBufferTarget::new(device, stage.size, 1).map_err(|e| failure(stage, &e))?;
        let technique = Pipelines::new(device, &options).map_err(|e| failure(stage, &e))?;
        let maps = rsm::views::views(stage.scene).len();
        let resources = Resources::new(device, &technique, maps, &camera).map_err(|e| failure(stage, &e))?;
        Ok(Self { context, options, params, technique, resources, camera })
    }

    /// Everything of a frame, from the scene's lights to the image. Two timers: both the camera and the maps have the passes
    /// `visibility` and `resolve`.
    fn render(&mut self, stage: &Stage<'_>, camera_timer: &mut PassTimer, timer: &mut PassTimer) -> Outcome {
        let Context { device, queue, .. } = &self.context;
        let views = rsm::views::views(stage.scene);
        let failed = |e: image_space_radiosity::Error| failure(stage, &e);
        self.resources
            .prepare(queue, &stage.scene.lights, &views, &stage.view, &self.params)
            .map_err(failed)?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let crate::gpu::Gpu { raster, scene, .. } = stage.gpu()?;
        raster
            .encode(&mut encoder, camera_timer, scene, &stage.view, &self.camera, 0)
            .map_err(|e| failure(stage, &e))?;
        self.technique.encode(&mut encoder, timer, scene, &self.resources).map_err(failed)?;
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
        let expected = cpu::indirect(&stage.accel, &camera, &stage.view, &self.options, &self.params)
            .map_err(|e| failure(stage, &e))?;
        let found = image_space_radiosity::gpu::twins(
            (device, queue),
            &self.technique,
            &self.resources,
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
