use indirect_core::Image;
#[cfg(feature = "cpu")]
use indirect_filter::cpu::shade;
use indirect_technique::{Row, Technique, passes};
use rsm::Error;
#[cfg(feature = "cpu")]
use rsm::{Bound, Selection, Vpl};

#[cfg(feature = "cpu")]
use crate::cpu;
#[cfg(feature = "gpu")]
use crate::gpu;
use crate::output::{InstantRadiosity, Output};
#[cfg(feature = "cpu")]
use crate::sequence::{Use, points};
#[cfg(feature = "cpu")]
use crate::settings::Bounce;
use crate::settings::{Options, Params, Visibility};
use crate::setup::Setup;

#[cfg(feature = "cpu")]
fn lights<'a, S: cpu::Shadow>(o: &'a Output, setup: &Setup, shadow: &'a S) -> cpu::Lights<'a, S> {
    let compensated = setup.options.compensate.is_on();
    cpu::Lights { vpls: &o.vpls, parts: parts(setup), summary: o.summary, compensated, shadow }
}

#[cfg(feature = "cpu")]
fn parts(setup: &Setup) -> cpu::Parts {
    let Options { interleave, bounces, .. } = setup.options;
    cpu::Parts { interleave, per_bounce: setup.options.per_bounce(), bounces }
}

/// What a frame without a past is called, so that every frame of a still scene is the same where nothing is kept.
#[cfg(feature = "cpu")]
fn frame_number(setup: &Setup, output: &Output) -> u32 {
    if setup.options.has_history() { output.frame } else { 0 }
}

#[cfg(feature = "cpu")]
fn gather(f: &cpu::Frame<'_, Setup>, o: &Output) -> Vec<glam::Vec4> {
    let (tests, seed) = (f.setup.options.tests(), f.setup.pixel_seed(frame_number(f.setup, o)));
    if f.setup.options.has_cuts() {
        return match f.setup.options.visibility {
            Visibility::Rays => {
                cpu::gather_cuts(&lights(o, f.setup, &cpu::Rays(f.accel)), &o.tree, f.camera, tests, seed)
            }
            Visibility::Maps => {
                cpu::gather_cuts(&lights(o, f.setup, &cpu::Maps(&o.shadows)), &o.tree, f.camera, tests, seed)
            }
            Visibility::Off => {
                cpu::gather_cuts(&lights(o, f.setup, &cpu::Open), &o.tree, f.camera, tests, seed)
            }
        };
    }
    match f.setup.options.visibility {
        Visibility::Rays => cpu::gather(&lights(o, f.setup, &cpu::Rays(f.accel)), f.camera, tests, seed),
        Visibility::Maps => cpu::gather(&lights(o, f.setup, &cpu::Maps(&o.shadows)), f.camera, tests, seed),
        Visibility::Off => cpu::gather(&lights(o, f.setup, &cpu::Open), f.camera, tests, seed),
    }
}

#[cfg(feature = "cpu")]
fn compensate(f: &cpu::Frame<'_, Setup>, o: &mut Output) {
    let Setup { options, params, fitted } = f.setup;
    let seed = f.setup.pixel_seed(frame_number(f.setup, o));
    let paths = cpu::Paths {
        accel: f.accel,
        fitted,
        bounces: f.setup.path_bounces(),
        parts: options.path_parts(),
        tests: options.path_tests(),
        paths: params.paths,
        seed,
    };
    let mut gathered = core::mem::take(&mut o.gathered);
    match options.visibility {
        Visibility::Rays => {
            cpu::compensate(&mut gathered, &paths, &lights(o, f.setup, &cpu::Rays(f.accel)), f.camera);
        }
        Visibility::Maps => {
            cpu::compensate(&mut gathered, &paths, &lights(o, f.setup, &cpu::Maps(&o.shadows)), f.camera);
        }
        Visibility::Off => {
            cpu::compensate(&mut gathered, &paths, &lights(o, f.setup, &cpu::Open), f.camera);
        }
    }
    o.gathered = gathered;
}

impl Technique for InstantRadiosity {
    const NAME: &'static str = "instant-radiosity";
    const MAP_PASSES: &'static [&'static str] = &rsm::MAP_PASSES;
    type Options = Options;
    type Params = Params;
    type Setup = Setup;
    type Output = Output;
    #[cfg(feature = "gpu")]
    type Sizes = gpu::Sizes;
    #[cfg(not(feature = "gpu"))]
    type Sizes = ();
    #[cfg(feature = "gpu")]
    type Buffers = gpu::Buffers;
    #[cfg(not(feature = "gpu"))]
    type Buffers = ();
    type Error = Error;

    fn options(setup: &Setup) -> &Options {
        &setup.options
    }

    fn rows() -> Vec<Row<Self>> {
        let mut rows = rsm::map_rows!(Self);
        rows.extend(passes!(
            Self,
            [
                Row {
                    name: "vpls",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let (setup, frame) = (f.setup, frame_number(f.setup, o));
                        o.vpls.clear();
                        if setup.map_lights() > 0 {
                            let selection = Selection::Importance { count: setup.map_lights() };
                            let points = points(setup, Use::Maps, frame, setup.map_lights());
                            o.vpls = rsm::cpu::vpls(&o.rsm, selection, &points);
                        }
                        o.vpls.resize(setup.slots() as usize, Vpl::default());
                    },
                    gpu: |b, pass, _| gpu::vpls(b, pass),
                    data: |b, o, x, _| x.elements(
                        "",
                        &b.own.vpls,
                        0,
                        &mut o.vpls[..b.setup.map_lights() as usize]
                    ),
                },
                Row {
                    name: "emit",
                    times: |s| (s.fitted.from_emitters > 0).into(),
                    cpu: |f, o, _| {
                        let fitted = &f.setup.fitted;
                        let points =
                            points(f.setup, Use::Emitters, frame_number(f.setup, o), fitted.from_emitters);
                        let first = f.setup.options.slots() as usize;
                        o.vpls[first..].copy_from_slice(&cpu::emit(
                            &fitted.emitters,
                            fitted.emitted,
                            &points,
                        ));
                    },
                    gpu: |b, pass, _| gpu::emit(b, pass),
                    data: |b, o, x, _| {
                        let first = b.setup.options.slots() as usize;
                        x.elements("", &b.own.vpls, first, &mut o.vpls[first..]);
                    },
                },
                Row {
                    name: "bounce",
                    times: Setup::runs,
                    cpu: |f, o, number| {
                        let (run, frame) = (f.setup.run(number), frame_number(f.setup, o));
                        let sources = &o.vpls[run.source as usize..][..run.count as usize];
                        let fitted = &f.setup.fitted;
                        let next = if f.setup.options.bounce == Bounce::Rays {
                            let points = points(f.setup, Use::Bounce(run.bounce), frame, run.count);
                            cpu::bounce_rays(f.accel, fitted, sources, &points)
                        } else {
                            cpu::bounce_points(
                                &cpu::Rays(f.accel),
                                fitted,
                                sources,
                                f.setup.choice(run, frame),
                            )
                        };
                        o.vpls[run.target as usize..][..run.count as usize].copy_from_slice(&next);
                    },
                    gpu: gpu::bounce,
                    data: |b, o, x, number| {
                        let run = b.setup.run(number);
                        let targets = &mut o.vpls[run.target as usize..][..run.count as usize];
                        x.elements("", &b.own.vpls, run.target as usize, targets);
                    },
                },
                Row {
                    name: "shadows",
                    times: |s| (s.options.visibility == Visibility::Maps).into(),
                    cpu: |f, o, _| {
                        let (options, points) = (f.setup.options, &f.setup.fitted.points);
                        let vpls = &o.vpls[..options.slots() as usize];
                        o.shadows = imperfect_shadow_maps::cpu::build(vpls, points, &options.shadow_maps());
                    },
                    gpu: |b, pass, _| gpu::shadows(b, pass),
                    data: |b, o, x, _| {
                        if let Some(atlas) = &b.atlas {
                            atlas.exchange_maps(&mut o.shadows, x);
                        }
                    },
                },
                Row {
                    name: "summary",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let (n, all) = (f.setup.options.per_bounce(), f.setup.options.slots() as usize);
                        o.summary = cpu::summary(&o.vpls[..all], n, f.setup.params.bound, f.setup.has_tail());
                    },
                    gpu: |b, pass, _| gpu::summary(b, pass),
                    data: |b, o, x, _| x.elements(
                        "",
                        &b.own.summary,
                        0,
                        core::slice::from_mut(&mut o.summary)
                    ),
                },
                Row {
                    name: "tree",
                    times: |s| s.options.has_cuts().into(),
                    cpu: |f, o, _| {
                        let seed = f.setup.tree_seed(frame_number(f.setup, o));
                        let vpls = cpu::tailed(&o.vpls, &parts(f.setup), &o.summary);
                        o.tree.rebuild(&vpls, seed);
                        let reference = o.tree.reference_irradiance(&f.camera.position, &f.camera.normal);
                        o.tree.solve_reach(Bound::Error, f.setup.params.tau * reference);
                    },
                    gpu: |b, pass, _| gpu::tree(b, pass),
                    data: |b, o, x, _| {
                        if let Some(cuts) = &b.cuts {
                            x.elements("", &cuts.tree.buffers.branches, 0, &mut o.tree.branches);
                        }
                    },
                },
                Row {
                    name: "gather",
                    times: |_| 1,
                    cpu: |f, o, _| o.gathered = gather(f, o),
                    gpu: |b, pass, _| gpu::gather(b, pass),
                    data: |b, o, x, _| x.vectors_by_choice("irradiance", &b.own.image, &mut o.gathered),
                },
                Row {
                    name: "compensate",
                    times: |s| s.options.compensate.is_on().into(),
                    cpu: |f, o, _| compensate(f, o),
                    gpu: |b, pass, _| gpu::compensate(b, pass),
                    data: |b, o, x, _| x.vectors_by_choice("irradiance", &b.own.image, &mut o.gathered),
                },
                Row {
                    name: "movement",
                    times: |s| s.follows_motion().into(),
                    cpu: |f, o, _| o.before = cpu::movement(&f.setup.fitted, f.camera),
                    gpu: |b, pass, _| gpu::movement(b, pass),
                    data: |b, o, x, _| {
                        if b.setup.fitted.moved() {
                            x.vectors("before", &b.own.before, 0, &mut o.before);
                        }
                    },
                },
                Row {
                    name: "merge",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let Setup { options, params, .. } = f.setup;
                        let past = o.history.take().filter(|_| options.has_history());
                        let seen = (f.view, f.camera);
                        let merged = cpu::merge(
                            &o.gathered,
                            seen,
                            options.interleave,
                            params,
                            past.as_ref(),
                            &o.before,
                        );
                        o.history = Some(merged);
                        o.frame = o.frame.wrapping_add(1);
                    },
                    gpu: |b, pass, _| gpu::merge(b, pass),
                    data: |b, o, x, _| {
                        if let Some(h) = &mut o.history {
                            x.floats("irradiance", &b.own.irradiance, &mut h.irradiance, 4);
                            x.floats("normals", &b.own.merged_normals, &mut h.normals, 4);
                        }
                    },
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let irradiance: Vec<_> =
                            o.history.iter().flat_map(|h| &h.irradiance).map(|e| e.truncate()).collect();
                        o.image = shade(f.camera, &irradiance);
                    },
                    gpu: |b, pass, _| {
                        b.compute(pass, (&indirect_gpu::shaders::FILTER_SHADE, "shade"), b.sizes.pixels, &[])
                    },
                    data: |b, o, x, _| x.image("image", &b.own.image, &mut o.image),
                },
            ]
        ));
        rows
    }

    fn image(output: &Output) -> &Image {
        &output.image
    }

    fn output_bytes(o: &Output) -> u64 {
        let vectors = o.before.len() + o.image.pixels.len();
        #[cfg(feature = "cpu")]
        let history = o.history.as_ref().map_or(0, |h| 32 * h.irradiance.len());
        #[cfg(feature = "cpu")]
        let (shadows, tree) =
            (o.shadows.bytes(), size_of_val(&o.tree.branches[..]) + size_of_val(&o.tree.order[..]));
        #[cfg(not(feature = "cpu"))]
        let (history, shadows, tree) = (0, 0, 0);
        (o.rsm.bytes()
            + shadows
            + tree
            + size_of_val(&o.vpls[..])
            + vectors * size_of::<glam::Vec3>()
            + 16 * o.gathered.len()
            + history) as u64
    }
}
