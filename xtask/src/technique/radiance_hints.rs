//! Radiance hints: a lattice that samples reflective shadow maps.

use std::fmt::Display;
use std::time::Instant;

use glam::Vec3;
use indirect_accel::cast;
use indirect_core::{Image, SceneProfile, View};
use indirect_gpu::wgpu::{Buffer, CommandEncoderDescriptor, PollType};
use indirect_gpu::{Context, GBufferTarget, Kernel, PassTimer, empty_storage_buffer, shaders, workgroups_1d};
use radiance_hints::gpu::{RadianceHints as Hints, Resources, Smooth, SmoothResources};
use radiance_hints::{
    Lattice, Options, Order, Params, Reconstruction, Sampling, Scale, Transport as Bounce, Visibility, cpu,
};

use super::params::Kind;
use super::shared::{self, milliseconds};
use super::{Backend, Bytes, Data, Notes, Param, Pass, Renderer, Technique, Transport, Twin, Values};
use crate::failure::Outcome;
use crate::stage::Stage;

const NAME: &str = "radiance-hints";

/// The technique.
pub(crate) struct RadianceHints;

const PARAMS: [Param; 17] = [
    Param {
        key: "resolution",
        default: "512",
        kind: Kind::Int { min: 1, max: 8192 },
        doc: "texels along each side of each map; higher: finer, time and memory grow with the square",
    },
    Param {
        key: "lattice",
        default: "16",
        kind: Kind::Int { min: 1, max: 128 },
        doc: "cube root of the most hints; the scene's extents share them out; higher: finer, time grows with the cube",
    },
    Param {
        key: "order",
        default: "3",
        kind: Kind::Int { min: 2, max: 3 },
        doc: "2: 4 coefficients a hint and channel; 3: 9, sharper in direction",
    },
    Param {
        key: "samples",
        default: "60",
        kind: Kind::Int { min: 1, max: 1024 },
        doc: "of all maps together per hint; higher: less noise, time grows in proportion",
    },
    Param {
        key: "sampling",
        default: "nearby",
        kind: Kind::Choice(&["nearby", "importance", "disc"]),
        doc: "texels by the flux they reflect, those near a hint one by one or not; or as printed: a disc around its projection",
    },
    Param {
        key: "disc",
        default: "0.9",
        kind: Kind::Number { min: 0.001, max: 1.0 },
        doc: "share of the map that the disc takes (c_RSM) with sampling=disc",
    },
    Param {
        key: "visibility",
        default: "rsm-depth",
        kind: Kind::Choice(&["off", "rsm-depth", "camera-depth"]),
        doc: "what blocks light: nothing as printed; the maps' depth, in all bounces; the camera's in the first (view-dependent)",
    },
    Param {
        key: "bounces",
        default: "3",
        kind: Kind::Int { min: 1, max: 64 },
        doc: "indirect bounces; 1 allocates no second volume",
    },
    Param {
        key: "bounce-samples",
        default: "32",
        kind: Kind::Int { min: 1, max: 1024 },
        doc: "of the field per hint and later bounce; higher: less noise, time grows in proportion",
    },
    Param {
        key: "transport",
        default: "directions",
        kind: Kind::Choice(&["directions", "sphere", "sphere-as-printed"]),
        doc: "later bounces: even directions to the border, or places in a sphere, corrected or as printed",
    },
    Param {
        key: "enclosure",
        default: "measured",
        kind: Kind::Choice(&["measured", "maps"]),
        doc: "albedo around the box: by 2048 rays once per scene, or what the maps alone tell",
    },
    Param {
        key: "range",
        default: "1",
        kind: Kind::Number { min: 0.01, max: 1.0 },
        doc: "farthest that a later bounce comes from, as a share of the box's diagonal",
    },
    Param {
        key: "jitter",
        default: "0",
        kind: Kind::Number { min: 0.0, max: 1.0 },
        doc: "share of the cell from which a hint looks; 1 is the paper's; lower: sharper",
    },
    Param {
        key: "footprint",
        default: "0.4",
        kind: Kind::Number { min: 0.0, max: 1.0 },
        doc: "share of a sample's area that bounds 1/d²; 0 is the paper's, unbounded",
    },
    Param {
        key: "reconstruct",
        default: "near-surface",
        kind: Kind::Choice(&["near-surface", "as-printed"]),
        doc: "where pixels read: extrapolated to their surface, or half to one and a half diagonals of a cell away",
    },
    Param {
        key: "scale",
        default: "full",
        kind: Kind::Choice(&["full", "half", "quarter"]),
        doc: "resolution at which pixels read the field; the rest is upsampled by depth and normal",
    },
    Param {
        key: "smoothing",
        default: "0",
        kind: Kind::Number { min: 0.0, max: 0.95 },
        doc: "share of the past in a frame, reprojected; the paper's is 0.5; higher: calmer, slower to follow",
    },
];

fn options(values: &Values) -> Options {
    Options {
        resolution: values.int("resolution"),
        order: if values.int("order") == 2 { Order::Two } else { Order::Three },
        samples: values.int("samples"),
        sampling: match values.word("sampling") {
            "disc" => Sampling::Disc { fraction: values.number("disc") },
            "importance" => Sampling::Importance,
            _ => Sampling::Nearby,
        },
        visibility: match values.word("visibility") {
            "rsm-depth" => Visibility::RsmDepth,
            "camera-depth" => Visibility::CameraDepth,
            _ => Visibility::Off,
        },
        bounces: values.int("bounces"),
        bounce_samples: values.int("bounce-samples"),
        scale: match values.word("scale") {
            "half" => Scale::Half,
            "quarter" => Scale::Quarter,
            _ => Scale::Full,
        },
    }
}

/// What is fixed from frame to frame in the harness.
struct Setup {
    options: Options,
    params: Params,
    lattice: Lattice,
    smoothing: f32,
}

impl Setup {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let failed = |e: radiance_hints::Error| failure(stage, &e);
        // A scene without extent has no light either: any box will do.
        let unit = indirect_core::Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let bounds = stage.scene.bounds().filter(|b| b.diagonal() > 0.0).unwrap_or(unit);
        let lattice = Lattice::fit(&bounds, values.int("lattice").pow(3)).map_err(failed)?;
        let measured = values.int("bounces") > 1 && values.word("enclosure") == "measured";
        let maps =
            rsm::cpu::generate(&stage.accel, &rsm::Options { resolution: 64, ..rsm::Options::default() })
                .map_err(|e| failure(stage, &e))?;
        let params = Params {
            seed,
            jitter: values.number("jitter"),
            footprint: values.number("footprint"),
            transport: match values.word("transport") {
                "sphere" => Bounce::Sphere,
                "sphere-as-printed" => Bounce::SphereAsPrinted,
                _ => Bounce::Directions,
            },
            enclosure: measured.then(|| cpu::enclosure(&stage.accel, &bounds, &maps)),
            range: values.number("range"),
            reconstruction: match values.word("reconstruct") {
                "as-printed" => Reconstruction::AsPrinted,
                _ => Reconstruction::NearSurface,
            },
        };
        let options = options(values);
        options.validate().and_then(|()| params.validate()).map_err(failed)?;
        Ok(Self { options, params, lattice, smoothing: values.number("smoothing") })
    }
}

impl Technique for RadianceHints {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "any number of bounces of punctual lights, by a lattice of spherical harmonics that samples reflective shadow \
         maps (Papaioannou 2011)"
    }

    fn params(&self) -> &'static [Param] {
        &PARAMS
    }

    fn backends(&self) -> &'static [Backend] {
        &[Backend::Cpu, Backend::Gpu]
    }

    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>> {
        let curve = |base: &[&str], key: &str, numbers: &[u32]| -> Vec<Vec<String>> {
            let of = |n: &u32| base.iter().map(|s| (*s).to_owned()).chain([format!("{key}={n}")]).collect();
            numbers.iter().map(of).collect()
        };
        let base = ["resolution=256"];
        let one = ["resolution=256", "bounces=1", "visibility=off"];
        let two = ["resolution=256", "order=2"];
        if quick {
            return vec![
                curve(&base, "lattice", &[8, 16, 32]),
                curve(&one, "lattice", &[8, 16]),
                curve(&one, "samples", &[12, 60, 200]),
                curve(&two, "lattice", &[8, 16]),
            ];
        }
        let half = ["resolution=256", "scale=half"];
        let lists = ["resolution=256", "bounces=1", "visibility=off", "sampling=importance"];
        let printed = [
            "resolution=256",
            "bounces=1",
            "visibility=off",
            "reconstruct=as-printed",
            "footprint=0",
            "jitter=1",
        ];
        vec![
            curve(&base, "lattice", &[8, 12, 16, 24, 32]),
            curve(&base, "samples", &[12, 30, 60, 200]),
            curve(&base, "bounces", &[1, 2, 3, 5]),
            curve(&one, "lattice", &[8, 12, 16, 24, 32]),
            curve(&one, "samples", &[12, 30, 60, 200]),
            curve(&lists, "samples", &[12, 30, 60, 200]),
            curve(&two, "lattice", &[8, 16, 32]),
            curve(&half, "lattice", &[8, 16, 32]),
            curve(&printed, "lattice", &[8, 16, 32]),
        ]
    }

    fn notes(&self, profile: &SceneProfile) -> Notes {
        let mut notes = shared::light_notes(profile);
        if profile.punctual_lights() > 0 {
            notes.modelled.push(
                "second and later bounces, from hint to hint, with the mean albedo around the box".into(),
            );
            notes
                .modelled
                .push("visibility of all bounces where a light's map sees what is in the way".into());
            notes.skipped.push("what blocks a bounce and no light sees".into());
            notes
                .skipped
                .push("where the surfaces of later bounces are: they count as the box's walls".into());
        }
        notes
    }

    fn transport(&self, values: &Values) -> Transport {
        Transport { bounces: values.int("bounces"), occluded: values.word("visibility") != "off" }
    }

    fn largest_buffer(&self, profile: &SceneProfile, size: [u32; 2], values: &Values) -> u64 {
        let (options, hints) = (options(values), values.int("lattice").pow(3));
        let lists = u64::from(options.sets(hints)) * u64::from(options.samples)
            + u64::from(hints) * u64::from(options.near());
        let hints = u64::from(hints) * u64::from(options.order.vectors()) * 16;
        let depths = shared::most_maps(profile) * u64::from(options.resolution).pow(2) * 4;
        let rsm = shared::largest_rsm_buffer(options.resolution);
        let lists = lists * size_of::<radiance_hints::Sample>() as u64;
        lists.max(hints).max(depths).max(rsm).max(shared::image_buffer(size))
    }

    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        let settings: [(&str, &[&str]); 3] = [
            ("", &["resolution=128", "lattice=9", "samples=30", "bounce-samples=16", "scale=half"]),
            (
                "disc: ",
                &[
                    "resolution=64",
                    "lattice=6",
                    "samples=20",
                    "sampling=disc",
                    "order=2",
                    "bounces=2",
                    "bounce-samples=9",
                    "transport=sphere",
                    "visibility=camera-depth",
                    "scale=quarter",
                ],
            ),
            (
                "printed: ",
                &[
                    "resolution=64",
                    "lattice=7",
                    "samples=12",
                    "sampling=importance",
                    "visibility=off",
                    "transport=sphere-as-printed",
                    "reconstruct=as-printed",
                    "footprint=0",
                    "jitter=1",
                ],
            ),
        ];
        let mut twins = Vec::new();
        for (prefix, pairs) in settings {
            let values = Values::parse(NAME, &PARAMS, pairs)?;
            let found = Gpu::new(stage, &values, 1)?.twins(stage, prefix.is_empty())?;
            twins.extend(found.into_iter().map(|t| Twin { buffer: format!("{prefix}{}", t.buffer), ..t }));
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
            Backend::Cpu => Box::new(Cpu::new(stage, values, seed)?),
            Backend::Gpu => Box::new(Gpu::new(stage, values, seed)?),
        })
    }
}

fn failure(stage: &Stage<'_>, error: &dyn Display) -> crate::failure::Failure {
    shared::failure(stage, NAME, error)
}

struct Cpu {
    setup: Setup,
    /// Of the last frame.
    image: Image,
    past: Option<Past>,
    passes: Vec<Pass>,
    bytes: u64,
}

/// What a smoothed frame leaves to the next.
struct Past {
    view: View,
    depth: Vec<f32>,
    irradiance: Vec<Vec3>,
}

impl Cpu {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let setup = Setup::new(stage, values, seed)?;
        Ok(Self { setup, image: Image::new(stage.size), past: None, passes: Vec::new(), bytes: 0 })
    }
}

impl Renderer for Cpu {
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64> {
        let Setup { options, params, lattice, smoothing } = &self.setup;
        let start = Instant::now();
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        let camera_ms = milliseconds(start);
        let mut output = cpu::indirect(&stage.accel, &stage.view, &camera, lattice, options, params)
            .map_err(|e| failure(stage, &e))?;
        self.passes = vec![Pass { name: "camera".into(), ms: camera_ms }];
        self.passes.extend(output.passes.iter().map(|p| Pass { name: p.name.to_owned(), ms: p.ms }));
        self.bytes = (output.bytes() + shared::camera_bytes(&camera)) as u64;
        if *smoothing > 0.0 {
            let begin = Instant::now();
            if let Some(Past { view, depth, irradiance }) = &self.past {
                let previous = cpu::Previous { view, size: stage.size, depth, irradiance };
                output.irradiance = cpu::smooth(&output.irradiance, &camera, &previous, *smoothing);
                output.image = cpu::shade(&camera, &output.irradiance);
            }
            self.passes.push(Pass { name: "smooth".into(), ms: milliseconds(begin) });
            let irradiance = std::mem::take(&mut output.irradiance);
            self.past = Some(Past { view: stage.view, depth: camera.depth.clone(), irradiance });
            self.bytes += camera.len() as u64 * 16;
        }
        let ms = milliseconds(start);
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
    setup: Setup,
    hints: Hints,
    resources: Resources,
    camera: GBufferTarget,
    smoothing: Option<Smoothing>,
}

/// The smoothed frames and what shades them.
struct Smoothing {
    smooth: Smooth,
    resources: SmoothResources,
    shade: Kernel,
    image: Buffer,
    /// Camera of the last frame; none before the first.
    view: Option<View>,
}

impl Gpu {
    fn new(stage: &Stage<'_>, values: &Values, seed: u32) -> Outcome<Self> {
        let context = stage.gpu()?.context.clone();
        let device = &context.device;
        let setup = Setup::new(stage, values, seed)?;
        let camera = GBufferTarget::new(device, stage.size, 1).map_err(|e| failure(stage, &e))?;
        let hints = Hints::new(device, &setup.options).map_err(|e| failure(stage, &e))?;
        let maps = rsm::views::views(stage.scene).len();
        let resources = Resources::new(device, &hints, maps, &setup.lattice, &camera);
        let resources = resources.map_err(|e| failure(stage, &e))?;
        let smoothing = if setup.smoothing > 0.0 {
            let smooth = Smooth::new(device);
            let smoothed = SmoothResources::new(device, &smooth, &resources.irradiance, &camera);
            let pixels = u64::from(stage.size[0]) * u64::from(stage.size[1]);
            let image = empty_storage_buffer::<[f32; 4]>(device, "smoothed image", pixels);
            Some(Smoothing {
                smooth,
                resources: smoothed.map_err(|e| failure(stage, &e))?,
                shade: Kernel::new(device, &shaders::RSM_SHADE, "shade", &[]),
                image: image.map_err(|e| failure(stage, &e))?,
                view: None,
            })
        } else {
            None
        };
        Ok(Self { context, setup, hints, resources, camera, smoothing })
    }

    /// Everything of a frame, from the scene's lights to the image. Two timers: both the camera and the maps have the passes
    /// `visibility` and `resolve`.
    fn render(&mut self, stage: &Stage<'_>, camera_timer: &mut PassTimer, timer: &mut PassTimer) -> Outcome {
        let Context { device, queue, .. } = &self.context;
        let views = rsm::views::views(stage.scene);
        let lights = (stage.scene.lights.as_slice(), views.as_slice());
        let failed = |e: radiance_hints::Error| failure(stage, &e);
        let Setup { params, lattice, smoothing: factor, .. } = &self.setup;
        self.resources.prepare(queue, lights, &stage.view, lattice, params).map_err(failed)?;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let crate::gpu::Gpu { raster, scene, .. } = stage.gpu()?;
        raster
            .encode(&mut encoder, camera_timer, scene, &stage.view, &self.camera, 0)
            .map_err(|e| failure(stage, &e))?;
        self.hints.encode(&mut encoder, timer, scene, &self.resources).map_err(failed)?;
        if let Some(s) = &mut self.smoothing {
            let share = if s.view.is_some() { *factor } else { 0.0 };
            s.resources.prepare(queue, &s.view.unwrap_or(stage.view), share).map_err(failed)?;
            s.smooth.encode(&mut encoder, timer, &mut s.resources).map_err(failed)?;
            let group = s.shade.bind(
                device,
                0,
                &[
                    (0, self.camera.albedo.as_entire_binding()),
                    (1, s.resources.smoothed().as_entire_binding()),
                    (2, s.image.as_entire_binding()),
                ],
            );
            let [width, height] = self.camera.size();
            let workgroups = workgroups_1d(u64::from(width) * u64::from(height), 64);
            s.shade.dispatch(&mut encoder, timer, &[&group], workgroups.map_err(|e| failure(stage, &e))?);
            s.view = Some(stage.view);
        }
        queue.submit([encoder.finish()]);
        device.poll(PollType::wait_indefinitely()).map_err(|e| failure(stage, &e))?;
        Ok(())
    }

    fn twins(&mut self, stage: &Stage<'_>, with_camera: bool) -> Outcome<Vec<Twin>> {
        self.render(stage, &mut PassTimer::off(), &mut PassTimer::off())?;
        let Context { device, queue, .. } = &self.context;
        let camera = cast::gbuffer(&stage.accel, &stage.view, stage.size);
        let seen = self.camera.read(device, queue).map_err(|e| failure(stage, &e))?;
        let mut twins = if with_camera { shared::camera_twins(&camera, &seen[0]) } else { Vec::new() };
        let Setup { options, params, lattice, .. } = &self.setup;
        let expected = cpu::indirect(&stage.accel, &stage.view, &camera, lattice, options, params)
            .map_err(|e| failure(stage, &e))?;
        let found = radiance_hints::gpu::twins(
            (device, queue),
            &self.hints,
            &self.resources,
            &camera,
            &self.camera,
            &expected,
        )
        .map_err(|e| failure(stage, &e))?;
        let mut found = shared::rsm_twins(&found);
        for t in &mut found {
            // What grazes a texel's border falls to either side of it, as a silhouette does.
            if let ("occlusion" | "near" | "stops", Data::Ints(a), Data::Ints(b)) =
                (t.pass.as_str(), &t.cpu, &t.gpu)
            {
                t.same_triangle = Some(a.iter().zip(b).map(|(a, b)| a == b).collect());
            }
        }
        twins.extend(found);
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
        let image = self.smoothing.as_ref().map_or(&self.resources.image, |s| &s.image);
        shared::read_image(&self.context, image, self.camera.size())
    }

    fn passes(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Pass>> {
        let gpu = stage.gpu()?;
        let (mut camera, mut rest) = (gpu.timer(), gpu.timer());
        self.render(stage, &mut camera, &mut rest)?;
        shared::passes(stage, camera, rest)
    }

    fn bytes(&self) -> Bytes {
        let smoothing = self.smoothing.as_ref().map_or(0, |s| s.resources.bytes() + s.image.size());
        Bytes { cpu: 0, gpu: self.resources.bytes() + self.camera.bytes() + smoothing }
    }
}
