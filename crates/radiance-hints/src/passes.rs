use glam::{Vec3, Vec4};
use indirect_core::Image;
use indirect_filter::History;
#[cfg(feature = "cpu")]
use indirect_filter::{
    Reduced,
    cpu::{shade, smooth},
};
#[cfg(feature = "gpu")]
use indirect_gpu::{named, shaders};
use indirect_technique::{Row, Technique, passes};
use rsm::{Error, Rsm};

#[cfg(feature = "cpu")]
use crate::cpu::{
    bounce::bounce, directions::Directions, estimate::estimate, field::Field, look::Samples, near::near,
    occlusion::occlusion, reconstruct::reconstruct, sample::sample, stops::stops, upsample::upsample,
};
#[cfg(feature = "gpu")]
use crate::settings::{Sampling, Transport};
use crate::{
    layout::{Near, Sample, Surroundings},
    settings::{Options, Params, Scale, Visibility},
    setup::Setup,
};

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct RadianceHints;

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// The maps.
    pub rsm: Rsm,
    /// The lists of samples, one after the other.
    pub samples: Vec<Sample>,
    /// The windows and their samples; empty for other samplings than [`Sampling::Nearby`].
    pub near: Near,
    /// What stands between hints and samples, see [`occlusion`](crate::cpu::occlusion()); empty where nothing is tested.
    pub blocked: Vec<u32>,
    /// Where directions of later bounces end, see [`stops`](crate::cpu::stops()); empty where nothing is tested.
    pub stops: Vec<u32>,
    /// The hints after each bounce, W/(sr·m²): [`Order::vectors`](crate::Order::vectors) vectors each, see
    /// [`pack`](crate::cpu::pack).
    pub bounces: Vec<Vec<Vec4>>,
    /// The albedo around each hint; empty for one bounce.
    pub surroundings: Vec<Surroundings>,
    /// Irradiance per texel of the reduced image, W/m²; empty at full resolution.
    pub low: Vec<Vec3>,
    /// Irradiance per pixel, W/m².
    pub irradiance: Vec<Vec3>,
    /// What the next frame is blended with; none where nothing is smoothed.
    pub history: Option<History>,
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
}

#[cfg(feature = "cpu")]
impl Output {
    fn seen(&self, setup: &Setup) -> Samples<'_> {
        Samples { draw: setup.draw(), lists: &self.samples, near: &self.near }
    }

    /// The hints after the last bounce so far.
    fn field<'a>(&'a self, setup: &'a Setup) -> Field<'a> {
        let hints = self.bounces.last().map_or(&[][..], |b| b);
        Field { lattice: &setup.lattice, order: setup.options.order, hints }
    }
}

impl Technique for RadianceHints {
    const NAME: &'static str = "radiance-hints";
    type Options = Options;
    type Params = Params;
    type Setup = Setup;
    type Output = Output;
    #[cfg(feature = "gpu")]
    type Sizes = crate::gpu::buffers::Sizes;
    #[cfg(not(feature = "gpu"))]
    type Sizes = ();
    #[cfg(feature = "gpu")]
    type Buffers = crate::gpu::buffers::Buffers;
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
                    name: "sample",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        // What later passes need not overwrite.
                        (o.near, o.blocked, o.stops, o.low) = Default::default();
                        o.samples = sample(&o.rsm, &f.setup.lattice, &f.setup.draw());
                    },
                    gpu: |b, pass, _| {
                        let entry = match b.setup.options.sampling {
                            Sampling::Importance | Sampling::Nearby => "sample_importance",
                            Sampling::Disc => "sample_disc",
                        };
                        (0..b.sizes.maps).try_for_each(|i| {
                            let own = b.buffers.of_map(i);
                            b.compute(pass, (&shaders::RADIANCE_HINTS_SAMPLE, entry), b.sizes.slots, &own)
                        })
                    },
                    data: |b, o, x, _| x.elements("", &b.own.samples, 0, &mut o.samples),
                },
                Row {
                    name: "near",
                    times: |s| u32::from(s.draw().near() > 0),
                    cpu: |f, o, _| o.near = near(&o.rsm, &f.setup.lattice, &f.setup.draw()),
                    gpu: |b, pass, _| {
                        (0..b.sizes.maps).try_for_each(|i| {
                            let (entry, own) = ("sample_near", b.buffers.of_map(i));
                            b.compute(pass, (&shaders::RADIANCE_HINTS_SAMPLE, entry), b.sizes.hints, &own)
                        })
                    },
                    data: |b, o, x, _| b.exchange_near(o.samples.len(), &mut o.near, x),
                },
                Row {
                    name: "occlusion",
                    times: |s| u32::from(s.options.visibility != Visibility::Off),
                    cpu: |f, o, _| {
                        let (s, samples) = (f.setup, o.seen(f.setup));
                        let (camera, visibility) = ((f.view, f.camera), s.options.visibility);
                        o.blocked =
                            occlusion(&o.rsm, camera, &s.lattice, &samples, visibility, s.params.jitter);
                    },
                    gpu: |b, pass, _| {
                        let module = &shaders::RADIANCE_HINTS_OCCLUSION;
                        let copy = (module, "occlusion_depths");
                        let (entry, views) = if b.setup.options.visibility == Visibility::CameraDepth {
                            b.compute(pass, copy, b.sizes.pixels, &[b.buffers.current(0)])?;
                            ("occlusion_camera", &b.buffers.own.camera)
                        } else {
                            let texels = u64::from(b.setup.options.resolution).pow(2);
                            for i in 0..b.sizes.maps {
                                b.compute(pass, copy, texels, &b.buffers.of_map(i))?;
                            }
                            ("occlusion_rsm", &b.buffers.own.views)
                        };
                        b.compute(pass, (module, entry), b.sizes.blocked_words(), &[named("views", views)])
                    },
                    data: |b, o, x, _| x.choices("blocked", &b.own.blocked, &mut o.blocked),
                },
                Row {
                    name: "estimate",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let Setup { options, params, lattice, .. } = f.setup;
                        let shape = (params.jitter, params.footprint);
                        let (samples, later) = (o.seen(f.setup), options.bounces > 1);
                        let found = estimate(lattice, &samples, &o.blocked, options.order, shape, later);
                        (o.bounces, o.surroundings) = (vec![found.hints], found.surroundings);
                    },
                    gpu: |b, pass, _| {
                        let own = [named("hints", b.buffers.field(1))];
                        b.compute(pass, (&shaders::RADIANCE_HINTS_ESTIMATE, "estimate"), b.sizes.hints, &own)
                    },
                    data: |b, o, x, _| {
                        x.floats("hints", b.field(1), &mut o.bounces[0], b.floats());
                        x.elements("", &b.own.surroundings, 0, &mut o.surroundings);
                    },
                },
                Row {
                    name: "stops",
                    times: |s| u32::from(s.options.stop_words() > 0),
                    cpu: |f, o, _| o.stops = stops(&o.rsm, &f.setup.lattice, &Directions::new(f.setup)),
                    gpu: |b, pass, _| {
                        let entry = (&shaders::RADIANCE_HINTS_STOPS, "stop_directions");
                        b.compute(pass, entry, b.sizes.stop_words(), &[])
                    },
                    data: |b, o, x, _| x.choices("stops", &b.own.stops, &mut o.stops),
                },
                Row {
                    name: "bounce",
                    times: |s| s.options.bounces - 1,
                    cpu: |f, o, i| {
                        let (last, first) = (o.field(f.setup), &o.bounces[0]);
                        let (directions, transport) = (Directions::new(f.setup), f.setup.options.transport);
                        let next =
                            bounce(&last, first, &o.surroundings, &o.stops, &directions, transport, i + 2);
                        o.bounces.push(next);
                    },
                    gpu: |b, pass, i| {
                        let (first, last, next) =
                            (b.buffers.field(1), b.buffers.field(i + 1), b.buffers.field(i + 2));
                        let (entry, base) = match b.setup.options.transport {
                            Transport::Directions => ("bounce_directions", first),
                            Transport::Sphere => ("bounce_sphere", first),
                            Transport::SphereAsPrinted => ("bounce_sphere_as_printed", last),
                        };
                        let own = [
                            named("hints", last),
                            named("base", base),
                            named("next", next),
                            b.buffers.current(i as usize + 2),
                        ];
                        b.compute(pass, (&shaders::RADIANCE_HINTS_BOUNCE, entry), b.sizes.hints, &own)
                    },
                    data: |b, o, x, i| {
                        let (name, hints) =
                            (format!("hints after bounce {}", i + 2), &mut o.bounces[i as usize + 1]);
                        x.floats(&name, b.field(i + 2), hints, b.floats());
                    },
                },
                Row {
                    name: "reconstruct",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let reduced = Reduced::new(f.camera.size, f.setup.options.scale.step());
                        let e =
                            reconstruct(&o.field(f.setup), f.camera, &reduced, f.setup.params.reconstruct);
                        *(if reduced.step == 1 { &mut o.irradiance } else { &mut o.low }) = e;
                    },
                    gpu: |b, pass, _| {
                        let own = &b.buffers.own;
                        let full = b.setup.options.scale == Scale::Full;
                        let low = named("low", if full { &own.irradiance } else { &own.low });
                        let entry = (&shaders::RADIANCE_HINTS_RECONSTRUCT, "reconstruct");
                        let texels = b.sizes.reduced.texels().into();
                        b.compute(pass, entry, texels, &[named("hints", b.buffers.last_field()), low])
                    },
                    data: |b, o, x, _| {
                        let full = o.low.is_empty();
                        let (buffer, e) = if full {
                            (&b.own.irradiance, &mut o.irradiance)
                        } else {
                            (&b.own.low, &mut o.low)
                        };
                        x.vectors("irradiance", buffer, 0, e);
                    },
                },
                Row {
                    name: "upsample",
                    times: |s| u32::from(s.options.scale != Scale::Full),
                    cpu: |f, o, _| {
                        let reduced = Reduced::new(f.camera.size, f.setup.options.scale.step());
                        let form = f.setup.params.reconstruct;
                        o.irradiance = upsample(&o.field(f.setup), f.camera, &reduced, &o.low, form);
                    },
                    gpu: |b, pass, _| {
                        let own = [named("hints", b.buffers.last_field())];
                        b.compute(pass, (&shaders::RADIANCE_HINTS_UPSAMPLE, "upsample"), b.sizes.pixels, &own)
                    },
                    data: |b, o, x, _| x.vectors("irradiance", &b.own.irradiance, 0, &mut o.irradiance),
                },
                Row {
                    name: "smooth",
                    times: |s| u32::from(s.options.smoothing > 0.0),
                    cpu: |f, o, _| {
                        let (past, share) = (o.history.as_ref(), f.setup.options.smoothing);
                        o.history = Some(smooth(&o.irradiance, (f.view, f.camera), past, share));
                    },
                    gpu: |b, pass, _| b.buffers.smooth.smooth(b.pipelines, pass, b.sizes.pixels, b.named()),
                    data: |b, o, x, _| b.exchange_smoothed(&mut o.history, x),
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let smoothed = o.history.as_ref().filter(|_| f.setup.options.smoothing > 0.0);
                        o.image = match smoothed {
                            Some(history) => shade(f.camera, &history.irradiance()),
                            None => shade(f.camera, &o.irradiance),
                        };
                    },
                    gpu: |b, pass, _| {
                        let smoothed = b.setup.options.smoothing > 0.0;
                        let (smooth, own) = (&b.buffers.smooth, &b.buffers.own);
                        let e = if smoothed { &smooth.smoothed } else { &own.irradiance };
                        let entry = (&shaders::FILTER_SHADE, "shade");
                        b.compute(pass, entry, b.sizes.pixels, &[named("irradiance", e)])
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
        let samples =
            size_of_val(&o.samples[..]) + size_of_val(&o.near.samples[..]) + size_of_val(&o.near.windows[..]);
        let hints: usize = o.bounces.iter().map(|b| size_of_val(&b[..])).sum();
        let words =
            size_of_val(&o.blocked[..]) + size_of_val(&o.stops[..]) + size_of_val(&o.surroundings[..]);
        let images =
            size_of_val(&o.low[..]) + size_of_val(&o.irradiance[..]) + size_of_val(&o.image.pixels[..]);
        let history = o.history.as_ref().map_or(0, |h| size_of_val(&h.pixels[..]));
        (o.rsm.bytes() + samples + hints + words + images + history) as u64
    }
}

#[cfg(all(feature = "cpu", feature = "gpu"))]
impl crate::gpu::buffers::Buffers {
    /// Names the results of `near`, whose samples lie behind the `lists` of those of the lists. Where a hint's projection grazes a
    /// texel's border its window may be another: counted, and with other samples.
    fn exchange_near(&self, lists: usize, near: &mut Near, x: &mut indirect_technique::gpu::Exchange<'_>) {
        let place = |w: &crate::Window| (w.first, w.end, w.map);
        let windows: Vec<crate::Window> = x.read(&self.own.windows, 0, near.windows.len());
        let same: Vec<bool> = near.windows.iter().zip(&windows).map(|(a, b)| place(a) == place(b)).collect();
        let count = near.samples.len() / near.windows.len().max(1);
        let samples: Vec<Sample> = x.read(&self.own.samples, lists, near.samples.len());
        // A hint without a window keeps the samples of one that it had.
        let stale = |i: usize| {
            near.windows[i / count].first == near.windows[i / count].end && samples[i] != near.samples[i]
        };
        let of_samples = (0..samples.len()).map(|i| same[i / count] && !stale(i)).collect();
        x.same(Some(same));
        x.elements("window", &self.own.windows, 0, &mut near.windows);
        x.same(Some(of_samples));
        x.elements("", &self.own.samples, lists, &mut near.samples);
        x.same(None);
    }

    /// Names the result of `smooth`.
    fn exchange_smoothed(
        &self,
        history: &mut Option<History>,
        x: &mut indirect_technique::gpu::Exchange<'_>,
    ) {
        if let Some(h) = history {
            x.floats("irradiance and depth", &self.smooth.smoothed, &mut h.pixels, 4);
        }
    }
}
