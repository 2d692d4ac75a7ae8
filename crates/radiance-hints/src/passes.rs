use indirect_core::Image;
#[cfg(feature = "cpu")]
use indirect_filter::cpu::{shade, smooth};
#[cfg(feature = "gpu")]
use indirect_gpu::{named, shaders};
use indirect_technique::{Row, Technique, passes};
use rsm::Error;

#[cfg(feature = "cpu")]
use crate::cpu::{
    bounce::bounce, directions::Directions, estimate::estimate, field::Field, look::Samples, near::near,
    occlusion::occlusion, reconstruct::reconstruct, sample::sample, stops::stops, upsample::upsample,
};
#[cfg(feature = "gpu")]
use crate::{gpu::for_each_map, settings::Transport};
use crate::{
    output::{Output, RadianceHints},
    settings::{Options, Params, Sampling, Scale, Visibility},
    setup::Setup,
};

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
    const MAP_PASSES: &'static [&'static str] = &rsm::MAP_PASSES;
    type Options = Options;
    type Params = Params;
    type Setup = Setup;
    type Output = Output;
    #[cfg(feature = "gpu")]
    type Sizes = crate::gpu::Sizes;
    #[cfg(not(feature = "gpu"))]
    type Sizes = ();
    #[cfg(feature = "gpu")]
    type Buffers = crate::gpu::Buffers;
    #[cfg(not(feature = "gpu"))]
    type Buffers = ();
    type Error = Error;

    fn options(setup: &Setup) -> &Options {
        &setup.options
    }

    fn rows() -> Vec<Row<Self>> {
        let mut rows = rsm::map_rows!(Self, |s| u32::from(s.options.sampling != Sampling::Disc));
        rows.extend(passes!(
            Self,
            [
                Row {
                    name: "sample",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        // What later passes need not overwrite; the history ends where nothing is smoothed.
                        (o.near, o.blocked, o.stops, o.low) = Default::default();
                        o.history = o.history.take().filter(|_| f.setup.options.smoothing > 0.0);
                        o.samples = sample(&o.rsm, &f.setup.lattice, &f.setup.draw());
                    },
                    gpu: |b, pass, _| {
                        let entry = match b.setup.options.sampling {
                            Sampling::Importance | Sampling::Nearby => "sample_importance",
                            Sampling::Disc => "sample_disc",
                        };
                        for_each_map(b, pass, (&shaders::RADIANCE_HINTS_SAMPLE, entry), b.sizes.slots)
                    },
                    data: |b, o, x, _| x.elements("", &b.own.samples, 0, &mut o.samples),
                },
                Row {
                    name: "near",
                    times: |s| u32::from(s.draw().near() > 0),
                    cpu: |f, o, _| o.near = near(&o.rsm, &f.setup.lattice, &f.setup.draw()),
                    gpu: |b, pass, _| {
                        let entry = (&shaders::RADIANCE_HINTS_SAMPLE, "sample_near");
                        for_each_map(b, pass, entry, b.sizes.hints)
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
                            for_each_map(b, pass, copy, u64::from(b.setup.options.resolution).pow(2))?;
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
                        let [first, last, next] = [1, i + 1, i + 2].map(|number| b.buffers.field(number));
                        let (entry, base) = match b.setup.options.transport {
                            Transport::Directions => ("bounce_directions", first),
                            Transport::Sphere => ("bounce_sphere", first),
                            Transport::SphereAsPrinted => ("bounce_sphere_as_printed", last),
                        };
                        let (hints, number) = (named("hints", last), b.buffers.current(i as usize + 2));
                        let own = [hints, named("base", base), named("next", next), number];
                        b.compute(pass, (&shaders::RADIANCE_HINTS_BOUNCE, entry), b.sizes.hints, &own)
                    },
                    data: |b, o, x, i| {
                        let (number, hints) = (i + 2, &mut o.bounces[i as usize + 1]);
                        x.floats(&format!("hints after bounce {number}"), b.field(number), hints, b.floats());
                    },
                },
                Row {
                    name: "reconstruct",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let (reduced, form) = (f.setup.reduced(f.camera.size), f.setup.params.reconstruct);
                        let e = reconstruct(&o.field(f.setup), f.camera, &reduced, form);
                        *(if reduced.step == 1 { &mut o.irradiance } else { &mut o.low }) = e;
                    },
                    gpu: |b, pass, _| {
                        let own = [named("hints", b.buffers.last_field()), named("low", b.buffers.low())];
                        let (module, texels) =
                            (&shaders::RADIANCE_HINTS_RECONSTRUCT, b.sizes.reduced.texels());
                        b.compute(pass, (module, "reconstruct"), texels.into(), &own)
                    },
                    data: |b, o, x, _| {
                        let e = if o.low.is_empty() { &mut o.irradiance } else { &mut o.low };
                        x.vectors("irradiance", b.low(), 0, e);
                    },
                },
                Row {
                    name: "upsample",
                    times: |s| u32::from(s.options.scale != Scale::Full),
                    cpu: |f, o, _| {
                        let (reduced, form) = (f.setup.reduced(f.camera.size), f.setup.params.reconstruct);
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
                    data: |b, o, x, _| {
                        let pixels = o.history.as_mut().map_or(&mut [][..], |h| &mut h.pixels);
                        x.floats("irradiance and depth", &b.smooth.smoothed, pixels, 4);
                    },
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        o.image = match &o.history {
                            Some(history) => shade(f.camera, &history.irradiance()),
                            None => shade(f.camera, &o.irradiance),
                        };
                    },
                    gpu: |b, pass, _| {
                        let own = [named("irradiance", b.buffers.shaded())];
                        b.compute(pass, (&shaders::FILTER_SHADE, "shade"), b.sizes.pixels, &own)
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
        let hints: usize = o.bounces.iter().map(|b| size_of_val(&b[..])).sum();
        let history = o.history.as_ref().map_or(0, |h| size_of_val(&h.pixels[..]));
        let samples = size_of_val(&o.samples[..]) + size_of_val(&o.near.samples[..]);
        let of_hints = hints + size_of_val(&o.near.windows[..]) + size_of_val(&o.surroundings[..]);
        let words = size_of_val(&o.blocked[..]) + size_of_val(&o.stops[..]);
        let images =
            size_of_val(&o.low[..]) + size_of_val(&o.irradiance[..]) + size_of_val(&o.image.pixels[..]);
        (o.rsm.bytes() + samples + of_hints + words + images + history) as u64
    }
}
