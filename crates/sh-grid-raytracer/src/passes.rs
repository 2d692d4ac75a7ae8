use indirect_core::Image;
#[cfg(feature = "cpu")]
use indirect_filter::cpu::shade;
use indirect_technique::{Row, Technique, passes};

#[cfg(feature = "cpu")]
use crate::cpu;
use crate::error::Error;
#[cfg(feature = "gpu")]
use crate::gpu;
use crate::output::{Output, ShGridRaytracer};
#[cfg(feature = "cpu")]
use crate::settings::Gather;
use crate::settings::{Options, Params};
use crate::setup::Setup;

/// The passes that make what every camera shares: they can be left out of a frame in which neither light nor geometry changed
/// ([`run_without`](indirect_technique::cpu::run_without), `Resources::encode_without`).
pub const FIELD_PASSES: [&str; 6] = ["emit", "trace", "sort", "radiance", "levels", "field"];

#[cfg(feature = "cpu")]
fn sight<'a>(f: &cpu::Frame<'a, Setup>, o: &'a Output) -> cpu::Sight<'a> {
    let Setup { options, params, fitted } = f.setup;
    cpu::Sight {
        accel: f.accel,
        normals: &fitted.normals,
        voxels: &fitted.voxels,
        lookup: cpu::Lookup {
            pyramid: &fitted.pyramid,
            faces: &o.faces,
            least_area: params.least_area,
            printed: options.is_printed(),
        },
        traverse: options.traverse,
    }
}

#[cfg(feature = "cpu")]
fn gather(f: &cpu::Frame<'_, Setup>, o: &Output) -> Vec<glam::Vec4> {
    let Setup { options, params, fitted } = f.setup;
    if options.gather == Gather::Final {
        return cpu::gather_final(&sight(f, o), options.samples, params.seed, f.camera);
    }
    let field = cpu::Field {
        accel: f.accel,
        voxels: &fitted.voxels,
        cells: &o.field.coefficients,
        coefficients: options.coefficients(),
        weights: options.weights,
        reach: params.reach,
    };
    let looks = cpu::Looks { directions: &fitted.pixel_directions, turns: &fitted.turns, seed: params.seed };
    let mut irradiance = if options.gather == Gather::Samples {
        cpu::gather_samples(&field, &looks, f.camera)
    } else {
        cpu::gather(&field, f.camera)
    };
    if options.obscurance.is_on() {
        cpu::obscure(&mut irradiance, &field, &looks, f.setup.obscurance_range(), f.camera);
    }
    irradiance
}

impl Technique for ShGridRaytracer {
    const NAME: &'static str = "sh-grid-raytracer";
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
        passes!(
            Self,
            [
                Row {
                    name: "emit",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let mut sources = f.setup.fitted.sources.clone();
                        sources.set_lights(&f.scene.lights);
                        o.photons = photon_tracing::cpu::emit(&sources, &f.setup.photon_params());
                        o.stored.clear();
                    },
                    gpu: |b, pass, _| gpu::emit(b, pass),
                    data: |b, o, x, _| x.elements("", &b.photons.buffers.photons, 0, &mut o.photons),
                },
                Row {
                    name: "trace",
                    times: |s| s.options.bounces,
                    cpu: |f, o, _| {
                        let setup = f.setup;
                        photon_tracing::cpu::trace(f.accel, setup.params.seed, &mut o.photons);
                        let store = cpu::Store {
                            accel: f.accel,
                            voxels: &setup.fitted.voxels,
                            reach: setup.store_reach(),
                            printed: setup.options.is_printed(),
                        };
                        o.stored.extend(store.all(&o.photons).into_iter().flatten());
                        o.stored.truncate(setup.options.most_stored() as usize);
                    },
                    gpu: gpu::trace,
                    data: |b, o, x, _| gpu::exchange_photons(b, o, x),
                },
                Row {
                    name: "sort",
                    times: |_| 1,
                    cpu: |_, o, _| o.order = cpu::sort(&o.stored),
                    gpu: |b, pass, _| gpu::sort(b, pass),
                    data: |b, o, x, _| x.words("order", b.order(), &mut o.order),
                },
                Row {
                    name: "radiance",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let (voxels, printed) = (&f.setup.fitted.voxels, f.setup.options.is_printed());
                        o.faces = cpu::radiance(&o.stored, &o.order, voxels, printed);
                    },
                    gpu: |b, pass, _| gpu::radiance(b, pass),
                    data: |b, o, x, _| x.floats("faces", &b.own.faces, &mut o.faces, 4),
                },
                Row {
                    name: "levels",
                    times: |_| 1,
                    cpu: |f, o, _| cpu::levels(&mut o.faces, &f.setup.fitted.pyramid),
                    gpu: |b, pass, _| gpu::levels(b, pass),
                    data: |b, o, x, _| x.floats("faces", &b.own.faces, &mut o.faces, 4),
                },
                Row {
                    name: "field",
                    times: |s| s.options.has_field().into(),
                    cpu: |f, o, _| {
                        let Setup { options, params, fitted } = f.setup;
                        let settings = cpu::FieldSettings {
                            directions: &fitted.directions,
                            turns: &fitted.turns,
                            turned: options.turned.is_on(),
                            footprint: options.footprint.is_on(),
                            seed: params.seed,
                            coefficients: options.coefficients(),
                        };
                        o.field = cpu::field(&sight(f, o), &settings);
                    },
                    gpu: |b, pass, _| gpu::field(b, pass),
                    data: |b, o, x, _| gpu::exchange_field(b, o, x),
                },
                Row {
                    name: "gather",
                    times: |_| 1,
                    cpu: |f, o, _| o.irradiance = gather(f, o),
                    gpu: |b, pass, _| gpu::gather(b, pass),
                    data: |b, o, x, _| x.vectors_by_choice(
                        "irradiance",
                        &b.own.irradiance,
                        &mut o.irradiance
                    ),
                },
                Row {
                    name: "shade",
                    times: |_| 1,
                    cpu: |f, o, _| {
                        let irradiance: Vec<_> = o.irradiance.iter().map(|e| e.truncate()).collect();
                        o.image = shade(f.camera, &irradiance);
                    },
                    gpu: |b, pass, _| {
                        let entry = (&indirect_gpu::shaders::FILTER_SHADE, "shade");
                        b.compute(pass, entry, b.sizes.pixels, &[])
                    },
                    data: |b, o, x, _| x.image("image", &b.own.image, &mut o.image),
                },
            ]
        )
    }

    fn image(output: &Output) -> &Image {
        &output.image
    }

    fn output_bytes(o: &Output) -> u64 {
        #[cfg(feature = "cpu")]
        let field = size_of_val(&o.field.coefficients[..]) + size_of_val(&o.field.seen[..]);
        #[cfg(not(feature = "cpu"))]
        let field = 0;
        (size_of_val(&o.photons[..])
            + size_of_val(&o.stored[..])
            + size_of_val(&o.order[..])
            + size_of_val(&o.faces[..])
            + field
            + size_of_val(&o.irradiance[..])
            + size_of_val(&o.image.pixels[..])) as u64
    }
}
